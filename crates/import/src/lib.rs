#![deny(clippy::disallowed_methods)]
//! Readers of file formats of other programs, such as maps, robot models, traffic and data sets.
//!
//! Every reader accepts its file plain or compressed with gzip, refuses absurd sizes before it
//! allocates memory for them, and reports errors as an [`InputError`](sidestep_kernel::InputError)
//! with file, line and column. Readers record what they dropped, repaired, guessed or did not use in an [`ImportReport`]
//! beside their data.

pub mod ascii;
pub mod bag;
pub mod bluesky;
pub mod carmen;
mod char_map;
mod extension;
mod foreign_file;
pub mod geojson;
pub mod image;
mod imported_map;
pub mod local_plane;
pub mod lorr;
mod map_file;
mod map_yaml;
pub mod mesh;
pub mod movingai;
pub mod mrclam;
mod named_file;
pub mod openap;
mod pixel_map;
mod pnm;
mod raycast;
pub mod rosmap;
pub mod stage;
pub mod table;
pub mod track;
mod track_pair;
pub mod traffic;
pub mod urdf;
pub mod write;
mod xml;

#[cfg(test)]
mod shared_data;

pub use foreign_file::ForeignFormat;
pub use imported_map::ImportedMap;
pub use map_file::{GridOptions, IMAGE_ENDINGS, import_map, load_map, load_pixel_map};
pub use pixel_map::{MAX_PIXELS, PixelMap};
pub use raycast::RayHit;
pub use sidestep_scenario::import_report as report;
pub use sidestep_scenario::{ImportReport, Treatment};
pub use write::clean_map;
