//! Saves of a page: they read nothing elsewhere, make only scenarios, and never lose the changes of others.

use super::*;
use std::fs;
use std::path::{Path, PathBuf};

const MAP: &str = "type octile\nheight 4\nwidth 8\nmap\n........\n........\n........\n........\n";

/// A folder `in` with a scenario, and a map beside it that may not be read.
fn places() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("in/s.toml", ROBOTS), ("out/secret.map", MAP)] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, text).expect("written");
    }
    folder
}

fn naming(map: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\ncycles = 10\n[map]\nfile = \"{map}\"\nbox_size_m = 0.25\n\
         [[robots]]\ncount = 1\n"
    )
}

fn scenario(path: &Path) -> OpenTarget {
    OpenTarget::Scenario { path: path.display().to_string() }
}

/// A page that has opened the scenario, and the folder that may be read.
fn page() -> (Page, PathBuf) {
    let folder = places();
    let inside = folder.path().join("in");
    let (page, opened) =
        Page::open_target(deps(&inside, 1), scenario(&inside.join("s.toml")), folder);
    assert!(opened.get("problem").is_none(), "{opened}");
    (page, inside)
}

impl Page {
    fn save(&mut self, text: &str, to: Option<&Path>, base: Option<&str>, over: bool) -> Value {
        let to = to.map(|path| path.display().to_string());
        let call = json!({
            "do": "save", "text": text, "to": to, "base": base, "overwrite": over
        });
        let id = self.send(call);
        self.wait(id)
    }
}

#[test]
fn nothing_elsewhere_is_read_by_a_text_that_is_saved_and_opened() {
    let (mut page, inside) = page();
    let stolen = inside.join("stolen.toml");
    let reply = page.save(&naming("../out/secret.map"), Some(&stolen), None, false);
    assert_eq!(reply["problem"]["place"], "../out/secret.map", "{reply}");
    assert!(!stolen.exists());
    // From a folder below, the same name leads elsewhere.
    let deep = inside.join("deep/x.toml");
    fs::create_dir(inside.join("deep")).expect("made");
    let reply = page.save(&naming("../../out/secret.map"), Some(&deep), None, false);
    assert_eq!(reply["problem"]["place"], "../../out/secret.map", "{reply}");
    fs::write(&stolen, naming("../out/secret.map")).expect("written");
    let open = |deps: SessionDeps| {
        Page::open_target(deps, scenario(&stolen), tempfile::tempdir().expect("a folder")).1
    };
    let reply = open(deps(&inside, 1));
    assert_eq!(reply["problem"]["place"], "../out/secret.map", "{reply}");
    let reads = SessionDeps { read_only: true, ..deps(&inside, 1) };
    assert_eq!(open(reads)["answer"]["is"], "opened", "no page can have written it");
    let own = deps(&inside, 1);
    let named =
        SessionDeps { files: own.files.with_files_referenced_by([&*stolen].into_iter()), ..own };
    assert_eq!(open(named)["answer"]["is"], "opened", "it was named at start");
}

#[test]
fn what_is_read_stays_inside_where_a_session_goes_on_in_another_folder() {
    let folder = places();
    let inside = folder.path().join("in");
    fs::create_dir(inside.join("deep")).expect("made");
    for map in ["in/m.map", "m.map"] {
        fs::write(folder.path().join(map), MAP).expect("written");
    }
    let deep = inside.join("deep/x.toml");
    fs::write(&deep, naming("../m.map")).expect("written");
    let (mut page, opened) = Page::open_target(deps(&inside, 1), scenario(&deep), folder);
    assert_eq!(opened["answer"]["is"], "opened");
    let saved = page.save(ROBOTS, Some(&inside.join("y.toml")), None, false);
    assert_eq!(saved["answer"]["is"], "saved");
    let id = page.send(json!({ "do": "restart", "seed": null, "text": null }));
    assert_eq!(page.wait(id)["problem"]["place"], "../m.map");
}

#[test]
fn what_is_saved_is_a_scenario_or_a_text_that_cannot_be_read_yet() {
    let (mut page, inside) = page();
    let other = inside.join("Cargo.toml");
    let refuse = |page: &mut Page| {
        let reply = page.save("hello = 1\n", Some(&other), None, true);
        assert!(reply["problem"]["cause"].as_str().is_some_and(|c| c.contains("world")), "{reply}");
    };
    refuse(&mut page);
    assert!(!other.exists());
    // Nor in two saves, over a text that may be saved.
    for first in ["world = = 1", ROBOTS] {
        assert_eq!(page.save(first, Some(&other), None, true)["answer"]["is"], "saved");
        refuse(&mut page);
        assert_eq!(fs::read_to_string(&other).expect("read"), first);
    }
}

#[test]
fn no_text_that_is_saved_is_read_as_a_map_or_a_floor_that_names_files_elsewhere() {
    let (mut page, inside) = page();
    fs::write(inside.join("../out/secret.pgm"), "P2 2 2 255 0 255 255 205").expect("written");
    fs::write(inside.join("../out/secret.inc"), "speedup 3").expect("written");
    let map = "image: ../out/secret.pgm\nresolution: 0.05\norigin: [9, 9, 0]\nnegate: 0\n\
               occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    // A text that is a scenario, by its `world`, and a map as well.
    let both = format!("name = \"\"\": 1\n{map}last: |\n  \"\"\"\n  world = \"chain\"\n");
    let floor = "model ( bitmap \"../out/secret.pgm\" size [1 1 1] pose [9 9 0 0] )\n";
    let part = "include \"../out/secret.inc\"\n";
    for (key, text) in [("map", map), ("map", &both), ("stage", floor), ("stage", part)] {
        let saved = page.save(text, Some(&inside.join("m.toml")), None, true);
        assert_eq!(saved["answer"]["is"], "saved", "{saved}");
        let text = format!("{CHAINS}[ground]\n{key} = \"m.toml\"\n");
        let id = page.send(json!({ "do": "restart", "seed": null, "text": text }));
        let reply = page.wait(id);
        let cause = reply["problem"]["cause"].as_str().unwrap_or_default();
        assert!(cause.contains("the file name is not that of"), "{text}: {reply}");
    }
}

#[test]
fn a_file_that_changed_while_its_page_was_cut_off_is_not_replaced_unasked() {
    let (mut page, inside) = page();
    let path = inside.join("s.toml");
    // The session has read the text that another program has written since the page read the file.
    let before = ROBOTS.replace("seed = 5", "seed = 4");
    let mine = ROBOTS.replace("seed = 5", "seed = 6");
    let reply = page.save(&mine, None, Some(&before), false);
    assert_eq!(reply["answer"], json!({ "is": "differs", "text": ROBOTS }));
    assert_eq!(fs::read_to_string(&path).expect("read"), ROBOTS);
    assert_eq!(page.save(&mine, None, Some(ROBOTS), false)["answer"]["is"], "saved");
    assert_eq!(page.save(ROBOTS, None, Some(&before), true)["answer"]["is"], "saved");
    assert_eq!(fs::read_to_string(&path).expect("read"), ROBOTS);
}
