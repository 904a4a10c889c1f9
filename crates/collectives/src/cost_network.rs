//! The part of a game that a search for its minimum has not decided yet, in a form with a tight lower bound.
//!
//! Costs can be moved between a pair of players and one of the two, and from a player to the lower bound that all joint
//! moves share, without a change of what any joint move costs: soft arc consistency (Cooper, de Givry, Sanchez, Schiex,
//! Zytnicki and Werner, "Soft arc consistency revisited", 2010). Here the moves are those of sequential
//! tree-reweighted message passing (Kolmogorov, "Convergent tree-reweighted message passing for energy minimization",
//! 2006), which never lowers the bound. A strategy that costs as much as the best joint move known, beside the bound, is
//! in no better one, and is left out.

use super::game::PairwiseGame;

/// The undecided part of a game. All its costs are at least 0.
#[derive(Debug, Clone)]
pub(super) struct CostNetwork {
    /// What every joint move costs at least.
    pub(super) bound: f64,
    pub(super) players: Vec<NetworkPlayer>,
    pairs: Vec<NetworkPair>,
}

/// A player that has not chosen yet.
#[derive(Debug, Clone)]
pub(super) struct NetworkPlayer {
    /// Its number in the game.
    pub(super) player: usize,
    /// The strategies that are left, by their numbers in the game.
    pub(super) strategies: Vec<usize>,
    /// The cost of each of them.
    pub(super) costs: Vec<f64>,
}

/// A pair of players by their places among those left, the earlier one first.
#[derive(Debug, Clone)]
struct NetworkPair {
    places: [usize; 2],
    /// A row for each strategy of the first one.
    costs: Vec<f64>,
}

/// Which way players are visited, and so to which of their pairs they pass costs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sweep {
    Forward,
    Backward,
}

impl NetworkPlayer {
    /// Returns the place of its cheapest strategy, the first among equals.
    pub(super) fn cheapest(&self) -> usize {
        let mut best = 0;
        for x in 1..self.costs.len() {
            if self.costs[x] < self.costs[best] {
                best = x;
            }
        }
        best
    }
}

impl NetworkPair {
    /// Returns the place of the player that is not at `place`.
    fn other(&self, place: usize) -> usize {
        self.places[0] + self.places[1] - place
    }

    /// Moves costs to the strategies of the player at `place`: of each as much as the other player has to pay beside it
    /// anyway.
    fn project(&mut self, place: usize, costs: &mut [f64], width: usize) {
        if place == self.places[0] {
            for (row, sum) in self.costs.chunks_exact_mut(width).zip(costs) {
                let least = lowest(row);
                if least > 0.0 {
                    row.iter_mut().for_each(|cost| *cost -= least);
                    *sum += least;
                }
            }
            return;
        }
        let mut least = vec![f64::INFINITY; width];
        for row in self.costs.chunks_exact(width) {
            least.iter_mut().zip(row).for_each(|(least, cost)| *least = least.min(*cost));
        }
        for row in self.costs.chunks_exact_mut(width) {
            row.iter_mut().zip(&least).for_each(|(cost, least)| *cost -= least);
        }
        costs.iter_mut().zip(least).for_each(|(sum, least)| *sum += least);
    }

    /// Adds costs of the strategies of the player at `place`.
    fn extend(&mut self, place: usize, costs: &[f64], width: usize) {
        let is_first = place == self.places[0];
        for (x, row) in self.costs.chunks_exact_mut(width).enumerate() {
            if is_first {
                row.iter_mut().for_each(|sum| *sum += costs[x]);
            } else {
                row.iter_mut().zip(costs).for_each(|(sum, cost)| *sum += cost);
            }
        }
    }
}

impl CostNetwork {
    /// Returns the network of a game. `least` is the cost of a joint move: no better one has a part that costs as much.
    pub(super) fn new(game: &PairwiseGame, least: f64) -> Self {
        let own_shifts: f64 = game.own.iter().map(|costs| lowest(costs)).sum();
        let pair_shifts: f64 = game.pairs.iter().map(|pair| pair.given_a.min).sum();
        let bound = own_shifts + pair_shifts;
        // Larger costs would only add to the rounding.
        let most = (least - bound).max(0.0);
        let shifted = |costs: &[f64], least: f64| -> Vec<f64> {
            costs.iter().map(|cost| (cost - least).min(most)).collect()
        };
        let players = game.own.iter().enumerate().map(|(player, costs)| NetworkPlayer {
            player,
            strategies: (0..costs.len()).collect(),
            costs: shifted(costs, lowest(costs)),
        });
        let pairs = game.pairs.iter().map(|pair| {
            let [first, second] = [pair.a.min(pair.b), pair.a.max(pair.b)];
            let table = pair.given(first);
            NetworkPair {
                places: [first, second],
                costs: (0..game.own[first].len())
                    .flat_map(|row| shifted(table.row(row), table.min))
                    .collect(),
            }
        });
        Self { bound, players: players.collect(), pairs: pairs.collect() }
    }

