//! A leader and its followers, a tick at a time.
//!
//! Each tick the leader perceives, decides and proposes where its wheels would take it; the chain
//! moves there or objects. Then every follower steers toward its own connector. All perceive the
//! robots as they were before the tick.
//!
//! A connector that is pulled round a sharp corner goes up to three times as fast as the leader,
//! which wheels cannot. A follower that is late cuts the corner and hangs on it. So each tells the
//! robot before it how late it is, as it would tell a veto, and the leader slows down.

use super::drive::{Drive, Pose};
use super::follower::{Follower, Goal};
use super::laser::{Body, Scan};
use super::leader::{Layer, Leader, LeaderState, Surroundings};
use crate::rods::geometry::{Point, distance, scaled, sub};
use crate::rods::veto::{Mode, Motion, Request, Source, Veto};
use crate::rods::{Chain, Connector, Obstacles, Propagator, Rod, Rules};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::stream::Draws;

/// What a convoy is.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// How the first robot behaves.
    pub leader: Leader,
    /// Its wheels.
    pub drive: Drive,
    /// How the others behave.
    pub follower: Follower,
    /// How many others there are.
    pub followers: usize,
    /// The distances that neighbors keep.
    pub rod: Rod,
    /// By how much followers' connectors are larger than their bodies.
    pub margin_m: f64,
    /// The leader slows down from half this distance of a follower from its connector on, and
    /// stands when it is reached; infinite for a leader that does not care.
    pub lag_limit_m: f64,
    /// How the chain reacts.
    pub rules: Rules,
    /// Length of a tick.
    pub dt_s: f64,
}

impl Plan {
    /// The convoy of the slides: robots of radius 0.25 m on wheels 0.4 m apart, 0.6 to 0.8 m
    /// behind each other, connectors 0.08 m larger, wheels 20 % faster than the leader's.
    ///
    /// # Errors
    /// A speed that is not above 0.
    pub fn new(followers: usize, speed_m_s: f64) -> Result<Self, InputError> {
        Ok(Self {
            leader: Leader::new(speed_m_s)?,
            drive: Drive::new(0.4, speed_m_s)?,
            follower: Follower::new(Drive::new(0.4, 1.2 * speed_m_s)?, 0.25)?,
            followers,
            rod: Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 },
            margin_m: 0.08,
            lag_limit_m: 0.15,
            rules: Rules::default(),
            dt_s: 0.02,
        })
    }
}

/// What part of its speed a leader may go whose latest follower is so far from its connector: it
/// slows down from half the limit on.
pub(crate) fn pace(worst_lag_m: f64, limit_m: f64) -> f64 {
    (2.0 - 2.0 * worst_lag_m / limit_m).clamp(0.0, 1.0)
}

/// A convoy on its way.
#[derive(Debug, Clone)]
pub struct Convoy {
    plan: Plan,
    chain: Chain<2>,
    propagator: Propagator<2>,
    leader: LeaderState,
    followers: Vec<Pose>,
    scan: Scan,
    /// Connectors before the tick, and bodies of the followers.
    before: Vec<Point<2>>,
    bodies: Vec<Body>,
}

/// What happened in a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// The leader's layer that acted.
    pub layer: Layer,
    /// The part of its speed to which followers slow the leader down; 1 for all of it.
    pub pace: f64,
    /// The chain's objection to the leader's way.
    pub veto: Option<Veto<2>>,
    /// Followers that were held back by their sensors.
    pub held: usize,
    /// Followers whose bumper is pressed.
    pub bumped: usize,
}

impl Convoy {
    /// A convoy that stands in line behind its leader, rods at their greatest length.
    ///
    /// # Errors
    /// As [`Chain::new`] and [`Leader::check`]; a tick out of range.
    pub fn new(plan: Plan, start: Pose) -> Result<Self, InputError> {
        plan.leader.check()?;
        if plan.lag_limit_m.is_nan() || plan.lag_limit_m <= 0.0 {
            let cause = format!("is {} m", plan.lag_limit_m);
            return Err(InputError::new("lag limit", cause, "give more than 0, or infinity"));
        }
        if !(plan.dt_s > 0.0 && plan.dt_s <= 1.0) {
            let cause = format!("takes {} s", plan.dt_s);
            return Err(InputError::new("tick", cause, "give more than 0, up to 1 s"));
        }
        let radius_m = plan.follower.ring.radius_m;
        // The leader is where its connector is, so that needs no margin.
        let mut connectors = vec![Connector::free(radius_m + plan.margin_m); plan.followers + 1];
        connectors[0] = Connector::free(radius_m);
        let back = [-cos(start.heading_rad), -sin(start.heading_rad)];
        let at = |i: usize| {
            let behind_m = plan.rod.max_m * i as f64;
            [start.at[0] + back[0] * behind_m, start.at[1] + back[1] * behind_m]
        };
        let points: Vec<_> = (0..=plan.followers).map(at).collect();
        let followers = points[1..].iter().map(|&at| Pose { at, ..start }).collect();
        let chain = Chain::new(points, connectors, vec![plan.rod; plan.followers])?;
        Ok(Self {
            chain,
            propagator: Propagator::new(plan.rules),
            leader: LeaderState::at(start),
            followers,
            scan: Scan::default(),
            before: Vec::new(),
            bodies: Vec::new(),
            plan,
        })
    }

