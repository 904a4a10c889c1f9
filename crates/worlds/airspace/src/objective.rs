//! The objective of the paper (eq. 8 to 11): separation against deviation.
//!
//! ```text
//! G(x)       = sum_{i != j} Gcol_i(x_i, x_j) + alpha sum_i Gdev_i(x_i)                (8, 9, 10)
//! Gcol_i     = sum_k beta^(k-1) max(R_i - |f_i(x_i, k) - f_j(x_j, k)|, 0)^2           (9)
//! Gdev_i     = |f_i(x_i, kmax) - f_i(x_i_opt, kmax)|^2                                (10)
//! ```

use super::areas::{AreaContext, LocalArea};
use super::flight::{
    Action, ChangeableFlight, FlightLevelRange, Frame, PairPlane, Point, Prediction, RigidMotion,
    SteadyChange, Surface, TimeDiscretization, distance_m,
};
use super::non_cooperative::NonCooperativeAircraft;
use serde::{Deserialize, Serialize};
use sidestep_collectives::PairwiseGame;
use sidestep_kernel::{interrupt, math};

/// The weights of separation and deviation.
///
/// Where actions change levels and speeds, a deviation is of all three:
/// `|dx|^2 + level_weight dh^2 + speed_weight (dv T)^2`, with the difference `dx` of places at the horizon `T` as in the
/// paper, `dh` of altitudes, and `dv` of speeds. Airplanes that are on levels apart at a step add no cost then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Objective {
    /// Weight of deviations from the optimal path.
    pub alpha: f64,
    /// Factor on penalties per step into the future, in (0, 1].
    pub beta: f64,
    /// Factor on separations in the objective; above 1, it asks for a margin.
    pub inflation: f64,
    /// Whether steps after the arrival of either airplane do not count.
    pub mask: bool,
    /// Airplanes at least this many meters above each other add no cost to each other.
    pub vertical_m: f64,
    /// Weight of a square meter of altitude against one of place.
    pub level_weight: f64,
    /// Weight of the square of the way that a change of speed makes longer or shorter, beside that of the place.
    pub speed_weight: f64,
}

impl Objective {
    /// Returns the cost of a prediction of an airplane with this separation beside a non-cooperative one in its frame,
    /// which is assumed to fly straight on.
    fn non_cooperative_cost(
        &self,
        one: &NonCooperativeAircraft,
        prediction: &Prediction,
        separation_m: f64,
        dtau_s: f64,
    ) -> f64 {
        let points: Vec<Point> =
            (1..=prediction.points.len()).map(|k| one.position_after(k as f64 * dtau_s)).collect();
        let straight = Prediction { counted: points.len(), points };
        let r = [one.required_clearance_m(separation_m), 0.0];
        self.collision_costs(&PairPlane::ONE_FRAME, prediction, &straight, r)[0]
    }

    /// Returns `Gcol_i` and `Gcol_j` of two predictions in the frames of a pair, for separations `r` of `i` and `j` in
    /// meters (eq. 9). Sums slice by slice of time, so that a caller that skips slices which are
    /// apart gets the same bits.
    pub fn collision_costs(
        &self,
        plane: &PairPlane,
        a: &Prediction,
        b: &Prediction,
        r: [f64; 2],
    ) -> [f64; 2] {
        self.collision_costs_where(plane, [a, b], r, |_| true)
    }

    /// Returns the same of the points alone at which the two are on levels that meet, as `meets` tells by their number.
    pub(super) fn collision_costs_where(
        &self,
        plane: &PairPlane,
        [a, b]: [&Prediction; 2],
        r: [f64; 2],
        meets: impl Fn(usize) -> bool,
    ) -> [f64; 2] {
        let end = self.counted_points(a).min(self.counted_points(b));
        let mut sums = [0.0; 2];
        let mut weight = 1.0;
        let slices = a.points[..end].chunks(SLICE).zip(b.points[..end].chunks(SLICE));
        let terms = PairTerms { plane, r };
        for (k, (of_a, of_b)) in slices.enumerate() {
            let meets_in_slice = |point: usize| meets(k * SLICE + point);
            let parts = self.slice_collision_costs(terms, [of_a, of_b], weight, meets_in_slice);
            sums[0] += parts[0];
            sums[1] += parts[1];
            weight = self.next_slice_weight(weight);
        }
        sums
    }

