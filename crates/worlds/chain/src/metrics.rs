//! Metrics of a run.

use super::agents::traffic::NetworkTraffic;
use super::motion::escape::EscapeReport;
use super::motion::recovery::RecoveryOutcome;
use super::swarm::follower::FollowResult;
use serde::{Deserialize, Serialize};
use sidestep_arms::Arm;
use sidestep_arms::motion::JointRates;
use sidestep_kernel::EntityId;
use sidestep_rods::{CompletedMotion, VetoReason};
use sidestep_scenario::metrics;
use std::collections::BTreeMap;

/// Depth in an obstacle beyond which a part counts as a penetration, meters: far more than the tolerance of the rules,
/// 1e-9, and far less than anything that a user would see.
pub const PENETRATION_THRESHOLD_M: f64 = 1e-6;

/// Counts for one chain that a run keeps beside its state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChainTally {
    /// Cycles in which the chain could act.
    pub steps: u64,
    /// Vetoes that drivers received, by [`VetoReason::ALL`].
    pub vetoes: [u64; VetoReason::ALL.len()],
    /// Steps at whose end some part was in an obstacle, or in another part of the chain,
    pub penetrations: u64,
    /// how many in a row ended so up to the last step,
    pub inside_steps: u64,
    /// and the most that ever did.
    pub longest_inside_steps: u64,
    /// Whether parts got out of the way in the last step.
    pub is_escaping: bool,
    /// Least distance of any part from obstacles, meters; infinite if none came near.
    pub min_clearance_m: f64,
    /// Least gap between parts of the chain that share no joint, while they are solid to each other,
    /// meters; negative where they overlapped, infinite if none came near.
    pub min_own_gap_m: f64,
    /// Depth of the deepest overlap of two parts of the chain when it was last measured, meters.
    pub own_depth_m: f64,
    /// Greatest amount by which a rod was outside its limits while the chain was whole, meters.
    pub max_rod_violation_m: f64,
    /// Longest distance that a connector other than the initiator moved in one sub-step, meters.
    pub max_slave_step_m: f64,
    /// Greatest speed of any connector, m/s.
    pub max_speed_m_s: f64,
    /// Greatest rates of each joint of an arm, from base to tip; none of other chains.
    pub joint_peaks: Vec<JointPeaks>,
    /// Distance traveled by its initiators, meters.
    pub way_m: f64,
    /// Rods turned to avoid something.
    pub rotations: u64,
    /// Connectors moved, summed over the sub-steps.
    pub moved: u64,
    /// Tasks done, targets reached.
    pub done: u64,
    /// Tasks and targets that were given up.
    pub given_up: Vec<AbandonedSubtask>,
    /// Number of times that broken parts were joined again,
    pub reformed: u64,
    /// and that they could not be.
    pub not_reformed: u64,
    /// Greatest number of parts that were missing then.
    pub missing_parts: u64,
    /// Steps in which each layer of a navigator acted, layer 1 first.
    pub layers: [u64; 6],
    /// Counts for the robots on wheels.
    pub robots: RobotTally,
    /// Rungs by which initiators continued after vetoes.
    pub rungs: RungTally,
    /// Counts of parts that got out of the way.
    pub escapes: EscapeTally,
    /// Packets between its agents,
    pub messages: u64,
    /// their bytes,
    pub bytes: u64,
    /// and packets that came and made no sense.
    pub dropped: u64,
    /// Number of times that a connector was no longer heard,
    pub contacts_lost: u64,
    /// and that time was up before the leader had finished.
    pub deadlines_missed: u64,
    /// Steps in which the chain stood because of that.
    pub stood: u64,
}

/// The greatest rates of a joint, in rad or m per s, s2 and s3: differences of its values in successive cycles.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct JointPeaks {
    /// Greatest speed.
    pub max_speed: f64,
    /// Greatest acceleration.
    pub max_acceleration: f64,
    /// Greatest jerk.
    pub max_jerk: f64,
}

