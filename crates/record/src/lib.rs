#![doc = include_str!("../README.md")]

mod disk;
mod encode;
mod group;
mod part;
mod schema;
mod staging;
mod table_file;

pub mod folder;
pub mod format;
pub mod manifest;
pub mod mcap;
pub mod parquet;
pub mod read;
pub mod sweep;
pub mod whole;

pub use folder::{Existing, NewRun, ResumePoint, RunFolder, RunView};
pub use format::FormatVersion;
pub use manifest::{Manifest, Status};
pub use mcap::{
    BagSchema, BagWriter, LiveFrames, LiveServer, McapEnd, McapOrigin, McapRecorder, McapRun,
    McapScenes, Playback, Playing, Steering, is_mcap, live,
};
pub use parquet::ParquetRecorder;
pub use read::{Table, for_each_block, read_table, tables};
pub use schema::Origin;
pub use staging::followed;
pub use table_file::TableFile;
pub use whole::WholeTable;