    /// Returns the distance in meters beyond which two of a separation cost each other nothing.
    fn gap_m(&self, separation_m: f64) -> f64 {
        // Slightly more, so that no rounding of bounds leaves out points that add a cost.
        self.inflation * separation_m * (1.0 + 1e-9)
    }

    fn counted_points(&self, prediction: &Prediction) -> usize {
        if self.mask { prediction.counted } else { prediction.points.len() }
    }

    /// Returns the same over the points of one slice, of which the first has the weight `weight`. `counts` tells whether
    /// the two are on levels that meet at a point of the slice.
    // Inlined, so that where all points count no call is left.
    #[inline(always)]
    fn slice_collision_costs(
        &self,
        PairTerms { plane, r }: PairTerms<'_>,
        [a, b]: [&[Point]; 2],
        mut weight: f64,
        counts: impl Fn(usize) -> bool,
    ) -> [f64; 2] {
        let [ra, rb] = r.map(|r| r * self.inflation);
        let max_square_m2 = ra.max(rb) * ra.max(rb);
        let squares_m2 = plane.squared_distances_m2::<SLICE>(a, b);
        // Nearly all points are farther apart than that, and need neither weight nor root. No early exit: all of them are
        // compared at once.
        let is_any_near = squares_m2
            .iter()
            .fold(false, |is_any, square_m2| is_any | (*square_m2 < max_square_m2));
        let mut sums = [0.0; 2];
        if !is_any_near {
            return sums;
        }
        for (k, square_m2) in squares_m2.into_iter().enumerate() {
            if square_m2 < max_square_m2 && counts(k) {
                let distance_m = square_m2.sqrt();
                let shortfall_a_m = (ra - distance_m).max(0.0);
                let shortfall_b_m = (rb - distance_m).max(0.0);
                sums[0] += weight * shortfall_a_m * shortfall_a_m;
                sums[1] += weight * shortfall_b_m * shortfall_b_m;
            }
            weight *= self.beta;
        }
        sums
    }

    /// Returns the weight of a slice's first point if that of the slice before has the weight
    /// `weight`. It is multiplied step by step, as within a slice, and not by a power, which rounds differently.
    fn next_slice_weight(&self, weight: f64) -> f64 {
        (0..SLICE).fold(weight, |weight, _| weight * self.beta)
    }

    /// Returns `Gdev_i`, from the ends of a prediction and of the optimal one (eq. 10).
    pub fn deviation_cost(&self, of: &Prediction, optimal: &Prediction) -> f64 {
        match (of.points.last(), optimal.points.last()) {
            (Some(p), Some(q)) => {
                let dx = p[0] - q[0];
                let dy = p[1] - q[1];
                dx * dx + dy * dy
            }
            _ => 0.0,
        }
    }
}

/// What all slices of a pair have in common.
#[derive(Debug, Clone, Copy)]
struct PairTerms<'a> {
    plane: &'a PairPlane,
    /// The separations of the two, in meters.
    r: [f64; 2],
}

/// Weight of a meter beyond a border against one of a lost separation: areas are to be kept clear of first.
const AREA_WEIGHT: f64 = 4.0;
/// Distance from borders that the objective asks for, in separations, so that airplanes need not be stopped there.
const AREA_GAP_SEPARATIONS: f64 = 0.1;

