//! Linear axes.

use anyhow::Result;
use plotters::prelude::*;

use crate::{FONT, Line, lines, svg};

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

/// Curves as SVG, 760 by 340 pixels.
pub fn curves(axes: &Axes, curves: &[Line]) -> Result<String> {
    svg((760, 340), |area| {
        let mut chart = ChartBuilder::on(area)
            .caption(axes.title, (FONT, 18))
            .margin(8)
            .x_label_area_size(40)
            .y_label_area_size(56)
            .build_cartesian_2d(0.0..1.0, 0.0..axes.top)?;
        chart
            .configure_mesh()
            .max_light_lines(0)
            .bold_line_style(BLACK.mix(0.12))
            .x_desc(axes.x)
            .y_desc(axes.y)
            .draw()?;
        lines(&mut chart, curves, 0)
    })
}
