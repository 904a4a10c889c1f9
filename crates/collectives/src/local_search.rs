//! Local search from the outcome of the rounds and from further starts: moves of one or two players at a time.
//!
//! It is the algorithm MGM-2 (Maheswaran, Pearce and Tambe 2004) without its random draws. In a step every player
//! tells the cost of each of its strategies beside those of the others, and then its best move: of itself, or, where
//! neither it nor a neighbor saves anything alone, of itself and one later neighbor. Moves that do not touch each other are
//! made at once. A joint move from which no two players can save anything is *2-optimal*; of all starts, the cheapest end
//! is taken.
//!
//! [`optimize`](super::optimize) runs it in one process. Players that know only the pairs that they are part of run
//! the same functions on messages, and come to the same bits.

use super::game::{Game, PairCosts, PairwiseGame};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::interrupt;

/// A move has to save more than this share of what its players pay: less is rounding, which might be saved forever.
const MIN_SAVED_SHARE: f64 = 1e-9;
/// The share by which a cost may be above a lower bound and counts as equal to it: both are rounded.
const BOUND_TOLERANCE: f64 = 1e-9;

/// What follows the rounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LocalSearch {
    /// Nothing: the players take strategies from their distributions, as in the paper.
    #[default]
    None,
    /// Moves of one or two players, until none saves anything.
    Pairs,
    /// The same, and then branch and bound: the true minimum, unless it takes too long.
    BranchAndBound,
}

/// New strategies of a player, and maybe of a later one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairMove {
    /// The cost that it saves.
    pub gain: f64,
    /// The new strategy of the player.
    pub strategy: usize,
    /// The other player with its new strategy, if it moves too.
    pub partner: Option<(usize, usize)>,
}

/// The costs of a player in a descent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlayerCosts {
    /// The part of the joint move's cost that it bears.
    pub cost: f64,
    /// The cost that each of its strategies has beside the strategies of the others, up to a constant.
    pub given: Vec<f64>,
}

/// The search from one start.
#[derive(Debug, Clone)]
struct Descent {
    joint: Vec<usize>,
    /// Costs of each player.
    players: Vec<PlayerCosts>,
    /// The least cost that any strategy of each player has beside those of the others.
    least: Vec<f64>,
    /// What each player can save alone; none if nothing.
    gains_alone: Vec<Option<f64>>,
    /// Whether each player or one of its neighbors has moved in the step before, so that its costs may have changed.
    touched: Vec<bool>,
    /// The step in which each player has moved or its costs have changed last.
    changed_in: Vec<u32>,
    /// What each player and each of its neighbors can save by moving together; empty before it is asked for, because an
    /// agent asks for itself alone.
    pair_gains: Vec<Vec<PairGain>>,
    is_settled: bool,
}

/// What two players can save by moving together.
#[derive(Debug, Clone, Copy)]
struct PairGain {
    /// It is not more than this.
    max: f64,
    /// The step in which that was found.
    found_in: u32,
}

impl PairGain {
    const UNKNOWN: Self = Self { max: f64::INFINITY, found_in: 0 };
}

/// The searches from all starts, which take their steps together.
#[derive(Debug, Clone, Default)]
pub struct Descents {
    /// Each player's neighbors: those with which it shares a cost.
    neighbors: Vec<Vec<usize>>,
    descents: Vec<Descent>,
    /// Number of steps made.
    steps: u32,
}

impl Descents {
    /// Largest number of steps, which all save something. Fifty players take about 30.
    pub const MAX_STEPS: u32 = 1000;

    /// Creates searches. `starts` are each player's strategies, one a start (shape: players, starts); `neighbors` those
    /// with which it shares a cost (shape: players, neighbors).
    pub fn new(neighbors: Vec<Vec<usize>>, starts: &[Vec<usize>]) -> Self {
        let count = starts.iter().map(Vec::len).min().unwrap_or(0);
        let descents = (0..count).map(|start| Descent {
            joint: starts.iter().map(|strategies| strategies[start]).collect(),
            players: vec![PlayerCosts::default(); starts.len()],
            least: vec![0.0; starts.len()],
            gains_alone: vec![None; starts.len()],
            touched: vec![true; starts.len()],
            changed_in: vec![0; starts.len()],
            pair_gains: vec![Vec::new(); starts.len()],
            is_settled: false,
        });
        Self { descents: descents.collect(), neighbors, steps: 0 }
    }

