//! What a session keeps has bounds, however long a run is played, and ends with the session.

use super::*;
use crate::protocol::StoreUsage;
use crate::usage_registry::UsageRegistry;
use std::sync::mpsc::RecvTimeoutError::Disconnected;

/// Cycles of a run with so much of everything that its checkpoints fill their share: at 5 cycles a second, two hours of
/// play.
const LONG_CYCLES: u64 = 40_000;

/// A run with many events.
fn long_robots() -> String {
    ROBOTS
        .replace("cycles = 600", &format!("cycles = {LONG_CYCLES}"))
        .replace("count = 6", "count = 14")
}

/// Opens a scenario; returns the registry of what sessions keep, too.
fn open_with_usage(text: &str) -> (Page, UsageRegistry) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.toml");
    std::fs::write(&path, text).expect("written");
    let what = OpenTarget::Scenario { path: path.display().to_string() };
    let small_budget = Arc::new(MemoryBudget::new(1 << 15, 1 << 14));
    let deps = SessionDeps { budget: small_budget, ..deps(folder.path(), 1) };
    let usage = deps.usage.clone();
    let (page, _) = Page::open_target(deps, what, folder);
    (page, usage)
}

fn store<'s>(stores: &'s [StoreUsage], name: &str) -> &'s StoreUsage {
    stores.iter().find(|store| store.name == name).unwrap_or_else(|| panic!("no store {name}"))
}

#[test]
fn a_long_play_in_fast_forward_stays_within_the_bounds() {
    let (mut page, usage) = open_with_usage(&long_robots());
    page.ask(json!({ "do": "play", "speed": "fastest" }));
    let mut largest = [0; 4];
    let mut is_over = false;
    while !is_over {
        page.ask(json!({ "do": "metrics", "from": 0 }));
        let stores = usage.stores();
        assert_eq!(stores.len(), largest.len(), "each store is compared");
        for (largest, StoreUsage { name, bytes, max_bytes, .. }) in largest.iter_mut().zip(&stores)
        {
            assert!(bytes <= max_bytes, "{name}: {bytes} of {max_bytes} bytes");
            *largest = (*largest).max(*bytes);
        }
        let last = page.notices.iter().rfind(|notice| notice["notice"] == "status");
        is_over = last.is_some_and(|last| last["state"] == "over");
        page.notices.truncate(0);
        if !is_over {
            page.read();
            is_over = page.notices.iter().any(|notice| notice["state"] == "over");
        }
    }
    let stores = usage.stores();
    let checkpoints = store(&stores, "checkpoints to seek to");
    assert!(largest[0] > checkpoints.max_bytes / 4, "they have filled their share: {largest:?}");
    let events = store(&stores, "events");
    let all = page.ask(json!({ "do": "events", "from": 0, "until": LONG_CYCLES, "limit": 1 }));
    let count = all["left_out"].as_u64().expect("a number");
    assert!(count > 20_000 && events.bytes < 50 * count, "{count} events: {events:?}");
    let metrics = store(&stores, "metrics over time");
    assert!(metrics.bytes > 1000 * 8 && metrics.bytes < metrics.max_bytes / 4, "{metrics:?}");
}

#[test]
fn nothing_is_kept_of_sessions_that_were_closed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.toml");
    std::fs::write(&path, ROBOTS).expect("written");
    let shared = deps(folder.path(), 1);
    for number in 1..=30 {
        let outbox = Arc::new(Outbox::default());
        let target = OpenTarget::Scenario { path: path.display().to_string() };
        let request = OpenRequest { session: number, id: 1, target, seed: None };
        let (closed, is_closed) = std::sync::mpsc::channel::<()>();
        let session = Session::start(shared.clone(), request, outbox, closed).expect("a thread");
        drop(session);
        // The permit of a session is dropped when its thread ends.
        assert!(is_closed.recv_timeout(Duration::from_secs(60)).is_err_and(|e| e == Disconnected));
    }
    assert_eq!(shared.usage.stores(), [], "after thirty sessions");
    assert_eq!(shared.budget.used_bytes(), 0);
}

#[test]
fn metrics_are_exact_where_a_run_pauses_between_two_rows() {
    let text = ROBOTS.replace("cycles = 600", "cycles = 10000000");
    let (mut page, _) = Page::open(&text, 1);
    page.ask(json!({ "do": "seek", "cycle": 12_345 }));
    let charts = page.ask(json!({ "do": "metrics", "from": 0 }));
    assert_eq!(charts["present"]["cycle"], 12_345.0, "no row is due there, and it is exact");
    page.ask(json!({ "do": "play", "speed": "fastest" }));
    for _ in 0..20 {
        let charts = page.ask(json!({ "do": "metrics", "from": 0 }));
        assert!(charts["present"]["cycle"].as_f64().expect("a cycle") >= 12_345.0);
    }
    page.ask(json!({ "do": "pause" }));
    let charts = page.ask(json!({ "do": "metrics", "from": 0 }));
    let paused = page.ask(json!({ "do": "events", "from": 0, "until": 1, "limit": 1 }));
    let known_until = paused["known_until"].as_f64();
    assert_eq!(charts["present"]["cycle"].as_f64(), known_until, "where it pauses");
}
