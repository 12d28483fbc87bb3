//! Curves over depth, as SVG.

use anyhow::anyhow;
use plotters::prelude::*;

use crate::failure::Failure;

/// A curve with its name.
pub struct Curve {
    /// In the legend.
    pub name: String,
    /// From left to right.
    pub points: Vec<(f64, f64)>,
}

/// What the axes say, and how high the plot is.
pub struct Axes<'a> {
    /// Over the plot.
    pub title: &'a str,
    /// Along x, from 0 to 1.
    pub x: &'a str,
    /// Along y, from 0.
    pub y: &'a str,
    /// The highest value shown.
    pub top: f64,
}

/// The first, which is exact, is black.
const COLORS: [RGBColor; 5] =
    [BLACK, RGBColor(30, 90, 200), RGBColor(214, 60, 50), RGBColor(40, 150, 70), RGBColor(150, 80, 180)];

/// Curves as SVG.
pub fn svg(axes: &Axes, curves: &[Curve]) -> Result<String, Failure> {
    let mut text = String::new();
    draw(axes, curves, &mut text).map_err(|error| Failure::Failed(anyhow!("a plot cannot be drawn: {error}")))?;
    Ok(text)
}

fn draw(axes: &Axes, curves: &[Curve], text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(text, (760, 340)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(axes.title, ("sans-serif", 18))
        .margin(8)
        .x_label_area_size(40)
        .y_label_area_size(56)
        .build_cartesian_2d(0.0..1.0, 0.0..axes.top)?;
    chart.configure_mesh().max_light_lines(0).x_desc(axes.x).y_desc(axes.y).draw()?;
    for (i, curve) in curves.iter().enumerate() {
        let color = COLORS[i % COLORS.len()];
        chart
            .draw_series(LineSeries::new(curve.points.iter().copied(), color.stroke_width(2)))?
            .label(&curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.2)).draw()?;
    area.present()?;
    Ok(())
}