    /// Returns the descents that are not settled.
    fn open(&self) -> impl Iterator<Item = &Descent> {
        self.descents.iter().filter(|descent| !descent.is_settled)
    }

    /// Returns the number of descents that are not settled.
    pub fn count_open(&self) -> usize {
        self.open().count()
    }

    /// Returns the number of steps made.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Returns the costs of a player in each open descent.
    pub fn player_costs(&self, game: &PairwiseGame, player: usize) -> Vec<PlayerCosts> {
        let costs = |descent: &Descent| {
            let mut costs = PlayerCosts::default();
            game.write_player_costs(player, &descent.joint, &mut costs);
            costs
        };
        self.open().map(costs).collect()
    }

    /// Computes the costs of a player in each open descent, and sets them; `buffer` may have any content.
    fn update_player_costs(
        &mut self,
        game: &PairwiseGame,
        player: usize,
        buffer: &mut PlayerCosts,
    ) {
        let step = self.steps;
        let open = self.descents.iter_mut().filter(|descent| !descent.is_settled);
        for descent in open.filter(|descent| descent.touched[player]) {
            game.write_player_costs(player, &descent.joint, buffer);
            descent.set_player_costs(player, buffer, step);
        }
    }

    /// Sets the costs of a player in each open descent (shape: open descents).
    pub fn set_player_costs(&mut self, player: usize, costs: Vec<PlayerCosts>) {
        let open = self.descents.iter_mut().filter(|descent| !descent.is_settled);
        for (descent, mut costs) in open.zip(costs) {
            descent.set_player_costs(player, &mut costs, self.steps);
        }
    }

    /// Lets a player of unknown costs keep its strategy in each open descent: every other one seems infinitely dear.
    pub fn keep_strategy(&mut self, game: &PairwiseGame, player: usize) {
        for descent in self.descents.iter_mut().filter(|descent| !descent.is_settled) {
            let mut given = vec![f64::INFINITY; game.strategies()[player]];
            given[descent.joint[player]] = 0.0;
            let cost = game.player_cost(&descent.joint, player);
            descent.set_player_costs(player, &mut PlayerCosts { cost, given }, self.steps);
        }
    }

    /// Returns the best move of a player in each open descent, when the costs of all are set.
    pub fn player_moves(&mut self, game: &PairwiseGame, player: usize) -> Vec<Option<PairMove>> {
        let open = self.descents.iter_mut().filter(|descent| !descent.is_settled);
        let neighbors = &self.neighbors[player];
        let step = self.steps;
        open.map(|descent| descent.best_move(game, player, neighbors, step)).collect()
    }

    /// Makes a step by the moves of all players (shape: players, open descents).
    pub fn step(&mut self, moves: &[Vec<Option<PairMove>>]) {
        self.steps += 1;
        let open_descents = self.descents.iter_mut().filter(|descent| !descent.is_settled);
        for (open, descent) in open_descents.enumerate() {
            let mut offers: Vec<(usize, PairMove)> = Vec::new();
            for (player, moves) in moves.iter().enumerate() {
                offers.extend(moves.get(open).copied().flatten().map(|offer| (player, offer)));
            }
            // After the last step nobody would learn what its moves cost.
            descent.is_settled = offers.is_empty() || self.steps >= Self::MAX_STEPS;
            if !descent.is_settled {
                descent.make_moves(offers, &self.neighbors, self.steps);
            }
        }
        self.settle_duplicates();
    }

    /// Ends descents that have come to where another one is: from there on they are the same.
    fn settle_duplicates(&mut self) {
        for k in 1..self.descents.len() {
            let (before, from) = self.descents.split_at_mut(k);
            let descent = &mut from[0];
            interrupt::check();
            if !descent.is_settled && before.iter().any(|other| other.joint == descent.joint) {
                descent.is_settled = true;
                descent.players.iter_mut().for_each(|player| player.cost = f64::INFINITY);
            }
        }
    }

