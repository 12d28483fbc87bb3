//! Lines over linear or logarithmic axes, as SVG, and the exponent of a power law.

mod linear;
mod logarithmic;

pub use linear::{Axes, curves};
pub use logarithmic::{log_log, slope};

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

/// A line with its name.
pub struct Line {
    /// In the legend.
    pub name: String,
    /// From left to right.
    pub points: Vec<(f64, f64)>,
}

/// The first, which is often what is exact, is black.
const COLORS: [RGBColor; 6] = [
    BLACK,
    RGBColor(30, 90, 200),
    RGBColor(214, 60, 50),
    RGBColor(40, 150, 70),
    RGBColor(150, 80, 180),
    RGBColor(220, 140, 20),
];
const FONT: &str = "sans-serif";

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// The text of a plot of a size [pixels].
fn svg(size: (u32, u32), draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Drawn) -> Result<String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(Into::into).and_then(|()| draw(&area)).map_err(failed)?;
        area.present().map_err(|error| failed(error.into()))?;
    }
    Ok(text)
}

fn failed(error: Box<dyn std::error::Error>) -> anyhow::Error {
    anyhow!("the plot cannot be drawn: {error}")
}

/// Lines with points of a radius [pixels] and, where there are several, a legend in the corner that they leave emptiest.
fn lines<'a, X, Y>(
    chart: &mut ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>,
    lines: &[Line],
    radius: u32,
) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64> + 'a,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64> + 'a,
{
    for (line, color) in lines.iter().zip(COLORS.into_iter().cycle()) {
        let points = line.points.iter().copied();
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)).point_size(radius))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
    }
    if lines.len() > 1 {
        let position = emptiest(chart.plotting_area(), lines);
        let mut legend = chart.configure_series_labels();
        legend.position(position).background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.2)).draw()?;
    }
    Ok(())
}

/// The corner through which the shortest pieces of lines pass.
fn emptiest<X, Y>(area: &DrawingArea<SVGBackend<'_>, Cartesian2d<X, Y>>, lines: &[Line]) -> SeriesLabelPosition
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
{
    let (width, height) = area.dim_in_pixel();
    let (left, top) = area.get_base_pixel();
    let place = |&(x, y): &(f64, f64)| {
        let (x, y) = area.map_coordinate(&(x, y));
        (f64::from(x - left) / f64::from(width), f64::from(y - top) / f64::from(height))
    };
    let mut crowded = [0.0; 4];
    for pair in lines.iter().flat_map(|line| line.points.windows(2)) {
        let [from, to] = [place(&pair[0]), place(&pair[1])];
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        for step in 0..STEPS {
            let t = (f64::from(step) + 0.5) / f64::from(STEPS);
            let at = (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1));
            let [outer_x, outer_y] = [at.0.min(1.0 - at.0), at.1.min(1.0 - at.1)];
            if outer_x < CORNER && outer_y < CORNER {
                crowded[usize::from(at.0 > 0.5) + 2 * usize::from(at.1 > 0.5)] += length / f64::from(STEPS);
            }
        }
    }
    let least = (0..4).min_by(|&a, &b| f64::total_cmp(&crowded[a], &crowded[b])).unwrap_or(0);
    [
        SeriesLabelPosition::UpperLeft,
        SeriesLabelPosition::UpperRight,
        SeriesLabelPosition::LowerLeft,
        SeriesLabelPosition::LowerRight,
    ][least]
        .clone()
}

/// Pieces of a line between two of its points.
const STEPS: u32 = 32;
/// What of a plot's width and height is a corner.
const CORNER: f64 = 0.4;
