//! The objective of a group as a game, of which an optimization finds the best joint action.

use super::action_predictions::ActionPredictions;
use super::slices::{BoundingBox, SLICE};
use super::{Objective, PairTerms};
use crate::flight::PairPlane;
use sidestep_collectives::PairwiseGame;
use sidestep_kernel::interrupt;

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
pub(super) fn pairs_in_reach(
    objective: &Objective,
    group: &[ActionPredictions],
) -> Vec<[usize; 2]> {
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
pub(crate) fn own_costs(objective: &Objective, options: &ActionPredictions) -> Vec<f64> {
    let optimal = options.predictions.last().expect("every airplane has an optimal action");
    let alpha = objective.alpha * options.deviation_weight;
    let mut costs: Vec<f64> = options
        .predictions
        .iter()
        .map(|prediction| {
            // One that has right of way keeps its way: it is not enough that it is back on it at the end.
            let deviation = if options.deviation_weight > 1.0 {
                objective.max_deviation_cost(prediction, optimal)
            } else {
                objective.deviation_cost(prediction, optimal)
            };
            alpha * deviation
        })
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
pub(crate) fn add_pair_costs(
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
pub(super) fn pair_costs(
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
