//! One fuzzer for every parser and decoder: `SIDESTEP_FUZZ=NAME`, with a name of [`TARGETS`].
//!
//! An input may be refused, but it may not panic, overflow, hang or take all memory (promise E1).

#![no_main]

use libfuzzer_sys::fuzz_target;
use sidestep::experiment::sweep::Sweep;
use sidestep::import::table::CsvTable;
use sidestep::import::urdf::{Model, srdf::Semantics};
use sidestep::import::{
    ascii, bag, bluesky, carmen, image::Bitmap, movingai, mrclam, rosmap, stage, stl, traffic,
};
use sidestep::kernel::checkpoint;
use sidestep::learn::{effector, sensor};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep::kernel::network::{Draft, Seal, TalkId, open};
use sidestep::worlds::airspace::agents::contact::Contacts;
use sidestep::worlds::airspace::pilot::{Fleet, Packet, Pilot, Sight, Topic};
use sidestep::worlds::airspace::{AirspaceWorld, airspace_run};
use sidestep::worlds::chain::ChainState;
use sidestep::worlds::chain::agents::{ConnectorAgent, Motion};
use sidestep::worlds::chain::scenario::Compiled;
use sidestep_record::sweep::read_journal;
use sidestep_record::{McapRun, RunView, read_table};
use sidestep_server::protocol::Edit;
use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

/// A reader of text or bytes, by its name. A folder of the same name in `seeds` has inputs to begin with.
type Target = (&'static str, fn(&[u8]));

const TARGETS: &[Target] = &[
    ("scenario", |data| text(data, scenario)),
    ("override", |data| text(data, overridden)),
    ("edit", |data| text(data, edited)),
    ("script", |data| text(data, script)),
    ("chain_packets", chain_packets),
    ("sweep", |data| text(data, |t| drop(Sweep::parse(&Source::new("f", t, ""))))),
    ("ascii_map", |data| text(data, |t| drop(ascii::parse("f", t, 0.25)))),
    ("movingai_map", |data| text(data, |t| drop(movingai::parse_map("f", t, 0.25)))),
    ("movingai_scen", |data| text(data, |t| drop(movingai::parse_scen("f", t)))),
    ("ros_map", |data| drop(rosmap::load(&beside_an_image(data)))),
    ("image", |data| drop(Bitmap::decode("f", data.to_vec()))),
    ("stage", |data| drop(stage::load(&file("f.world", data)))),
    ("urdf", |data| text(data, |t| drop(Model::parse("f", t)))),
    ("srdf", |data| text(data, srdf)),
    ("stl", |data| drop(stl::parse("f", data))),
    ("bluesky", |data| text(data, |t| drop(bluesky::parse(&"f", t)))),
    ("traffic", |data| text(data, |t| drop(traffic::parse(&"f", t)))),
    ("translate", |data| drop(WORLDS.translate(&file("f.scn", data)))),
    ("carmen", |data| text(data, |t| drop(carmen::parse("f", t)))),
    ("learn_carmen", |data| drop(effector::from_carmen(&file("f.log", data), &Default::default()))),
    ("bag", |data| drop(bag::read(&file("f.mcap", data), &all_of_a_bag()))),
    ("cdr", messages),
    ("mrclam", |data| drop(mrclam::read(&mrclam_folder(data)))),
    ("learn_csv", |data| text(data, learned)),
    ("checkpoint", |data| drop(checkpoint::decode_header(data))),
    ("journal", |data| drop(read_journal(&file("f.jsonl", data), "0", |_: serde_json::Value| {}))),
    ("manifest", |data| drop(RunView::open(&run_folder(data)))),
    ("mcap", |data| drop(McapRun::open(&file("f.mcap", data)))),
    ("request", |data| text(data, |t| drop(sidestep_server::decode(t)))),
    ("packets", packets),
    ("parquet", |data| drop(read_table(&folder_of(&file("f.parquet", data)), "f", ..))),
];

fuzz_target!(|data: &[u8]| (CHOSEN.1)(data));

static CHOSEN: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("SIDESTEP_FUZZ").unwrap_or_default();
    let names = TARGETS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let chosen = TARGETS.iter().copied().find(|(own, _)| *own == name);
    chosen.unwrap_or_else(|| panic!("SIDESTEP_FUZZ is one of {names}"))
});

