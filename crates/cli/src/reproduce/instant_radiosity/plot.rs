//! Plots with logarithmic axes, as SVG.

use anyhow::anyhow;
use plotters::prelude::*;

use crate::failure::Failure;

/// A line with its points; all coordinates are positive.
pub struct Line {
    /// In the legend.
    pub name: String,
    /// From left to right.
    pub points: Vec<(f64, f64)>,
}

/// Lines as SVG.
pub fn svg(title: &str, x: &str, y: &str, lines: &[Line]) -> Result<String, Failure> {
    let mut text = String::new();
    draw(title, x, y, lines, &mut text).map_err(|error| Failure::Failed(anyhow!("a plot cannot be drawn: {error}")))?;
    Ok(text)
}

fn draw(title: &str, x: &str, y: &str, lines: &[Line], text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let range = |axis: fn(&(f64, f64)) -> f64| {
        let values = lines.iter().flat_map(|line| &line.points).map(axis);
        let (low, high) = values.fold((f64::INFINITY, 0f64), |(low, high), v| (low.min(v), high.max(v)));
        (low / 1.3..high * 1.3).log_scale()
    };
    let area = SVGBackend::with_string(text, (760, 380)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 18))
        .margin(8)
        .x_label_area_size(40)
        .y_label_area_size(64)
        .build_cartesian_2d(range(|point| point.0), range(|point| point.1))?;
    chart.configure_mesh().light_line_style(TRANSPARENT).x_desc(x).y_desc(y).draw()?;
    for (i, line) in lines.iter().enumerate() {
        let color = Palette99::pick(i).to_rgba();
        chart
            .draw_series(LineSeries::new(line.points.iter().copied(), color.stroke_width(2)).point_size(3))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.2)).draw()?;
    area.present()?;
    Ok(())
}

/// The slope of the least-squares line through the logarithms of points, and its standard error.
pub fn slope(points: &[(f64, f64)]) -> (f64, f64) {
    let logs: Vec<_> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx).powi(2)));
    let slope = xy / xx;
    let residual: f64 = logs.iter().map(|(x, y)| (y - my - slope * (x - mx)).powi(2)).sum();
    (slope, (residual / (n - 2.0).max(1.0) / xx).sqrt())
}
