//! Pictures of runs and of measurements: the visible part of a run, or plain numbers, in; SVG text
//! and PNG bytes out.
//!
//! There is one drawing path: every picture is first an SVG ([`draw`], [`Plot`], [`BarChart`]); [`to_png`] rasterizes
//! exactly that SVG, and a [`AnimationRenderer`] does so repeatedly. The crate reads no files, asks for no system font and knows
//! no world: of a run it sees scenery, frames and trails (`sidestep_kernel::view`).
//!
//! The same input gives the same bytes, for any fonts and locale of the machine: numbers are
//! rounded to a hundredth of a unit, logarithms come from `libm`, and the only font is the
//! embedded DejaVu Sans.
//!
//! ```
//! use sidestep_draw::{Axis, Plot, Point, Series, Style, to_png};
//!
//! let points = vec![
//!     Point::new(1.0, 1.0),
//!     Point::new(2.0, 1.9).with_interval(1.8, 2.0),
//!     Point::new(4.0, 3.4).with_interval(3.1, 3.7),
//! ];
//! let svg = Plot::new("Speed-up")
//!     .x_axis(Axis::log("workers").ticks([1.0, 2.0, 4.0]))
//!     .y_axis(Axis::log("speed-up").ticks([1.0, 2.0, 4.0]))
//!     .ideal_line("ideal", 0.0, 1.0)
//!     .series(Series::line("measured", points))
//!     .to_svg(&Style::CHART)?;
//! let png = to_png(&svg, 1440)?;
//! # assert!(png.starts_with(b"\x89PNG"));
//! # Ok::<(), sidestep_draw::DrawError>(())
//! ```

mod animation;
mod axis;
mod chart;
mod error;
#[cfg(test)]
mod layout_tests;
mod legend;
mod pdf;
mod picture;
mod raster;
mod style;
mod svg;
#[cfg(test)]
mod testing;
mod text;
mod theme;
mod ticks;

pub use animation::{AnimationFrame, AnimationLook, AnimationRenderer, AnimationSize};
pub use axis::Axis;
pub use chart::bars::{Bar, BarChart, BarSeries};
pub use chart::forest::{ForestChart, ForestMark, ForestSeries};
pub use chart::heat::HeatChart;
pub use chart::plot::{LegendGroup, LegendLook, Mark, Plot, Point, Series};
pub use chart::slots::{QuartileBox, Slot, SlotChart};
pub use chart::{DrawnChart, Spot};
pub use error::DrawError;
pub use pdf::to_pdf;
pub use picture::{PictureOptions, PictureView, TrailChoice, bodies_with_trails, describe, draw};
pub use raster::{MAX_PNG_PX, to_png, to_png_with_density};
pub use style::{SeriesLook, Style, series_colors};
pub use text::Fonts;
pub use theme::{DARK_COLORS, to_dark};
