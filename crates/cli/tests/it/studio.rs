//! D1 for the studio: its digest is that of `run`; and nothing that a page sends ends a session or the process.

use crate::support::{CommandOutput, TestFolder, signal, wait_for};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Child;
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// The command while it runs.
pub(crate) struct Studio {
    child: Child,
    url: String,
}

impl Studio {
    pub(crate) fn start(place: &TestFolder, args: &[&str]) -> Self {
        let all = [&["studio", "--no-open", "--port", "0", "--quiet"], args].concat();
        let mut child = place.start(&all);
        let out = child.stdout.take().expect("its output");
        let mut url = String::new();
        BufReader::new(out).read_line(&mut url).expect("a line");
        assert!(url.starts_with("http://"), "{url}");
        Self { child, url: url.trim().into() }
    }

    /// Host and port.
    fn host(&self) -> &str {
        self.url.trim_start_matches("http://").split('/').next().expect("a host")
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.host()).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time");
        stream
    }

    /// Opens a socket, with further headers; or returns the status of the refusal.
    fn socket(&self, headers: &[(&'static str, &str)]) -> Result<Page, u16> {
        let address = format!("ws://{}/socket", self.host());
        let mut request = address.into_client_request().expect("an address");
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().expect("a value"));
        }
        match tungstenite::client(request, self.connect()) {
            Ok((socket, _)) => Ok(Page { socket, id: 0, notices: Vec::new(), frames: Vec::new() }),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(other) => panic!("{other}"),
        }
    }

    pub(crate) fn page(&self) -> Page {
        let origin = format!("http://{}", self.host());
        self.socket(&[("origin", &origin)]).expect("its own page")
    }

    /// Sends a request by hand; returns the answer.
    fn http(&self, request: &str) -> String {
        let mut stream = self.connect();
        stream.write_all(request.replace('\n', "\r\n").as_bytes()).expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    }

    /// Ends it by a signal.
    fn end(mut self, name: &str) -> CommandOutput {
        signal(&self.child, name);
        let status = self.child.wait().expect("it ends");
        let mut stderr = Vec::new();
        self.child.stderr.take().expect("errors").read_to_end(&mut stderr).expect("read");
        CommandOutput(std::process::Output { status, stdout: Vec::new(), stderr })
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page that speaks with it.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    id: u32,
    notices: Vec<Value>,
    frames: Vec<Vec<u8>>,
}

