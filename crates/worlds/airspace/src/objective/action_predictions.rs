//! What an airplane may fly within the horizon: the predictions of its actions, and what each of them costs by itself.

use super::Objective;
use super::slices::{BoundingBox, DistinctSlicePath, SLICE, TimeSlice};
use crate::areas::{AreaContext, LocalArea};
use crate::flight::{
    Action, ChangeableFlight, FlightLevelRange, Frame, Point, Prediction, SteadyChange, Surface,
    TimeDiscretization, distance_m,
};
use crate::non_cooperative::NonCooperativeAircraft;

/// Weight of a meter beyond a border against one of a lost separation: areas are to be kept clear of first.
const AREA_WEIGHT: f64 = 4.0;
/// Distance from borders that the objective asks for, in separations, so that airplanes need not be stopped there.
const AREA_GAP_SEPARATIONS: f64 = 0.1;

/// An airplane's predictions, one per action, the optimal action last.
#[derive(Debug, Clone)]
pub struct ActionPredictions {
    /// One prediction per action.
    pub predictions: Vec<Prediction>,
    /// The frame in which they lie.
    pub frame: Frame,
    /// Separation asked for, in meters.
    pub separation_m: f64,
    /// The levels that the airplane occupies.
    pub levels: FlightLevelRange,
    /// Factor on the cost of deviations: more than 1 for an airplane that has right of way.
    pub(super) deviation_weight: f64,
    /// The altitudes and speeds that actions lead to; none where no action changes them.
    pub(super) changes: Option<ActionChanges>,
    /// Costs of the actions beside non-cooperative aircraft; empty where there are none.
    pub(super) non_cooperative_costs: Vec<f64>,
    /// Costs of the actions in areas; empty where there are none.
    pub(super) area_costs: Vec<f64>,
    pub(super) slices: Vec<TimeSlice>,
    /// Bounds around the points of all slices.
    bounds: BoundingBox,
    /// Largest distance of a point from the origin of the frame, in meters.
    reach_m: f64,
}

impl ActionPredictions {
    /// Returns options in a frame, with their slices.
    pub fn new(
        predictions: Vec<Prediction>,
        frame: Frame,
        separation_m: f64,
        levels: FlightLevelRange,
    ) -> Self {
        let max_points = predictions.iter().map(|p| p.points.len()).max().unwrap_or(0);
        let slices: Vec<TimeSlice> = (0..max_points)
            .step_by(SLICE)
            .map(|from| TimeSlice::new(&predictions, from, None))
            .collect();
        let reach_m = slices.iter().map(|slice| slice.all.reach_m()).fold(0.0, f64::max);
        let corners: Vec<Point> =
            slices.iter().flat_map(|slice| [slice.all.low, slice.all.high]).collect();
        Self {
            predictions,
            frame,
            separation_m,
            levels,
            deviation_weight: 1.0,
            changes: None,
            non_cooperative_costs: Vec::new(),
            area_costs: Vec::new(),
            slices,
            bounds: BoundingBox::from_points(&corners),
            reach_m,
        }
    }

    /// Returns where the airplane may be by `Surface::sweep_m`, from the least to the most.
    pub(super) fn sweep_range_m(&self) -> [f64; 2] {
        let surface = self.frame.surface();
        match surface {
            Surface::Plane => [self.bounds.low[0], self.bounds.high[0]],
            Surface::Earth => {
                let origin_m = surface.sweep_m(self.frame.to_world([0.0; 2]));
                [origin_m - self.reach_m, origin_m + self.reach_m]
            }
        }
    }

    /// Returns no if another airplane is surely farther than `gap_m` meters away, whatever the two do.
    pub(super) fn is_in_reach(&self, other: &Self, gap_m: f64) -> bool {
        match self.frame.surface() {
            Surface::Plane => self.bounds.is_within_gap(&other.bounds, gap_m),
            Surface::Earth => {
                let reach_m = gap_m + self.reach_m + other.reach_m;
                !self.frame.is_surely_beyond(&other.frame, reach_m)
            }
        }
    }

    /// Returns the same options with the altitudes and speeds that the actions lead to.
    #[must_use]
    pub(crate) fn with_changes(mut self, changes: ActionChanges) -> Self {
        self.levels = changes.extend(self.levels);
        let starts =
            (0..self.predictions.first().map_or(0, |first| first.points.len())).step_by(SLICE);
        let altitudes = Some(changes.altitudes.as_slice());
        self.slices =
            starts.map(|from| TimeSlice::new(&self.predictions, from, altitudes)).collect();
        Self { changes: Some(changes), ..self }
    }

    /// Returns the levels that an action leads to within the horizon.
    fn action_levels(&self, action: usize) -> FlightLevelRange {
        match &self.changes {
            None => self.levels,
            Some(changes) => changes.altitudes[action].range(0.0, changes.horizon_s),
        }
    }

    /// Returns the levels that an action leads to in one step.
    pub(crate) fn step_levels(&self, action: usize, step: usize) -> FlightLevelRange {
        match &self.changes {
            None => self.levels,
            Some(changes) => changes.step_levels(action, step),
        }
    }

    /// Returns whether actions change levels or speeds.
    pub(crate) fn has_changes(&self) -> bool {
        self.changes.is_some()
    }

    /// Returns the same options with a factor on the cost of deviations.
    #[must_use]
    pub(crate) fn with_deviation_weight(self, deviation_weight: f64) -> Self {
        Self { deviation_weight, ..self }
    }