metrics! {
    /// Number of climbs that each rung of the ladder ended.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
    pub struct RungTally in "rungs." {
        /// Climbs that ended with shorter steps.
        pub shorter: u64 => "vetoes overcome by shorter steps",
        /// Climbs that ended with another heading.
        pub sideways: u64 => "vetoes overcome by another heading",
        /// Climbs that ended with a turn on the spot.
        pub turned: u64 => "vetoes overcome by a turn on the spot",
        /// Cycles waited.
        pub waited: u64 => "time waited" ("cycles"),
        /// Cycles in which the other end led.
        pub pulled_back: u64 => "time pulled back" ("cycles"),
        /// Climbs without success.
        pub stuck: u64 => "vetoes not overcome",
        /// Ways planned after local rules came no nearer.
        pub planned: u64 => "ways planned",
        /// Plans for which no way was found.
        pub not_planned: u64 => "plans without a way",
    }
}

impl RungTally {
    /// Counts a climb; one without a veto, or of an operator, is on no rung.
    pub(super) fn record<const D: usize>(&mut self, climbed: &RecoveryOutcome<D>) {
        let rung = match climbed {
            RecoveryOutcome::Straight(_) | RecoveryOutcome::Vetoed(_) => return,
            RecoveryOutcome::Shorter { .. } => &mut self.shorter,
            RecoveryOutcome::Sideways { .. } => &mut self.sideways,
            RecoveryOutcome::TurnOnTheSpot { .. } => &mut self.turned,
            RecoveryOutcome::Waiting { .. } => &mut self.waited,
            RecoveryOutcome::PulledBack { .. } => &mut self.pulled_back,
            RecoveryOutcome::Stuck { .. } => &mut self.stuck,
        };
        *rung += 1;
    }

    fn add(self, other: &Self) -> Self {
        Self {
            shorter: self.shorter + other.shorter,
            sideways: self.sideways + other.sideways,
            turned: self.turned + other.turned,
            waited: self.waited + other.waited,
            pulled_back: self.pulled_back + other.pulled_back,
            stuck: self.stuck + other.stuck,
            planned: self.planned + other.planned,
            not_planned: self.not_planned + other.not_planned,
        }
    }
}

metrics! {
    /// Results of getting out of the way.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
    pub struct EscapeTally in "escapes." {
        /// Moves of parts out of the way of something.
        pub moves: u64 => "moves out of the way",
        /// Vetoes against such moves.
        pub vetoes: u64 => "vetoes against moves out of the way",
        /// Vetoes against moves out of the way that were due to the speed limit alone.
        pub capped: u64 => "moves too slow for the speed limit",
    }
}

impl EscapeTally {
    pub(super) fn add<const D: usize>(&mut self, escaped: &EscapeReport<D>) {
        self.moves += escaped.moves as u64;
        self.vetoes += escaped.vetoes as u64;
        self.capped += escaped.capped as u64;
    }

    fn sum_with(self, other: &Self) -> Self {
        Self {
            moves: self.moves + other.moves,
            vetoes: self.vetoes + other.vetoes,
            capped: self.capped + other.capped,
        }
    }
}

/// Counts for robots that keep to connectors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobotTally {
    /// One for each robot and cycle.
    pub steps: u64,
    /// Times that a bumper was pressed,
    pub bumper_events: u64,
    /// and steps with a pressed bumper.
    pub bumper_steps: u64,
    /// Steps in which sensors slowed a robot down.
    pub held_steps: u64,
    /// Distances from their connectors, summed over steps, meters,
    pub lag_sum_m: f64,
    /// and the greatest.
    pub max_lag_m: f64,
    /// Least gap between a body and anything else, up to 1 m, meters.
    pub min_gap_m: f64,
}

impl Default for RobotTally {
    fn default() -> Self {
        Self {
            steps: 0,
            bumper_events: 0,
            bumper_steps: 0,
            held_steps: 0,
            lag_sum_m: 0.0,
            max_lag_m: 0.0,
            min_gap_m: 1.0,
        }
    }
}

impl RobotTally {
    /// Counts a step of a robot that ended `lag_m` from its connector.
    pub(crate) fn record(&mut self, followed: &FollowResult, lag_m: f64) {
        self.steps += 1;
        self.lag_sum_m += lag_m;
        self.max_lag_m = self.max_lag_m.max(lag_m);
        self.held_steps += u64::from(followed.is_held);
        self.bumper_steps += u64::from(followed.is_bumped);
        self.min_gap_m = self.min_gap_m.min(followed.gap_m);
    }

