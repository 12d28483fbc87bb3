//! The table: comments, a header with units, and a line a point.

use super::{Row, TERMS};

/// The table as text. `about` goes ahead of it, a comment each.
pub fn table(rows: &[Row], about: &[String]) -> String {
    let mut text: String = about.iter().map(|line| format!("# {line}\n")).collect();
    let columns = TERMS.iter().flat_map(|[symbol, _, unit]| {
        let of_channel = move |channel| {
            ["marcher", "reference", "standard error"].map(|by| format!("{symbol} {channel} {by} [{unit}]"))
        };
        ["red", "green", "blue"].into_iter().flat_map(of_channel)
    });
    line(&mut text, std::iter::once("t [m]".into()).chain(columns));
    for row in rows {
        let terms = row.marcher.iter().zip(&row.reference);
        let values = terms.flat_map(|(marcher, reference)| {
            (0..3).flat_map(move |c| [marcher[c], reference.mean[c], reference.error[c]])
        });
        line(&mut text, std::iter::once(row.distance).chain(values).map(number));
    }
    text
}

fn line(text: &mut String, cells: impl Iterator<Item = String>) {
    *text += &cells.collect::<Vec<_>>().join(",");
    text.push('\n');
}

/// Seven digits: what single precision holds.
fn number(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.6e}") }
}
