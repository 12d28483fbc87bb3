//! What must hold of the files themselves: their length, their ends, nothing left undone.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::process;

/// The most lines of a file, by its extension; half of it is what to aim at.
const MOST_LINES: [(&str, usize); 2] = [("rs", 800), ("wesl", 400)];

/// Extensions of the texts that are checked.
const TEXTS: [&str; 9] = ["rs", "wesl", "wgsl", "toml", "md", "py", "json", "yml", "sh"];

/// What stands for code that is not there yet.
const UNDONE: [&str; 2] = [concat!("todo", "!("), concat!("unimplemented", "!(")];

/// Checks every text that git knows or would add.
///
/// # Errors
/// All that is wrong, a line each.
pub fn run() -> Result<()> {
    let mut wrong = Vec::new();
    for file in files()? {
        let extension = file.extension().unwrap_or_default().to_string_lossy().into_owned();
        if !TEXTS.contains(&extension.as_str()) {
            continue;
        }
        let path = process::root().join(&file);
        // A file that was deleted but is still in git's index is no concern.
        if !path.is_file() {
            continue;
        }
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        wrong.extend(problems(&extension, &bytes).into_iter().map(|problem| format!("{}{problem}", file.display())));
    }
    if wrong.is_empty() { Ok(()) } else { bail!("{}", wrong.join("\n")) }
}

/// The files of the working tree, those aside that git ignores.
fn files() -> Result<Vec<PathBuf>> {
    let mut git = std::process::Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(process::root());
    let listed = process::output(&mut git)?;
    Ok(listed.split('\0').filter(|name| !name.is_empty()).map(|name| Path::new(name).to_owned()).collect())
}

/// What is wrong with a file; each begins with `:line: ` or `: `.
fn problems(extension: &str, bytes: &[u8]) -> Vec<String> {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return vec![": not UTF-8".into()];
    };
    let mut wrong = Vec::new();
    let lines = text.lines().count();
    if let Some((_, most)) = MOST_LINES.iter().find(|(of, most)| *of == extension && lines > *most) {
        wrong.push(format!(": {lines} lines; at most {most} are accepted, {} are aimed at", most / 2));
    }
    if !text.is_empty() && (!text.ends_with('\n') || text.ends_with("\n\n")) {
        wrong.push(": must end with one newline".into());
    }
    for (number, line) in (1..).zip(text.split('\n')) {
        if line.ends_with('\r') {
            wrong.push(format!(":{number}: ends with a carriage return"));
        } else if line.ends_with([' ', '\t']) {
            wrong.push(format!(":{number}: ends with a blank"));
        }
        if let Some(word) = UNDONE.iter().find(|word| extension == "rs" && line.contains(**word)) {
            wrong.push(format!(":{number}: {})", word));
        }
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tidy_file_has_no_problems() {
        assert_eq!(problems("rs", b"fn main() {}\n"), Vec::<String>::new());
        assert_eq!(problems("rs", b""), Vec::<String>::new());
    }

    #[test]
    fn every_problem_is_found() {
        assert_eq!(problems("rs", "\n".repeat(801).as_bytes()).len(), 2);
        assert_eq!(problems("wesl", "x\n".repeat(401).as_bytes()).len(), 1);
        assert_eq!(problems("md", b"no newline").len(), 1);
        assert_eq!(problems("md", b"blank \n"), [":1: ends with a blank"]);
        assert_eq!(problems("toml", b"dos\r\n"), [":1: ends with a carriage return"]);
        assert_eq!(problems("md", &[0xff]), [": not UTF-8"]);
        let undone = format!("    {})\n", UNDONE[0]);
        assert_eq!(problems("rs", undone.as_bytes()).len(), 1);
        assert_eq!(problems("md", undone.as_bytes()).len(), 0);
    }
}