impl Page {
    /// Waits for something that is no frame.
    pub(crate) fn read(&mut self) -> Value {
        loop {
            match self.socket.read().expect("a message") {
                Message::Text(text) => return serde_json::from_str(&text).expect("JSON"),
                Message::Binary(bytes) => self.frames.push(bytes.into()),
                Message::Ping(_) | Message::Pong(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }

    fn send(&mut self, text: impl Into<String>) {
        self.socket.send(Message::text(text.into())).expect("sent");
    }

    /// Asks and waits for the reply. The call is written with the session that it is for, if there is one.
    pub(crate) fn reply(&mut self, mut call: Value) -> Value {
        self.id += 1;
        let id = self.id;
        let session = call.as_object_mut().and_then(|call| call.remove("session"));
        self.send(json!({ "id": id, "session": session, "call": call }).to_string());
        self.wait_reply(id)
    }

    fn wait_reply(&mut self, id: u32) -> Value {
        loop {
            let value = self.read();
            match value.get("id") {
                Some(found) if *found == id => return value,
                _ => self.notices.push(value),
            }
        }
    }

    pub(crate) fn ask(&mut self, call: Value) -> Value {
        let reply = self.reply(call.clone());
        assert!(reply.get("problem").is_none(), "{call}: {reply}");
        reply["answer"].clone()
    }

    pub(crate) fn open(&mut self, path: &str) -> Value {
        self.ask(
            json!({ "do": "open", "target": { "kind": "scenario", "path": path }, "seed": null }),
        )
    }

    /// Returns the frames that came so far.
    pub(crate) fn frames(&self) -> &[Vec<u8>] {
        &self.frames
    }

    fn last_over(&self, session: &Value) -> Option<Value> {
        let is_it = |n: &&Value| n["notice"] == "status" && n["session"] == *session;
        self.notices.iter().rfind(is_it).filter(|status| status["state"] == "over").cloned()
    }

    /// Waits until a session has come to its end; returns its status.
    pub(crate) fn over(&mut self, session: &Value) -> Value {
        loop {
            if let Some(status) = self.last_over(session) {
                return status;
            }
            let value = self.read();
            self.notices.push(value);
        }
    }

    /// Plays as fast as it goes, and takes all frames; returns the last status.
    fn play_to_the_end(&mut self) -> Value {
        self.ask(json!({ "do": "credit", "session": 1, "frames": 5 }));
        self.ask(json!({ "do": "play", "session": 1, "speed": "fastest" }));
        // Notices of an earlier end are over.
        self.notices.retain(|notice| notice["notice"] != "status");
        loop {
            if let Some(status) = self.last_over(&json!(1)) {
                return status;
            }
            let seen = self.frames.len();
            let value = self.read();
            self.notices.push(value);
            let shown = self.frames.len() - seen;
            self.ask(json!({ "do": "credit", "session": 1, "frames": shown }));
        }
    }
}

#[test]
fn a_scenario_played_in_the_studio_comes_to_the_digest_of_run() {
    let place = TestFolder::new();
    let digest = place.json(&["run", "s.toml"])["digest"].clone();
    let studio = Studio::start(&place, &["s.toml", "--workers", "2"]);
    let mut page = studio.page();
    let hello = page.read();
    assert_eq!((&hello["notice"], &hello["version"]), (&"hello".into(), &3.into()));
    assert_eq!(hello["open"], json!([{ "kind": "scenario", "path": "s.toml" }]));
    let listed = page.ask(json!({ "do": "files", "folder": "." }));
    assert_eq!(listed["entries"][0]["about"], "robots: small");
    let opened = page.open("s.toml");
    assert_eq!((&opened["session"], &opened["scene"]["dimensions"]), (&1.into(), &2.into()));
    let over = page.play_to_the_end();
    assert_eq!((&over["digest"], &over["cycle"]), (&digest, &3000.0.into()));
    assert!(!page.frames.is_empty() && page.frames.iter().all(|frame| frame.starts_with(b"SSTF")));
    assert_eq!(page.notices.iter().filter(|notice| notice["notice"] == "bodies").count(), 1);
    page.ask(json!({ "do": "seek", "session": 1, "cycle": 10 }));
    assert_eq!(page.play_to_the_end()["digest"], digest, "and again from an earlier cycle");
}

#[test]
fn noise_is_answered_with_problems_and_the_session_goes_on() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["s.toml"]);
    let mut page = studio.page();
    page.open("s.toml");
    let deep = "[".repeat(100_000);
    for noise in ["", "{", "null", "[]", "\u{0}", "{\"id\":1}", &deep] {
        page.send(noise);
        assert!(
            page.wait_reply(if noise.len() == 8 { 1 } else { 0 })["problem"].is_object(),
            "{noise:.20}"
        );
    }
    page.socket.send(Message::binary(vec![0xff; 1000])).expect("sent");
    assert!(page.wait_reply(0)["problem"].is_object());
    page.send(" ".repeat(42_000_000));
    assert!(page.wait_reply(0)["problem"]["cause"].as_str().is_some_and(|c| c.contains("bytes")));
    for call in [
        json!({ "do": "play", "session": 77, "speed": "fastest" }),
        json!({ "do": "close", "session": 77 }),
        json!({ "do": "check", "session": 77, "text": "" }),
        json!({ "do": "files", "folder": "/" }),
        json!({ "do": "open", "target": { "kind": "recording", "path": "s.toml" }, "seed": null }),
        json!({ "do": "open", "target": { "kind": "new", "world": "mars" }, "seed": null }),
    ] {
        assert!(page.reply(call.clone())["problem"].is_object(), "{call}");
    }
    for _ in 0..1000 {
        page.send("noise");
    }
    (0..1000).for_each(|_| drop(page.wait_reply(0)));
    page.ask(json!({ "do": "step", "session": 1, "cycles": 3 }));
    // A page that breaks off in the middle of a word harms no other.
    let mut other = studio.page();
    other.open("s.toml");
    other.socket.get_mut().write_all(&[0x81, 0xfe, 0xff]).expect("sent");
    drop(other);
    assert_eq!(page.play_to_the_end()["cycle"], 3000.0);
}

#[test]
fn a_page_has_so_many_sessions_and_closes_them_one_by_one() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &[]);
    let mut page = studio.page();
    let numbers: Vec<Value> = (0..4).map(|_| page.open("s.toml")["session"].clone()).collect();
    assert_eq!(numbers, [1, 2, 3, 4]);
    let open =
        json!({ "do": "open", "target": { "kind": "scenario", "path": "s.toml" }, "seed": 7 });
    assert!(page.reply(open.clone())["problem"].is_object());
    page.ask(json!({ "do": "close", "session": 2 }));
    assert_eq!(page.ask(open)["status"]["seed"], "7");
    // Sessions belong to their socket.
    let mut other = studio.page();
    assert!(other.reply(json!({ "do": "pause", "session": 1 }))["problem"].is_object());
}

