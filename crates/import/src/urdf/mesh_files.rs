//! The files of meshes that a model names.

use crate::named_file::is_inside;
use std::path::{Path, PathBuf};

/// The number of folders above the model's that are searched for a package.
const MAX_LEVELS: usize = 8;

/// The folder in which the meshes of a model have to lie that it names by paths: the package of the model, which is the
/// nearest folder with a `package.xml`; without one, the folder above the model's, because models and meshes lie side by
/// side there.
fn package_folder(folder: &Path) -> &Path {
    let above = folder.ancestors().take(MAX_LEVELS);
    let package = above.into_iter().find(|above| above.join("package.xml").is_file());
    package.unwrap_or_else(|| folder.parent().unwrap_or(folder))
}

/// Returns the path of a mesh of a model, or the reason why there is none.
pub(super) fn find_mesh(urdf: &Path, file: &str) -> Result<PathBuf, String> {
    let folder = std::path::absolute(urdf).ok().and_then(|urdf| Some(urdf.parent()?.to_owned()));
    let folder = folder.ok_or("the model has no folder")?;
    if let Some(package_path) = file.strip_prefix("package://") {
        return find_in_packages(&folder, package_path);
    }
    let path = match file.strip_prefix("file://") {
        // A host, of which only the own one makes sense, or none.
        Some(path) => PathBuf::from(path.strip_prefix("localhost").unwrap_or(path)),
        None if file.contains("://") => return Err("its scheme is not read".to_owned()),
        None => folder.join(file),
    };
    if !path.is_file() {
        return Err("the file is absent".to_owned());
    }
    let package = package_folder(&folder);
    if is_inside(&path, package) {
        return Ok(path);
    }
    Err(format!("the file is outside of {}", package.display()))
}

/// Searches for a mesh of a package. There is no index of packages without ROS: the package is a folder above the
/// model, or a neighbor of one.
fn find_in_packages(folder: &Path, package_path: &str) -> Result<PathBuf, String> {
    let (package, path_in_package) = package_path.split_once('/').unwrap_or((package_path, ""));
    let mut is_outside = false;
    for above in folder.ancestors().take(MAX_LEVELS) {
        for root in [above.join(package), above.to_owned()] {
            let path = root.join(path_in_package);
            if !path.is_file() {
                continue;
            }
            if is_inside(&path, &root) {
                return Ok(path);
            }
            is_outside = true;
        }
    }
    Err(if is_outside { "the file is outside of its package" } else { "the file is absent" }
        .to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(files: &[&str]) -> tempfile::TempDir {
        let place = tempfile::tempdir().expect("a temporary folder");
        for file in files {
            let path = place.path().join(file);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, "").expect("written");
        }
        place
    }

    #[test]
    fn paths_and_packages_lead_to_the_files_of_the_package() {
        let files = ["ws/arm/urdf/arm.urdf", "ws/arm/meshes/a.stl", "ws/hand/b.stl"];
        let place = place(&files);
        let urdf = place.path().join(files[0]);
        let mesh = place.path().join(files[1]);
        let by_address = format!("file://{}", mesh.display());
        for name in ["../meshes/a.stl", "package://arm/meshes/a.stl", &by_address] {
            let found = find_mesh(&urdf, name).expect(name).canonicalize().expect("there");
            assert_eq!(found, mesh.canonicalize().expect("there"), "{name}");
        }
        assert!(find_mesh(&urdf, "package://hand/b.stl").is_ok());
        assert_eq!(find_mesh(&urdf, "package://foot/b.stl"), Err("the file is absent".into()));
        assert_eq!(find_mesh(&urdf, "c.stl"), Err("the file is absent".into()));
        assert!(find_mesh(&urdf, "https://a.org/c.stl").is_err_and(|e| e.contains("scheme")));
    }

    #[test]
    fn files_outside_of_the_package_are_none() {
        let files =
            ["a/b/urdf/arm.urdf", "a/secret.stl", "a/b/inside.stl", "a/b/deep/urdf/arm.urdf"];
        let place = place(&files);
        let path = |file: &str| place.path().join(file);
        let is_outside = |urdf: &str, name: &str| {
            find_mesh(&path(urdf), name).is_err_and(|reason| reason.contains("outside"))
        };
        let by_address = format!("file://{}", path("a/secret.stl").display());
        for name in ["../../secret.stl", &by_address, "package://b/../secret.stl"] {
            assert!(is_outside(files[0], name), "{name}");
        }
        assert!(find_mesh(&path(files[0]), "../inside.stl").is_ok());
        assert!(is_outside(files[3], "../../inside.stl"));
        std::fs::write(path("a/b/package.xml"), "").expect("written");
        assert!(find_mesh(&path(files[3]), "../../inside.stl").is_ok(), "the package is larger");
    }
}
