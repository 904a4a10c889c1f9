//! The table of a fleet's nodes while it runs, in 80 columns.

use crate::console::Console;
use crate::progress::RunBar;
use sidestep::kernel::terminal::escape_controls_in_lines;
use sidestep_document::estimate::format_short;
use sidestep_session::fleet::{FleetStatus, NodeStatus};
use std::fmt::Write;
use std::io::{IsTerminal, Write as _};
use std::time::{Duration, Instant};

/// Time between two tables where there is no terminal to draw one over the other: a log must stay readable.
const PRINT_INTERVAL: Duration = Duration::from_secs(5);

/// Lines of a terminal that a table leaves free, for the command line above and warnings below: a table that scrolls cannot be
/// drawn over.
const FREE_LINES: usize = 4;

/// A fleet on the terminal: a table, or a bar.
pub(crate) struct FleetTable {
    console: Console,
    is_table: bool,
    is_terminal: bool,
    bar: Option<RunBar>,
    /// Number of lines of the table that was printed last.
    lines: usize,
    /// Time of the next table where there is no terminal.
    next: Instant,
}

impl FleetTable {
    /// Shows a table, or only progress.
    pub(crate) fn new(console: Console, is_table: bool) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        Self { console, is_table, is_terminal, bar: None, lines: 0, next: Instant::now() }
    }

    /// Shows the fleet at once on a terminal, else only when a print is due.
    pub(crate) fn update(&mut self, now: &FleetStatus) {
        if !self.is_table {
            let bar =
                self.bar.get_or_insert_with(|| RunBar::for_cycles(self.console, 0, now.cycles));
            bar.set(now.cycle);
            return;
        }
        if !self.is_terminal && Instant::now() < self.next {
            return;
        }
        self.next = Instant::now() + PRINT_INTERVAL;
        let height =
            terminal_size::terminal_size().map_or(usize::MAX, |(_, height)| height.0.into());
        let text = table(now, height.saturating_sub(FREE_LINES));
        let text = escape_controls_in_lines(&text);
        let mut out = std::io::stderr().lock();
        let erase = match self.lines {
            // ANSI: to the start of the table's first line (CPL), then erase to the end of the screen (ED).
            lines if self.is_terminal && lines > 0 => format!("\x1b[{lines}F\x1b[J"),
            _ => String::new(),
        };
        self.lines = text.lines().count();
        let _ = write!(out, "{erase}{text}").and_then(|()| out.flush());
    }

    /// Takes the bar away; the last table stays.
    pub(crate) fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.clear();
        }
    }
}

/// Returns the table of a fleet in at most `max_lines` lines; where not all nodes fit, those in trouble come first.
fn table(now: &FleetStatus, max_lines: usize) -> String {
    let mut nodes: Vec<&NodeStatus> = now.nodes.iter().collect();
    let waiting_lines = usize::from(!now.waits_for.is_empty());
    // Besides the rows: two lines of headings, and the one that counts the nodes left out.
    let max_rows = max_lines.saturating_sub(3 + waiting_lines).max(1);
    if nodes.len() > max_rows {
        nodes.sort_by_key(|node| (!is_lost(node), std::cmp::Reverse(node.late), node.agent));
    }
    let mut text = heading(now);
    let _ = writeln!(
        text,
        "{:>9}  state    epoch  heard  round   flown   late  silent   msg/s     kB/s",
        now.noun
    );
    for node in nodes.iter().take(max_rows) {
        text.push_str(&row(node, now.nodes.len()));
    }
    if nodes.len() > max_rows {
        let _ = writeln!(text, "and {} more", nodes.len() - max_rows);
    }
    text
}