#[test]
fn a_page_that_reads_nothing_for_a_while_does_not_stop_the_run() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["s.toml"]);
    let mut page = studio.page();
    let text = place.read("s.toml").replace("cycles = 3000", "cycles = 100000000");
    page.open("s.toml");
    page.ask(json!({ "do": "restart", "session": 1, "seed": null, "text": text }));
    page.ask(json!({ "do": "credit", "session": 1, "frames": 1000 }));
    page.ask(json!({ "do": "play", "session": 1, "speed": "fastest" }));
    std::thread::sleep(Duration::from_secs(2));
    let before = page.frames.len();
    page.ask(json!({ "do": "pause", "session": 1 }));
    let cycle = |frame: &Vec<u8>| f64::from_le_bytes(*frame[16..].first_chunk().expect("a cycle"));
    assert!(page.frames.len() > before && page.frames.last().map(cycle) > Some(1000.0));
}

#[test]
fn a_studio_that_only_reads_takes_no_text() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["s.toml", "--read-only"]);
    let mut page = studio.page();
    assert_eq!(page.read()["read_only"], true);
    page.open("s.toml");
    let source = page.ask(json!({ "do": "source", "session": 1 }));
    assert_eq!(source["read_only"], true);
    for call in ["restart", "check"] {
        let mut call = json!({ "do": call, "session": 1, "text": source["text"] });
        if call["do"] == "restart" {
            call["seed"] = Value::Null;
        }
        let remedy = page.reply(call)["problem"]["remedy"].clone();
        assert!(remedy.as_str().is_some_and(|remedy| remedy.contains("--read-only")), "{remedy}");
    }
    page.ask(json!({ "do": "restart", "session": 1, "seed": 8, "text": null }));
}

#[test]
fn only_its_own_page_may_ask() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &[]);
    let status = |headers: &[_]| studio.socket(headers).err();
    assert_eq!(status(&[("origin", "http://evil.example")]), Some(403));
    assert_eq!(status(&[("host", "evil.example")]), Some(421));
    assert_eq!(status(&[]), None, "a program that is no browser");
    let get = |host: &str, path: &str| {
        studio.http(&format!("GET {path} HTTP/1.1\nHost: {host}\nConnection: close\n\n"))
    };
    assert!(get("evil.example", "/").starts_with("HTTP/1.1 421"));
    let answer = get(studio.host(), "/");
    assert!(
        answer.starts_with("HTTP/1.1 200") && answer.contains("default-src 'self'"),
        "{answer}"
    );
    for path in ["/../../s.toml", "/s.toml", "/%2e%2e/s.toml", "//etc/passwd.txt"] {
        assert!(get(studio.host(), path).starts_with("HTTP/1.1 404"), "{path}");
    }
}

