//! Measures of a convoy's run.

use super::{Convoy, TickResult};
use sidestep_rods::Obstacles;
use sidestep_rods::geometry::{Point, distance};

/// Measures of a run so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvoyStats {
    /// Ticks so far.
    pub ticks: usize,
    /// Ticks in which each layer acted, layer 1 first.
    pub layers: [usize; 6],
    /// Ticks in which the chain objected.
    pub vetoes: usize,
    /// Ticks in which followers slowed the leader down.
    pub slowed: usize,
    /// Distance traveled by the leader.
    pub way_m: f64,
    /// Least gap between the leader's body and anything, up to 1 m.
    pub leader_clearance_m: f64,
    /// Least gap between a connector and anything, up to 1 m.
    pub connector_clearance_m: f64,
    /// Least gap between a follower's body and anything, up to 1 m.
    pub follower_clearance_m: f64,
    /// Robot-ticks with a pressed bumper.
    pub bumped: usize,
    /// Robot-ticks with sensors that held a robot back.
    pub held: usize,
    /// Distances of followers from their connectors, summed over followers and ticks.
    pub lag_sum_m: f64,
    /// The greatest such distance.
    pub max_lag_m: f64,
    /// Least and greatest distance of neighbors.
    pub pairs_m: [f64; 2],
    /// Speed of the fastest connector, as a multiple of the leader's speed.
    pub fastest: f64,
}

impl Default for ConvoyStats {
    fn default() -> Self {
        Self {
            ticks: 0,
            layers: [0; 6],
            vetoes: 0,
            slowed: 0,
            way_m: 0.0,
            leader_clearance_m: 1.0,
            connector_clearance_m: 1.0,
            follower_clearance_m: 1.0,
            bumped: 0,
            held: 0,
            lag_sum_m: 0.0,
            max_lag_m: 0.0,
            pairs_m: [f64::INFINITY, 0.0],
            fastest: 0.0,
        }
    }
}

impl ConvoyStats {
    /// Adds the state after a tick.
    pub fn record(&mut self, convoy: &Convoy, obstacles: &Obstacles<2>, tick: &TickResult) {
        self.ticks += 1;
        self.layers[tick.layer as usize - 1] += 1;
        self.vetoes += usize::from(tick.is_vetoed);
        self.slowed += usize::from(tick.pace < 1.0);
        self.bumped += tick.bumped;
        self.held += tick.held;
        let (plan, points, before) =
            (convoy.config(), convoy.chain().points(), convoy.previous_points());
        self.way_m += distance(before[0], points[0]);
        let radius_m = plan.follower.ring.radius_m;
        let air_m = |at: Point<2>, radius_m| obstacles.clearance_m([at; 2], radius_m, 1.0);
        self.leader_clearance_m = self.leader_clearance_m.min(air_m(points[0], radius_m));
        let mut ahead = convoy.leader();
        for (i, follower) in (1..).zip(convoy.followers()) {
            let body_m = air_m(follower.at, radius_m);
            self.follower_clearance_m = self.follower_clearance_m.min(body_m);
            let connector_m = air_m(points[i], convoy.chain().connectors()[i].radius_m);
            self.connector_clearance_m = self.connector_clearance_m.min(connector_m);
            let lag_m = distance(follower.at, points[i]);
            self.lag_sum_m += lag_m;
            self.max_lag_m = self.max_lag_m.max(lag_m);
            let pair_m = distance(follower.at, ahead.at);
            self.pairs_m = [self.pairs_m[0].min(pair_m), self.pairs_m[1].max(pair_m)];
            let speed_m_s = distance(before[i], points[i]) / plan.dt_s;
            self.fastest = self.fastest.max(speed_m_s / plan.leader.speed_m_s);
            ahead = *follower;
        }
    }

    /// Returns the mean distance of followers from their connectors, meters.
    pub fn mean_lag_m(&self, followers: usize) -> f64 {
        self.lag_sum_m / (self.ticks * followers).max(1) as f64
    }
}