    fn add(self, other: &Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            bumper_events: self.bumper_events + other.bumper_events,
            bumper_steps: self.bumper_steps + other.bumper_steps,
            held_steps: self.held_steps + other.held_steps,
            lag_sum_m: self.lag_sum_m + other.lag_sum_m,
            max_lag_m: self.max_lag_m.max(other.max_lag_m),
            min_gap_m: self.min_gap_m.min(other.min_gap_m),
        }
    }
}

impl ChainTally {
    /// Adds a motion that the chain has followed.
    pub(crate) fn add_motion<const D: usize>(&mut self, moved: &CompletedMotion<D>) {
        self.rotations += moved.rotated as u64;
        self.moved += moved.changed as u64;
        self.max_slave_step_m = self.max_slave_step_m.max(moved.max_slave_step_m);
    }

    /// Records the rates of an arm's joints in a cycle.
    pub(crate) fn add_joint_rates(&mut self, rates: &[JointRates]) {
        self.joint_peaks.resize(rates.len(), JointPeaks::default());
        for (peaks, rates) in self.joint_peaks.iter_mut().zip(rates) {
            peaks.max_speed = peaks.max_speed.max(rates.speed);
            peaks.max_acceleration = peaks.max_acceleration.max(rates.acceleration);
            peaks.max_jerk = peaks.max_jerk.max(rates.jerk);
        }
    }

    pub(crate) fn add_network_traffic(&mut self, traffic: NetworkTraffic) {
        self.messages += traffic.messages;
        self.bytes += traffic.bytes;
        self.dropped += traffic.dropped;
    }

    /// Returns the gap of the own body below which it matters how large it is, in meters: an overlap counts in each cycle
    /// that it lasts, a gap only if it is the least so far. Beyond `look_m` nothing is looked for.
    pub(crate) fn own_gap_to_find_m(&self, look_m: f64) -> f64 {
        self.min_own_gap_m.min(look_m).max(0.0)
    }

    /// Takes the gap of the own body in a cycle, in meters, negative where parts overlap: the least of the run, and the
    /// depth of an overlap now.
    pub(crate) fn add_own_gap(&mut self, gap_m: f64) {
        self.min_own_gap_m = self.min_own_gap_m.min(gap_m);
        self.own_depth_m = (-gap_m).max(0.0);
    }

    /// Counts a step that left a part in an obstacle, or none; returns whether that is news.
    pub(crate) fn record_inside(&mut self, is_inside: bool) -> bool {
        let was_inside = self.inside_steps > 0;
        self.penetrations += u64::from(is_inside);
        self.inside_steps = if is_inside { self.inside_steps + 1 } else { 0 };
        self.longest_inside_steps = self.longest_inside_steps.max(self.inside_steps);
        is_inside != was_inside
    }

    /// Counts every veto, also those that are no events of their own.
    pub(crate) fn add_veto(&mut self, reason: VetoReason) {
        self.vetoes[reason.number()] += 1;
    }
}

impl Default for ChainTally {
    fn default() -> Self {
        Self {
            steps: 0,
            vetoes: [0; VetoReason::ALL.len()],
            penetrations: 0,
            inside_steps: 0,
            longest_inside_steps: 0,
            is_escaping: false,
            min_clearance_m: f64::INFINITY,
            min_own_gap_m: f64::INFINITY,
            own_depth_m: 0.0,
            max_rod_violation_m: 0.0,
            max_slave_step_m: 0.0,
            max_speed_m_s: 0.0,
            joint_peaks: Vec::new(),
            way_m: 0.0,
            rotations: 0,
            moved: 0,
            done: 0,
            given_up: Vec::new(),
            reformed: 0,
            not_reformed: 0,
            missing_parts: 0,
            layers: [0; 6],
            robots: RobotTally::default(),
            rungs: RungTally::default(),
            escapes: EscapeTally::default(),
            messages: 0,
            bytes: 0,
            dropped: 0,
            contacts_lost: 0,
            deadlines_missed: 0,
            stood: 0,
        }
    }
}

