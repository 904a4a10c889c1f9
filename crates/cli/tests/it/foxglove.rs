//! Foxglove and Lichtblick as viewers: they get the contents of a recording live, and no result depends on them.

use crate::studio::Studio;
use crate::support::{TestFolder, signal};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::net::{TcpListener, TcpStream};
use std::process::Child;
use std::time::Duration;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A port that was free a moment ago.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("bound").port()
}

/// A viewer that speaks the protocol.
struct Viewer {
    socket: WebSocket<TcpStream>,
    info: Value,
    /// Names of schemas by topic, and numbers of channels.
    channels: BTreeMap<String, (String, u64)>,
    /// Messages that came before the one that was waited for: topics and states come in any order.
    kept: Vec<Vec<u8>>,
}

/// A state of the run: 0 it goes on, 1 it stands still, 3 it is over.
#[derive(Debug, PartialEq)]
struct State {
    status: u8,
    time_ns: u64,
    speed: f32,
    did_seek: bool,
}

impl Viewer {
    /// Connects once the server is there.
    fn connect(port: u16) -> Self {
        let mut tried = (0..2000).filter_map(|_| {
            let stream = TcpStream::connect(("127.0.0.1", port)).ok();
            if stream.is_none() {
                std::thread::sleep(Duration::from_millis(5));
            }
            stream
        });
        let stream = tried.next().expect("a server");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time");
        let mut request = format!("ws://127.0.0.1:{port}").into_client_request().expect("valid");
        let protocol = "foxglove.sdk.v1";
        request.headers_mut().insert("sec-websocket-protocol", protocol.parse().expect("valid"));
        let (socket, response) = tungstenite::client(request, stream).expect("a handshake");
        assert_eq!(response.headers()["sec-websocket-protocol"], protocol);
        let (channels, kept) = (BTreeMap::new(), Vec::new());
        let mut viewer = Self { socket, info: Value::Null, channels, kept };
        while viewer.channels.is_empty() {
            // The time may come before the channels: it is binary, and nobody has asked for anything yet.
            if let Message::Text(text) = viewer.read() {
                viewer.note(serde_json::from_str(&text).expect("JSON"));
            }
        }
        viewer
    }

    fn note(&mut self, told: Value) {
        match told["op"].as_str() {
            Some("serverInfo") => self.info = told,
            Some("advertise") => {
                for channel in told["channels"].as_array().expect("channels") {
                    let word = |key: &str| channel[key].as_str().expect(key).to_string();
                    let id = channel["id"].as_u64().expect("a number");
                    self.channels.insert(word("topic"), (word("schemaName"), id));
                }
            }
            _ => {}
        }
    }

    fn read(&mut self) -> Message {
        self.socket.read().expect("a message")
    }

    /// Subscribes to all topics, each by the number of its channel.
    fn subscribe(&mut self) {
        let all = self.channels.values().map(|(_, id)| json!({ "id": id, "channelId": id }));
        let request = json!({ "op": "subscribe", "subscriptions": all.collect::<Vec<_>>() });
        self.socket.send(Message::text(request.to_string())).expect("sent");
    }

    /// Waits for the next message in which `take` finds something, and keeps those before it.
    fn wait<T>(&mut self, take: impl Fn(&[u8]) -> Option<T>) -> T {
        let found = self.kept.iter().enumerate().find_map(|(k, bytes)| Some((k, take(bytes)?)));
        if let Some((k, found)) = found {
            self.kept.remove(k);
            return found;
        }
        loop {
            let Message::Binary(bytes) = self.read() else { continue };
            match take(&bytes) {
                Some(found) => return found,
                None => self.kept.push(bytes.to_vec()),
            }
        }
    }

    /// Waits for the next message of a topic; returns its time and its length.
    fn message(&mut self, topic: &str) -> (u64, usize) {
        let wanted = self.channels[topic].1;
        self.wait(|bytes| {
            let number = |from: usize| {
                u64::from_le_bytes(bytes[from..from + 8].try_into().expect("eight bytes"))
            };
            let is_it = bytes[0] == 1 && number(1) & 0xffff_ffff == wanted;
            is_it.then(|| (number(5), bytes.len() - 13))
        })
    }

    /// Waits for a state that fits.
    fn state(&mut self, fits: impl Fn(&State) -> bool) -> State {
        self.wait(|bytes| {
            let state = |_| State {
                status: bytes[1],
                time_ns: u64::from_le_bytes(bytes[2..10].try_into().expect("eight bytes")),
                speed: f32::from_le_bytes(bytes[10..14].try_into().expect("four bytes")),
                did_seek: bytes[14] == 1,
            };
            (bytes[0] == 5).then_some(()).map(state).filter(&fits)
        })
    }

