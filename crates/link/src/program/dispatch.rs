//! A master control as a process: vehicles of a warehouse carry out the plan of a scenario, by VDA 5050.

use super::certificates::is_of_this_machine;
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use crate::vda5050::broker::{Broker, BrokerAddress, BrokerEvent};
use crate::vda5050::master::{Master, MasterConfig, Remark};
use crate::vda5050::routes::{FloorFrame, Route, routes};
use chrono::{DateTime, Utc};
use sidestep::kernel::InputError;
use sidestep::planners::DependencyGraph;
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::{WORLDS, robots};
use sidestep_session::Error;
use sidestep_session::fleet::{DispatchJob, JobScenario, LinkMessage};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Time between two reports to the parent process.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// Time for which nothing but messages is looked at.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Time that a broker has to accept the first connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// Time that vehicles have to confirm the end of their orders.
const CANCEL_TIMEOUT: Duration = Duration::from_secs(5);

/// Time that the broker has to send the last messages.
const FAREWELL_TIMEOUT: Duration = Duration::from_secs(2);

/// Lets vehicles carry out the plan of a scenario.
///
/// # Errors
/// When the scenario has no plan, the broker is not there, or vehicles do not go on.
pub(super) fn run(job: &DispatchJob, parent: &ParentMonitor) -> Result<(), Error> {
    let address = BrokerAddress::parse(&job.broker);
    let address = address.map_err(|cause| {
        InputError::new(&job.broker, cause, "correct the address after --vda5050")
    })?;
    if !job.is_insecure && !is_of_this_machine(&address.host) {
        let cause = "the broker is on another machine, and the link to it is not encrypted: whoever reaches it can read \
                     and change all orders";
        let remedy = "use a broker of this machine that is linked to the other one by TLS (a bridge of mosquitto), or, on \
                      a network that you trust, --insecure";
        return Err(InputError::new(&job.broker, cause, remedy).into());
    }
    let fleet = plan(&job.planned)?;
    let now_ms = since_epoch().as_millis();
    let config = MasterConfig {
        interface: job.interface.clone(),
        manufacturer: job.manufacturer.clone(),
        serial_prefix: job.serial_prefix.clone(),
        map_id: job.map_id.clone(),
        floor: fleet.floor,
        // Two runs do not begin in the same millisecond at one broker: vehicles would be in both.
        order_prefix: format!("sidestep-{now_ms:x}"),
        horizon_nodes: job.horizon_nodes,
        silence: Duration::from_secs_f64(job.silence_s),
        resend: Duration::from_secs_f64(job.resend_s),
    };
    let name = format!("{}-{}", config.order_prefix, std::process::id());
    let vehicles = fleet.routes.len();
    let master = Master::new(config, fleet.routes);
    let broker = Broker::connect(&address, &name, master.topics(), vehicles);
    let give_up = job.give_up_s.map(Duration::from_secs_f64);
    Dispatch::new(master, broker, give_up).run(job, parent)
}

/// The routes of a scenario's robots.
struct PlannedFleet {
    routes: Vec<Route>,
    floor: FloorFrame,
}

/// Computes the plan of a scenario.
///
/// # Errors
/// When it has none, or none that vehicles can carry out.
fn plan(planned: &JobScenario) -> Result<PlannedFleet, InputError> {
    let as_given = sidestep_session::read_scenario(&WORLDS, &planned.file, &planned.overrides)?;
    // Another world has no regime, and says so first.
    as_robots(&as_given.0, as_given.1.as_ref())?;
    let mut overrides = planned.overrides.clone();
    // Vehicles err in their own way: what the plan needs is the order of the robots.
    overrides.push("regime=\"reliable\"".to_string());
    let (source, compiled) = sidestep_session::read_scenario(&WORLDS, &planned.file, &overrides)?;
    let robots = as_robots(&source, compiled.as_ref())?;
    let planned = robots.run_plan(&source)?;
    let internal = |cause: String| InputError::new(&source.place, cause, "report this as a bug");
    let graph = DependencyGraph::new(&planned.instance, &planned.plan);
    let graph = graph.map_err(|error| internal(error.to_string()))?;
    let routes = routes(&planned.instance, &planned.plan, &graph).map_err(|error| {
        let remedy = "give conflict_policy = \"random\" or another one than \"simultaneous\": then robots enter only \
                      boxes that are free";
        InputError::new(&source.place, error.to_string(), remedy)
    })?;
    let map = &robots.world.map;
    Ok(PlannedFleet { routes, floor: FloorFrame { box_m: map.box_size_m, plane: map.plane } })
}

/// Returns a scenario of robots.
///
/// # Errors
/// When it is of another world.
fn as_robots<'a>(
    source: &Source,
    compiled: &'a dyn CompiledScenario,
) -> Result<&'a robots::scenario::Compiled, InputError> {
    compiled.as_any().downcast_ref().ok_or_else(|| {
        let cause = format!("the world `{}` has no vehicles on a grid", compiled.world());
        let remedy = "give a scenario with world = \"robots\" and a planner";
        InputError::new(&source.place, cause, remedy)
    })
}

/// A master control and its broker.
struct Dispatch {
    master: Master,
    broker: Broker,
    start: Instant,
    report_at: Duration,
    /// Nodes that all vehicles have reached, and when that number has grown last.
    reached: usize,
    reached_at: Duration,
    give_up: Option<Duration>,
    was_connected: bool,
}

impl Dispatch {
    fn new(master: Master, broker: Broker, give_up: Option<Duration>) -> Self {
        Self {
            master,
            broker,
            start: Instant::now(),
            report_at: Duration::ZERO,
            reached: 0,
            reached_at: Duration::ZERO,
            give_up,
            was_connected: false,
        }
    }

