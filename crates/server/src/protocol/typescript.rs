//! The types of the page, which are those of the server.
//!
//! `SIDESTEP_WRITE=protocol cargo test --release -p sidestep-server protocol` writes them.

use super::*;
use serde_json::json;
use std::path::Path;
use ts_rs::{Config, TS};

/// The file that the page imports.
const TYPES_PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../studio/src/protocol/types.ts");

const HEADER: &str = "\
// Written from crates/server/src/protocol by
// `SIDESTEP_WRITE=protocol cargo test --release -p sidestep-server protocol`. Do not edit.
";

/// The file with the editing of the worlds, for tests of the page.
const EDITING_PATH: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../studio/tests/fake/editing.json");

/// Returns the declaration of a type, with its documentation.
fn typescript_declaration<T: TS>(config: &Config) -> String {
    let docs = T::docs().map(|docs| docs.trim_end().to_string() + "\n").unwrap_or_default();
    format!("{docs}export {}\n", T::decl(config))
}

fn types() -> String {
    let config = Config::new().with_large_int("number");
    macro_rules! all {
        ($($name:ty),+ $(,)?) => { [$(typescript_declaration::<$name>(&config)),+] };
    }
    let types = all![
        ClientRequest,
        ServerMethod,
        SessionMethod,
        RunMethod,
        Edit,
        OpenTarget,
        Speed,
        BodyId,
        Reply,
        ReplyResult,
        ReplyBody,
        Problem,
        FileEntry,
        FileKind,
        GalleryEntry,
        ServerUsage,
        StoreUsage,
        MetricName,
        MetricRow,
        ServerNotification,
        TargetRef,
        SessionStatus,
        SessionState,
        Fleet,
        FleetNode,
        Scene,
        BodyName,
        SceneGroup,
        OccupancyGrid,
        StaticBody,
        Shape,
        Appearance,
        BodyTable,
        Traffic,
        EarthChart,
        TrafficArea,
        TrafficRoute,
        BodyTrail,
        SweepOutlier,
        SweepRun,
        SweepColumn,
        FrameText,
        Scan,
        RunEvent,
        ReplayFile,
        ReplayRun,
        ReplayAgentMetrics,
        ReplayTables,
        ReplayTablesPart,
        ReplayChunk,
        ReplaySpan,
        ReplayEvents,
        ReplayInspection,
    ];
    let version = format!(
        "/** Version of requests, replies, notifications and frames together. */\nexport const VERSION = {VERSION};\n"
    );
    let lines = format!("{HEADER}\n{version}\n{}\n{}", types.join("\n"), inspection::TYPES);
    lines.lines().map(|line| line.trim_end().to_string() + "\n").collect()
}

/// Checks that a file has this text, and writes it where that is asked for.
fn check_written(path: &Path, expected: &str) {
    if std::env::var("SIDESTEP_WRITE").is_ok_and(|what| what == "protocol") {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, expected).expect("written");
    }
    let found = std::fs::read_to_string(path).unwrap_or_default();
    assert!(found == expected, "to write {}: see the head of {}", path.display(), file!());
}

#[test]
fn the_page_has_the_types_of_the_protocol() {
    check_written(Path::new(TYPES_PATH), &types());
}

#[test]
fn tests_of_the_page_have_the_editing_of_the_worlds() {
    let worlds = sidestep::worlds::WORLDS.iter();
    let editing = worlds.map(|world| (world.name().to_string(), json!(world.editing()))).collect();
    let text = serde_json::to_string_pretty(&serde_json::Value::Object(editing)).expect("JSON");
    check_written(Path::new(EDITING_PATH), &(text + "\n"));
}

#[test]
fn every_type_that_is_named_is_declared() {
    let all = types();
    let is_doc =
        |line: &&str| ["*", "/**", "//"].iter().any(|begin| line.trim().starts_with(begin));
    let code: Vec<&str> = all.lines().filter(|line| !is_doc(line)).collect();
    let words = code.iter().flat_map(|line| line.split(|c: char| !c.is_ascii_alphanumeric()));
    for name in words.filter(|word| word.starts_with(|c: char| c.is_ascii_uppercase())) {
        let declared = [format!("export type {name} "), format!("export const {name} ")];
        let is_declared = code.iter().any(|line| declared.iter().any(|d| line.starts_with(d)));
        assert!(is_declared || name == "Array", "{name}");
    }
}