#[test]
fn a_body_that_comes_byte_by_byte_holds_no_place() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["--addr", "0.0.0.0"]);
    let host = studio.host();
    let begun = Instant::now();
    let length = "Content-Length: 200";
    let chunked = "Transfer-Encoding: chunked";
    std::thread::scope(|scope| {
        for (method, path, body) in [
            ("POST", "/enter", length),
            ("POST", "/enter", chunked),
            ("GET", "/enter", length),
            ("POST", "/report", length),
            ("POST", "/export?path=s.toml&as=svg", chunked),
            ("POST", "/socket", length),
            ("POST", "/", length),
            ("GET", "/", chunked),
            ("PUT", "/nowhere", length),
        ] {
            let mut stream = studio.connect();
            let head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\n{body}\r\n\r\n");
            stream.write_all(head.as_bytes()).expect("sent");
            scope.spawn(move || {
                // A write fails once the connection is ended.
                let bytes = if body == chunked { "1\r\nx\r\n" } else { "x" };
                while stream.write_all(bytes.as_bytes()).is_ok() {
                    assert!(begun.elapsed() < Duration::from_secs(40), "{method} {path} is held");
                    std::thread::sleep(Duration::from_millis(500));
                }
            });
        }
    });
}

#[test]
fn a_studio_that_others_can_reach_asks_for_its_token() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["--addr", "0.0.0.0"]);
    let token = studio.url.split("#token=").nth(1).expect("a token").to_string();
    assert_eq!(token.len(), 32);
    assert_eq!(studio.socket(&[]).err(), Some(401));
    let enter = |token: &str| {
        let (host, bytes) = (studio.host(), token.len());
        let head = format!(
            "POST /enter HTTP/1.1\nHost: {host}\nConnection: close\nContent-Length: {bytes}"
        );
        studio.http(&format!("{head}\n\n{token}"))
    };
    assert!(enter(&token[1..]).starts_with("HTTP/1.1 401"));
    assert!(enter(&"x".repeat(1000)).starts_with("HTTP/1.1 413"));
    let entered = enter(&token);
    assert!(
        entered.starts_with("HTTP/1.1 204") && entered.contains("HttpOnly; SameSite=Strict"),
        "{entered}"
    );
    let cookie = entered.split("set-cookie: ").nth(1).and_then(|rest| rest.split(';').next());
    assert_eq!(studio.socket(&[("cookie", cookie.expect("a cookie"))]).err(), None);
    let said = studio.end("INT").err();
    assert!(said.contains("warning: others can reach"), "{said}");
}

#[test]
fn what_cannot_be_served_is_wrong_input() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &[]);
    let port = studio.host().split(':').nth(1).expect("a port");
    let ended = place.run(&["studio", "--no-open", "--port", port]);
    assert_eq!((ended.code(), ended.out().as_str()), (2, ""));
    assert!(
        ended.err().contains("the port is in use") && ended.err().contains("--port "),
        "{}",
        ended.err()
    );
    for args in [&["nowhere.toml"][..], &["--addr", "192.0.2.1"]] {
        let ended = place.run(&[&["studio", "--no-open"], args].concat());
        assert_eq!(ended.code(), 2, "{}", ended.err());
        assert!(ended.err().contains("help:"), "{}", ended.err());
    }
}

#[test]
fn signals_end_all_sessions_and_the_process() {
    for name in ["INT", "TERM", "HUP"] {
        let place = TestFolder::new();
        let studio = Studio::start(&place, &["s.toml"]);
        let mut page = studio.page();
        page.open("s.toml");
        page.ask(json!({ "do": "play", "session": 1, "speed": { "times": 0.1 } }));
        let started = Instant::now();
        let ended = studio.end(name);
        assert_eq!(ended.code(), 0, "{name}: {}", ended.err());
        assert!(started.elapsed() < Duration::from_secs(20));
    }
}

#[test]
fn a_page_finds_the_studio_again_after_it_was_killed_and_started_anew() {
    let place = TestFolder::new();
    let mut studio = Studio::start(&place, &["s.toml"]);
    let port = studio.host().split(':').nth(1).expect("a port").to_string();
    studio.page().open("s.toml");
    studio.child.kill().expect("killed");
    studio.child.wait().expect("ended");
    let again = || place.start(&["studio", "--no-open", "--quiet", "--port", &port, "s.toml"]);
    let mut child = again();
    wait_for("the port", || TcpStream::connect(studio.host()).is_ok());
    studio.page().open("s.toml");
    child.kill().expect("killed");
    child.wait().expect("ended");
}