    /// Runs to the end of all routes.
    fn run(mut self, job: &DispatchJob, parent: &ParentMonitor) -> Result<(), Error> {
        let result = self.work(job, parent);
        if !self.master.is_complete() {
            self.cancel();
        }
        let now = self.start.elapsed();
        print_message(&LinkMessage::Dispatch(self.master.status(now)));
        self.broker.disconnect(FAREWELL_TIMEOUT);
        result
    }

    fn work(&mut self, job: &DispatchJob, parent: &ParentMonitor) -> Result<(), Error> {
        while !self.master.is_complete() {
            if parent.has_ended() {
                return Err(Error::Interrupted);
            }
            self.step(job)?;
            let now = self.start.elapsed();
            self.check_progress(now)?;
            if now >= self.report_at {
                self.report_at = now + REPORT_INTERVAL;
                print_message(&LinkMessage::Dispatch(self.master.status(now)));
            }
        }
        Ok(())
    }

    /// Reads what has come, and sends what is to be sent.
    ///
    /// # Errors
    /// When the broker was never there.
    fn step(&mut self, job: &DispatchJob) -> Result<(), Error> {
        let event = self.broker.next(POLL_INTERVAL);
        let now = self.start.elapsed();
        match event {
            Some(BrokerEvent::Connected) => {
                self.was_connected = true;
                tracing::info!("connected to {}", job.broker);
            }
            Some(BrokerEvent::Lost(reason)) if !self.was_connected && now >= CONNECT_TIMEOUT => {
                let remedy =
                    "start a broker there, such as mosquitto, or give its address after --vda5050";
                let cause = format!("no broker has accepted the connection: {reason}");
                return Err(InputError::new(&job.broker, cause, remedy).into());
            }
            Some(BrokerEvent::Lost(reason)) => {
                tracing::warn!("no connection to {}: {reason}", job.broker);
            }
            Some(BrokerEvent::Message { topic, payload }) => {
                self.master.on_message(&topic, &payload, now);
            }
            None => {}
        }
        self.master.on_time(now);
        self.send();
        Ok(())
    }

    fn send(&mut self) {
        let timestamp = timestamp(since_epoch());
        for outgoing in self.master.take_outgoing() {
            let payload = outgoing.message.into_json(&timestamp);
            tracing::debug!(topic = outgoing.topic, "{payload}");
            if !self.broker.publish(&outgoing.topic, payload) {
                tracing::debug!("not sent: {}", outgoing.topic);
            }
        }
        for remark in self.master.take_remarks() {
            log(&remark);
        }
    }

    /// Notes whether anybody goes on.
    ///
    /// # Errors
    /// When nobody has for the time after which the job is given up.
    fn check_progress(&mut self, now: Duration) -> Result<(), Error> {
        let reached = self.master.nodes_reached();
        if reached > self.reached {
            self.reached = reached;
            self.reached_at = now;
        }
        let Some(give_up) = self.give_up.filter(|&time| now - self.reached_at > time) else {
            return Ok(());
        };
        let status = self.master.status(now);
        let open = status.vehicles.iter().filter(|vehicle| !vehicle.is_complete);
        let open: Vec<String> =
            open.map(|vehicle| format!("{} {}", vehicle.serial, vehicle.state)).collect();
        let cause = format!(
            "no vehicle has reached a node for {} s: {}",
            give_up.as_secs_f64(),
            open.join(", ")
        );
        let remedy = "see to these vehicles and start again from where they stand, or give a longer --give-up";
        Err(Error::other(cause, remedy))
    }

    /// Asks vehicles to end their orders, and waits until they have, for a time at most.
    fn cancel(&mut self) {
        let asked = self.start.elapsed();
        self.master.cancel(asked);
        loop {
            self.send();
            let open = self.master.unconfirmed_cancellations();
            if open.is_empty() {
                return;
            }
            let now = self.start.elapsed();
            if now - asked >= CANCEL_TIMEOUT {
                tracing::warn!("have not confirmed the end of their orders: {}", open.join(", "));
                return;
            }
            if let Some(BrokerEvent::Message { topic, payload }) = self.broker.next(POLL_INTERVAL) {
                self.master.on_message(&topic, &payload, now);
            }
            self.master.on_time(now);
        }
    }
}

fn log(remark: &Remark) {
    let Remark { is_warning, serial, text } = remark;
    let name = if serial.is_empty() { String::new() } else { format!("{serial} ") };
    if *is_warning {
        tracing::warn!("{name}{text}");
    } else {
        tracing::info!("{name}{text}");
    }
}

/// Returns the time since 1970. It names orders and stamps messages; nothing is computed with it.
fn since_epoch() -> Duration {
    // A clock before 1970 is wrong anyway.
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

/// Returns a time since 1970 as the standard writes it: ISO 8601, in UTC, with hundredths of a second.
fn timestamp(since_epoch: Duration) -> String {
    let time = DateTime::<Utc>::from(UNIX_EPOCH + since_epoch);
    let hundredths = since_epoch.subsec_millis() / 10;
    format!("{}.{hundredths:02}Z", time.format("%Y-%m-%dT%H:%M:%S"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_in_utc() {
        let written = |seconds, millis: u32| timestamp(Duration::new(seconds, millis * 1_000_000));
        assert_eq!(written(0, 0), "1970-01-01T00:00:00.00Z");
        assert_eq!(written(951_782_399, 129), "2000-02-28T23:59:59.12Z");
        assert_eq!(written(951_782_400, 0), "2000-02-29T00:00:00.00Z");
        assert_eq!(written(1_767_225_599, 999), "2025-12-31T23:59:59.99Z");
        assert_eq!(written(4_107_542_400, 0), "2100-03-01T00:00:00.00Z");
    }
}
