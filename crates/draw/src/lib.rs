//! Pictures of maps, trajectories and measurements: plain numbers in, SVG text and PNG bytes out.
//!
//! There is one drawing path, but for films ([`Stage`]), which skip the SVG. Every picture is first an SVG ([`GridScene`], [`BodyScene`],
//! [`Plot`], [`BarChart`], [`Histogram`], [`Matrix`]); [`to_png`] rasterizes that very SVG. The
//! crate reads no files, asks for no system font and knows nothing of worlds, runs or robots'
//! types.
//!
//! The same input gives the same bytes, whatever fonts and locale the machine has: numbers are
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

mod axis;
mod bodies;
mod chart;
mod error;
mod film;
mod heat;
#[cfg(test)]
mod layout_tests;
mod legend;
mod raster;
mod scene;
mod style;
mod svg;
mod text;
mod ticks;

pub use axis::Axis;
pub use bodies::{BodyScene, Obstacle, Shape, Strand, Trail};
pub use chart::bars::{Bar, BarChart, BarSeries};
pub use chart::histogram::Histogram;
pub use chart::plot::{Mark, Plot, Point, Series};
pub use error::DrawError;
pub use film::{Camera, Figure, Form, Picture, Stage};
pub use heat::Matrix;
pub use raster::to_png;
pub use scene::{BodyRect, BodyShade, CellShade, DoorRect, GridScene, Track, to_svg};
pub use style::{SERIES_COLORS, Style};
