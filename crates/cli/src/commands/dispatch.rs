//! `sidestep dispatch`: vehicles of a warehouse that carry out the plan of a scenario.

use crate::console::{Console, format_fixed};
use crate::exit::{ExitCode, Failure};
use crate::link::{LOST_SERVER_REMEDY, run_job};
use crate::progress::StageBar;
use crate::scenario_args::ScenarioArgs;
use crate::worlds;
use clap::Args;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep_session::fleet::{
    DispatchJob, DispatchStatus, Job, JobScenario, LinkMessage, VehicleStatus,
};
use std::collections::BTreeMap;

const EXAMPLES: &str = "\
Examples:
  sidestep dispatch hall.toml --vda5050 mqtt://127.0.0.1:1883
  sidestep dispatch hall.toml --vda5050 mqtt://127.0.0.1:1883 \\
      --manufacturer acme --serial-prefix truck- --map-id hall-3
                                   robot 0 is the vehicle acme/truck-0, and so on
  sidestep dispatch hall.toml --vda5050 mqtt://127.0.0.1:1883 --give-up 60
                                   ends when nobody has gone on for a minute

The scenario is one of robots that planners lead; the plan is its run without errors (see the \
chapter \"Vehicles by VDA 5050\" of the book for what is promised and what is not). Ctrl-C cancels \
the orders of all vehicles. The program sidestep-link does it: `cargo install --path crates/link`. \
A password for the broker, with mqtt://USER@HOST:PORT, is read from SIDESTEP_MQTT_PASSWORD.";

/// Let vehicles of a warehouse carry out the plan of a scenario, as their master control by
/// VDA 5050 version 2.1.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct DispatchArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// MQTT broker to which the vehicles are connected
    #[arg(long, value_name = "mqtt://HOST:PORT")]
    vda5050: String,

    /// Manufacturer of all vehicles, a level of their topics
    #[arg(long, value_name = "NAME", default_value = "sidestep", value_parser = parse_level)]
    manufacturer: String,

    /// Serial number of a vehicle, without the number of its robot
    #[arg(long, value_name = "TEXT", default_value = "agv-", value_parser = parse_level)]
    serial_prefix: String,

    /// First level of all topics
    #[arg(long, value_name = "NAME", default_value = "uagv", value_parser = parse_level)]
    interface: String,

    /// Name of the map, in whose frame places are given in meters
    #[arg(long, value_name = "NAME", default_value = "map")]
    map_id: String,

    /// Nodes after the released ones that a vehicle is told of (its horizon)
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(0..=1000))]
    horizon: u16,

    /// Seconds without a state after which a vehicle counts as silent: it gets no orders until it
    /// is heard. Vehicles send one every 30 s at least
    #[arg(long, value_name = "S", default_value_t = 35.0, value_parser = parse_seconds)]
    silence: f64,

    /// Seconds after which an order is sent again that no state has confirmed
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = parse_seconds)]
    resend: f64,

    /// Seconds in which no vehicle reaches a node, after which all orders are canceled and the
    /// command fails [default: it waits, until Ctrl-C]
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    give_up: Option<f64>,

    /// Allow a broker on another machine: the link to it is not encrypted
    #[arg(long)]
    insecure: bool,

    /// Log level on standard error: off, error, warn, info, debug or trace
    #[arg(long, value_name = "LEVEL", default_value = "warn")]
    log: String,

    /// Write each line of the log as a JSON object
    #[arg(long)]
    log_json: bool,
}

/// Parses a time in seconds, from 0.1 to a day.
fn parse_seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|s| (0.1..=86_400.0).contains(s));
    number.ok_or_else(|| "give seconds from 0.1 to 86400".into())
}

/// Parses a level of a topic, or a part of one (VDA 5050, 6.3).
fn parse_level(text: &str) -> Result<String, String> {
    let is_level = !text.is_empty() && !text.contains(['/', '$', '+', '#', '\0']);
    if is_level { Ok(text.into()) } else { Err("give letters without /, $, + and #".into()) }
}

/// # Errors
/// When the scenario has no plan, the broker is not there, or vehicles do not go on.
pub(crate) fn dispatch(args: &DispatchArgs, console: Console) -> Result<ExitCode, Failure> {
    args.check_unused()?;
    let mut end: Option<DispatchStatus> = None;
    let bar = StageBar::new(console);
    let result = run_job(&Job::Dispatch(args.job()), |message| {
        // All other messages are of fleets, and `run_job` returns the failure.
        if let LinkMessage::Dispatch(now) = message {
            bar.set("vehicles on their routes", share_done(&now));
            end = Some(now);
        }
    });
    bar.clear();
    if let Some(end) = end {
        console.print_result(&json!(end), || text(&end))?;
    }
    match result {
        Ok(()) => Ok(ExitCode::Done),
        Err(Failure::Other { cause, remedy }) if remedy == LOST_SERVER_REMEDY => {
            let remedy = "vehicles stop at the last nodes that were released; start again from where they stand";
            Err(Failure::other(cause, remedy))
        }
        Err(failure) => Err(failure),
    }
}