#[test]
fn recordings_are_replayed_and_a_damaged_one_is_a_problem() {
    let place = TestFolder::new();
    let recorded =
        place.json(&["run", "s.toml", "--out", "r", "--mcap", "x.mcap", "--mcap-every", "100"]);
    let bytes = std::fs::read(place.path("x.mcap")).expect("read");
    place.write("cut.mcap", &bytes[..bytes.len() / 2]);
    let studio = Studio::start(&place, &["r", "x.mcap", "cut.mcap"]);
    let mut page = studio.page();
    let kinds: Vec<Value> =
        page.read()["open"].as_array().expect("a list").iter().map(|o| o["kind"].clone()).collect();
    assert_eq!(kinds, ["recording"; 3]);
    let open = |path| json!({ "do": "open", "target": { "kind": "recording", "path": path }, "seed": null });
    let problem = page.reply(open("cut.mcap"))["problem"].clone();
    assert!(
        !problem["cause"].as_str().expect("a cause").is_empty()
            && !problem["remedy"].as_str().expect("a remedy").is_empty()
    );
    for path in ["r", "x.mcap"] {
        let session = page.ask(open(path))["session"].clone();
        page.ask(json!({ "do": "seek", "session": session, "cycle": 3000 }));
        let last = page.over(&session);
        assert_eq!(last["digest"], recorded["digest"]);
        assert!(last["banner"].as_str().is_some_and(|b| b.contains("the recorded one")), "{last}");
    }
}

#[test]
fn who_finds_all_places_taken_is_told_so_and_let_in_when_one_is_free() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &[]);
    let mut pages: Vec<Page> = (0..16).map(|_| studio.page()).collect();
    assert_eq!(studio.socket(&[]).err(), Some(503));
    let host = studio.host();
    let enter =
        || studio.http(&format!("GET /enter HTTP/1.1\nHost: {host}\nConnection: close\n\n"));
    let told = enter();
    assert!(told.starts_with("HTTP/1.1 503") && told.contains("close one of them"), "{told}");
    pages.pop();
    wait_for("a place", || enter().starts_with("HTTP/1.1 204"));
    assert_eq!(studio.socket(&[]).err(), None);
}

/// A scenario of which a check takes a while.
const HEAVY: &str = "format = 1\nworld = \"robots\"\nseed = 1\ncycles = 10\n[map]\nbox_size_m = 0.25\n[map.office]\n\
    floors = 4\ncorridors = 10\nrooms_per_side = 12\n[[robots]]\ncount = 5000\nsensors = [\"sonar-8\"]\n";

#[test]
fn pages_that_ask_for_much_keep_no_other_page_waiting() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["s.toml"]);
    // Sockets count their sessions on, and each of them asks as much as is taken in at a time.
    let asking = (1..=6).map(|session| {
        let mut page = studio.page();
        page.open("s.toml");
        for id in 1000..1060 {
            let call = json!({ "do": "check", "text": HEAVY });
            page.send(json!({ "id": id, "session": session, "call": call }).to_string());
        }
        page
    });
    let mut first = asking.collect::<Vec<Page>>();
    let mut other = studio.page();
    let answered = std::thread::scope(|scope| {
        let all = scope.spawn(|| {
            first[0].wait_reply(1059);
            Instant::now()
        });
        other.ask(json!({ "do": "files", "folder": "." }));
        let listed = Instant::now();
        (listed, all.join().expect("answered"))
    });
    assert!(answered.0 < answered.1, "the other waited until all were done");
}

/// The status, the head and the body of an answer.
fn parts(answer: &str) -> (u16, &str, &str) {
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
    (head[9..12].parse().expect("a status"), head, body)
}