/// Number of points of a slice of time. Within a slice airplanes move little, so bounds around it are
/// tight.
const SLICE: usize = 16;

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
    deviation_weight: f64,
    /// The altitudes and speeds that actions lead to; none where no action changes them.
    changes: Option<ActionChanges>,
    /// Costs of the actions beside non-cooperative aircraft; empty where there are none.
    non_cooperative_costs: Vec<f64>,
    /// Costs of the actions in areas; empty where there are none.
    area_costs: Vec<f64>,
    slices: Vec<TimeSlice>,
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
    fn sweep_range_m(&self) -> [f64; 2] {
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
    fn is_in_reach(&self, other: &Self, gap_m: f64) -> bool {
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
    pub(super) fn step_levels(&self, action: usize, step: usize) -> FlightLevelRange {
        match &self.changes {
            None => self.levels,
            Some(changes) => changes.step_levels(action, step),
        }
    }

    /// Returns whether actions change levels or speeds.
    pub(super) fn has_changes(&self) -> bool {
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

    fn piece_points(&self, piece: &DistinctSlicePath, from: usize, mask: bool) -> &[Point] {
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
    fn deviation_cost(&self, objective: &Objective, action: usize) -> f64 {
        let [of_level, of_speed] = [&self.altitudes, &self.speeds].map(|changes| {
            let optimal = changes.last().expect("every airplane has an optimal action");
            changes[action].after(self.horizon_s) - optimal.after(self.horizon_s)
        });
        let way_m = of_speed * self.horizon_s;
        objective.level_weight * of_level * of_level + objective.speed_weight * way_m * way_m
    }
}

/// The paths of all actions of an airplane in one slice of time.
#[derive(Debug, Clone)]
struct TimeSlice {
    pieces: Vec<DistinctSlicePath>,
    /// Bounds around all of them.
    all: BoundingBox,
}

/// Points of a slice that some actions share: actions with the same turn differ only later.
#[derive(Debug, Clone)]
struct DistinctSlicePath {
    /// The actions, at least one.
    actions: Vec<usize>,
    /// Point of the prediction at which the counted part of the slice ends.
    counted: usize,
    bounds: BoundingBox,
}

impl TimeSlice {
    /// Returns a slice from point `from` on. `altitudes` are those of all actions, where some change them.
    fn new(predictions: &[Prediction], from: usize, altitudes: Option<&[SteadyChange]>) -> Self {
        let mut pieces: Vec<DistinctSlicePath> = Vec::new();
        for (action, prediction) in predictions.iter().enumerate() {
            let points = slice_points(prediction, from);
            let end = prediction.points.len().min(from + SLICE);
            let counted = prediction.counted.clamp(from.min(end), end);
            // The last points are compared first, because most paths that differ do so there.
            let same = pieces.iter_mut().find(|piece| {
                let first = piece.actions[0];
                let other = slice_points(&predictions[first], from);
                piece.counted == counted
                    && points.last() == other.last()
                    && points == other
                    && altitudes.is_none_or(|all| all[first] == all[action])
            });
            match same {
                Some(piece) => piece.actions.push(action),
                None => {
                    let bounds = BoundingBox::from_points(points);
                    pieces.push(DistinctSlicePath { actions: vec![action], counted, bounds });
                }
            }
        }
        let corners: Vec<Point> =
            pieces.iter().flat_map(|p| [p.bounds.low, p.bounds.high]).collect();
        Self { pieces, all: BoundingBox::from_points(&corners) }
    }
}

/// Returns the points of a prediction in the slice that starts with point `from`.
fn slice_points(prediction: &Prediction, from: usize) -> &[Point] {
    let end = prediction.points.len().min(from + SLICE);
    &prediction.points[from.min(end)..end]
}

/// The smallest upright rectangle around some points.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BoundingBox {
    low: Point,
    high: Point,
}

impl BoundingBox {
    fn from_points(points: &[Point]) -> Self {
        let start = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        points.iter().fold(start, |b, p| Self {
            low: [b.low[0].min(p[0]), b.low[1].min(p[1])],
            high: [b.high[0].max(p[0]), b.high[1].max(p[1])],
        })
    }

    /// Returns the largest distance of a point in it from the origin.
    fn reach_m(&self) -> f64 {
        let [x, y] = [0, 1].map(|k: usize| self.low[k].abs().max(self.high[k].abs()));
        math::hypot(x, y)
    }

    /// Returns the smallest upright rectangle around this one in another plane.
    fn moved(&self, motion: &RigidMotion) -> Self {
        let [low, high] = [self.low, self.high];
        let corners = [low, [low[0], high[1]], [high[0], low[1]], high];
        // Corners of no points are infinite, and would become no numbers.
        if low[0] > high[0] {
            return *self;
        }
        Self::from_points(&corners.map(|corner| motion.point(corner)))
    }

    fn is_within_gap(&self, other: &Self, gap_m: f64) -> bool {
        (0..2).all(|k| self.low[k] - gap_m <= other.high[k] && other.low[k] - gap_m <= self.high[k])
    }
}

/// Returns the objective of a group as a game: players are airplanes, strategies actions, and
/// `G = sum own + sum pairs` with `own_i = alpha Gdev_i` and `pair_ij = Gcol_i + Gcol_j`.
///
/// Everything that does not change during an optimization is computed here, once.
pub fn build_group_game(objective: &Objective, group: &[ActionPredictions]) -> PairwiseGame {
    let own = group.iter().map(|options| own_costs(objective, options)).collect();
    let mut game = PairwiseGame::new(own);
    for [i, j] in pairs_in_reach(objective, group) {
        add_pair_costs(&mut game, objective, [i, j], [&group[i], &group[j]]);
    }
    game
}

/// Returns the pairs of a group that may come so near to each other that it costs something, in the order of the first
/// one and then of the second.
fn pairs_in_reach(objective: &Objective, group: &[ActionPredictions]) -> Vec<[usize; 2]> {
    // Most airplanes of a large group are far from each other. Sorted by where their reach begins, each is compared with
    // those alone that begin before its own reach ends.
    let separation_m = group.iter().map(|options| options.separation_m).fold(0.0, f64::max);
    let gap_m = objective.gap_m(separation_m);
    let ranges_m: Vec<[f64; 2]> = group.iter().map(ActionPredictions::sweep_range_m).collect();
    let mut order: Vec<usize> = (0..group.len()).collect();
    order.sort_by(|i, j| ranges_m[*i][0].total_cmp(&ranges_m[*j][0]));
    let mut pairs = Vec::new();
    for (place, &i) in order.iter().enumerate() {
        let end_m = ranges_m[i][1] + gap_m;
        let later = order[place + 1..].iter().take_while(|j| ranges_m[**j][0] <= end_m);
        let in_reach = later.filter(|j| group[i].is_in_reach(&group[**j], gap_m));
        pairs.extend(in_reach.map(|&j| [i.min(j), i.max(j)]));
    }
    // The order of the game, by which its costs are summed.
    pairs.sort_unstable();
    pairs
}

/// Returns the sum of `alpha Gdev` of every action and its costs beside non-cooperative aircraft and among areas.
pub(super) fn own_costs(objective: &Objective, options: &ActionPredictions) -> Vec<f64> {
    let optimal = options.predictions.last().expect("every airplane has an optimal action");
    let alpha = objective.alpha * options.deviation_weight;
    let mut costs: Vec<f64> = options
        .predictions
        .iter()
        .map(|prediction| alpha * objective.deviation_cost(prediction, optimal))
        .collect();
    if let Some(changes) = &options.changes {
        for (action, cost) in costs.iter_mut().enumerate() {
            *cost += alpha * changes.deviation_cost(objective, action);
        }
    }
    for further in [&options.non_cooperative_costs, &options.area_costs] {
        costs.iter_mut().zip(further).for_each(|(cost, further)| *cost += further);
    }
    costs
}

/// Adds the costs of two players' airplanes to each other to a game, if there are any.
pub(super) fn add_pair_costs(
    game: &mut PairwiseGame,
    objective: &Objective,
    [i, j]: [usize; 2],
    [a, b]: [&ActionPredictions; 2],
) {
    interrupt::check();
    if a.levels.overlaps(&b.levels, objective.vertical_m)
        && let Some(costs) = pair_costs(objective, a, b)
    {
        game.add_split_pair(i, j, costs);
    }
}

/// Returns `Gcol` of both for every two actions, if any two cost anything. Most slices of two airplanes
/// never come near each other, and the points that several actions share are computed once.
fn pair_costs(
    objective: &Objective,
    a: &ActionPredictions,
    b: &ActionPredictions,
) -> Option<Vec<[f64; 2]>> {
    let r = [a.separation_m, b.separation_m];
    let gap_m = objective.gap_m(r[0].max(r[1]));
    if !a.is_in_reach(b, gap_m) {
        return None;
    }
    let plane = PairPlane::between(a.frame, b.frame);
    let terms = PairTerms { plane: &plane, r };
    let is_near = |p: &BoundingBox, q: &BoundingBox| match plane.motions() {
        None => p.is_within_gap(q, gap_m),
        Some([first, second]) => p.moved(first).is_within_gap(&q.moved(second), gap_m),
    };
    let columns = b.predictions.len();
    let has_changes = a.changes.is_some() || b.changes.is_some();
    let mut costs = None;
    let mut weight = 1.0;
    let mut slice_of_weight = 0;
    for (k, (of_a, of_b)) in a.slices.iter().zip(&b.slices).enumerate() {
        if !is_near(&of_a.all, &of_b.all) {
            continue;
        }
        // Only now, because most pairs are far from each other in all slices.
        while slice_of_weight < k {
            weight = objective.next_slice_weight(weight);
            slice_of_weight += 1;
        }
        for p in of_a.pieces.iter().filter(|p| is_near(&p.bounds, &of_b.all)) {
            let of_p = a.piece_points(p, k * SLICE, objective.mask);
            for q in of_b.pieces.iter().filter(|q| is_near(&p.bounds, &q.bounds)) {
                let of_q = b.piece_points(q, k * SLICE, objective.mask);
                let parts = if has_changes {
                    let meets = |point: usize| {
                        let step = k * SLICE + point;
                        let levels = a.step_levels(p.actions[0], step);
                        levels.overlaps(&b.step_levels(q.actions[0], step), objective.vertical_m)
                    };
                    objective.slice_collision_costs(terms, [of_p, of_q], weight, meets)
                } else {
                    objective.slice_collision_costs(terms, [of_p, of_q], weight, |_| true)
                };
                if parts != [0.0; 2] {
                    // Most pairs never need the table, which is large.
                    let costs =
                        costs.get_or_insert_with(|| vec![[0.0; 2]; a.predictions.len() * columns]);
                    add_action_pair_costs(costs, columns, [&p.actions, &q.actions], parts);
                }
            }
        }
    }
    costs
}

/// Adds `parts` for every two of some actions.
fn add_action_pair_costs(
    costs: &mut [[f64; 2]],
    columns: usize,
    [actions_a, actions_b]: [&[usize]; 2],
    parts: [f64; 2],
) {
    for action_a in actions_a {
        for action_b in actions_b {
            let sums = &mut costs[action_a * columns + action_b];
            sums[0] += parts[0];
            sums[1] += parts[1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::flight::{
        Action, AfterLastWaypoint, AircraftModel, Autopilot, ChangeAlternatives, Pose2,
        TimeDiscretization, TurnAction, WaypointRule,
    };
    use super::*;
    use serde_json::Value;
    use sidestep_collectives::Game;

    /// Independent numbers of the shared data, to 1e-9 relative.
    #[test]
    fn the_objective_and_its_parts_are_those_of_the_oracle() {
        let root = sidestep_testing::root().join("..");
        let path = root.join("shared/data/oracle/collectives_cases.json");
        let Ok(text) = std::fs::read_to_string(&path) else {
            sidestep_testing::skip(format!("{} is not there", path.display()));
            return;
        };
        let cases: Vec<Value> = serde_json::from_str(&text).expect("JSON");
        assert_eq!(cases.len(), 5);
        cases.iter().for_each(check);
    }

    fn near(found: f64, expected: &Value, what: &str) {
        let expected = expected.as_f64().expect(what);
        let error = (found - expected).abs();
        assert!(error <= 1e-9 * expected.abs().max(1e-3), "{what}: {found} is not {expected}");
    }

    fn point(value: &Value) -> Point {
        [value[0].as_f64().expect("x"), value[1].as_f64().expect("y")]
    }

    fn check(case: &Value) {
        let name = case["name"].as_str().expect("a name");
        let params = &case["params"];
        let number = |key: &str| params[key].as_f64().expect("a number");
        let timing = TimeDiscretization {
            dt_s: number("dt"),
            dtau_s: number("dtau"),
            horizon: number("kmax") as usize,
        };
        let objective = Objective {
            alpha: number("alpha"),
            beta: number("beta"),
            inflation: 1.0,
            mask: params["mask"] == true,
            vertical_m: 1.0,
            level_weight: 1.0,
            speed_weight: 0.0,
        };
        let after = if params["after"] == "pursue" {
            AfterLastWaypoint::Pursue
        } else {
            AfterLastWaypoint::Straight
        };
        let passing =
            WaypointRule { tolerance_m: number("tol"), passes: false, passes_abeam: false };
        let expected = &case["expected"];
        let mut predictions = Vec::new();
        let planes = case["planes"].as_array().expect("planes");
        let actions = case["actions"].as_array().expect("actions");
        for (i, (plane, action)) in planes.iter().zip(actions).enumerate() {
            let number = |key: &str| plane[key].as_f64().expect("a number");
            let model = AircraftModel {
                v_m_s: number("v"),
                omega_max_rad_s: number("omega_max"),
                separation_m: number("R"),
                turns: 5,
            };
            let mission: Vec<Point> =
                plane["wps"].as_array().expect("way-points").iter().map(point).collect();
            let pilot = Autopilot {
                model: &model,
                mission: &mission,
                passing,
                after,
                dtau_s: timing.dtau_s,
            };
            let pose = Pose2 { at: [number("x"), number("y")], heading_rad: number("psi") };
            let chosen = match action["omega"].as_f64() {
                None => TurnAction::Proceed,
                Some(omega_rad_s) if action["g"] == 0 => TurnAction::Hold { omega_rad_s },
                Some(omega_rad_s) => TurnAction::Then { omega_rad_s, hold_s: timing.dt_s },
            };
            let optimal = pilot.predict(TurnAction::Proceed, pose, 0, &timing);
            let prediction = pilot.predict(chosen, pose, 0, &timing);
            for (key, k) in [("f_k1", 0), ("f_k10", 9), ("f_kmax", timing.horizon - 1)] {
                (0..2).for_each(|c| near(prediction.points[k][c], &expected[key][i][c], name));
            }
            assert_eq!(expected["ka"][i].as_u64(), Some(prediction.counted as u64), "{name}");
            near(objective.deviation_cost(&prediction, &optimal), &expected["G_dev_i"][i], name);
            predictions.push((prediction, optimal, model.separation_m));
        }
        let mut total = [0.0; 2];
        for (i, (a, optimal, ra)) in predictions.iter().enumerate() {
            let mut own = objective.alpha * objective.deviation_cost(a, optimal);
            total[1] += objective.deviation_cost(a, optimal);
            for (j, (b, _, rb)) in predictions.iter().enumerate().filter(|(j, _)| *j != i) {
                let [of_a, _] = objective.collision_costs(&PairPlane::ONE_FRAME, a, b, [*ra, *rb]);
                near(of_a, &expected["G_col_ij"][i][j], name);
                own += of_a;
                total[0] += of_a;
            }
            near(own, &expected["G_i"][i], name);
        }
        near(total[0], &expected["G_col"], name);
        near(total[1], &expected["G_dev"], name);
        near(total[0] + objective.alpha * total[1], &expected["G"], name);
        let options: Vec<ActionPredictions> = predictions
            .iter()
            .map(|(p, optimal, r)| {
                ActionPredictions::new(
                    vec![p.clone(), optimal.clone()],
                    Frame::PLANE,
                    *r,
                    FlightLevelRange::from_level(0.0),
                )
            })
            .collect();
        let game = build_group_game(&objective, &options);
        near(game.cost(&vec![0; options.len()]), &expected["G"], name);
    }

    /// The parts left out by slices, bounds and shared pieces cost nothing, to the bit.
    #[test]
    fn tables_hold_what_two_predictions_cost_to_the_bit() {
        use super::super::flight::{DetourAlternatives, actions};
        let model =
            AircraftModel { v_m_s: 35.0, omega_max_rad_s: 0.07, separation_m: 500.0, turns: 5 };
        let timing = TimeDiscretization { dt_s: 5.0, dtau_s: 1.0, horizon: 90 };
        let passing = WaypointRule { tolerance_m: 100.0, passes: true, passes_abeam: false };
        let all = [DetourAlternatives::default(), DetourAlternatives::default_preset()]
            .map(|legs| actions(&model, 5.0, &[], &legs, &ChangeAlternatives::default()));
        let mut meetings = 0;
        for (k, mask) in (0..12).flat_map(|k| [(k, true), (k, false)]) {
            let options = [0.0, 1.0].map(|side| {
                let angle = side * 0.5 * f64::from(k);
                let pose =
                    Pose2 { at: [900.0 * side, 700.0 * side], heading_rad: angle + 3.0 * side };
                let mission = [[2000.0 - 2500.0 * side, 300.0]];
                let after = AfterLastWaypoint::Straight;
                let pilot =
                    Autopilot { model: &model, mission: &mission, passing, after, dtau_s: 1.0 };
                let predict = |action: &Action| pilot.predict(action.turn, pose, 0, &timing);
                let predictions = all[k as usize % 2].iter().map(predict).collect();
                ActionPredictions::new(
                    predictions,
                    Frame::PLANE,
                    model.separation_m * (1.0 - 0.1 * side),
                    FlightLevelRange::from_level(0.0),
                )
            });
            let [a, b] = &options;
            let objective = Objective {
                alpha: 1.0,
                beta: 0.995,
                inflation: 1.05,
                mask,
                vertical_m: 300.0,
                level_weight: 1.0,
                speed_weight: 0.0,
            };
            let free = vec![[0.0; 2]; a.predictions.len() * b.predictions.len()];
            let table = pair_costs(&objective, a, b).unwrap_or(free);
            let pairs =
                a.predictions.iter().flat_map(|p| b.predictions.iter().map(move |q| (p, q)));
            let r = [a.separation_m, b.separation_m];
            for ((p, q), found) in pairs.zip(&table) {
                assert_eq!(*found, objective.collision_costs(&PairPlane::ONE_FRAME, p, q, r));
                meetings += usize::from(*found != [0.0; 2]);
            }
        }
        assert!(meetings > 500, "{meetings}");
    }

    /// Two fly toward each other, and one of them may climb.
    #[test]
    fn airplanes_cost_each_other_at_the_steps_at_which_their_levels_meet_alone() {
        let straight = |from_m: f64, v_m_s: f64| {
            let points: Vec<Point> =
                (1..=60).map(|k| [from_m + v_m_s * f64::from(k), 0.0]).collect();
            Prediction { counted: points.len(), points }
        };
        let options = |from_m: f64, v_m_s: f64, altitudes: Option<Vec<SteadyChange>>| {
            let count = altitudes.as_ref().map_or(1, Vec::len);
            let predictions = vec![straight(from_m, v_m_s); count];
            let levels = FlightLevelRange::from_level(0.0);
            let options = ActionPredictions::new(predictions, Frame::PLANE, 500.0, levels);
            match altitudes {
                None => options,
                Some(altitudes) => options.with_changes(ActionChanges {
                    speeds: vec![SteadyChange::constant(35.0); count],
                    altitudes,
                    dtau_s: 1.0,
                    horizon_s: 60.0,
                }),
            }
        };
        let objective = Objective {
            alpha: 0.001,
            beta: 0.995,
            inflation: 1.0,
            mask: true,
            vertical_m: 300.0,
            level_weight: 2.0,
            speed_weight: 0.0,
        };
        let climb = SteadyChange { from: 0.0, to: 400.0, rate_s: 10.0 };
        let level = SteadyChange::constant(0.0);
        let a = options(-1400.0, 35.0, Some(vec![climb, level]));
        let b = options(1400.0, -35.0, None);
        let table = pair_costs(&objective, &a, &b).expect("they meet");
        // Above 300 m, from 30 s on, they are 700 m and less apart.
        let each = objective.collision_costs(
            &PairPlane::ONE_FRAME,
            &a.predictions[1],
            &b.predictions[0],
            [500.0; 2],
        );
        assert_eq!(table[1], each);
        assert!(each[0] > 1e5, "{each:?}");
        assert_eq!(table[0], [0.0; 2]);
        // From a slower climb there is a part left: that before it is 300 m above the other one.
        let slow = SteadyChange { rate_s: 8.0, ..climb };
        let a = options(-1400.0, 35.0, Some(vec![slow, level]));
        let table = pair_costs(&objective, &a, &b).expect("they meet");
        assert!(table[0][0] > 0.0 && table[0][0] < 0.3 * each[0], "{table:?}");
        let costs = own_costs(&objective, &a);
        assert_eq!(costs, [0.001 * 2.0 * 400.0 * 400.0, 0.0]);
        // On levels far apart nothing costs anything.
        let far = options(1400.0, -35.0, Some(vec![SteadyChange::constant(900.0)]));
        let mut game = PairwiseGame::new(vec![vec![0.0; 2], vec![0.0]]);
        add_pair_costs(&mut game, &objective, [0, 1], [&a, &far]);
        assert_eq!(game.pair_costs().count(), 0);
    }
}