/// A motion or target that an initiator gave up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AbandonedSubtask {
    /// Number of the task, from 0.
    pub task: u32,
    /// The motion of its script, or the target.
    pub part: u32,
    /// Smallest distance from the initiator to it, meters.
    pub nearest_m: f64,
    /// Part of the task that is left undone because of it, 0 to 1.
    pub undone: f64,
    /// The last connector that objected, if any,
    pub by: Option<u32>,
    /// and the reason.
    pub reason: Option<String>,
}

metrics! {
    /// Metrics of a run. The names of the first seven are fixed, because scripts of users rely on them.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct Metrics {
        /// Cycles of all chains, summed.
        pub steps: u64 => "steps",
        /// Vetoes that initiators received.
        pub vetoes: u64 => "vetoes",
        /// Steps at whose end some part was deeper than 1e-6 m in an obstacle, or in another part of its chain (of
        /// chains of more than 32 rods: by a measurement in every 16th cycle, of more than 1,024 more rarely).
        pub penetrations: u64 => "steps inside an obstacle or its own body",
        /// Least distance of any part from obstacles; none if nothing came near. In meters.
        pub min_clearance_m: Option<f64> => "least clearance",
        /// Greatest amount by which a rod was outside its limits. In meters.
        pub max_rod_violation_m: f64 => "greatest error of a rod",
        /// Share of their tasks that the chains have done, 0 to 1, on average. See
        /// [`super::world::ChainWorld::progress`].
        pub progress: f64 => "share of the tasks done",
        /// Steps per second of processor time; measured. Processor time is that of the run of this process.
        pub steps_per_cpu_s: f64 => "speed of simulation",
        /// Vetoes by reason. Reasons that did not occur are left out.
        pub vetoes_by_reason.*: BTreeMap<&'static str, u64> => "vetoes because of *",
        /// Rods turned to avoid something.
        pub rotations: u64 => "rods turned",
        /// Connectors moved per step, summed over sub-steps.
        pub moved_per_step: f64 => "connectors moved per step",
        /// Longest way of a connector that does not lead, in one sub-step. In meters.
        pub max_slave_step_m: f64 => "longest way of a follower in a sub-step",
        /// Greatest speed of any connector. In meters per second.
        pub max_speed_m_s: f64 => "greatest speed",
        /// Most steps in a row at whose ends some part of one chain was deeper than 1e-6 m in an obstacle, or in
        /// another of its parts.
        pub longest_inside_steps: u64 => "steps inside in a row, at most",
        /// Least gap between parts of a chain that share no joint (of more than 32 rods: in every 16th cycle, of
        /// more than 1,024 more rarely); below 0 where they overlapped; none if none came near. In meters, while they
        /// are solid to each other.
        pub min_own_gap_m: Option<f64> => "least distance of own parts",
        /// Tasks done, targets reached.
        pub done: u64 => "tasks done",
        /// Times that broken parts were joined again.
        pub reformed: u64 => "parts joined again",
        /// Times that broken parts could not be joined again. The gap was too long, or no way was found.
        pub not_reformed: u64 => "parts not joined again",
        /// Greatest number of parts that were missing when parts could not be joined. Of each chain the most, summed.
        pub missing_parts: u64 => "missing parts",
        /// Motions and targets that were given up, by chain, with who objected and why.
        pub given_up: Vec<ChainAbandonedSubtask> => "tasks given up",
        /// Rungs by which initiators continued after vetoes.
        pub rungs: RungTally,
        /// Counts of parts that got out of the way.
        pub escapes: EscapeTally,
        /// Packets between the agents of connectors; 0 where one process moves the chains.
        pub messages: u64 => "messages",
        /// Bytes of these packets.
        pub bytes: u64 => "size of all messages" ("bytes"),
        /// Packets that came and were dropped, because they made no sense.
        pub dropped: u64 => "messages that made no sense",
        /// Times that a connector was no longer heard by a neighbor.
        pub contacts_lost: u64 => "contacts lost",
        /// Times that time was up before a leader had finished.
        pub deadlines_missed: u64 => "deadlines missed",
        /// Steps in which a chain stood because a connector was lost, or time was up.
        pub stood: u64 => "time stood for the network" ("cycles"),
        /// Metrics of robots on wheels, if there are any.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub robots: Option<RobotMetrics>,
        /// Metrics of the joints of arms, if there are any.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub arms: Option<ArmMetrics>,
    }
}