    /// Returns the joint move of the first descent: the first start, before the first step.
    ///
    /// # Panics
    /// Without a start.
    pub fn first_joint(&self) -> &[usize] {
        &self.descents[0].joint
    }

    /// Returns the number of neighbors of each player.
    pub fn neighbor_counts(&self) -> Vec<usize> {
        self.neighbors.iter().map(Vec::len).collect()
    }

    /// Returns the cheapest descent; among equals the first.
    fn best(&self) -> &Descent {
        let mut best = &self.descents[0];
        for descent in &self.descents[1..] {
            if descent.cost() < best.cost() {
                best = descent;
            }
        }
        best
    }

    /// Returns the cheapest joint move of all descents.
    ///
    /// # Panics
    /// Without a start.
    pub fn best_joint(&self) -> &[usize] {
        &self.best().joint
    }

    /// Returns its cost.
    ///
    /// # Panics
    /// Without a start.
    pub fn best_cost(&self) -> f64 {
        self.best().cost()
    }

    /// Returns the cost that each strategy of a player has beside the strategies of the others in it.
    ///
    /// # Panics
    /// Without a start.
    pub fn best_costs_given(&self, player: usize) -> &[f64] {
        &self.best().players[player].given
    }
}

impl Descent {
    fn cost(&self) -> f64 {
        self.players.iter().fold(0.0, |sum, player| sum + player.cost)
    }

    /// Sets the costs of a player, and leaves those before in their place.
    fn set_player_costs(&mut self, player: usize, costs: &mut PlayerCosts, step: u32) {
        if costs.given != self.players[player].given {
            self.least[player] = lowest(&costs.given).1;
            self.changed_in[player] = step;
        }
        std::mem::swap(&mut self.players[player], costs);
        let now = self.players[player].given[self.joint[player]];
        let gain = now - self.least[player];
        self.gains_alone[player] = (gain > MIN_SAVED_SHARE * now.abs()).then_some(gain);
    }

    /// Returns the move of a player that saves most, or else of it and a later neighbor; `None` if none does. `neighbors`
    /// are those of the player.
    fn best_move(
        &mut self,
        game: &PairwiseGame,
        player: usize,
        neighbors: &[usize],
        step: u32,
    ) -> Option<PairMove> {
        if let Some(gain) = self.gains_alone[player] {
            let strategy = lowest(&self.players[player].given).0;
            return Some(PairMove { gain, strategy, partner: None });
        }
        // Moves of two are dear to find, and while single ones change what they would save, they are of no use.
        if neighbors.iter().any(|&neighbor| self.gains_alone[neighbor].is_some()) {
            return None;
        }
        self.pair_gains[player].resize(neighbors.len(), PairGain::UNKNOWN);
        let mut best: Option<PairMove> = None;
        let first_later = neighbors.partition_point(|&other| other < player);
        for (place, &other) in neighbors.iter().enumerate().skip(first_later) {
            let min_gain = best.map_or(0.0, |best| best.gain);
            let known = self.pair_gains[player][place];
            let changed_in = self.changed_in[player].max(self.changed_in[other]);
            // Most pairs are as they were in an earlier step, which did not find enough.
            if known.found_in >= changed_in && known.max <= min_gain {
                continue;
            }
            let pair = game.neighbor_pair(player, place);
            let found = self.best_move_of_two(pair, player, min_gain);
            let max = found.map_or(min_gain, |found| found.gain);
            self.pair_gains[player][place] = PairGain { max, found_in: step };
            best = found.or(best);
        }
        best
    }

