//! The list of all targets, and those that read files and texts.

use crate::files::{beside_an_image, file, folder, mrclam_folder, navdata_folder, run_folder};
use crate::packets;
use sidestep::experiment::sweep::Sweep;
use sidestep::import::table::CsvTable;
use sidestep::import::urdf::{Model, srdf::Semantics};
use sidestep::import::{
    ForeignFormat, ascii, bag, bluesky, carmen, geojson, image::Bitmap, lorr, mesh, movingai,
    mrclam, openap, rosmap, stage, traffic,
};
use sidestep::kernel::checkpoint;
use sidestep::learn::{effector, sensor};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_record::sweep::{SweepIdentity, read_journal};
use sidestep_record::{McapRunInfo, RunReader, read_table};
use sidestep_server::protocol::Edit;
use std::sync::LazyLock;

/// A reader of text or bytes, by its name. A folder of the same name in `seeds` has inputs to start from.
pub(crate) type Target = (&'static str, fn(&[u8]));

pub(crate) const TARGETS: &[Target] = &[
    ("scenario", |data| text(data, scenario)),
    ("override", |data| text(data, overridden)),
    ("edit", |data| text(data, edited)),
    ("script", |data| text(data, script)),
    ("chain_packets", packets::to_a_connector),
    ("sweep", |data| text(data, |t| drop(Sweep::parse(&Source::new("f", t, ""))))),
    ("ascii_map", |data| text(data, |t| drop(ascii::parse("f", t, 0.25)))),
    ("movingai_map", |data| text(data, |t| drop(movingai::parse_map("f", t, 0.25)))),
    ("movingai_scen", |data| text(data, |t| drop(movingai::parse_scen("f", t)))),
    ("lorr_problem", |data| text(data, |t| drop(lorr::parse_settings("f", t)))),
    ("lorr_lists", |data| text(data, robot_runners_lists)),
    ("ros_map", |data| drop(rosmap::load(&beside_an_image(data)))),
    ("image", |data| drop(Bitmap::decode("f", data.to_vec()))),
    ("stage", |data| drop(stage::load(&file("f.world", data)))),
    ("urdf", |data| text(data, |t| drop(Model::parse("f", t)))),
    ("srdf", |data| text(data, srdf)),
    ("stl", |data| drop(mesh::stl::parse("f", data))),
    ("obj", |data| drop(mesh::obj::parse("f", data))),
    ("dae", |data| drop(mesh::dae::parse("f", data))),
    ("bluesky", |data| text(data, |t| drop(bluesky::parse(&"f", t)))),
    ("geojson", |data| text(data, |t| drop(geojson::parse("f", t)))),
    ("traffic", |data| text(data, recorded)),
    ("traffic_parquet", |data| {
        drop(traffic::from_bytes(&"f", data.to_vec(), &Default::default()));
    }),
    ("translate", |data| drop(WORLDS.import_scenario(&file("f.scn", data), &Default::default()))),
    ("bluesky_call", |data| drop(bluesky::read(&file("f.scn", data)))),
    ("openap", |data| text(data, openap_type)),
    ("navdata", |data| drop(bluesky::NavigationData::read(navdata_folder(data)))),
    ("carmen", |data| text(data, |t| drop(carmen::parse("f", t, None)))),
    ("learn_carmen", |data| {
        drop(effector::from_carmen(&file("f.log", data), None, &Default::default()));
    }),
    ("bag", |data| drop(bag::read(&file("f.mcap", data), &all_of_a_bag()))),
    ("bag_sqlite", |data| drop(bag::read(&file("f.db3", data), &all_of_a_bag()))),
    ("bag_ros1", |data| drop(bag::read(&file("f.bag", data), &all_of_a_bag()))),
    ("bag_metadata", |data| {
        file("f.mcap", b"");
        drop(bag::inspect(&file("metadata.yaml", data)));
    }),
    ("bag_clean", |data| {
        drop(bag::write_clean(&file("f.mcap", data), &folder().join("clean.mcap")));
    }),
    ("inspect", inspected),
    ("cdr", messages),
    ("mrclam", |data| drop(mrclam::read(mrclam_folder(data), None))),
    ("learn_csv", |data| text(data, learned)),
    ("checkpoint", |data| drop(checkpoint::decode_header(data))),
    ("journal", |data| {
        let of = SweepIdentity { program_version: "0", fingerprint: "" };
        drop(read_journal(&file("f.jsonl", data), of, |_: serde_json::Value| {}));
    }),
    ("manifest", |data| drop(RunReader::open(run_folder(data)))),
    ("mcap", |data| drop(McapRunInfo::open(&file("f.mcap", data)))),
    ("request", |data| text(data, |t| drop(sidestep_server::decode(t)))),
    ("packets", packets::among_pilots),
    ("parquet", tabled),
];

/// Names of files whose ends tell what they are, or tell nothing.
const NAMES: [&str; 16] = [
    "f.txt", "f.csv", "f.tsv", "f.dat", "f.data", "f.json", "f.so6", "f.daa", "f.scn", "f.scen",
    "f.map", "f.xml", "f.srdf", "f.world", "f.jpg", "f.log",
];

/// Inspects a file whose first byte chooses its name.
fn inspected(data: &[u8]) {
    let Some((first, content)) = data.split_first() else { return };
    let path = file(NAMES[usize::from(*first) % NAMES.len()], content);
    match ForeignFormat::recognize(&path) {
        Ok(Some(format)) => drop(format.inspect(&path)),
        _ => drop(WORLDS.import_scenario(&path, &Default::default())),
    }
}

fn text(data: &[u8], read: impl Fn(&str)) {
    if let Ok(text) = std::str::from_utf8(data) {
        read(text);
    }
}

fn scenario(text: &str) {
    drop(WORLDS.compile(&Source::new("f", text, folder())));
}

/// Compiles the default scenario of each world with one setting.
fn overridden(setting: &str) {
    for kind in WORLDS.iter() {
        let source = Source::new("f", kind.default_scenario(), folder());
        drop(
            source
                .with_overrides(&[setting.to_string()])
                .and_then(|source| kind.compile(&source).map(drop)),
        );
    }
}

/// Edits a text: the JSON of the edits is the first line, the text the rest. TOML stays TOML.
fn edited(input: &str) {
    let Some((edits, text)) = input.split_once('\n') else { return };
    let Ok(edits) = serde_json::from_str::<Vec<Edit>>(edits) else { return };
    let edits: Vec<_> = edits.into_iter().map(Into::into).collect();
    if let Ok(edited) = Source::new("f", text, "").edited(&edits) {
        assert!(edits.is_empty() || edited.parse::<serde_json::Value>().is_ok(), "{}", edited.text);
    }
}

/// Compiles a scenario of a chain that follows a motion script.
fn script(script: &str) {
    let chain = "format = 1\nworld = \"chain\"\ncycles = 10\n[[chains]]\nconnectors = 4\n\
                 [[chains.tasks]]\nkind = \"script\"\n";
    let script = serde_json::Value::from(script).to_string();
    // JSON and TOML write strings alike, but for the escape of a slash and of characters above 16 bits.
    scenario(&format!("{chain}script = {script}\n"));
}

fn srdf(text: &str) {
    static ARM: LazyLock<Model> = LazyLock::new(|| {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/chain/arm.urdf");
        let urdf = std::fs::read_to_string(path).expect("our own arm");
        Model::parse("arm.urdf", &urdf).expect("our own arm")
    });
    drop(Semantics::parse("f", text, &ARM));
}

/// The topics of the seeds.
fn all_of_a_bag() -> bag::TopicSelection {
    let source = |topic: &str| bag::PoseTopic { topic: topic.into(), frames: None };
    bag::TopicSelection {
        odometry: Some(source("/robot_0/odom")),
        truth: source("/robot_0/ground_truth"),
        scans: Some("/robot_0/sonar_ring".into()),
        ..Default::default()
    }
}

fn messages(data: &[u8]) {
    drop(bag::cdr::decode::<bag::messages::Odometry>(data));
    drop(bag::cdr::decode::<bag::messages::LaserScan>(data));
    drop(bag::cdr::decode::<bag::messages::TfMessage>(data));
    drop(bag::cdr::decode_as::<bag::messages::Odometry>(bag::cdr::Encoding::Ros1, data));
    drop(bag::cdr::decode_as::<bag::messages::LaserScan>(bag::cdr::Encoding::Ros1, data));
}

/// Reads a recording of any source; what is written of it is read again.
fn recorded(text: &str) {
    if let Ok(recorded) = traffic::parse(&"f", text) {
        let again = traffic::parse(&"f", &traffic::to_csv(&recorded));
        assert_eq!(again.map(|again| again.tracks.len()), Ok(recorded.tracks.len()));
    }
}

fn learned(text: &str) {
    if let Ok(table) = CsvTable::parse(&"f", text) {
        drop(sensor::learn_csv(&table, &Default::default()));
        drop(effector::learn_csv(&table, &Default::default()));
    }
}

fn tabled(data: &[u8]) {
    file("f.parquet", data);
    drop(read_table(folder(), "f", ..));
}

/// Reads a text as both files of a type.
fn openap_type(text: &str) {
    drop(openap::parse("f", text, text));
}

/// Reads a text as a list of starts and as one of tasks.
fn robot_runners_lists(text: &str) {
    let map = "type octile\nheight 2\nwidth 3\nmap\n...\n@@.\n";
    let map = movingai::parse_map("f", map, 1.0).expect("a map").map;
    drop(lorr::parse_starts("f", text, &map));
    drop(lorr::parse_tasks("f", text, &map, &[(0, 1)]));
}
