//! Links every WESL entry file (one that has an entry point) under `src` to plain WGSL in `OUT_DIR`, at the same path, and
//! lists the techniques: the folders in `src/techniques`.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=src");
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    let mut entries = Vec::new();
    collect_entries(Path::new("src"), &mut entries)?;
    let mut list = String::from("[\n");
    for entry in entries {
        let relative = entry.strip_prefix("src")?.with_extension("");
        let name = relative.to_str().ok_or("a shader's path is not UTF-8")?.replace('\\', "/");
        let module = format!("package::{}", name.replace('/', "::")).parse()?;
        let target = out.join(&relative).with_extension("wgsl");
        fs::create_dir_all(target.parent().ok_or("a shader has no folder")?)?;
        // Names stay as they are written: passes bind by them.
        let linked = wesl::Wesl::new("src")
            .set_mangler(wesl::ManglerKind::None)
            .compile(&module)
            .map_err(|error| format!("{name}: {error}"))?;
        linked.write_to_file(&target)?;
        list += &format!("    crate::graph::shader!({name:?}),\n");
    }
    fs::write(out.join("shaders.rs"), list + "]\n")?;
    let techniques = sorted_paths(Path::new("src/techniques"))?;
    let names = techniques.iter().filter(|path| path.is_dir()).filter_map(|path| path.file_name()?.to_str());
    let list: String = names.map(|name| format!("    {name}::TECHNIQUE,\n")).collect();
    fs::write(out.join("techniques.rs"), format!("[\n{list}]\n"))?;
    Ok(())
}

fn sorted_paths(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut paths: Vec<_> = fs::read_dir(folder)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    paths.sort();
    Ok(paths)
}

fn collect_entries(folder: &Path, entries: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for path in sorted_paths(folder)? {
        if path.is_dir() {
            collect_entries(&path, entries)?;
        } else if path.extension().is_some_and(|extension| extension == "wesl") {
            let text = fs::read_to_string(&path)?;
            if ["@compute", "@vertex"].iter().any(|stage| text.contains(stage)) {
                entries.push(path);
            }
        }
    }
    Ok(())
}