    /// Returns the move of a player and the other one of a pair that saves most; `None` if none saves more than
    /// `min_gain`.
    fn best_move_of_two(&self, pair: &PairCosts, player: usize, min_gain: f64) -> Option<PairMove> {
        let other = pair.other(player);
        let own = &self.players[player].given;
        let others = &self.players[other].given;
        let table = pair.given(player);
        let of_own = pair.given(other).row(self.joint[other]);
        let of_other = table.row(self.joint[player]);
        let of_both = of_other[self.joint[other]];
        let alone = [own[self.joint[player]], others[self.joint[other]]];
        // What they pay to each other counts once.
        let now = alone[0] + alone[1] - of_both;
        // Of the terms and not of their sum, which may cancel.
        let scale = alone[0].abs() + alone[1].abs() + of_both.abs();
        let mut min_cost = now - min_gain.max(MIN_SAVED_SHARE * scale);
        // Costs without the pair's, of which most strategies have none.
        let least_own = if pair.given(other).is_nonzero(self.joint[other]) {
            least_difference(own, of_own)
        } else {
            self.least[player]
        };
        let least_other = if table.is_nonzero(self.joint[player]) {
            least_difference(others, of_other)
        } else {
            self.least[other]
        };
        if least_own + least_other + table.min >= min_cost {
            return None;
        }
        let rest: Vec<f64> = others.iter().zip(of_other).map(|(sum, cost)| sum - cost).collect();
        let mut best = None;
        for (x, (sum, cost)) in own.iter().zip(of_own).enumerate() {
            let own_rest = sum - cost;
            // No strategy of the other one can be good enough.
            if own_rest + least_other + table.min >= min_cost {
                continue;
            }
            for (y, (rest, cost)) in rest.iter().zip(table.row(x)).enumerate() {
                let cost = own_rest + (rest + cost);
                if cost < min_cost {
                    min_cost = cost;
                    let partner = Some((other, y));
                    best = Some(PairMove { gain: now - cost, strategy: x, partner });
                }
            }
        }
        best
    }

    /// Makes the moves that save most and do not touch each other, so that what they save adds up.
    /// `step` is the next step.
    fn make_moves(
        &mut self,
        mut offers: Vec<(usize, PairMove)>,
        neighbors: &[Vec<usize>],
        step: u32,
    ) {
        offers.sort_by(|(i, a), (j, b)| b.gain.total_cmp(&a.gain).then(i.cmp(j)));
        self.touched.fill(false);
        for (player, offer) in offers {
            let moves = [Some((player, offer.strategy)), offer.partner].into_iter().flatten();
            if moves.clone().any(|(mover, _)| self.touched[mover]) {
                continue;
            }
            for (mover, strategy) in moves {
                self.joint[mover] = strategy;
                self.changed_in[mover] = step;
                self.touched[mover] = true;
                for &neighbor in &neighbors[mover] {
                    self.touched[neighbor] = true;
                }
            }
        }
    }
}

/// Returns whether a cost cannot be improved upon, by a lower bound.
pub fn is_at_bound(cost: f64, bound: f64) -> bool {
    cost - bound <= BOUND_TOLERANCE * cost.abs()
}

/// Returns the strategy of a player in each start: its own choice from the rounds, the cheapest one if it were alone,
/// and one for each of some uniform numbers in [0, 1).
pub fn start_strategies(
    game: &PairwiseGame,
    player: usize,
    chosen: usize,
    uniform: impl Iterator<Item = f64>,
) -> Vec<usize> {
    let strategies = game.strategies()[player];
    let drawn = uniform.map(|u| ((u * strategies as f64) as usize).min(strategies - 1));
    [chosen, game.cheapest_alone(player)].into_iter().chain(drawn).collect()
}

/// Returns the searches from some starts (shape: players, starts) at their ends.
pub(super) fn run_descents(game: &PairwiseGame, starts: &[Vec<usize>]) -> Descents {
    let players = starts.len();
    let neighbors = (0..players).map(|player| game.neighbors(player).collect()).collect();
    let mut descents = Descents::new(neighbors, starts);
    let mut buffer = PlayerCosts::default();
    while descents.count_open() > 0 {
        interrupt::check();
        for player in 0..players {
            descents.update_player_costs(game, player, &mut buffer);
        }
        let moves: Vec<_> =
            (0..players).map(|player| descents.player_moves(game, player)).collect();
        descents.step(&moves);
    }
    descents
}

