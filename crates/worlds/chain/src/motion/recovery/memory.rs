//! The memory of a recovery ladder from tick to tick.

use super::RecoveryLimits;
use serde::{Deserialize, Serialize};
use sidestep_kernel::math::atan2;
use sidestep_rods::RequestSource;
use sidestep_rods::geometry::Point;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Side of the cells in which visits are counted, meters, to detect that an initiator moves to and fro: ten steps at the
/// usual speed, so that the same detour leads through the same cells though its steps differ.
const CELL_M: f64 = 0.1;
/// Number of headings that count as different visits to a cell: 22.5 degrees each, about the least turn of a detour.
const HEADINGS: f64 = 16.0;
/// Number of remembered visits; the oldest is forgotten, so that a checkpoint stays small; a loop through
/// more cells than that goes unnoticed.
const MAX_VISITS: usize = 64;
/// Approach to the goal, as a fraction of a cell, that counts as progress: a step of a centimeter, not rounding.
const MIN_PROGRESS_FRACTION: f64 = 0.1;

/// An initiator's memory of its ladder.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RecoveryMemory {
    /// The side of the last good turn: 1 left, -1 right, 0 unknown; and its plane.
    pub(super) side: i8,
    pub(super) plane: usize,
    /// Straight ticks in a row.
    pub(super) straight: u32,
    /// Whether the last motion was a turn to the side.
    pub(super) on_detour: bool,
    pub(super) turns: u32,
    pub(super) waits: u32,
    /// Ticks for which the other end still leads.
    pub(super) pulling_back: u32,
    pub(super) hand_overs: u32,
    /// Least distance from the goal, meters.
    pub(super) best_m: Option<f64>,
    pub(super) places: VecDeque<PlaceVisitCount>,
}

/// A cell and a heading.
pub(super) type VisitKey = ([i64; 3], i64);

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct PlaceVisitCount {
    place: VisitKey,
    times: u32,
    /// Distance from the goal at the first of these times, meters.
    goal_m: f64,
}

/// Rounds a point and a direction to a cell and a heading.
pub(super) fn visit_key<const D: usize>(at: Point<D>, u: Point<D>) -> VisitKey {
    let mut cell = [0; 3];
    for (i, x) in at.into_iter().enumerate() {
        cell[i] = (x / CELL_M).floor() as i64;
    }
    let heading = (atan2(u[1], u[0]) / TAU * HEADINGS).round() as i64;
    (cell, heading.rem_euclid(HEADINGS as i64))
}

impl RecoveryMemory {
    pub(super) fn side_or_left(&self) -> i8 {
        if self.side == 0 { 1 } else { self.side }
    }

    /// Records the distance of the goal. Coming a cell nearer than ever before is progress, after
    /// which the other end may lead again.
    pub(super) fn record_goal_distance(&mut self, goal_m: Option<f64>) {
        let Some(goal_m) = goal_m else { return };
        if self.best_m.is_none_or(|best_m| goal_m < best_m - CELL_M) {
            self.best_m = Some(goal_m);
            self.hand_overs = 0;
        }
    }

    /// Returns whether the other end leads.
    pub(crate) fn is_pulling_back(&self) -> bool {
        self.pulling_back > 0
    }

    /// Records a motion as wanted that nothing could veto.
    pub(crate) fn record_free_motion(
        &mut self,
        source: RequestSource,
        goal_m: Option<f64>,
        rungs: &RecoveryLimits,
    ) {
        if source == RequestSource::Autonomous {
            self.record_goal_distance(goal_m);
            self.record_straight_tick(rungs.straight);
        }
    }

    pub(super) fn record_straight_tick(&mut self, forget_after: u32) {
        self.reset_failures();
        self.on_detour = false;
        self.straight = self.straight.saturating_add(1);
        if self.straight >= forget_after {
            self.side = 0;
            // Without a goal to come nearer to, free motion is the only sign of progress.
            if self.best_m.is_none() {
                self.hand_overs = 0;
            }
        }
    }

    pub(super) fn record_sideways(&mut self, plane: usize, turn_rad: f64) {
        self.reset_failures();
        self.straight = 0;
        self.side = if turn_rad > 0.0 { 1 } else { -1 };
        self.plane = plane;
    }

    pub(super) fn reset_failures(&mut self) {
        self.turns = 0;
        self.waits = 0;
    }

    /// Counts a detour through a place; returns the number of times without progress.
    pub(super) fn record_visit(&mut self, place: VisitKey, goal_m: Option<f64>) -> u32 {
        let begins = !std::mem::replace(&mut self.on_detour, true);
        let Some(goal_m) = goal_m else { return 0 };
        let last = self.places.back().map(|visit| visit.place);
        // Several ticks of one detour in a cell are one visit.
        if !begins && last == Some(place) {
            return 0;
        }
        let known = self.places.iter().position(|visit| visit.place == place);
        let mut visit = known
            .and_then(|k| self.places.remove(k))
            .filter(|visit| goal_m > visit.goal_m - MIN_PROGRESS_FRACTION * CELL_M)
            .unwrap_or(PlaceVisitCount { place, times: 0, goal_m });
        visit.times += 1;
        self.places.push_back(visit);
        if self.places.len() > MAX_VISITS {
            self.places.pop_front();
        }
        visit.times
    }

    /// Counts a tick in which the other end led. After the last, the other side is tried first, because this one has
    /// led to a dead end.
    pub(super) fn record_pull_back(&mut self) {
        self.pulling_back -= 1;
        if self.pulling_back == 0 {
            self.side = -self.side_or_left();
            self.forget_visits();
        }
    }

    /// Forgets failures after the report that nothing works, so that every rung may be tried again.
    pub(super) fn forget_failures(&mut self) {
        self.pulling_back = 0;
        self.hand_overs = 0;
        self.forget_visits();
    }

    fn forget_visits(&mut self) {
        self.reset_failures();
        self.straight = 0;
        self.on_detour = false;
        self.places.clear();
    }
}