metrics! {
    /// Metrics of the joints of all arms. Each joint is compared with its own limit.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct ArmMetrics in "arms." {
        /// Greatest speed of a joint, divided by its limit.
        pub max_speed_ratio: f64 => "greatest speed of a joint by its limit",
        /// Greatest acceleration of a joint, divided by its limit.
        pub max_acceleration_ratio: f64 => "greatest acceleration of a joint by its limit",
        /// Greatest jerk of a joint, divided by its limit.
        pub max_jerk_ratio: f64 => "greatest jerk of a joint by its limit",
    }
}

impl ArmMetrics {
    /// Returns the metrics of the arms among the chains; none if there are none.
    pub(super) fn from_tallies<'a>(
        arms: impl Iterator<Item = (&'a Arm, &'a ChainTally)>,
    ) -> Option<Self> {
        let mut all: Option<Self> = None;
        for (arm, tally) in arms {
            let all = all.get_or_insert(Self {
                max_speed_ratio: 0.0,
                max_acceleration_ratio: 0.0,
                max_jerk_ratio: 0.0,
            });
            for (peaks, limits) in tally.joint_peaks.iter().zip(arm.motion.rates()) {
                let speed = peaks.max_speed / limits.speed;
                let acceleration = peaks.max_acceleration / limits.acceleration;
                let jerk = peaks.max_jerk / limits.jerk;
                all.max_speed_ratio = all.max_speed_ratio.max(speed);
                all.max_acceleration_ratio = all.max_acceleration_ratio.max(acceleration);
                all.max_jerk_ratio = all.max_jerk_ratio.max(jerk);
            }
        }
        all
    }
}

metrics! {
    /// Metrics of the robots on wheels of all swarms.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct RobotMetrics in "robots." {
        /// Times that a bumper was pressed.
        pub bumper_events: u64 => "bumpers pressed",
        /// Share of all robots' steps with a pressed bumper, 0 to 1.
        pub bumper_part: f64 => "share of time with a pressed bumper",
        /// Share of all steps in which sensors slowed a robot down, 0 to 1.
        pub held_part: f64 => "share of time held back by sensors",
        /// Mean distance of robots from their connectors. In meters.
        pub mean_lag_m: f64 => "mean lag of robots behind their connectors",
        /// Greatest distance of a robot from its connector. In meters.
        pub max_lag_m: f64 => "greatest lag of a robot",
        /// Least gap between a body and anything else, up to 1 m. In meters.
        pub min_gap_m: f64 => "least gap around robots",
    }
}

impl RobotMetrics {
    fn from_tally(tally: &RobotTally) -> Self {
        let steps = tally.steps.max(1) as f64;
        Self {
            bumper_events: tally.bumper_events,
            bumper_part: tally.bumper_steps as f64 / steps,
            held_part: tally.held_steps as f64 / steps,
            mean_lag_m: tally.lag_sum_m / steps,
            max_lag_m: tally.max_lag_m,
            min_gap_m: tally.min_gap_m,
        }
    }
}

/// A motion or target that a chain's initiator gave up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainAbandonedSubtask {
    /// Id of the chain.
    pub chain: EntityId,
    /// What it gave up, and why.
    #[serde(flatten)]
    pub what: AbandonedSubtask,
}

/// What a run reports about one chain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainMetrics {
    /// Its place among all chains, copies included, from 0.
    pub chain: EntityId,
    /// Its name; may be empty.
    pub name: String,
    /// See [`Metrics::progress`].
    pub progress: f64,
    /// Joint values of an arm, rad or m, by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints: Option<BTreeMap<String, f64>>,
    /// Highest rates that its joints may have, by joint from base to tip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_limits: Option<Vec<JointLimits>>,
    /// Its counts, beside these in one object.
    #[serde(flatten)]
    pub tally: ChainTally,
}

/// The limits of a joint's rates, in rad or m per s, s2 and s3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointLimits {
    /// Name of the joint.
    pub name: String,
    /// Highest speed.
    pub speed: f64,
    /// Highest acceleration.
    pub acceleration: f64,
    /// Highest jerk.
    pub jerk: f64,
}

