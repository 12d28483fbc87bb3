//! Logarithmic axes.

use anyhow::Result;
use plotters::prelude::*;

use crate::{FONT, Line, lines, svg};

/// Lines over two logarithmic axes as SVG, 640 by 380 pixels; all coordinates are positive.
pub fn log_log(title: &str, x: &str, y: &str, points: &[Line]) -> Result<String> {
    let range = |axis: fn(&(f64, f64)) -> f64| {
        let values = points.iter().flat_map(|line| &line.points).map(axis);
        let (low, high) = values.fold((f64::INFINITY, 0f64), |(low, high), v| (low.min(v), high.max(v)));
        low / 1.3..high * 1.3
    };
    let (across, up) = (range(|point| point.0), range(|point| point.1));
    let (columns, rows) = (ticks(across.start, across.end), ticks(up.start, up.end));
    svg((640, 380), |area| {
        let mut chart = ChartBuilder::on(area)
            .caption(title, (FONT, 18))
            .margin(8)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(across.log_scale().with_key_points(columns), up.log_scale().with_key_points(rows))?;
        chart
            .configure_mesh()
            .bold_line_style(BLACK.mix(0.12))
            .light_line_style(TRANSPARENT)
            .x_label_formatter(&|&value| label(value))
            .y_label_formatter(&|&value| label(value))
            .x_desc(x)
            .y_desc(y)
            .draw()?;
        lines(&mut chart, points, 3)
    })
}

/// Round numbers between two: powers of ten, and what halves decades where these are few.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let decades = (high / low).log10();
    let between: &[f64] = match decades {
        ..0.7 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
        ..2.5 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let all = powers.flat_map(|power| between.iter().map(move |digit| digit * 10f64.powi(power)));
    all.filter(|tick| (low..=high).contains(tick)).collect()
}

/// 0.05, 20 or 5·10⁶.
fn label(tick: f64) -> String {
    let power = (tick.log10() + 1e-9).floor() as i32;
    let digit = (tick / 10f64.powi(power) * 10.0).round() / 10.0;
    if (-3..4).contains(&power) {
        return format!("{}", (tick * 1e6).round() / 1e6);
    }
    let raised: String = power.to_string().chars().map(superscript).collect();
    if digit == 1.0 { format!("10{raised}") } else { format!("{digit}·10{raised}") }
}

fn superscript(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(u32::from(digit) - u32::from('0') + u32::from('⁰')).unwrap_or(digit),
    }
}

/// The slope of the least-squares line through the logarithms of points, which is the exponent of a power law, and its
/// standard error.
pub fn slope(points: &[(f64, f64)]) -> (f64, f64) {
    let logs: Vec<_> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx).powi(2)));
    let slope = xy / xx;
    let residual: f64 = logs.iter().map(|(x, y)| (y - my - slope * (x - mx)).powi(2)).sum();
    (slope, (residual / (n - 2.0).max(1.0) / xx).sqrt())
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let labels = |low, high| ticks(low, high).into_iter().map(label).collect::<Vec<_>>().join(" ");
        assert_eq!(labels(0.008, 0.4), "0.01 0.02 0.05 0.1 0.2");
        assert_eq!(labels(800.0, 1.3e6), "1000 10⁴ 10⁵ 10⁶");
        assert_eq!(labels(0.5, 1.7), "0.5 0.6 0.8 1 1.5");
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([0.30000000000000004, 20.0, 5e6, 1e-4].map(label), ["0.3", "20", "5·10⁶", "10⁻⁴"]);
    }

    #[test]
    fn slope_is_the_exponent() {
        let points: Vec<_> = (1..6).map(|n| (f64::from(n), 3.0 * f64::from(n).powf(-0.5))).collect();
        let (exponent, error) = slope(&points);
        assert!((exponent + 0.5).abs() < 1e-12 && error < 1e-12);
    }
}
