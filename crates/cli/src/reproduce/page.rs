//! A page of results: sections of text, plots and tables; and the same numbers as JSON.

use std::path::Path;

use serde_json::{Map, Value, json};
use tyndall_scene::image::{DisplayImage, png, write_atomically};

use crate::failure::Failure;

/// A page in the making.
pub struct Page {
    title: String,
    body: String,
    results: Map<String, Value>,
    /// Pictures, as files beside the page.
    files: Vec<(String, Vec<u8>)>,
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Self {
        Self { title: title.into(), body: String::new(), results: Map::new(), files: Vec::new() }
    }

    /// Begins a section.
    pub fn section(&mut self, title: &str, text: &str) {
        self.body += &format!("<h2>{}</h2>\n<p>{}</p>\n", escaped(title), escaped(text));
    }

    /// Appends a plot, an SVG.
    pub fn plot(&mut self, svg: &str) {
        self.body += &format!("<figure>{svg}</figure>\n");
    }

    /// Appends a picture, which becomes a PNG beside the page.
    pub fn picture(&mut self, name: &str, caption: &str, picture: &DisplayImage) -> Result<(), Failure> {
        let (file, caption) = (format!("{name}.png"), escaped(caption));
        self.body +=
            &format!("<figure><img src=\"{file}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>\n");
        self.files.push((file, png::encode(picture)?));
        Ok(())
    }

    /// Appends a table; its rows stand in the JSON under `key`, each by the columns' names.
    pub fn table(&mut self, key: &str, columns: &[&str], rows: &[Vec<Value>]) {
        let cells = |values: &mut dyn Iterator<Item = String>, tag: &str| {
            values.map(|cell| format!("<{tag}>{}</{tag}>", escaped(&cell))).collect::<String>()
        };
        let head = cells(&mut columns.iter().map(|name| (*name).to_owned()), "th");
        self.body += &format!("<table>\n<tr>{head}</tr>\n");
        for row in rows {
            self.body += &format!("<tr>{}</tr>\n", cells(&mut row.iter().map(shown), "td"));
        }
        self.body += "</table>\n";
        let named = |row: &Vec<Value>| -> Value {
            columns
                .iter()
                .zip(row)
                .map(|(name, value)| ((*name).to_owned(), value.clone()))
                .collect::<Map<_, _>>()
                .into()
        };
        self.results.insert(key.into(), rows.iter().map(named).collect());
    }

    /// Writes index.html and results.json into a folder that is there.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        let title = escaped(&self.title);
        let html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
             <h1>{title}</h1>\n<p>Made by tyndall {}.</p>\n{}</html>\n",
            env!("CARGO_PKG_VERSION"),
            self.body
        );
        let results = json!({ "title": self.title, "version": env!("CARGO_PKG_VERSION"), "results": self.results });
        for (name, bytes) in &self.files {
            write_atomically(&folder.join(name), bytes)?;
        }
        write_atomically(&folder.join("index.html"), html.as_bytes())?;
        write_atomically(&folder.join("results.json"), format!("{results:#}\n").as_bytes())?;
        Ok(())
    }
}

const STYLE: &str = "body{font:16px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}\
                     table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.2rem .6rem;text-align:right}\
                     td:first-child,th:first-child{text-align:left}figure{margin:1rem 0}svg,img{max-width:100%}";

/// A number to four digits.
fn shown(value: &Value) -> String {
    match value {
        Value::Number(number) if number.is_f64() => match number.as_f64() {
            Some(x) if x != 0.0 && x.abs() < 1e-3 => format!("{x:.1e}"),
            Some(x) => format!("{x:.4}"),
            None => number.to_string(),
        },
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
