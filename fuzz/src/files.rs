//! Files for readers that take no text: all in one folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// Chooses the folder, once, before any target runs.
pub(crate) fn keep_in(folder: &Path) {
    fs::create_dir_all(folder).expect("a folder for files");
    FOLDER.set(folder.to_path_buf()).expect("the first folder");
}

pub(crate) fn folder() -> &'static Path {
    FOLDER.get().expect("a folder was chosen")
}

/// Writes a file for one input, over that of the input before, and returns its path.
pub(crate) fn file(name: &str, data: &[u8]) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, data).expect("a file");
    path
}

/// The YAML file of a map with an existing image.
pub(crate) fn beside_an_image(data: &[u8]) -> PathBuf {
    file("image.pgm", b"P2\n3 2\n255\n0 128 255\n255 205 0\n");
    file("f.yaml", data)
}

/// A folder of logs: its files in one input, each after a line `% NAME`.
pub(crate) fn mrclam_folder(data: &[u8]) -> &'static Path {
    let text = String::from_utf8_lossy(data);
    for name in [
        "Barcodes",
        "Landmark_Groundtruth",
        "Robot1_Groundtruth",
        "Robot1_Measurement",
        "Robot1_Odometry",
    ] {
        let inside = text.split(&format!("% {name}\n")).nth(1).unwrap_or_default();
        file(&format!("{name}.dat"), inside.split("% ").next().unwrap_or_default().as_bytes());
    }
    folder()
}

/// A folder of tables of places, each of which is the same input.
pub(crate) fn navdata_folder(data: &[u8]) -> &'static Path {
    for name in ["airports.dat", "fix.dat", "nav.dat"] {
        file(name, data);
    }
    folder()
}

/// A run folder with this manifest, and nothing else that a reader needs before it.
pub(crate) fn run_folder(data: &[u8]) -> &'static Path {
    file("scenario.toml", b"format = 1\n");
    file("run.json", data);
    folder()
}
