//! A convoy: a leader on wheels and its followers, without a scenario, a tick at a time.
//!
//! It is a world of one chain that is simulated as every other (`act/`); a tick is a cycle. This module
//! holds its design, and measures of its run.

mod stats;
#[cfg(test)]
mod tests;

pub use stats::ConvoyStats;

use super::driver::{Task, TaskKind};
use super::formation::Robots;
use super::metrics::ChainTally;
use super::motion::recovery::RecoveryLimits;
use super::navigate::{NavigationGoal, Navigator};
use super::scenario::{ChainScenario, RecordSection};
use super::swarm::follower::speed_fraction;
use super::swarm::leader::{Layer, LeaderState};
use super::swarm::{DifferentialDrive, Follower, Leader, Pose2};
use super::world::{ChainSpec, ChainWorld};
use super::world_impl::ChainRun;
use crate::deploy::deployment::Deployment;
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed, Simulation};
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Chain, Connector, Obstacles, Rod, Rules};
use sidestep_scenario::Source;
use std::sync::Arc;

/// Distance up to which gaps are measured, meters.
const SEARCH_RANGE_M: f64 = 1.0;

/// The design of a convoy.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvoyConfig {
    /// Behavior of the first robot.
    pub leader: Leader,
    /// Its wheels.
    pub drive: DifferentialDrive,
    /// Behavior of the others.
    pub follower: Follower,
    /// Number of the others.
    pub followers: usize,
    /// Distances that neighbors keep.
    pub rod: Rod,
    /// Amount by which the followers' connectors are larger than their bodies, meters.
    pub margin_m: f64,
    /// Lag of a follower at which the leader stops, meters; from half of it on the leader slows
    /// down. Infinite for a leader that never waits.
    pub lag_limit_m: f64,
    /// Rules by which the chain reacts.
    pub rules: Rules,
    /// Length of a tick, s.
    pub dt_s: f64,
}

impl ConvoyConfig {
    /// Returns the convoy of the slides: robots of radius 0.25 m on wheels 0.4 m apart, 0.6 to 0.8
    /// m behind each other, connectors 0.08 m larger, wheels 20 % faster than the leader's.
    ///
    /// # Errors
    /// When the speed is not above 0.
    pub fn new(followers: usize, speed_m_s: f64) -> Result<Self, InputError> {
        Ok(Self {
            leader: Leader::new(speed_m_s)?,
            drive: DifferentialDrive::new(0.4, speed_m_s)?,
            follower: Follower::new(DifferentialDrive::new(0.4, 1.2 * speed_m_s)?, 0.25)?,
            followers,
            rod: Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 },
            margin_m: 0.08,
            lag_limit_m: 0.15,
            rules: Rules::default(),
            dt_s: 0.02,
        })
    }
}

/// The surroundings of a convoy.
#[derive(Debug, Clone, Default)]
pub struct ConvoySurroundings {
    /// The obstacle in its way.
    pub obstacles: Obstacles<2>,
    /// The place that its leader goes to, if any.
    pub target: Option<Point<2>>,
    /// Random seed of the laser's errors.
    pub seed: u64,
}

/// A moving convoy.
#[derive(Debug)]
pub struct Convoy {
    plan: ConvoyConfig,
    run: ChainRun<2>,
    /// The chain and its robots after the last tick, the leader first.
    chain: Chain<2>,
    robots: Vec<Pose2>,
    /// Connectors before the last tick, and the counts after it.
    before: Vec<Point<2>>,
    tally: ChainTally,
}

/// Results of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickResult {
    /// The leader's layer that acted.
    pub layer: Layer,
    /// The part of its speed to which followers slow the leader down; 1 for all of it.
    pub pace: f64,
    /// Whether the chain objected to the leader's way.
    pub is_vetoed: bool,
    /// Followers that were held back by their sensors.
    pub held: usize,
    /// Followers with a pressed bumper.
    pub bumped: usize,
}

impl Convoy {
    /// Returns a convoy that stands in line behind its leader, rods at their greatest length.
    ///
    /// # Errors
    /// As [`Chain::new`] and [`Leader::check`]; also when a tick is out of range.
    pub fn new(
        plan: ConvoyConfig,
        start: Pose2,
        around: ConvoySurroundings,
    ) -> Result<Self, InputError> {
        plan.check()?;
        let chain = plan.chain_behind(start)?;
        let compiled = ChainScenario {
            world: Arc::new(plan.world(chain.clone(), around)),
            name: String::new(),
            seed: 0,
            cycles: u64::MAX,
            record: RecordSection::default(),
            recipe: None,
        };
        let run = compiled.start(&Source::new("convoy", "", ""), 1);
        run.state().body_mut(0).driving.leader = Some(LeaderState::new(start));
        let robots = vec![start; plan.followers + 1];
        let mut convoy =
            Self { plan, run, chain, robots, before: Vec::new(), tally: ChainTally::default() };
        convoy.read_positions();
        Ok(convoy)
    }

    /// Returns the chain that the robots keep to.
    pub fn chain(&self) -> &Chain<2> {
        &self.chain
    }

