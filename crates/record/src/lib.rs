#![doc = include_str!("../README.md")]

mod create_error;
mod disk;
mod encode;
mod export_folder;
mod file_list;
mod file_manifest;
mod file_set;
mod flight;
mod group;
mod if_exists;
mod leftovers;
mod mcap_request;
mod origin;
mod part;
mod process_lock;
mod replacement;
mod run_content;
mod run_reader;
mod schema;
mod sealed_json;
mod staging;
mod table_file;

pub mod folder;
pub mod format;
pub mod manifest;
pub mod mcap;
pub mod parquet;
pub mod read;
pub mod run_table;
pub mod sweep;
pub mod verify;

pub use create_error::{CreateError, PathError, is_wrong_path, replace_path};
pub use disk::{missing_folders, remove_folders};
pub use export_folder::ExportFolder;
pub use file_list::{DamagedFile, FileFault, FileList, hash_file};
pub use file_manifest::{EXPORT, FileManifest, REPORT};
pub use file_set::{FileSet, free_name};
pub use flight::FlightProgress;
pub use folder::{NewRun, ResumePoint, RunFolder};
pub use format::FormatVersion;
pub use if_exists::IfExists;
pub use manifest::{Manifest, Status};
pub use mcap::{
    BagSchema, BagWriter, LiveFrameWriter, LiveServer, McapFooter, McapProvenance, McapRecorder,
    McapRunInfo, McapSceneReader, Playback, PlaybackPhase, PlaybackRequest, ServedRun, check_mcap,
    is_mcap, start_live_server,
};
pub use mcap_request::McapRequest;
pub use origin::{CycleOrigin, OriginRange, origins_text};
pub use parquet::ParquetRecorder;
pub use read::{Table, for_each_block, read_table, row_count, tables};
pub use run_reader::RunReader;
pub use run_table::LoadedTable;
pub use schema::Provenance;
pub use sealed_json::{FileDigest, Seal, seal_again};
pub use staging::resolve_link;
pub use table_file::TableFileWriter;