fn heading(now: &FleetStatus) -> String {
    if !now.has_begun {
        let present = now.nodes.iter().filter(|node| node.state != "awaited").count();
        return format!("{present} of {} nodes are there\n", now.nodes.len());
    }
    let p50 = format_ms(now.talk_p50_ms);
    let p99 = format_ms(now.talk_p99_ms);
    let late =
        if now.late_cycles > 0 { format!(", {} late", now.late_cycles) } else { String::new() };
    format!(
        "cycle {} of {}{late}; talks within {p50} ms (half), {p99} ms (99 %)\n{}",
        now.cycle,
        now.cycles,
        waiting_line(now)
    )
}

/// Returns a time, or a dash if nothing has been measured yet.
pub(crate) fn format_ms(time_ms: Option<f64>) -> String {
    time_ms.map_or("-".into(), format_short)
}

/// Returns a line with the nodes that the fleet waits for, if there are any.
fn waiting_line(now: &FleetStatus) -> String {
    match now.waits_for.as_slice() {
        [] => String::new(),
        [first] => format!("waits for {} {first}\n", now.noun),
        [first, more @ ..] => format!("waits for {} {first}, and {} more\n", now.noun, more.len()),
    }
}

/// Returns whether a node was there and is not heard anymore.
fn is_lost(node: &NodeStatus) -> bool {
    ["gone", "silent"].contains(&&*node.state)
}

fn row(node: &NodeStatus, all: usize) -> String {
    let heard = format!("{}/{}", node.heard, all.saturating_sub(1));
    let silent = node.silent_s.map_or("-".into(), |s| format!("{s:.1} s"));
    format!(
        "{:>9}  {:<8} {:>5}  {heard:>5}  {:>5} {:>7} {:>6} {silent:>7} {:>7.0} {:>8.1}\n",
        node.name,
        node.state.chars().take(8).collect::<String>(),
        node.epoch,
        node.round,
        node.flown,
        node.late,
        node.packets_per_s,
        node.bytes_per_s / 1e3,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fleet(count: u32) -> FleetStatus {
        let node = |agent: u32| NodeStatus {
            agent,
            name: agent.to_string(),
            state: if agent == 7 { "gone" } else { "decide" }.into(),
            epoch: 12,
            heard: 49,
            round: 1234,
            flown: 123_456,
            late: 9999,
            packets_per_s: 99_999.0,
            bytes_per_s: 12_345_678.9,
            silent_s: Some(123.4),
            ..NodeStatus::default()
        };
        let nodes = (0..count).map(node).collect();
        let times = (Some(0.5), Some(2000.0));
        FleetStatus {
            flown_s: 0.0,
            cycle: 123_456,
            cycles: 1_000_000,
            has_begun: true,
            late_cycles: 1234,
            talk_p50_ms: times.0,
            talk_p99_ms: times.1,
            server_frame_bytes: 0,
            noun: "airplane".into(),
            waits_for: Vec::new(),
            nodes,
        }
    }

    #[test]
    fn a_table_fits_80_columns_and_its_columns_stand_below_their_heads() {
        let text = table(&fleet(50), usize::MAX);
        assert_eq!(text.lines().count(), 52);
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1].chars().count(), lines[2].chars().count(), "{text}");
    }

    #[test]
    fn a_fleet_that_waits_says_for_whom_in_as_many_lines_as_there_are() {
        let names = |names: &[&str]| names.iter().map(|name| name.to_string()).collect();
        let noun = String::from("connector");
        for (waits_for, line) in [
            (names(&["0.3"]), "waits for connector 0.3"),
            (names(&["0.3", "0.4", "1.0"]), "waits for connector 0.3, and 2 more"),
        ] {
            let now = FleetStatus { waits_for, noun: noun.clone(), ..fleet(50) };
            let text = table(&now, 10);
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!((lines.len(), lines[1]), (10, line), "{text}");
            assert!(lines[2].starts_with("connector  state"), "{text}");
        }
    }

    #[test]
    fn where_not_all_fit_nodes_in_trouble_come_first_and_the_others_are_counted() {
        let text = table(&fleet(50), 10);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 10);
        assert!(lines[2].trim_start().starts_with("7  gone"), "{text}");
        assert_eq!(lines[9], "and 43 more");
    }
}
