//! The plot: a panel a term, the marcher as lines, the reference as points with their standard errors.

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::{Row, TERMS};
use crate::failure::Failure;

const SIZE: (u32, u32) = (900, 1080);
/// Red, green, blue; where they coincide, the broader ones still show at the rim.
const CHANNELS: [(RGBColor, u32); 3] =
    [(RGBColor(214, 60, 50), 6), (RGBColor(40, 150, 70), 4), (RGBColor(30, 90, 200), 2)];
/// Points of the reference in a panel: more would hide the lines.
const POINTS: usize = 32;
const FONT: &str = "sans-serif";

/// The plot as SVG.
pub fn svg(rows: &[Row], title: &str) -> Result<String, Failure> {
    let mut text = String::new();
    draw(rows, title, SVGBackend::with_string(&mut text, SIZE).into_drawing_area())
        .map_err(|error| Failure::Failed(anyhow!("the plot cannot be drawn: {error}")))?;
    Ok(text)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(rows: &[Row], title: &str, area: Area) -> Drawn {
    area.fill(&WHITE)?;
    let area = area.titled(title, (FONT, 26))?;
    let legend = "red, green, blue; lines: the marcher; points: the reference with its standard error";
    let area = area.titled(legend, (FONT, 18))?;
    for (term, panel) in area.split_evenly((TERMS.len(), 1)).into_iter().enumerate() {
        draw_panel(rows, term, &panel)?;
    }
    area.present()?;
    Ok(())
}

fn draw_panel(rows: &[Row], term: usize, panel: &Area) -> Drawn {
    let marcher = |c: usize| rows.iter().map(move |row| (row.distance, row.marcher[term][c]));
    let every = rows.len().div_ceil(POINTS);
    let reference = |c: usize| {
        let points = rows.iter().skip(every / 2).step_by(every);
        points.map(move |row| (row.distance, row.reference[term].mean[c], row.reference[term].error[c]))
    };
    let tops = (0..3).flat_map(|c| marcher(c).map(|(_, y)| y).chain(reference(c).map(|(_, y, error)| y + error)));
    let top = tops.filter(|y| y.is_finite()).fold(0.0, f64::max);
    let top = if top > 0.0 { 1.05 * top } else { 1.0 };
    let half = 0.5 * (rows[1].distance - rows[0].distance);
    let [begin, end] = [rows[0].distance - half, rows[rows.len() - 1].distance + half];

    let [symbol, name, unit] = TERMS[term];
    let last = term + 1 == TERMS.len();
    let mut chart = ChartBuilder::on(panel)
        .margin(6)
        .margin_right(20)
        .x_label_area_size(if last { 46 } else { 24 })
        .y_label_area_size(84)
        .build_cartesian_2d(begin..end, 0.0..top)?;
    chart
        .configure_mesh()
        .max_light_lines(0)
        .bold_line_style(BLACK.mix(0.12))
        .label_style((FONT, 17))
        .axis_desc_style((FONT, 18))
        .x_desc(if last { "t, distance from the eye [m]" } else { "" })
        .y_desc(if unit == "1" { format!("{symbol}, {name}") } else { format!("{symbol}, {name} [{unit}]") })
        .y_labels(6)
        .draw()?;
    for (c, (color, width)) in CHANNELS.into_iter().enumerate() {
        let line = marcher(c).filter(|(_, y)| y.is_finite());
        chart.draw_series(LineSeries::new(line, color.mix(0.5).stroke_width(width)))?;
    }
    for (c, (color, width)) in CHANNELS.into_iter().enumerate() {
        let bars = reference(c).filter(|(_, _, error)| *error > 0.0);
        let bar = |(x, y, error): (f64, f64, f64)| PathElement::new([(x, (y - error).max(0.0)), (x, y + error)], color);
        chart.draw_series(bars.map(bar))?;
        chart.draw_series(reference(c).map(|(x, y, _)| Circle::new((x, y), 2 + width / 3, color.filled())))?;
    }
    Ok(())
}