/// The folder for files of this process, which whoever starts it makes and takes away.
static SCRATCH: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder =
        std::env::var_os("SIDESTEP_FUZZ_FILES").map_or_else(std::env::temp_dir, PathBuf::from);
    fs::create_dir_all(&folder).expect("a folder for files");
    folder
});

fn text(data: &[u8], read: impl Fn(&str)) {
    if let Ok(text) = std::str::from_utf8(data) {
        read(text);
    }
}

fn file(name: &str, data: &[u8]) -> PathBuf {
    let path = SCRATCH.join(name);
    fs::write(&path, data).expect("a file");
    path
}

fn folder_of(file: &Path) -> PathBuf {
    file.parent().expect("a folder").to_path_buf()
}

fn scenario(text: &str) {
    drop(WORLDS.compile(&Source::new("f", text, SCRATCH.as_path())));
}

/// Compiles the default scenario of each world with one setting.
fn overridden(setting: &str) {
    for kind in WORLDS.0 {
        let source = Source::new("f", kind.default_scenario(), SCRATCH.as_path());
        drop(
            source.with(&[setting.to_string()]).and_then(|source| kind.compile(&source).map(drop)),
        );
    }
}

/// Edits a text: the JSON of the edits is the first line, the text the rest. What was TOML stays TOML.
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
    // JSON and TOML write strings alike, but for the escape of a slash and of what is above 16 bits.
    scenario(&format!("{chain}script = {script}\n"));
}

/// Hands packets to the agent of a connector in the middle of a chain: each begins with its sender and its
/// length. Whatever they are, the agent comes to a decision once time is up.
fn chain_packets(mut data: &[u8]) {
    static TEAM: LazyLock<Compiled<2>> = LazyLock::new(|| {
        let text = "format = 1\nworld = \"chain\"\n[chain]\nself_collision = false\nbacktracks = 0\n\
                    deployment = \"team\"\nnetwork = { loss = 0.1 }\n[[obstacles]]\nat_m = [0.5, 0.3]\n\
                    radius_m = 0.2\n[[chains]]\nconnectors = 5\nrod_m = [0.4, 0.5]\n[[chains.tasks]]\n\
                    kind = \"wander\"\nconnector = 2\n";
        Compiled::new(&Source::new("f", text, "")).expect("our own team")
    });
    let world = &*TEAM.world;
    let state = ChainState::new(world).expect("a team at its start");
    let (chain, mut sights) = world.sights_at(&state, 0).remove(0);
    let ids: Vec<u32> = (0..sights.len() as u32).collect();
    let talk = TalkId::new(0, Motion, &ids);
    let mut agent = ConnectorAgent::new(world, chain, 2);
    agent.begin(sights.remove(2), 0).expect("a sight");
    let mut tick = 0;
    while let Some((&[from, length], rest)) = data.split_first_chunk() {
        let (packet, rest) = rest.split_at(rest.len().min(usize::from(length)));
        tick += 1;
        let sender = u32::from(from & 0x7F);
        // Few bytes bear a right checksum: half of them are given one.
        if from & 0x80 > 0 {
            agent.on_packet(sender, packet, tick);
        } else {
            let seal = Seal { fingerprint: world.fingerprint, talk, sender, sequence: 0 };
            agent.on_packet(sender, &Draft::of_bytes(packet).sealed(&seal), tick);
        }
        agent.on_timer(tick);
        agent.take_packets();
        data = rest;
    }
    agent.on_timer(u64::MAX);
    assert!(agent.control().is_some(), "time is up");
}

fn srdf(text: &str) {
    static ARM: LazyLock<Model> = LazyLock::new(|| {
        let urdf = include_str!("../../scenarios/chain/arm.urdf");
        Model::parse("arm.urdf", urdf).expect("our own arm")
    });
    drop(Semantics::parse("f", text, &ARM));
}

/// The topics of the seeds.
fn all_of_a_bag() -> bag::Wanted {
    let source = |topic: &str| bag::Source { topic: topic.into(), frames: None };
    bag::Wanted {
        odometry: Some(source("/robot_0/odom")),
        truth: source("/robot_0/ground_truth"),
        scans: Some("/robot_0/sonar_ring".into()),
    }
}

fn messages(data: &[u8]) {
    drop(bag::cdr::decode::<bag::messages::Odometry>(data));
    drop(bag::cdr::decode::<bag::messages::LaserScan>(data));
    drop(bag::cdr::decode::<bag::messages::TfMessage>(data));
}