    /// The chain that the robots keep to.
    pub fn chain(&self) -> &Chain<2> {
        &self.chain
    }

    /// The first robot.
    pub fn leader(&self) -> &LeaderState {
        &self.leader
    }

    /// The other robots; robot `i` keeps to connector `i + 1`.
    pub fn followers(&self) -> &[Pose] {
        &self.followers
    }

    /// Where the connectors were before the last tick; empty before the first.
    pub fn before(&self) -> &[Point<2>] {
        &self.before
    }

    /// What it is.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// One tick. `noise` is where the errors of the laser come from in this tick.
    ///
    /// # Errors
    /// As [`Propagator::propagate`].
    pub fn tick(
        &mut self,
        obstacles: &Obstacles<2>,
        target: Option<Point<2>>,
        noise: &mut Draws,
    ) -> Result<Tick, InputError> {
        let radius_m = self.plan.follower.ring.radius_m;
        self.bodies.clear();
        self.bodies.extend(self.followers.iter().map(|f| Body::disc(f.at, radius_m)));
        let leader_was = self.leader.pose.at;
        let pace = self.pace();
        let (layer, veto) = self.lead(obstacles, target, noise, pace)?;
        self.bodies.push(Body::disc(leader_was, radius_m));
        let (mut held, mut bumped) = (0, 0);
        for i in 0..self.followers.len() {
            let (is_held, is_bumped) = self.follow(i, obstacles);
            held += usize::from(is_held);
            bumped += usize::from(is_bumped);
        }
        Ok(Tick { layer, pace, veto, held, bumped })
    }

    fn lead(
        &mut self,
        obstacles: &Obstacles<2>,
        target: Option<Point<2>>,
        noise: &mut Draws,
        pace: f64,
    ) -> Result<(Layer, Option<Veto<2>>), InputError> {
        let Self { plan, leader, scan, bodies, .. } = self;
        let around = Surroundings { obstacles, bodies, target };
        let percept = plan.leader.perceive(&leader.pose, &around, noise, scan);
        let decision = plan.leader.decide(leader.followed, &percept);
        leader.followed = decision.followed;
        let wheels = decision.wheels.slowed(pace);
        let proposed = plan.drive.step(leader.pose, wheels, plan.dt_s);
        self.before.clear();
        self.before.extend_from_slice(self.chain.points());
        let motion = Motion::Connector { k: 0, to: proposed.at };
        let request = Request { motion, source: Source::Autonomous, mode: Mode::Exact };
        let outcome = self.propagator.propagate(&mut self.chain, obstacles, &request)?;
        let veto = outcome.veto().copied();
        self.leader.pose = if veto.is_none() {
            Pose { at: self.chain.points()[0], ..proposed }
        } else {
            let instead = plan.leader.when_blocked(wheels);
            plan.drive.step(self.leader.pose, instead, plan.dt_s)
        };
        Ok((decision.layer, veto))
    }

    /// What part of its speed the leader may go for the sake of the latest follower.
    fn pace(&self) -> f64 {
        let lag_m = |(f, at): (&Pose, &Point<2>)| distance(f.at, *at);
        let connectors = &self.chain.points()[1..];
        let worst_m = self.followers.iter().zip(connectors).map(lag_m).fold(0.0, f64::max);
        pace(worst_m, self.plan.lag_limit_m)
    }

    /// Moves a follower; whether it was held back, and whether its bumper is pressed.
    fn follow(&mut self, i: usize, obstacles: &Obstacles<2>) -> (bool, bool) {
        let Plan { follower, dt_s, .. } = &self.plan;
        let (was, at) = (self.before[i + 1], self.chain.points()[i + 1]);
        let goal = Goal { at, velocity_m_s: scaled(sub(at, was), 1.0 / dt_s) };
        let pose = self.followers[i];
        let others = || self.bodies.iter().enumerate().filter(|&(k, _)| k != i).map(|(_, b)| *b);
        let followed = follower.follow(&pose, &goal, obstacles, others(), *dt_s);
        self.followers[i] = followed.pose;
        (followed.is_held, followed.is_bumped)
    }
}
