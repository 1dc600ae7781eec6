//! Series of numbers -> one chart as SVG text. Pure.
//!
//! For `--plot`, for reports, and for the pictures in `docs/`. Drawn with `plotters`; the text is set by
//! whoever shows the picture, so no font is read and the same numbers give the same bytes everywhere.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt;

/// A chart: axes, and what is drawn between them.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Above the chart.
    pub title: String,
    /// Axis to the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// Drawn in this order, later ones on top.
    pub series: Vec<Series>,
    /// One unit is as long upwards as to the right: for paths and shapes.
    pub equal: bool,
    /// Width and height in pixels; `(0, 0)` = 860 by 520.
    pub size: (u32, u32),
    /// Least width of the legend in pixels, for charts that are to be as wide as each other.
    pub beside: u32,
}

/// One axis of a [`Chart`].
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// Quantity that it measures, with its unit.
    pub label: String,
    /// Logarithmic; values that are not positive are then left out.
    pub log: bool,
    /// Ends; `None` = those of the data, a little widened.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that fits the data.
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Axis {
        Axis {
            label: label.into(),
            ..Axis::default()
        }
    }

    /// A logarithmic axis that fits the data.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Axis {
        Axis {
            log: true,
            ..Axis::linear(label)
        }
    }
}

/// One row of the legend.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Name in the legend; empty = not in it.
    pub name: String,
    /// `[x, y]`; a point that is not finite (or not positive on a logarithmic axis) interrupts the line.
    pub points: Vec<[f64; 2]>,
    /// Look.
    pub look: SeriesStyle,
    /// Place in the palette; `None` = the next one. For series that belong together.
    pub color: Option<usize>,
}

/// Look of a [`Series`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SeriesStyle {
    /// A line through the points.
    #[default]
    Line,
    /// A thin line: many points, many lines.
    Thin,
    /// A broken line: references, theory.
    Dashed,
    /// A line with its points marked: few, measured.
    Marked,
    /// Points alone.
    Dots,
    /// A pale area: its points run along one side and back along the other.
    Band,
}

/// A chart that could not be drawn.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PlotError(String);

impl fmt::Display for PlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the chart could not be drawn: {}", self.0)
    }
}

impl std::error::Error for PlotError {}

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008), black first, grey for yellow. The
/// three after black are those of x, y and z everywhere: red, green, blue.
const PALETTE: [RGBColor; 8] = [
    RGBColor(0, 0, 0),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(0, 114, 178),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(140, 140, 140),
];

/// Size of the legend: width of a letter and height of a row, pixels.
const LETTER: f64 = 7.2;
const ROW: i32 = 20;

impl Chart {
    /// The chart as SVG text.
    ///
    /// # Errors
    /// No finite point to draw, or a given range that is empty.
    pub fn svg(&self) -> Result<String, PlotError> {
        let (x, y) = (self.range(0, &self.x)?, self.range(1, &self.y)?);
        let (width, height) = match self.size {
            (0, 0) => (860, 520),
            size => size,
        };
        let mut text = String::new();
        {
            let whole = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            let beside = self.legend_width().max(self.beside).min(width / 2);
            let (area, legend) = whole.split_horizontally(width - beside);
            let drawn = whole
                .fill(&WHITE)
                .map_err(|e| e.to_string())
                .and_then(|()| {
                    self.draw_legend(&legend)?;
                    let (x, y) = if self.equal {
                        // What the margins and labels below leave of the picture.
                        let pixels = f64::from(width - beside) - 96.0;
                        widened(x, y, pixels, f64::from(height) - 104.0)
                    } else {
                        (x, y)
                    };
                    let largest = |(low, high): (f64, f64), axis: &Axis| {
                        if axis.log {
                            0.0
                        } else {
                            low.abs().max(high.abs())
                        }
                    };
                    let ends = (largest(x, &self.x), largest(y, &self.y));
                    match (self.x.log, self.y.log) {
                        (false, false) => self.draw(&area, x.0..x.1, y.0..y.1, ends),
                        (true, false) => self.draw(&area, (x.0..x.1).log_scale(), y.0..y.1, ends),
                        (false, true) => self.draw(&area, x.0..x.1, (y.0..y.1).log_scale(), ends),
                        (true, true) => {
                            self.draw(&area, (x.0..x.1).log_scale(), (y.0..y.1).log_scale(), ends)
                        }
                    }?;
                    whole.present().map_err(|e| e.to_string())
                });
            drawn.map_err(PlotError)?;
        }
        Ok(text)
    }