impl PairwiseGame {
    /// Returns the players with which a player shares a cost, by number.
    pub fn neighbors(&self, player: usize) -> impl Iterator<Item = usize> {
        self.player_pairs[player].iter().map(move |&index| self.pairs[index].other(player))
    }

    /// Returns the pair of a player with one of its neighbors, by the place of that among all of them.
    fn neighbor_pair(&self, player: usize, place: usize) -> &PairCosts {
        &self.pairs[self.player_pairs[player][place]]
    }

    /// Returns the strategy of a player that costs least without the others; among equals the first.
    fn cheapest_alone(&self, player: usize) -> usize {
        lowest(&self.own[player]).0
    }

    /// Writes the costs of a player in a joint move, in place of what was there.
    fn write_player_costs(&self, player: usize, joint: &[usize], costs: &mut PlayerCosts) {
        let PlayerCosts { cost, given } = costs;
        *cost = self.player_cost(joint, player);
        given.clone_from(&self.own[player]);
        for &index in &self.player_pairs[player] {
            let pair = &self.pairs[index];
            let other = pair.other(player);
            let table = pair.given(other);
            if table.is_nonzero(joint[other]) {
                let row = table.row(joint[other]);
                given.iter_mut().zip(row).for_each(|(sum, cost)| *sum += cost);
            }
        }
    }

    /// Returns the cost that each strategy of a player has beside the strategies of the others, up to a constant.
    pub(super) fn costs_given(&self, player: usize, joint: &[usize]) -> Vec<f64> {
        let mut costs = PlayerCosts::default();
        self.write_player_costs(player, joint, &mut costs);
        costs.given
    }

    /// Returns a player's part of a lower bound on the cost of every joint move: the sum of the parts of all players is
    /// one. `neighbors` is the number of neighbors of each player.
    ///
    /// The cost is divided into stars of a player and its neighbors: half of each pair, and of a player's own cost an
    /// equal share for each star that it is in. Each star alone is minimized exactly.
    pub fn bound_part(&self, player: usize, neighbors: &[usize]) -> f64 {
        let share = |player: usize| 1.0 / (neighbors[player] + 1) as f64;
        let own_share = share(player);
        let mut costs: Vec<f64> = self.own[player].iter().map(|cost| own_share * cost).collect();
        for &index in &self.player_pairs[player] {
            let pair = &self.pairs[index];
            let other = pair.other(player);
            let other_share = share(other);
            let others: Vec<f64> = self.own[other].iter().map(|cost| other_share * cost).collect();
            let free = lowest(&others).1;
            let table = pair.given(player);
            for (x, sum) in costs.iter_mut().enumerate() {
                if !table.is_nonzero(x) {
                    *sum += free;
                    continue;
                }
                let least = others.iter().zip(table.row(x)).map(|(own, cost)| own + 0.5 * cost);
                *sum += least.fold(f64::INFINITY, f64::min);
            }
        }
        lowest(&costs).1
    }

    /// Returns a lower bound on the cost of every joint move.
    pub fn lower_bound(&self) -> f64 {
        let players = self.strategies().len();
        let neighbors: Vec<usize> =
            (0..players).map(|player| self.neighbors(player).count()).collect();
        (0..players).fold(0.0, |sum, player| sum + self.bound_part(player, &neighbors))
    }
}

/// Returns the least of `a[x] - b[x]`.
fn least_difference(a: &[f64], b: &[f64]) -> f64 {
    // Several minima side by side, each of which waits for no other one.
    const LANES: usize = 8;
    let mut least = [f64::INFINITY; LANES];
    let [a_chunks, b_chunks] = [a, b].map(|costs| costs.chunks_exact(LANES));
    let tail = a_chunks.remainder().iter().zip(b_chunks.remainder());
    let tail = tail.fold(f64::INFINITY, |least, (a, b)| least.min(a - b));
    for (a, b) in a_chunks.zip(b_chunks) {
        for lane in 0..LANES {
            let difference = a[lane] - b[lane];
            if difference < least[lane] {
                least[lane] = difference;
            }
        }
    }
    least.into_iter().fold(tail, f64::min)
}