impl Metrics {
    /// Sums the tallies of the chains, of which some have robots on wheels or none; `progress` has one entry per chain.
    pub(super) fn from_tallies(
        tallies: &[ChainTally],
        has_robots: bool,
        progress: &[f64],
        cpu_s: f64,
        timed_steps: u64,
    ) -> Self {
        let steps = sum_over_chains(tallies, |t| t.steps);
        let robots = tallies.iter().fold(RobotTally::default(), |all, t| all.add(&t.robots));
        let vetoes_of = |index: usize| tallies.iter().map(|t| t.vetoes[index]).sum();
        let names = VetoReason::ALL.iter().map(|reason| reason.name());
        // Collected at once: series ask for the metrics a thousand times in a run.
        let vetoes_by_reason: BTreeMap<&str, u64> =
            names.enumerate().map(|(index, name)| (name, vetoes_of(index))).collect();
        Self {
            steps,
            vetoes: vetoes_by_reason.values().sum(),
            penetrations: sum_over_chains(tallies, |t| t.penetrations),
            min_clearance_m: min_over_chains(tallies, |t| t.min_clearance_m),
            max_rod_violation_m: max_over_chains(tallies, |t| t.max_rod_violation_m),
            progress: progress.iter().sum::<f64>() / progress.len().max(1) as f64,
            steps_per_cpu_s: timed_steps as f64 / cpu_s.max(1e-9),
            vetoes_by_reason,
            rotations: sum_over_chains(tallies, |t| t.rotations),
            moved_per_step: sum_over_chains(tallies, |t| t.moved) as f64 / steps.max(1) as f64,
            max_slave_step_m: max_over_chains(tallies, |t| t.max_slave_step_m),
            max_speed_m_s: max_over_chains(tallies, |t| t.max_speed_m_s),
            longest_inside_steps: tallies.iter().map(|t| t.longest_inside_steps).max().unwrap_or(0),
            min_own_gap_m: min_over_chains(tallies, |t| t.min_own_gap_m),
            done: sum_over_chains(tallies, |t| t.done),
            reformed: sum_over_chains(tallies, |t| t.reformed),
            not_reformed: sum_over_chains(tallies, |t| t.not_reformed),
            missing_parts: sum_over_chains(tallies, |t| t.missing_parts),
            given_up: abandoned_subtasks(tallies),
            rungs: tallies.iter().fold(RungTally::default(), |all, t| all.add(&t.rungs)),
            escapes: tallies.iter().fold(EscapeTally::default(), |all, t| all.sum_with(&t.escapes)),
            messages: sum_over_chains(tallies, |t| t.messages),
            bytes: sum_over_chains(tallies, |t| t.bytes),
            dropped: sum_over_chains(tallies, |t| t.dropped),
            contacts_lost: sum_over_chains(tallies, |t| t.contacts_lost),
            deadlines_missed: sum_over_chains(tallies, |t| t.deadlines_missed),
            stood: sum_over_chains(tallies, |t| t.stood),
            robots: has_robots.then(|| RobotMetrics::from_tally(&robots)),
            arms: None,
        }
    }
}

fn abandoned_subtasks(tallies: &[ChainTally]) -> Vec<ChainAbandonedSubtask> {
    let mut parts = Vec::new();
    for (chain, tally) in (0..).zip(tallies) {
        for what in tally.given_up.iter().cloned() {
            parts.push(ChainAbandonedSubtask { chain, what });
        }
    }
    parts
}

fn sum_over_chains(tallies: &[ChainTally], count: fn(&ChainTally) -> u64) -> u64 {
    tallies.iter().map(count).sum()
}

fn max_over_chains(tallies: &[ChainTally], value: fn(&ChainTally) -> f64) -> f64 {
    tallies.iter().map(value).fold(0.0, f64::max)
}

/// Returns the least value; none if no chain has one, which is infinite then.
fn min_over_chains(tallies: &[ChainTally], value: fn(&ChainTally) -> f64) -> Option<f64> {
    let least = tallies.iter().map(value).fold(f64::INFINITY, f64::min);
    Some(least).filter(|m| m.is_finite())
}