    /// Ends of one axis.
    fn range(&self, index: usize, axis: &Axis) -> Result<(f64, f64), PlotError> {
        let (low, high) = axis.range.unwrap_or_else(|| {
            self.series
                .iter()
                .flat_map(|s| &s.points)
                .filter(|p| self.drawable(p))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                    (low.min(p[index]), high.max(p[index]))
                })
        });
        if !(low.is_finite() && high.is_finite() && low <= high) || (axis.log && low <= 0.0) {
            return Err(PlotError(format!(
                "there is no finite point along the axis \"{}\"",
                axis.label
            )));
        }
        if axis.range.is_some() && low < high {
            return Ok((low, high));
        }
        Ok(if axis.log {
            let margin = if low < high {
                (high / low).powf(0.04)
            } else {
                2.0
            };
            (low / margin, high * margin)
        } else {
            let margin = if low < high {
                0.04 * (high - low)
            } else {
                0.5 * low.abs().max(1e-12)
            };
            (low - margin, high + margin)
        })
    }

    fn drawable(&self, [x, y]: &[f64; 2]) -> bool {
        let fits = |v: f64, axis: &Axis| v.is_finite() && (!axis.log || v > 0.0);
        fits(*x, &self.x) && fits(*y, &self.y)
    }

    /// Columns of pixels to the right of the chart for the names of its series.
    fn legend_width(&self) -> u32 {
        let longest = self.series.iter().map(|s| s.name.chars().count()).max();
        match longest.unwrap_or(0) {
            0 => 0,
            letters => (letters as f64 * LETTER) as u32 + 48,
        }
    }

    /// The names of the series, each behind a piece of its line.
    fn draw_legend(
        &self,
        area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    ) -> Result<(), String> {
        let say = |e: DrawingAreaErrorKind<std::io::Error>| e.to_string();
        let middle = Pos::new(HPos::Left, VPos::Center);
        let text = ("sans-serif", 13)
            .into_font()
            .into_text_style(area)
            .pos(middle);
        let named = self.series.iter().enumerate();
        for (row, (i, series)) in named.filter(|(_, s)| !s.name.is_empty()).enumerate() {
            let y = 52 + ROW * row as i32;
            let color = PALETTE[series.color.unwrap_or(i) % PALETTE.len()];
            let pieces: &[(i32, i32)] = match series.look {
                SeriesStyle::Line | SeriesStyle::Thin | SeriesStyle::Marked => &[(0, 24)],
                SeriesStyle::Dashed => &[(0, 6), (9, 15), (18, 24)],
                SeriesStyle::Dots | SeriesStyle::Band => &[],
            };
            if series.look == SeriesStyle::Band {
                let area_of_it = Rectangle::new([(0, y - 5), (24, y + 5)], pale(color));
                area.draw(&area_of_it).map_err(say)?;
            }
            for (from, to) in pieces {
                let line = PathElement::new([(*from, y), (*to, y)], color.stroke_width(2));
                area.draw(&line).map_err(say)?;
            }
            if matches!(series.look, SeriesStyle::Marked | SeriesStyle::Dots) {
                area.draw(&Circle::new((12, y), 3, color.filled()))
                    .map_err(say)?;
            }
            area.draw_text(&series.name, &text, (32, y)).map_err(say)?;
        }
        Ok(())
    }

    fn draw<'a, X, Y>(
        &self,
        area: &DrawingArea<SVGBackend<'a>, plotters::coord::Shift>,
        x: X,
        y: Y,
        ends: (f64, f64),
    ) -> Result<(), String>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let say = |e: DrawingAreaErrorKind<std::io::Error>| e.to_string();
        let middle = Pos::new(HPos::Center, VPos::Top);
        let title = ("sans-serif", 17)
            .into_font()
            .into_text_style(area)
            .pos(middle);
        let (width, _) = area.dim_in_pixel();
        area.draw_text(&self.title, &title, (width as i32 / 2, 12))
            .map_err(say)?;
        let mut chart = ChartBuilder::on(area)
            .margin_top(40)
            .margin_right(24)
            .margin_left(8)
            .margin_bottom(8)
            .x_label_area_size(48)
            .y_label_area_size(64)
            .build_cartesian_2d(x, y)
            .map_err(say)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(221, 221, 221))
            .axis_style(RGBColor(85, 85, 85))
            .label_style(("sans-serif", 13))
            .x_desc(self.x.label.as_str())
            .y_desc(self.y.label.as_str())
            .x_label_formatter(&|value| number(*value, ends.0))
            .y_label_formatter(&|value| number(*value, ends.1))
            .draw()
            .map_err(say)?;
        for (i, series) in self.series.iter().enumerate() {
            let color = PALETTE[series.color.unwrap_or(i) % PALETTE.len()];
            let style = color.stroke_width(if series.look == SeriesStyle::Thin {
                1
            } else {
                2
            });
            for run in series.points.split(|p| !self.drawable(p)) {
                let points = || run.iter().map(|[x, y]| (*x, *y));
                match series.look {
                    SeriesStyle::Line | SeriesStyle::Thin | SeriesStyle::Marked => {
                        chart
                            .draw_series(LineSeries::new(points(), style))
                            .map_err(say)?;
                    }
                    SeriesStyle::Dashed => {
                        let dashes = DashedLineSeries::new(points(), 6, 4, style);
                        chart.draw_series(dashes).map_err(say)?;
                    }
                    SeriesStyle::Band => {
                        let outline = Polygon::new(points().collect::<Vec<_>>(), pale(color));
                        chart.draw_series([outline]).map_err(say)?;
                    }
                    SeriesStyle::Dots => {}
                }
                if matches!(series.look, SeriesStyle::Marked | SeriesStyle::Dots) {
                    let size = if series.look == SeriesStyle::Dots {
                        2
                    } else {
                        3
                    };
                    let dots = points().map(|p| Circle::new(p, size, color.filled()));
                    chart.draw_series(dots).map_err(say)?;
                }
            }
        }
        Ok(())
    }
}

