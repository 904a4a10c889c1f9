//! Fonts of figures: from a file, or from the font folders of this machine by the name of their family.

use sidestep::kernel::InputError;
use sidestep_draw::Fonts;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Most families that an error lists.
const MAX_LISTED: usize = 12;
/// Most folders below a font folder: those of systems are two deep.
const MAX_DEPTH: usize = 6;
/// Largest font file that is read, bytes: fonts of Chinese and Japanese have some tens of megabytes.
const MAX_FONT_BYTES: u64 = 1 << 26;

/// Returns the fonts that `given` stands for: a font file, or the name of an installed family.
///
/// # Errors
/// When the file is no font, or no installed family has the name.
pub(crate) fn find_fonts(given: &str) -> Result<Fonts, InputError> {
    let path = Path::new(given);
    if path.is_file() {
        return from_file(path);
    }
    let is_path = path.components().count() > 1 || has_font_ending(path);
    if is_path {
        let remedy = "give the path of a .ttf or .otf file, or the name of an installed family";
        return Err(InputError::new(path.display(), "there is no such file", remedy));
    }
    from_installed(given, &font_folders())
}

fn from_file(path: &Path) -> Result<Fonts, InputError> {
    let remedy = "give a font file: .ttf or .otf";
    let wrong = |cause: String| InputError::new(path.display(), cause, remedy);
    let bytes = std::fs::read(path).map_err(|error| wrong(error.to_string()))?;
    Fonts::from_file_bytes(bytes).map_err(|error| wrong(error.to_string()))
}

/// Returns the fonts of a family in some folders: all of its weights and slopes.
fn from_installed(family: &str, folders: &[PathBuf]) -> Result<Fonts, InputError> {
    let mut files = Vec::new();
    folders.iter().for_each(|folder| collect_fonts(folder, MAX_DEPTH, &mut files));
    // The order of a folder's entries is that of its file system.
    files.sort();
    let mut found = Vec::new();
    let mut known: BTreeSet<String> = BTreeSet::new();
    for path in files {
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let families = Fonts::families(&bytes);
        if families.iter().any(|name| name.eq_ignore_ascii_case(family)) {
            found.push(bytes);
        }
        known.extend(families);
    }
    if found.is_empty() {
        return Err(unknown_family(family, &known, folders));
    }
    let place = format!("--figure-family {family}");
    Fonts::from_family(family, found)
        .map_err(|error| InputError::new(place, error.to_string(), "give the path of a font file"))
}

fn unknown_family(family: &str, known: &BTreeSet<String>, folders: &[PathBuf]) -> InputError {
    let place = format!("--figure-family {family}");
    if known.is_empty() {
        let looked: Vec<String> =
            folders.iter().map(|folder| folder.display().to_string()).collect();
        let cause = format!("no fonts are installed in {}", looked.join(", "));
        return InputError::new(place, cause, "give the path of a .ttf or .otf file");
    }
    // Families that begin alike come first: a word may have been left out.
    let wanted = family.to_ascii_lowercase();
    let is_alike = |name: &&String| {
        let name = name.to_ascii_lowercase();
        name.contains(&wanted) || wanted.contains(&name)
    };
    let alike = known.iter().filter(is_alike);
    let others = known.iter().filter(|name| !is_alike(name));
    let listed: Vec<&str> = alike.chain(others).take(MAX_LISTED).map(String::as_str).collect();
    let more = match known.len() - listed.len() {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    let remedy = format!(
        "give one of {}{more}, or the path of a .ttf or .otf file",
        listed.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
    );
    InputError::new(place, "no installed font has this name", remedy)
}

/// Adds the font files below a folder.
fn collect_fonts(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            // Links may lead in circles.
            if depth > 0 {
                collect_fonts(&path, depth - 1, files);
            }
        } else if has_font_ending(&path)
            && std::fs::metadata(&path).is_ok_and(|about| about.len() <= MAX_FONT_BYTES)
        {
            files.push(path);
        }
    }
}

fn has_font_ending(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    ["ttf", "otf", "ttc", "otc"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Returns the folders in which systems keep fonts.
fn font_folders() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = Vec::new();
    let of_home = |folder: &str| std::env::var_os("HOME").map(|home| Path::new(&home).join(folder));
    if cfg!(target_os = "windows") {
        let windows = std::env::var_os("WINDIR").map(|root| Path::new(&root).join("Fonts"));
        let own = std::env::var_os("LOCALAPPDATA")
            .map(|root| Path::new(&root).join("Microsoft\\Windows\\Fonts"));
        folders.extend(windows);
        folders.extend(own);
    } else if cfg!(target_os = "macos") {
        folders.extend(["/System/Library/Fonts", "/Library/Fonts"].map(PathBuf::from));
        folders.extend(of_home("Library/Fonts"));
    } else {
        folders.extend(["/usr/share/fonts", "/usr/local/share/fonts"].map(PathBuf::from));
        folders.extend(of_home(".local/share/fonts"));
        folders.extend(of_home(".fonts"));
    }
    folders
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_that_is_not_installed_is_told_with_those_that_are() {
        let known = ["Noto Sans", "Noto Serif", "Other"].map(String::from).into();
        let told = unknown_family("noto", &known, &[]).to_string();
        assert!(told.contains("no installed font has this name"), "{told}");
        assert!(told.contains("\"Noto Sans\", \"Noto Serif\", \"Other\""), "{told}");
        let none = unknown_family("noto", &BTreeSet::new(), &["/fonts".into()]).to_string();
        assert!(none.contains("no fonts are installed in /fonts"), "{none}");
    }

    #[test]
    fn fonts_are_files_with_their_endings_in_folders_below() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = place.path().join("truetype/noto");
        std::fs::create_dir_all(&folder).expect("a folder");
        for name in ["a.ttf", "b.OTF", "c.txt"] {
            std::fs::write(folder.join(name), "no font").expect("written");
        }
        let mut files = Vec::new();
        collect_fonts(place.path(), MAX_DEPTH, &mut files);
        files.sort();
        assert_eq!(files, [folder.join("a.ttf"), folder.join("b.OTF")]);
        assert!(from_installed("Noto", &[place.path().into()]).is_err(), "files that are no fonts");
    }

    #[test]
    fn a_path_of_no_file_is_told_as_a_path() {
        let told = find_fonts("fonts/missing.ttf").expect_err("no file").to_string();
        assert!(told.contains("there is no such file"), "{told}");
    }
}