/// Returns the fraction of all nodes that were reached.
fn share_done(now: &DispatchStatus) -> f64 {
    let nodes: usize = now.vehicles.iter().map(|vehicle| vehicle.nodes).sum();
    let done: usize = now.vehicles.iter().map(|vehicle| vehicle.nodes_done).sum();
    done as f64 / nodes.max(1) as f64
}

impl DispatchArgs {
    /// Refuses options of scenarios that have no effect here.
    ///
    /// # Errors
    /// When one is given.
    fn check_unused(&self) -> Result<(), InputError> {
        self.scenario.import.check_none("no file of air traffic has vehicles on a floor")?;
        if self.scenario.changes.regime.is_some() {
            let cause = "the plan is that of a run without errors; vehicles err in their own ways";
            return Err(InputError::new("--regime", cause, "leave it out"));
        }
        Ok(())
    }

    fn job(&self) -> DispatchJob {
        DispatchJob {
            planned: JobScenario {
                file: self.scenario.file.clone(),
                overrides: self.scenario.all_overrides(),
                build: worlds().build().into(),
            },
            broker: self.vda5050.clone(),
            is_insecure: self.insecure,
            interface: self.interface.clone(),
            manufacturer: self.manufacturer.clone(),
            serial_prefix: self.serial_prefix.clone(),
            map_id: self.map_id.clone(),
            horizon_nodes: self.horizon.into(),
            silence_s: self.silence,
            resend_s: self.resend,
            give_up_s: self.give_up,
            json_log: self.log_json,
            log: self.log.clone(),
        }
    }
}

/// Returns the result for people: a line for each vehicle, and what was dropped.
fn text(end: &DispatchStatus) -> String {
    let mut table = String::new();
    let width = end.vehicles.iter().map(|one| one.serial.chars().count()).max().unwrap_or(0).max(7);
    table.push_str(&format!(
        "{:<width$}  {:>11}  {:>5}  {:>8}  {:>8}  {:>7}  state\n",
        "vehicle", "nodes", "waits", "waited", "time", "dropped"
    ));
    for vehicle in &end.vehicles {
        table.push_str(&row(vehicle, width));
    }
    let mut dropped = end.dropped.clone();
    for vehicle in &end.vehicles {
        for (reason, count) in &vehicle.dropped {
            *dropped.entry(reason.clone()).or_default() += count;
        }
    }
    if !dropped.is_empty() {
        table.push_str(&format!("dropped messages: {}\n", counts(&dropped)));
    }
    table
}

fn row(vehicle: &VehicleStatus, width: usize) -> String {
    let nodes = format!("{} of {}", vehicle.nodes_done, vehicle.nodes);
    let waited = format!("{} s", format_fixed(vehicle.waited_s, 1));
    let time = vehicle.time_s.map_or("-".into(), |s| format!("{} s", format_fixed(s, 1)));
    let dropped: u64 = vehicle.dropped.values().sum();
    format!(
        "{:<width$}  {nodes:>11}  {:>5}  {waited:>8}  {time:>8}  {dropped:>7}  {}\n",
        vehicle.serial, vehicle.waits, vehicle.state
    )
}

/// Returns counts by their reasons, as `7 old_header, 2 malformed`.
fn counts(counts: &BTreeMap<String, u64>) -> String {
    let words: Vec<String> =
        counts.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_line_for_each_vehicle_and_what_was_dropped() {
        let vehicle = |serial: &str, old: u64| VehicleStatus {
            serial: serial.into(),
            state: "done".into(),
            nodes_done: 12,
            nodes: 12,
            waits: 3,
            waited_s: 4.25,
            time_s: Some(31.5),
            dropped: BTreeMap::from([("old_header".into(), old)]),
            ..VehicleStatus::default()
        };
        let end = DispatchStatus {
            vehicles: vec![vehicle("agv-0", 1), vehicle("a-longer-name-10", 2)],
            dropped: BTreeMap::from([("unknown_vehicle".into(), 4)]),
            ..DispatchStatus::default()
        };
        let text = text(&end);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4, "{text}");
        assert_eq!(lines[0].find("state"), lines[2].find("done"), "{text}");
        assert!(lines[1].contains("12 of 12") && lines[1].contains("31.5 s"), "{text}");
        assert_eq!(lines[3], "dropped messages: 3 old_header, 4 unknown_vehicle");
    }

    #[test]
    fn a_level_of_a_topic_has_no_separators() {
        assert_eq!(parse_level("acme"), Ok("acme".into()));
        assert!(["", "a/b", "a+", "#", "$sys"].iter().all(|text| parse_level(text).is_err()));
    }
}