/// A colour through which what lies behind is seen.
fn pale(color: RGBColor) -> ShapeStyle {
    color.mix(0.22).filled()
}

/// Ranges in which one unit is equally long along both axes of a picture of the given size.
fn widened(x: (f64, f64), y: (f64, f64), width: f64, height: f64) -> ((f64, f64), (f64, f64)) {
    let per_pixel = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
    let around = |(low, high): (f64, f64), pixels: f64| {
        let (middle, half) = (0.5 * (low + high), 0.5 * per_pixel * pixels);
        (middle - half, middle + half)
    };
    (around(x, width), around(y, height))
}

/// A number beside an axis whose largest is `largest` (0: logarithmic): short, in powers of ten where it is very small
/// or large, and zero where it is zero but for rounding.
fn number(value: f64, largest: f64) -> String {
    let size = value.abs();
    if size < 1e-12 * largest {
        return "0".to_owned();
    }
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        let text = format!("{value:.2e}");
        text.replace(".00e", "e").replace("0e", "e")
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        Chart {
            title: "error & rate".to_owned(),
            x: Axis::log("rate, Hz"),
            y: Axis::log("error, deg"),
            series: vec![Series {
                name: "auto".to_owned(),
                points: vec![[500.0, 1e-9], [1000.0, 1e-11], [2000.0, 3e-13]],
                look: SeriesStyle::Marked,
                ..Series::default()
            }],
            ..Chart::default()
        }
    }

    #[test]
    fn a_chart_is_svg_with_its_words_and_points() {
        let svg = chart().svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for word in ["error &amp; rate", "rate, Hz", "error, deg", "auto"] {
            assert!(svg.contains(word), "{word} in {svg}");
        }
        assert_eq!(
            svg.matches("<circle").count(),
            3 + 1,
            "three points, one in the legend"
        );
        assert_eq!(svg, chart().svg().unwrap(), "the same bytes again");
    }

    #[test]
    fn a_band_is_an_area_behind_the_line_with_its_name() {
        let mut chart = chart();
        let (low, high) = (
            [[500.0, 1e-10], [2000.0, 1e-13]],
            [[2000.0, 1e-12], [500.0, 1e-8]],
        );
        let band = Series {
            name: "3 sigma".to_owned(),
            points: [low, high].concat(),
            look: SeriesStyle::Band,
            color: None,
        };
        chart.series.insert(0, band);
        let svg = chart.svg().unwrap();
        let area = svg.find("<polygon").unwrap();
        assert_eq!(svg.matches("<polygon").count(), 1);
        assert!(svg[area..].contains("<circle"), "behind the line: {svg}");
        assert!(svg.contains("3 sigma"));
        assert!(svg[area..].contains("opacity=\"0.22\""), "{svg}");
    }

    #[test]
    fn points_that_can_not_be_drawn_interrupt_the_line() {
        let mut chart = chart();
        chart.series[0].look = SeriesStyle::Line;
        chart.series[0].points.insert(2, [1500.0, f64::NAN]);
        chart.series[0].points.insert(2, [1200.0, 0.0]);
        chart.series[0].points.push([4000.0, 1e-13]);
        let svg = chart.svg().unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn a_chart_without_points_is_an_error_that_names_the_axis() {
        let empty = Chart {
            series: Vec::new(),
            ..chart()
        };
        assert!(empty.svg().unwrap_err().to_string().contains("rate, Hz"));
        let mut flat = chart();
        flat.series[0].points = vec![[1.0, 1.0]];
        assert!(flat.svg().is_ok());
        flat.y = Axis::linear("y");
        flat.series[0].points = vec![[1.0, 0.0]];
        assert!(flat.svg().is_ok());
    }

    #[test]
    fn one_unit_is_equally_long_both_ways() {
        let (x, y) = widened((0.0, 1.0), (0.0, 1.0), 800.0, 400.0);
        assert!(((x.1 - x.0) / 800.0 - (y.1 - y.0) / 400.0).abs() < 1e-15);
        assert!(x.0 < 0.0 && y.0 <= 0.0 && y.1 >= 1.0);
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.5, "0.5"),
            (1e-12, "1e-12"),
            (2.5e-7, "2.5e-7"),
            (1e5, "1e5"),
            (250.0, "250"),
        ] {
            assert_eq!(number(value, value.abs()), text);
        }
        assert_eq!(
            number(2.22e-16, 1.0),
            "0",
            "a tick that missed zero by a rounding"
        );
        assert_eq!(
            number(1e-14, 0.0),
            "1e-14",
            "but small numbers on a logarithmic axis are not"
        );
    }
}
