//! A page in real Chromium: its content after its scripts ran, and its appearance.

use serde_json::Value;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Longest time that a busy machine may take for a page.
const PAGE_TIMEOUT: Duration = Duration::from_secs(240);

/// A script that inspects the page, acts like a reader, and leaves its findings in the page.
const PROBE: &str = include_str!("browser.js");

/// The browser, if there is one. Where `SIDESTEP_REQUIRE` names `chromium` there must be.
pub(crate) fn chromium() -> Option<Browser> {
    let program = std::env::var("SIDESTEP_CHROMIUM").unwrap_or_else(|_| "chromium".into());
    let version = Command::new(&program).arg("--version").stderr(Stdio::null()).output();
    if version.is_ok_and(|told| told.status.success()) {
        return Some(Browser(program));
    }
    let required = std::env::var("SIDESTEP_REQUIRE").unwrap_or_default();
    assert!(!required.split(',').any(|word| word == "chromium"), "`{program}` does not run");
    sidestep_testing::skip(format!(
        "`{program}` does not run here; SIDESTEP_CHROMIUM names another"
    ));
    None
}

/// The program.
pub(crate) struct Browser(String);

impl Browser {
    /// Opens the page, as wide as given or as the window, lets its scripts run, and returns the findings of
    /// [`PROBE`].
    ///
    /// # Panics
    /// When the browser prints an error of the page.
    pub(crate) fn probe(&self, page: &Path, width_px: Option<u32>) -> Value {
        let html = std::fs::read_to_string(page).expect("a page");
        let (head, rest) = html.split_once("<head>").expect("a head");
        let width = width_px.map_or(String::new(), |px| format!("globalThis.probeWidth = {px};"));
        let probed = format!("{head}<head><script>{width}{PROBE}</script>{rest}");
        let folder = tempfile::tempdir().expect("a folder");
        let copy = folder.path().join("probed.html");
        std::fs::write(&copy, probed).expect("written");
        let size = "--window-size=1280,1000";
        let (dom, words) = self.open(&copy, &["--virtual-time-budget=60000", "--dump-dom", size]);
        let said: Vec<&str> = words.lines().filter(|line| line.contains("CONSOLE")).collect();
        assert!(said.is_empty(), "the page complains: {said:#?}");
        let found = dom.split_once("<script type=\"application/json\" id=\"probe\">");
        let (_, found) = found.unwrap_or_else(|| panic!("the probe did not end: {words}"));
        let found = found.split_once("</script>").expect("its end").0;
        serde_json::from_str(found).expect("JSON")
    }

    /// A picture of the page at this width, as columns, rows and RGB values.
    pub(crate) fn picture(&self, page: &Path, width_px: u32) -> image::RgbImage {
        let folder = tempfile::tempdir().expect("a folder");
        let png = folder.path().join("page.png");
        let file = format!("--screenshot={}", png.display());
        let size = format!("--window-size={width_px},1000");
        self.open(page, &["--virtual-time-budget=20000", "--hide-scrollbars", &file, &size]);
        image::open(&png).expect("a picture").to_rgb8()
    }

    /// Standard output and standard error of the browser with this page.
    fn open(&self, page: &Path, how: &[&str]) -> (String, String) {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let file = |path: &PathBuf| File::create(path).expect("a file");
        let (out, err) = (at("out"), at("err"));
        let mut child = Command::new(&self.0)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"])
            .args(["--disable-quic", "--no-first-run", "--disable-background-networking"])
            .args(["--disable-component-update", "--disable-sync", "--enable-logging=stderr"])
            .args(["--host-resolver-rules=MAP * ~NOTFOUND", "--force-color-profile=srgb"])
            .arg(format!("--user-data-dir={}", at("profile").display()))
            .args(how)
            .arg(page)
            .stdin(Stdio::null())
            // Files: a page is larger than a pipe.
            .stdout(file(&out))
            .stderr(file(&err))
            .spawn()
            .expect("the browser starts");
        let started = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().expect("a status") {
                break status;
            }
            if started.elapsed() > PAGE_TIMEOUT {
                let _ = child.kill();
                let _ = child.wait();
                panic!("the browser did not end within {PAGE_TIMEOUT:?}");
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let read = |path: &PathBuf| String::from_utf8_lossy(&std::fs::read(path).unwrap()).into();
        let words: String = read(&err);
        assert!(status.success(), "{status}: {words}");
        (read(&out), words)
    }
}

/// Asserts properties of every page: it is complete, has no errors, and loads nothing. Returns the
/// findings of the probe.
pub(crate) fn assert_sound(browser: &Browser, page: &Path) -> Value {
    let narrow = browser.probe(page, Some(400));
    assert_eq!(narrow["width"], 400, "the page is as narrow as asked");
    assert_eq!(narrow["hidden"], Value::Array(Vec::new()), "columns that a phone does not show");
    let found = browser.probe(page, None);
    for found in [&narrow, &found] {
        assert_eq!(found["cut"], Value::Array(Vec::new()), "columns behind an edge");
        assert_eq!(found["beyond"], Value::Array(Vec::new()), "parts of the page are cut");
        assert_eq!(found["askew"], Value::Array(Vec::new()), "numbers apart from their heads");
        for (key, unwanted) in [("shown_by_more", false.into()), ("cut_by_more", Value::from(1))] {
            // Only where some table has more columns than room.
            assert_ne!(found[key], unwanted, "{key}: {found}");
        }
    }
    for key in ["errors", "violations", "requests"] {
        assert_eq!(found[key], Value::Array(Vec::new()), "{key}");
    }
    assert_eq!(found["drawn"], found["figures"], "every figure is drawn: {found}");
    assert_eq!(found["spoiled"], Value::Array(Vec::new()), "labels that touch or are cut");
    assert_eq!(found["silent"], 0, "a figure that does not answer the mouse");
    let picture = browser.picture(page, 420);
    let first = picture.get_pixel(0, 0);
    let inked = picture.pixels().filter(|pixel| *pixel != first).count();
    assert!(inked > 5000, "only {inked} pixels differ from the ground");
    found
}