/// Returns the place of the lowest cost, the first among equals, and that cost.
fn lowest(costs: &[f64]) -> (usize, f64) {
    let mut best = 0;
    for x in 1..costs.len() {
        if costs[x] < costs[best] {
            best = x;
        }
    }
    (best, costs[best])
}

#[cfg(test)]
mod tests {
    use super::super::game::tests::{game, joints};
    use super::*;
    use proptest::prelude::*;

    /// Returns the searches from one start.
    fn descend_from(game: &PairwiseGame, start: &[usize]) -> Descents {
        let starts: Vec<Vec<usize>> = start.iter().map(|&x| vec![x]).collect();
        run_descents(game, &starts)
    }

    proptest! {
        #[test]
        fn no_two_players_can_save_anything_at_the_end_of_a_descent(
            sizes in prop::collection::vec(1usize..4, 1..5),
            costs in prop::collection::vec(-5.0f64..5.0, 7..60),
        ) {
            let game = game(&sizes, &costs);
            let descents = descend_from(&game, &vec![0; sizes.len()]);
            let end = descents.best_joint();
            prop_assert!((descents.best_cost() - game.cost(end)).abs() < 1e-9);
            for joint in joints(&sizes) {
                let apart = joint.iter().zip(end).filter(|(a, b)| a != b).count();
                prop_assert!(apart > 2 || game.cost(&joint) >= descents.best_cost() - 1e-6);
            }
        }

        #[test]
        fn no_joint_move_is_cheaper_than_the_lower_bound(
            sizes in prop::collection::vec(1usize..4, 1..5),
            costs in prop::collection::vec(-5.0f64..5.0, 7..60),
        ) {
            let game = game(&sizes, &costs);
            let bound = game.lower_bound();
            for joint in joints(&sizes) {
                prop_assert!(game.cost(&joint) >= bound - 1e-9, "{bound}");
            }
        }
    }

    #[test]
    fn two_players_find_their_minimum_from_every_start() {
        let costs: Vec<f64> = (0..40u32).map(|k| f64::from(k * k * 7 % 31)).collect();
        let game = game(&[5, 6], &costs);
        let least =
            joints(&[5, 6]).iter().map(|joint| game.cost(joint)).fold(f64::INFINITY, f64::min);
        for start in joints(&[5, 6]) {
            assert_eq!(descend_from(&game, &start).best_cost(), least, "{start:?}");
        }
        // A single pair is one star.
        assert!(is_at_bound(least, game.lower_bound()));
    }

    #[test]
    fn the_cheapest_end_of_all_starts_is_taken() {
        // Both prefer to choose the same, and cheapest of all is 1; moves of both find it from anywhere, so that a
        // third player is needed for an end that is not the minimum.
        let mut game = PairwiseGame::new(vec![vec![1.0, 0.0]; 3]);
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            game.add_pair(a, b, vec![0.0, 9.0, 9.0, 0.0]);
        }
        assert_eq!(descend_from(&game, &[0, 0, 0]).best_cost(), 3.0);
        let descents = run_descents(&game, &[vec![0, 1], vec![0, 1], vec![0, 0]]);
        assert_eq!(descents.best_joint(), [1, 1, 1]);
        assert_eq!(descents.best_costs_given(0), [19.0, 0.0]);
    }

    #[test]
    fn a_player_of_unknown_costs_keeps_its_strategy() {
        // Only both together save anything: from 2 to 0.
        let mut game = PairwiseGame::new(vec![vec![1.0, 0.0]; 2]);
        game.add_pair(0, 1, vec![0.0, 9.0, 9.0, 0.0]);
        let moves = |is_known: bool| {
            let mut descents = Descents::new(vec![vec![1], vec![0]], &[vec![0], vec![0]]);
            for player in 0..2 {
                let costs = descents.player_costs(&game, player);
                descents.set_player_costs(player, costs);
            }
            if !is_known {
                descents.keep_strategy(&game, 1);
            }
            descents.player_moves(&game, 0)
        };
        let both = PairMove { gain: 2.0, strategy: 1, partner: Some((1, 1)) };
        assert_eq!(moves(true), [Some(both)]);
        assert_eq!(moves(false), [None]);
    }
}
