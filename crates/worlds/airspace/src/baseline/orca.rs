//! Optimal reciprocal collision avoidance (van den Berg and others, 2011), by a library; its
//! velocities are made flyable with the same turn rates as for the other methods.

use super::Moving;
use crate::flight::Point;
use dodgy_2d::{Agent, AvoidanceOptions, Vec2};
use std::borrow::Cow;

/// Returns the velocity that airplane `own` should fly among the others.
pub(in super::super) fn velocity<'a>(
    own: &Moving,
    others: impl Iterator<Item = &'a Moving>,
    look_ahead_s: f64,
    dt_s: f64,
    margin: f64,
) -> Point {
    // Positions relative to the airplane, because single precision is finer near the origin.
    let near = |at: Point| Vec2::new((at[0] - own.at[0]) as f32, (at[1] - own.at[1]) as f32);
    let plain = |v: Point| Vec2::new(v[0] as f32, v[1] as f32);
    let agent = |m: &Moving| Agent {
        position: near(m.at),
        velocity: plain(m.velocity),
        radius: (0.5 * m.separation_m * margin) as f32,
        avoidance_responsibility: if m.yields { 1.0 } else { 0.0 },
    };
    let neighbors: Vec<Cow<'_, Agent>> = others.map(|m| Cow::Owned(agent(m))).collect();
    let preferred = plain(own.preferred);
    let options = AvoidanceOptions {
        obstacle_margin: 0.0,
        time_horizon: look_ahead_s as f32,
        obstacle_time_horizon: 0.0,
    };
    let chosen = agent(own).compute_avoiding_velocity(
        &neighbors,
        &[],
        preferred,
        preferred.length(),
        dt_s as f32,
        &options,
    );
    [f64::from(chosen.x), f64::from(chosen.y)]
}
