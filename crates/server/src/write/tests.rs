//! Promise E1: a saved text is whole, or the file is as it was.

use super::*;
use std::cell::Cell;

const SCENARIO: &str = "world = \"robots\"\n";

/// A folder `in` that may be written, with a scenario, beside one that may not.
fn places() -> (tempfile::TempDir, AllowedFiles) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [
        ("in/a.toml", SCENARIO),
        ("in/deep/b.toml", SCENARIO),
        ("in/other.toml", "[package]\n"),
        ("in/.git/config.toml", SCENARIO),
        ("out/secret.toml", SCENARIO),
    ] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, text).expect("written");
    }
    let files = AllowedFiles::from_roots(&[folder.path().join("in")]).expect("a folder");
    (folder, files)
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
    let mut names: Vec<String> =
        entries.map(|entry| name(entry).to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn nothing_is_written_outside_hidden_or_in_place_of_what_is_no_file() {
    let (folder, files) = places();
    let path = |name: &str| folder.path().join(name).display().to_string();
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        symlink(path("out"), path("in/link")).expect("linked");
        symlink(path("out/secret.toml"), path("in/s.toml")).expect("linked");
        symlink(path("out/gone.toml"), path("in/gone.toml")).expect("linked");
        drop(std::os::unix::net::UnixListener::bind(path("in/socket.toml")).expect("a socket"));
    }
    for name in [
        "out/secret.toml",
        "out/new.toml",
        "in/../out/secret.toml",
        "in/link/secret.toml",
        "in/link/new.toml",
        "in/s.toml",
        "in/gone.toml",
        "in/socket.toml",
        "in/no folder/new.toml",
        "in/.git/config.toml",
        "in/.hidden.toml",
        "in/deep",
        "in/..",
        "in",
    ] {
        assert!(files.write_target(&path(name)).is_err(), "{name}");
    }
    assert!(files.write_target("").is_err() && files.write_target("/etc/new.toml").is_err());
    for name in ["in/a.toml", "in/new.toml", "in/deep/../new.toml"] {
        assert!(files.write_target(&path(name)).is_ok(), "{name}");
    }
}

#[test]
fn a_file_is_replaced_whole_with_its_permissions_and_its_mark() {
    let (folder, files) = places();
    let path = folder.path().join("in/a.toml");
    fs::write(&path, format!("{BYTE_ORDER_MARK}{SCENARIO}")).expect("written");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(&path, Permissions::from_mode(0o640)).expect("set");
        std::os::unix::fs::symlink("a.toml", folder.path().join("in/link.toml")).expect("linked");
    }
    let named = if cfg!(unix) { "in/link.toml" } else { "in/a.toml" };
    let target =
        files.write_target(&folder.path().join(named).display().to_string()).expect("a file");
    let seen = Cell::new(false);
    let may = |found: Option<&str>| {
        seen.set(found == Some(SCENARIO));
        true
    };
    assert_eq!(replace_file(&target, "new", true, may), Ok(None));
    assert!(seen.get());
    assert_eq!(fs::read_to_string(&path).expect("read"), format!("{BYTE_ORDER_MARK}new"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = fs::metadata(&path).expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        assert!(folder.path().join("in/link.toml").is_symlink());
    }
}

#[test]
fn what_another_program_writes_meanwhile_is_not_lost() {
    let (folder, files) = places();
    let path = folder.path().join("in/a.toml");
    let target = files.write_target(&path.display().to_string()).expect("a file");
    let asked = Cell::new(0);
    let may = |found: Option<&str>| {
        asked.set(asked.get() + 1);
        fs::write(&path, "another").expect("written");
        found == Some(SCENARIO)
    };
    let before = names(&folder.path().join("in"));
    assert_eq!(replace_file(&target, "new", true, may), Ok(Some("another".into())));
    assert_eq!((asked.get(), fs::read_to_string(&path).expect("read")), (2, "another".into()));
    assert_eq!(names(&folder.path().join("in")), before, "nothing half-written stays");
}

#[test]
fn what_cannot_be_replaced_stays_as_it_is() {
    let (folder, files) = places();
    let inside = folder.path().join("in");
    let place = |name: &str| inside.join(name).display().to_string();
    fs::write(inside.join("packed.toml"), b"\x1f\x8b\x08").expect("written");
    fs::write(inside.join("bytes.toml"), b"\xff\xfe").expect("written");
    let mut permissions = fs::metadata(inside.join("a.toml")).expect("there").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(inside.join("a.toml"), permissions).expect("set");
    fs::create_dir(inside.join("run")).expect("made");
    fs::write(inside.join("run/run.json"), "{}").expect("written");
    fs::write(inside.join("run/scenario.toml"), SCENARIO).expect("written");
    for folder in ["run/inputs", "sweep/variants/0000"] {
        fs::create_dir_all(inside.join(folder)).expect("made");
        fs::write(inside.join(folder).join("scenario.toml"), SCENARIO).expect("written");
        let new = files.write_target(&place(&format!("{folder}/new.toml"))).expect("a place");
        assert!(replace_file(&new, "new", false, |_| true).is_ok() == folder.starts_with("sweep"));
    }
    fs::write(inside.join("sweep/sweep.json"), "{}").expect("written");
    for (name, is_own, cause) in [
        ("run/scenario.toml", true, "a recording"),
        ("run/inputs/scenario.toml", true, "a recording"),
        ("sweep/variants/0000/scenario.toml", true, "a recording"),
        ("packed.toml", true, "packed"),
        ("bytes.toml", true, "UTF-8"),
        ("a.toml", true, "only be read"),
        ("other.toml", false, "else than a scenario"),
    ] {
        let old = fs::read(inside.join(name)).expect("read");
        let target = files.write_target(&place(name)).expect("a file");
        let problem = replace_file(&target, "new", is_own, |_| true).expect_err(name);
        assert!(problem.cause.contains(cause), "{problem:?}");
        assert_eq!(fs::read(inside.join(name)).expect("read"), old);
    }
    let target = files.write_target(&place("new.toml")).expect("a file");
    assert_eq!(replace_file(&target, "new", false, |found| found.is_none()), Ok(None));
    assert_eq!(
        replace_file(&target, "newer", true, |_| true),
        Ok(None),
        "its own need be no scenario"
    );
    // The folder is gone.
    let target = files.write_target(&place("deep/new.toml")).expect("a file");
    fs::remove_dir_all(inside.join("deep")).expect("removed");
    let problem = replace_file(&target, "new", false, |_| true).expect_err("no folder");
    assert!(problem.cause.contains("cannot be written"), "{problem:?}");
}