    /// Moves costs toward the bound, forward and backward once, and returns by how much it has risen.
    pub(super) fn raise_bound(&mut self) -> f64 {
        let before = self.bound;
        let of_player = self.pairs_of_players();
        for (place, pairs) in of_player.iter().enumerate() {
            self.visit(place, pairs, Sweep::Forward);
        }
        for (place, pairs) in of_player.iter().enumerate().rev() {
            self.visit(place, pairs, Sweep::Backward);
        }
        self.bound - before
    }

    /// Returns the indices of the pairs of each player.
    fn pairs_of_players(&self) -> Vec<Vec<usize>> {
        let mut of_player = vec![Vec::new(); self.players.len()];
        for (index, pair) in self.pairs.iter().enumerate() {
            pair.places.iter().for_each(|&place| of_player[place].push(index));
        }
        of_player
    }

    /// Collects at a player what its pairs cost in any case, moves what all its strategies cost to the bound, and passes
    /// the rest on to its pairs with those that are visited after it.
    fn visit(&mut self, place: usize, pairs: &[usize], sweep: Sweep) {
        let mut costs = std::mem::take(&mut self.players[place].costs);
        for &index in pairs {
            let width = self.width(index);
            self.pairs[index].project(place, &mut costs, width);
        }
        let least = lowest(&costs);
        self.bound += least;
        costs.iter_mut().for_each(|cost| *cost -= least);
        let is_later = |index: &usize| {
            let is_after = self.pairs[*index].other(place) > place;
            is_after == (sweep == Sweep::Forward)
        };
        let later: Vec<usize> = pairs.iter().copied().filter(is_later).collect();
        let parts = later.len().max(pairs.len() - later.len());
        if !later.is_empty() {
            // As many parts as there are chains of pairs through the player; those that end here are kept.
            let part: Vec<f64> = costs.iter().map(|cost| cost / parts as f64).collect();
            for &index in &later {
                let width = self.width(index);
                self.pairs[index].extend(place, &part, width);
            }
            let kept = (parts - later.len()) as f64;
            costs = part.iter().map(|part| part * kept).collect();
        }
        self.players[place].costs = costs;
    }

    /// Returns the number of strategies of the second player of a pair.
    fn width(&self, index: usize) -> usize {
        self.players[self.pairs[index].places[1]].strategies.len()
    }

    /// Collects the costs of all pairs at their players, as far as possible, and leaves out the strategies that are in no
    /// joint move cheaper than `least`. Returns whether all players have one left.
    pub(super) fn prune(&mut self, least: f64) -> bool {
        for index in 0..self.pairs.len() {
            for place in self.pairs[index].places {
                let width = self.width(index);
                self.pairs[index].project(place, &mut self.players[place].costs, width);
            }
        }
        for player in &mut self.players {
            let own = lowest(&player.costs);
            self.bound += own;
            player.costs.iter_mut().for_each(|cost| *cost -= own);
        }
        let most = least - self.bound;
        let is_left = |player: &NetworkPlayer| -> Vec<bool> {
            player.costs.iter().map(|cost| *cost < most).collect()
        };
        let left: Vec<Vec<bool>> = self.players.iter().map(is_left).collect();
        if left.iter().any(|left| left.iter().all(|is_left| !is_left)) {
            return false;
        }
        if left.iter().flatten().all(|is_left| *is_left) {
            return true;
        }
        for pair in &mut self.pairs {
            let [rows, columns] = pair.places.map(|place| &left[place]);
            let kept_rows = pair.costs.chunks_exact(columns.len()).zip(rows);
            pair.costs = kept_rows
                .filter(|(_, is_left)| **is_left)
                .flat_map(|(row, _)| kept(row, columns))
                .collect();
        }
        for (player, left) in self.players.iter_mut().zip(&left) {
            player.strategies = kept(&player.strategies, left);
            player.costs = kept(&player.costs, left);
        }
        true
    }

    /// Returns the network beside a strategy of the player at `place`.
    pub(super) fn given(&self, place: usize, strategy: usize) -> Self {
        let mut rest = Self {
            bound: self.bound + self.players[place].costs[strategy],
            players: self.players.clone(),
            pairs: Vec::with_capacity(self.pairs.len()),
        };
        for (index, pair) in self.pairs.iter().enumerate() {
            let width = self.width(index);
            let [first, second] = pair.places;
            if first == place {
                let row = &pair.costs[strategy * width..][..width];
                rest.players[second].costs.iter_mut().zip(row).for_each(|(sum, cost)| *sum += cost);
            } else if second == place {
                let column = pair.costs[strategy..].iter().step_by(width);
                rest.players[first]
                    .costs
                    .iter_mut()
                    .zip(column)
                    .for_each(|(sum, cost)| *sum += cost);
            } else {
                let places = pair.places.map(|other| other - usize::from(other > place));
                rest.pairs.push(NetworkPair { places, costs: pair.costs.clone() });
            }
        }
        rest.players.remove(place);
        rest
    }
}

/// Returns the items that are left.
fn kept<T: Copy>(items: &[T], is_left: &[bool]) -> Vec<T> {
    items.iter().zip(is_left).filter(|(_, is_left)| **is_left).map(|(item, _)| *item).collect()
}

/// Returns the lowest of all costs.
fn lowest(costs: &[f64]) -> f64 {
    costs.iter().copied().fold(f64::INFINITY, f64::min)
}