fn learned(text: &str) {
    if let Ok(table) = CsvTable::parse(&"f", text) {
        drop(sensor::learn_csv(&table, &Default::default()));
        drop(effector::learn_csv(&table, &Default::default()));
    }
}

/// The YAML file of a map whose image is there.
fn beside_an_image(data: &[u8]) -> PathBuf {
    file("image.pgm", b"P2\n3 2\n255\n0 128 255\n255 205 0\n");
    file("f.yaml", data)
}

/// A folder of logs: its files in one input, each after a line `% NAME`.
fn mrclam_folder(data: &[u8]) -> PathBuf {
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
    SCRATCH.clone()
}

/// Settings of airplanes that talk, with every kind of message.
const TALKS: [&str; 7] = [
    "deployment = \"team\"",
    "deployment = \"compact-team\"",
    "deployment = \"team\"\npreset = \"paper\"",
    "deployment = \"compact-team\"\npreset = \"paper\"",
    "deployment = \"pim\"",
    "deployment = \"team\"\nmethod = \"mvp\"",
    "deployment = \"hierarchical-pim\"\npreset = \"paper\"\nnetwork = { loss = 0.1 }",
];

/// Lets three pilots talk, on a network that does what the data says: the first byte chooses the settings, and then
/// each four bytes are a step: a packet arrives as it is, or changed with a right checksum, or damaged, or time passes.
fn packets(data: &[u8]) {
    static FLEETS: LazyLock<Vec<(Arc<AirspaceWorld>, Vec<Sight>)>> = LazyLock::new(|| {
        let fleet = |talk: &&str| {
            let text = format!(
                "format = 1\nworld = \"airspace\"\n[airspace]\n{talk}\nmax_rounds = 3\n\
                 [airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 2600.0\n"
            );
            let run = airspace_run(&Source::new("f", text, ""), 1).expect("our own scenario");
            (run.world().clone(), run.sights())
        };
        TALKS.iter().map(fleet).collect()
    });
    let Some((&which, steps)) = data.split_first() else { return };
    let (world, sights) = &FLEETS[usize::from(which) % FLEETS.len()];
    let mut pilots: Vec<Pilot> =
        (0..3).map(|id| Pilot::new(world.clone(), id, Contacts::new())).collect();
    let (mut due, mut tick) = (VecDeque::new(), 0);
    for (pilot, sight) in pilots.iter_mut().zip(sights) {
        pilot.begin(sight.clone(), tick);
    }
    for step in steps.as_chunks::<4>().0 {
        for pilot in &mut pilots {
            for Packet { to, payload, .. } in pilot.take_packets() {
                let others = (0..3).filter(|&id| id != pilot.id() && to.is_none_or(|to| to == id));
                due.extend(others.map(|other| (pilot.id(), other, payload.clone())));
            }
        }
        tick += 1;
        arrive(world, &mut pilots, &mut due, tick, *step);
    }
}

/// Carries out a step of the network.
fn arrive(
    world: &AirspaceWorld,
    pilots: &mut [Pilot],
    due: &mut VecDeque<(u32, u32, Vec<u8>)>,
    tick: u64,
    [kind, place, high, change]: [u8; 4],
) {
    if kind % 4 == 3 {
        let next = pilots.iter().filter_map(Pilot::next_timer).min().unwrap_or(tick);
        return pilots.iter_mut().for_each(|pilot| pilot.on_timer(next.max(tick)));
    }
    let Some((from, to, payload)) = due.pop_front() else { return };
    let at = usize::from(place) | usize::from(high) << 8;
    let mut bytes = payload.clone();
    match (kind % 4, open::<Topic>(&payload, world.fingerprint)) {
        (1, Ok((seal, message))) => {
            let mut message = message.to_vec();
            let at = at % message.len().max(1);
            match message.get_mut(at) {
                Some(byte) if change > 0 => *byte ^= change,
                _ => message.truncate(at),
            }
            bytes = Draft::of_bytes(&message).sealed(&seal);
        }
        (2, _) => {
            let at = at % bytes.len();
            bytes[at] ^= change;
        }
        _ => {}
    }
    pilots[to as usize].on_packet(from, &bytes, tick);
    if kind & 4 > 0 {
        // It is told the real thing, too, or again.
        pilots[to as usize].on_packet(from, &payload, tick);
    }
}

fn run_folder(data: &[u8]) -> PathBuf {
    file("scenario.toml", b"format = 1\n");
    folder_of(&file("run.json", data))
}
