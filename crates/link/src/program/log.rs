//! Logs to standard error, one line each, as text or as JSON.

use sidestep::kernel::InputError;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt;
use tracing_subscriber::prelude::*;

/// Starts to log from a level on, e.g. `info`. Of Zenoh only errors are logged, except at `trace`.
///
/// # Errors
/// When there is no such level.
pub(super) fn start(is_json: bool, level: &str) -> Result<(), InputError> {
    let level_filter: LevelFilter = level.parse().map_err(|_| {
        let remedy = "give one of off, error, warn, info, debug and trace";
        InputError::new("--log", format!("there is no level `{level}`"), remedy)
    })?;
    let mut targets = Targets::new().with_target("sidestep_link", level_filter);
    targets = match level_filter {
        LevelFilter::TRACE => targets.with_default(level_filter),
        // Zenoh warns of its scouting, which is off; it reports problems with certificates nowhere else.
        _ => targets
            .with_default(level_filter.min(LevelFilter::ERROR))
            .with_target("zenoh_link_tls", level_filter.min(LevelFilter::WARN)),
    };
    let lines = fmt::layer().with_writer(std::io::stderr).with_ansi(false).with_target(false);
    let registry = tracing_subscriber::registry();
    let started = if is_json {
        registry.with(lines.json().flatten_event(true).with_filter(targets)).try_init()
    } else {
        registry.with(lines.with_timer(fmt::time::uptime()).with_filter(targets)).try_init()
    };
    // It fails where a logger has been started, and this is called once.
    drop(started);
    Ok(())
}