    fn steer(&mut self, play: bool, speed: f32, seek_ns: Option<u64>) {
        let mut bytes = vec![3, u8::from(!play)];
        bytes.extend(speed.to_le_bytes());
        bytes.push(u8::from(seek_ns.is_some()));
        bytes.extend(seek_ns.unwrap_or(0).to_le_bytes());
        bytes.extend(1u32.to_le_bytes());
        bytes.push(b'a');
        self.socket.send(Message::binary(bytes)).expect("sent");
    }
}

/// The topics of a recording and their schemas, but for events, which come when something happens.
const RECORDED: [(&str, &str); 6] = [
    ("/map", "foxglove.Grid"),
    ("/poses/robot", "foxglove.PosesInFrame"),
    ("/scan/", "foxglove.LaserScan"),
    ("/scene", "foxglove.SceneUpdate"),
    ("/scenery", "foxglove.SceneUpdate"),
    ("/tf", "foxglove.FrameTransforms"),
];

/// Ends a run as Ctrl-C does; returns its summary.
fn interrupted(child: Child) -> Value {
    signal(&child, "INT");
    let ended = child.wait_with_output().expect("it ends");
    serde_json::from_slice(&ended.stdout).expect("a summary")
}

#[test]
fn a_run_is_seen_live_by_the_topics_of_a_recording_and_held_and_its_digest_is_the_same() {
    let place = TestFolder::new();
    let port = free_port();
    let at = format!("127.0.0.1:{port}");
    let args = ["run", "s.toml", "--cycles", "1000000000", "--json", "--foxglove", &at];
    let child = place.start(&args);
    let mut viewer = Viewer::connect(port);
    viewer.steer(false, 1.0, None);
    assert!(viewer.info["capabilities"].to_string().contains("playbackControl"), "{}", viewer.info);
    for (topic, schema) in RECORDED {
        let found = viewer.channels.iter().find(|(live, _)| live.starts_with(topic));
        assert_eq!(found.map(|(_, (name, _))| name.as_str()), Some(schema), "{topic}");
    }
    // One that asks for messages and takes none.
    let mut idle = Viewer::connect(port);
    idle.subscribe();
    viewer.subscribe();
    assert_eq!(viewer.message("/map").0, 0, "what was told before is told to those who come later");
    let held = viewer.state(|state| state.status == 1);
    viewer.steer(true, 100.0, Some(1));
    let later = viewer.state(|state| state.status == 0 && state.time_ns > held.time_ns);
    assert_eq!((later.speed, later.did_seek), (100.0, false), "a run goes on, never back");
    let mut scene = viewer.message("/scene");
    while scene.0 < later.time_ns {
        scene = viewer.message("/scene");
    }
    assert!(scene.1 > 100);
    let summary = interrupted(child);
    let cycles = summary["cycles"].as_u64().expect("a number").to_string();
    let alone = place.json(&["run", "s.toml", "--cycles", &cycles]);
    assert_eq!(summary["digest"], alone["digest"]);
}

#[test]
fn the_session_that_was_opened_last_is_seen_live_and_played_and_sought_from_there() {
    let place = TestFolder::new();
    let digest = place.json(&["run", "s.toml"])["digest"].clone();
    let port = free_port();
    let at = format!("127.0.0.1:{port}");
    let studio = Studio::start(&place, &["s.toml", "--foxglove", &at]);
    let mut page = studio.page();
    page.open("s.toml");
    let mut first = Viewer::connect(port);
    first.subscribe();
    assert_eq!(first.message("/scene").0, 0);
    page.open("s.toml");
    let mut viewer = Viewer::connect(port);
    viewer.subscribe();
    viewer.steer(true, 100.0, Some(20_000_000_000));
    assert!(viewer.state(|state| state.time_ns >= 20_000_000_000).did_seek);
    while viewer.message("/scene").0 <= 20_000_000_000 {}
    viewer.steer(false, 1.0, Some(1_000_000_000));
    while viewer.message("/scene").0 != 1_000_000_000 {}
    page.ask(json!({ "do": "play", "session": 2, "speed": "fastest" }));
    assert_eq!(page.over(&json!(2))["digest"], digest);
    viewer.state(|state| state.status == 3);
}

#[test]
fn a_port_that_viewers_cannot_have_is_an_error_with_another_one_and_nothing_is_written() {
    let place = TestFolder::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let at = taken.local_addr().expect("bound").to_string();
    for args in [&["run", "s.toml", "--out", "run"][..], &["studio", "--no-open"]] {
        let ended = place.run(&[args, &["--foxglove", &at]].concat());
        assert_eq!(ended.code(), 2, "{}", ended.err());
        assert!(ended.err().contains(&format!("--foxglove {at}")), "{}", ended.err());
        assert!(ended.err().contains("in use"), "{}", ended.err());
    }
    let many = ["run", "s.toml", "--replicate", "2", "--foxglove", "127.0.0.1:0"];
    assert!(place.run(&many).err().contains("leave it out"));
    assert_eq!(place.names(), ["s.toml"]);
}