    /// Returns the same options among areas: each second beyond a border, or nearer to it than asked for, costs the square
    /// of the meters, with the weight that a lost separation has then.
    #[must_use]
    pub(crate) fn with_areas(
        mut self,
        context: &AreaContext<'_>,
        objective: &Objective,
        dtau_s: f64,
    ) -> Self {
        let start = self.predictions.iter().find_map(|prediction| prediction.points.first());
        let Some(&start) = start.filter(|_| !context.areas.is_empty()) else { return self };
        let gap_m = AREA_GAP_SEPARATIONS * self.separation_m;
        // Within that of where it begins, because both are within reach of the origin; in a plane that is far away.
        let points = self.predictions.iter().flat_map(|prediction| &prediction.points);
        let path_m = points.map(|&at| distance_m(start, at)).fold(0.0, f64::max);
        let Some(near) = context.near(self.frame, self.frame.to_world(start), path_m + gap_m)
        else {
            return self;
        };
        let cost = |(action, prediction): (usize, &Prediction)| {
            let levels = self.action_levels(action);
            let points = &prediction.points[..objective.counted_points(prediction)];
            let of_area = |area: &LocalArea| {
                let mut weight = AREA_WEIGHT;
                let mut sum = 0.0;
                for shortfall_m in area.shortfalls_m(points, dtau_s, gap_m) {
                    sum += weight * shortfall_m * shortfall_m;
                    weight *= objective.beta;
                }
                sum
            };
            near.iter().filter(|area| area.is_on_levels(&levels)).map(of_area).sum()
        };
        self.area_costs = self.predictions.iter().enumerate().map(cost).collect();
        self
    }

    /// Returns the same options beside non-cooperative aircraft, seen at each point of the predictions.
    #[must_use]
    pub(crate) fn with_non_cooperative(
        mut self,
        non_cooperative: &[NonCooperativeAircraft],
        objective: &Objective,
        dtau_s: f64,
    ) -> Self {
        if non_cooperative.is_empty() {
            return self;
        }
        let on_level: Vec<NonCooperativeAircraft> = non_cooperative
            .iter()
            .filter(|one| one.levels.overlaps(&self.levels, objective.vertical_m))
            .map(|one| one.in_frame(self.frame))
            .collect();
        self.non_cooperative_costs = self
            .predictions
            .iter()
            .enumerate()
            .map(|(action, prediction)| {
                let levels = self.action_levels(action);
                on_level
                    .iter()
                    .filter(|one| one.levels.overlaps(&levels, objective.vertical_m))
                    .map(|one| {
                        objective.non_cooperative_cost(one, prediction, self.separation_m, dtau_s)
                    })
                    .sum()
            })
            .collect();
        self
    }

    pub(super) fn piece_points(
        &self,
        piece: &DistinctSlicePath,
        from: usize,
        mask: bool,
    ) -> &[Point] {
        let points = &self.predictions[piece.actions[0]].points;
        let end = if mask { piece.counted } else { points.len().min(from + SLICE) };
        &points[from.min(end)..end]
    }
}

/// The altitudes and speeds that the actions of an airplane lead to.
#[derive(Debug, Clone)]
pub(crate) struct ActionChanges {
    /// The altitudes of each action, in meters.
    pub(crate) altitudes: Vec<SteadyChange>,
    /// The speeds of each action, in meters per second.
    pub(crate) speeds: Vec<SteadyChange>,
    /// Seconds of a step.
    pub(crate) dtau_s: f64,
    /// Seconds until the horizon.
    pub(crate) horizon_s: f64,
}

impl ActionChanges {
    /// Returns those of some actions.
    pub(crate) fn new(
        flight: &ChangeableFlight<'_>,
        actions: &[Action],
        timing: &TimeDiscretization,
    ) -> Self {
        Self {
            altitudes: actions.iter().map(|action| flight.altitudes(action.change)).collect(),
            speeds: actions.iter().map(|action| flight.speeds(action.change)).collect(),
            dtau_s: timing.dtau_s,
            horizon_s: timing.horizon_s(),
        }
    }

    /// Returns the levels of all actions within the horizon, beside some others.
    pub(crate) fn extend(&self, levels: FlightLevelRange) -> FlightLevelRange {
        let ranges = self.altitudes.iter().map(|one| one.range(0.0, self.horizon_s));
        ranges.fold(levels, |levels, range| {
            levels.extended_by_level(range.low_m).extended_by_level(range.high_m)
        })
    }

    /// Returns the levels of an action in one step.
    pub(crate) fn step_levels(&self, action: usize, step: usize) -> FlightLevelRange {
        let from_s = step as f64 * self.dtau_s;
        self.altitudes[action].range(from_s, from_s + self.dtau_s)
    }

    /// Returns the squares of the deviations of altitude and speed of an action from the optimal one, by their weights.
    pub(super) fn deviation_cost(&self, objective: &Objective, action: usize) -> f64 {
        let [of_level, of_speed] = [&self.altitudes, &self.speeds].map(|changes| {
            let optimal = changes.last().expect("every airplane has an optimal action");
            changes[action].after(self.horizon_s) - optimal.after(self.horizon_s)
        });
        let way_m = of_speed * self.horizon_s;
        objective.level_weight * of_level * of_level + objective.speed_weight * way_m * way_m
    }
}
