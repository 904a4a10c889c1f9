//! Logs to standard error, one line each, as text or as JSON.

use crate::wire::access::{ACCESS_TARGET, DenialLayer};
use crate::wire::endpoint::without_sources;
use crate::wire::link_log::{FILE_LIMIT_HINT, LINK_TARGET, LinkLayer};
use sidestep::kernel::InputError;
use std::io::{self, Write};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt;
use tracing_subscriber::prelude::*;

/// Starts to log from a level on, e.g. `info`. Of Zenoh only errors are logged, except at `trace`.
///
/// # Errors
/// When there is no such level.
pub(super) fn start(is_json: bool, level: &str, is_encrypted: bool) -> Result<(), InputError> {
    let level_filter: LevelFilter = level.parse().map_err(|_| {
        let remedy = "give one of off, error, warn, info, debug and trace";
        InputError::new("--log", format!("there is no level `{level}`"), remedy)
    })?;
    let mut targets = Targets::new().with_target("sidestep_link", level_filter);
    targets = match level_filter {
        LevelFilter::TRACE => targets.with_default(level_filter),
        // Zenoh warns of its scouting, which is off. Its problems with certificates are told by `denials.rs`.
        _ => targets
            .with_default(level_filter.min(LevelFilter::ERROR))
            .with_target(LINK_TARGET, LevelFilter::OFF),
    };
    let lines = fmt::layer().with_writer(|| CleanStderr).with_ansi(false).with_target(false);
    let denials = is_encrypted.then(|| {
        DenialLayer.with_filter(Targets::new().with_target(ACCESS_TARGET, LevelFilter::TRACE))
    });
    let links = is_encrypted.then(|| {
        LinkLayer.with_filter(Targets::new().with_target(LINK_TARGET, LevelFilter::DEBUG))
    });
    let registry = tracing_subscriber::registry().with(denials).with(links);
    let started = if is_json {
        registry.with(lines.json().flatten_event(true).with_filter(targets)).try_init()
    } else {
        registry.with(lines.with_timer(fmt::time::uptime()).with_filter(targets)).try_init()
    };
    // It fails where a logger has been started, and this is called once.
    drop(started);
    Ok(())
}

/// What is said instead, unless files are the reason.
const REFUSED_LINK: &str = "A link was not opened: see the certificates of both ends.";

/// Standard error, to which lines of other libraries are written without the places in their sources, and with no advice
/// that does not fit the cause.
struct CleanStderr;

impl Write for CleanStderr {
    // Each line comes in one piece.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let clean = clean_line(&String::from_utf8_lossy(line));
        io::stderr().lock().write_all(clean.as_bytes())?;
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Returns a line of the log as users get it.
fn clean_line(line: &str) -> String {
    let lacks_files = line.contains("Too many open files") || line.contains("os error 24");
    let line = without_sources(line);
    if lacks_files { line } else { line.replace(FILE_LIMIT_HINT, REFUSED_LINK) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_a_library_names_the_cause_and_no_source() {
        let line =
            "WARN received fatal alert: UnknownCA. Hint: increase the system open file limit.\n";
        assert_eq!(
            clean_line(line),
            "WARN received fatal alert: UnknownCA. A link was not opened: see the certificates of both ends.\n"
        );
        let full =
            "WARN Too many open files (os error 24). Hint: increase the system open file limit.\n";
        assert_eq!(clean_line(full), full);
        let source = "ERROR no listener at /home/u/zenoh/src/unicast.rs:426. agent=3\n";
        assert_eq!(clean_line(source), "ERROR no listener. agent=3\n");
    }
}