    /// Returns the pose of the first robot.
    pub fn leader(&self) -> Pose2 {
        self.robots[0]
    }

    /// Returns the other robots; robot `i` keeps to connector `i + 1`.
    pub fn followers(&self) -> &[Pose2] {
        &self.robots[1..]
    }

    /// Returns the positions of the connectors before the last tick; empty before the first.
    pub fn previous_points(&self) -> &[Point<2>] {
        &self.before
    }

    /// Returns its design.
    pub fn config(&self) -> &ConvoyConfig {
        &self.plan
    }

    /// Makes one tick.
    pub fn tick(&mut self) -> TickResult {
        let (was, pace) = (self.tally.clone(), self.leader_speed_fraction());
        self.before.clear();
        self.before.extend_from_slice(self.chain.points());
        self.run.advance(1);
        self.read_positions();
        let is = &self.tally;
        let acted = is.layers.iter().zip(&was.layers).position(|(is, was)| is > was);
        let vetoes = |tally: &ChainTally| tally.vetoes.iter().sum::<u64>();
        TickResult {
            layer: Layer::ALL[acted.unwrap_or_default()],
            pace,
            is_vetoed: vetoes(is) > vetoes(&was),
            held: (is.robots.held_steps - was.robots.held_steps) as usize,
            bumped: (is.robots.bumper_steps - was.robots.bumper_steps) as usize,
        }
    }

    /// Reads the places of all robots.
    fn read_positions(&mut self) {
        let body = self.run.state().body(0);
        self.chain.points_mut().copy_from_slice(body.chain.points());
        self.tally.clone_from(&body.tally);
        for (pose, robot) in self.robots.iter_mut().zip(&body.robots) {
            *pose = robot.pose;
        }
        if let Some(leader) = &body.driving.leader {
            self.robots[0] = leader.pose;
        }
    }

    /// Returns the part of its speed at which the leader may go in the next tick.
    fn leader_speed_fraction(&self) -> f64 {
        let lags_m = self.robots[1..].iter().zip(&self.chain.points()[1..]);
        let worst_m = lags_m.map(|(f, at)| distance(f.at, *at)).fold(0.0, f64::max);
        speed_fraction(worst_m, self.plan.lag_limit_m)
    }
}

impl ConvoyConfig {
    fn check(&self) -> Result<(), InputError> {
        self.leader.check()?;
        if self.lag_limit_m.is_nan() || self.lag_limit_m <= 0.0 {
            let cause = format!("is {} m", self.lag_limit_m);
            return Err(InputError::new("lag limit", cause, "give more than 0, or infinity"));
        }
        if !(self.dt_s > 0.0 && self.dt_s <= 1.0) {
            let cause = format!("takes {} s", self.dt_s);
            return Err(InputError::new("tick", cause, "give more than 0, up to 1 s"));
        }
        Ok(())
    }

    /// Returns the chain behind a leader.
    fn chain_behind(&self, start: Pose2) -> Result<Chain<2>, InputError> {
        let radius_m = self.follower.ring.radius_m;
        // The leader is exactly at its connector, so that needs no margin.
        let mut connectors = vec![Connector::free(radius_m + self.margin_m); self.followers + 1];
        connectors[0] = Connector::free(radius_m);
        let back = [-cos(start.heading_rad), -sin(start.heading_rad)];
        let at = |i: usize| {
            let behind_m = self.rod.max_m * i as f64;
            [start.at[0] + back[0] * behind_m, start.at[1] + back[1] * behind_m]
        };
        Chain::new(
            (0..=self.followers).map(at).collect(),
            connectors,
            vec![self.rod; self.followers],
        )
    }

    /// Returns the world of the convoy.
    fn world(&self, start: Chain<2>, around: ConvoySurroundings) -> ChainWorld<2> {
        // A target is never reached, because the tick says nothing of it.
        let goal = around.target.map(|at| NavigationGoal::Target { at, tolerance_m: 0.0 });
        let navigator = Navigator { leader: self.leader.clone(), drive: self.drive, goal };
        let task = Task {
            agent: 0,
            speed_m_s: self.leader.speed_m_s,
            driver: TaskKind::Navigate(Arc::new(navigator)),
            lasts_s: f64::INFINITY,
            patience_s: f64::INFINITY,
            plans_after_s: None,
        };
        let spec = ChainSpec {
            name: String::new(),
            start,
            tasks: vec![task],
            changes: Vec::new(),
            arm: None,
            robots: Some(Robots { follower: self.follower, lag_limit_m: self.lag_limit_m }),
        };
        ChainWorld {
            chains: Arc::new(vec![spec]),
            obstacles: Arc::new(around.obstacles),
            movers: Arc::default(),
            dt_s: self.dt_s,
            cycles: u64::MAX,
            rules: self.rules,
            escape: None,
            rungs: RecoveryLimits::default(),
            look_m: SEARCH_RANGE_M,
            streams: Streams::new(Seed(around.seed)),
            teams: Arc::default(),
            deployment: Deployment::Direct,
            network: None,
            fingerprint: 0,
        }
    }
}
