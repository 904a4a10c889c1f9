//! Logs, to standard error: a line each, for people or as JSON.

use sidestep::kernel::InputError;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt;
use tracing_subscriber::prelude::*;

/// Starts to log from a level on, e.g. `info`. Of Zenoh only errors are logged, and everything at `trace`.
///
/// # Errors
/// When there is no such level.
pub(super) fn start(is_json: bool, level: &str) -> Result<(), InputError> {
    let wanted: LevelFilter = level.parse().map_err(|_| {
        let remedy = "give one of off, error, warn, info, debug and trace";
        InputError::new("--log", format!("there is no level `{level}`"), remedy)
    })?;
    let mut targets = Targets::new().with_target("sidestep_link", wanted);
    targets = match wanted {
        LevelFilter::TRACE => targets.with_default(wanted),
        // Zenoh warns of its scouting, which is off; it reports problems with certificates nowhere else.
        _ => targets
            .with_default(wanted.min(LevelFilter::ERROR))
            .with_target("zenoh_link_tls", wanted.min(LevelFilter::WARN)),
    };
    let lines = fmt::layer().with_writer(std::io::stderr).with_ansi(false).with_target(false);
    let told = tracing_subscriber::registry();
    // A process has one logger, and this is called once.
    let _ = match is_json {
        true => told.with(lines.json().flatten_event(true).with_filter(targets)).try_init(),
        false => told.with(lines.with_timer(fmt::time::uptime()).with_filter(targets)).try_init(),
    };
    Ok(())
}