#[test]
fn reports_and_exports_of_a_run_are_those_of_the_command() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "runs/a b"]);
    place.json(&["report", "runs/a b", "--out", "page.html"]);
    place.json(&["export", "runs/a b", "--to", "csv", "--out", "tables"]);
    let studio = Studio::start(&place, &["runs"]);
    let get = |path: &str, more: &str| {
        let host = studio.host();
        studio.http(&format!("GET {path} HTTP/1.1\nHost: {host}\n{more}Connection: close\n\n"))
    };
    let answer = get("/report?path=runs%2Fa%20b", "Sec-Fetch-Site: same-origin\n");
    let (status, head, body) = parts(&answer);
    assert_eq!(status, 200, "{head}");
    let policy = "content-security-policy: sandbox allow-scripts; default-src 'none'";
    for header in [policy, "frame-ancestors 'self'", "x-frame-options: SAMEORIGIN", "nosniff"] {
        assert!(head.contains(header), "{header}: {head}");
    }
    assert_eq!(body, place.read("page.html"));
    let answer = get("/report?path=runs%2Fa%20b&as=figures", "");
    let figures: Vec<String> = serde_json::from_str(parts(&answer).2).expect("a list");
    let answer = get(&format!("/report?path=runs%2Fa%20b&as={}", figures[0]), "");
    assert!(parts(&answer).2.starts_with("<svg") && answer.contains("attachment; filename=\"a-b-"));
    let answer = get("/export?path=runs%2Fa%20b&as=csv&table=events", "");
    let (status, head, body) = parts(&answer);
    assert!(status == 200 && head.contains("filename=\"a-b-events.csv\""), "{head}");
    assert_eq!(body, place.read("tables/events.csv"));
    let answer = get("/export?path=runs%2Fa%20b&as=svg&cycle=100", "");
    assert!(parts(&answer).2.starts_with("<svg") && answer.contains("Cycle 100."));
}

#[test]
fn results_are_made_of_what_may_be_read_and_for_its_own_page_alone() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "in/run"]);
    place.json(&["run", "s.toml", "--out", "out/run"]);
    let studio = Studio::start(&place, &["in"]);
    let get = |path: &str, more: &str| {
        let host = studio.host();
        let answer =
            studio.http(&format!("GET {path} HTTP/1.1\nHost: {host}\n{more}Connection: close\n\n"));
        let (status, _, body) = parts(&answer);
        (status, body.to_string())
    };
    for what in ["/report?path=", "/export?as=svg&path="] {
        assert_eq!(get(&format!("{what}in%2Frun"), "Sec-Fetch-Site: cross-site\n").0, 403);
        for path in ["out%2Frun", "in%2F..%2Fout%2Frun", "", "%2Fetc%2Fpasswd", "in"] {
            let (status, words) = get(&format!("{what}{path}"), "");
            assert!(status == 422 && words.contains("help: "), "{what}{path}: {status} {words}");
        }
    }
    for wrong in ["/report", "/report?path=in%2Frun&as=none", "/export?path=in%2Frun&as=exe"] {
        assert_eq!(get(wrong, "").0, 422, "{wrong}");
    }
    let open = Studio::start(&place, &["in", "--addr", "0.0.0.0"]);
    let host = open.host();
    let answer = open
        .http(&format!("GET /report?path=in%2Frun HTTP/1.1\nHost: {host}\nConnection: close\n\n"));
    assert_eq!(parts(&answer).0, 401);
}

#[test]
fn runs_of_a_sweep_are_listed_with_what_opens_them() {
    let place = TestFolder::new();
    place.json(&["sweep", "s.toml", "--replicate", "2", "--out", "sw"]);
    let studio = Studio::start(&place, &["."]);
    let mut page = studio.page();
    let runs = page.ask(json!({ "do": "runs", "folder": "./sw" }));
    assert_eq!(runs["runs"].as_array().map(Vec::len), Some(2), "{runs}");
    let run = &runs["runs"][1];
    let (path, seed) = (&run["replay"]["path"], run["seed"].as_str().expect("a seed"));
    assert_eq!(run["replay"]["kind"], "scenario");
    let what = json!({ "kind": "scenario", "path": path });
    let seed: u64 = seed.parse().expect("a number");
    let opened = page.ask(json!({ "do": "open", "target": what, "seed": seed }));
    assert_eq!(opened["status"]["seed"], seed.to_string());
    assert!(page.reply(json!({ "do": "runs", "folder": "." }))["problem"].is_object());
    let named = page.ask(
        json!({ "do": "open", "target": { "kind": "scenario", "path": "s.toml" }, "seed": 1 }),
    );
    let tables = page.ask(json!({ "do": "tables", "session": named["session"] }));
    assert_eq!(tables["names"], json!([]));
}
