//! The games that are optimized.

/// Strategies that are less probable than this do not count in expectations: a player keeps each at a tenth of it, so
/// that it may return, and after some rounds nearly all are there.
const MIN_COUNTED_PROBABILITY: f64 = 1e-8;

/// A finite game of common cost.
pub trait Game {
    /// Returns the number of strategies of each player (shape: players), at least 1 each.
    fn strategies(&self) -> &[usize];

    /// Returns the cost `G(x)` of a joint move, which is one strategy per player (eq. 1).
    fn cost(&self, joint: &[usize]) -> f64;

    /// Returns the part of the cost that player `i` can influence; the part left out must not
    /// depend on `joint[i]`. It has the same minimum for `i`, with less noise from the costs of
    /// others among themselves.
    fn private_cost(&self, joint: &[usize], _player: usize) -> f64 {
        self.cost(joint)
    }

    /// Returns the game as a sum over pairs, if it is one, because expectations then need no
    /// samples.
    fn as_pairwise(&self) -> Option<&PairwiseGame> {
        None
    }
}

/// A cost that is a sum over players and pairs of players:
/// `G(x) = sum_i own_i(x_i) + sum_{i<j} pair_ij(x_i, x_j)`.
#[derive(Debug, Clone, Default)]
pub struct PairwiseGame {
    strategies: Vec<usize>,
    pub(super) own: Vec<Vec<f64>>,
    pub(super) pairs: Vec<PairCosts>,
    /// Indices of each player's pairs.
    pub(super) player_pairs: Vec<Vec<usize>>,
}

/// The costs of the joint strategies of two players. They are stored with a row per strategy of either player, because
/// expectations read whole rows.
#[derive(Debug, Clone)]
pub(super) struct PairCosts {
    pub(super) a: usize,
    pub(super) b: usize,
    /// The joint cost of two strategies: a row per strategy of `a`.
    pub(super) given_a: CostTable,
    /// The same with a row per strategy of `b`.
    given_b: CostTable,
    /// The same divided into the parts of `a` and of `b`: `parts[x_a * strategies_b + x_b]`.
    parts: Vec<[f64; 2]>,
}

/// The costs of one player's strategies, a row per strategy of another.
#[derive(Debug, Clone)]
pub(super) struct CostTable {
    width: usize,
    costs: Vec<f64>,
    /// Rows with any cost that is not 0, in increasing order: most strategies of two airplanes do not conflict.
    nonzero_rows: Vec<usize>,
    /// Whether each row has any.
    is_nonzero_row: Vec<bool>,
    /// The lowest cost of all.
    pub(super) min: f64,
}

impl PairCosts {
    /// Returns the player of the pair that a player is not.
    pub(super) fn other(&self, player: usize) -> usize {
        self.a + self.b - player
    }

    /// Returns the costs with a row per strategy of a player.
    pub(super) fn given(&self, player: usize) -> &CostTable {
        if player == self.a { &self.given_a } else { &self.given_b }
    }
}

impl CostTable {
    fn new(width: usize, costs: Vec<f64>) -> Self {
        let rows = costs.chunks_exact(width);
        let is_nonzero_row: Vec<bool> =
            rows.map(|costs| costs.iter().any(|cost| *cost != 0.0)).collect();
        let nonzero_rows = (0..is_nonzero_row.len()).filter(|&row| is_nonzero_row[row]).collect();
        let min = costs.iter().copied().fold(f64::INFINITY, f64::min);
        Self { width, costs, nonzero_rows, is_nonzero_row, min }
    }

    /// Returns whether a row has any cost that is not 0.
    pub(super) fn is_nonzero(&self, row: usize) -> bool {
        self.is_nonzero_row[row]
    }

    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.costs[row * self.width..][..self.width]
    }

    /// Adds the expected costs if rows have the probabilities `q`.
    fn add_expected_costs(&self, q: &[f64], expected: &mut [f64]) {
        for &row in &self.nonzero_rows {
            let p = q[row];
            if p < MIN_COUNTED_PROBABILITY {
                continue;
            }
            expected.iter_mut().zip(self.row(row)).for_each(|(sum, cost)| *sum += cost * p);
        }
    }
}

impl PairwiseGame {
    /// Size of a pair in bytes per combination of two strategies.
    pub const BYTES_PER_ENTRY: u64 = 3 * size_of::<f64>() as u64;

    /// Creates a game of players that pay for their own strategies alone; `own[i][x]` is the cost
    /// of strategy `x` for player `i`.
    ///
    /// # Panics
    /// When a player has no strategy.
    pub fn new(own: Vec<Vec<f64>>) -> Self {
        assert!(own.iter().all(|costs| !costs.is_empty()), "every player needs a strategy");
        let strategies: Vec<usize> = own.iter().map(Vec::len).collect();
        Self { player_pairs: vec![Vec::new(); own.len()], strategies, own, pairs: Vec::new() }
    }

    /// Adds the joint cost of the strategies of players `a` and `b`: `costs[x_a][x_b]`, row by row
    /// in one list. A pair without any cost is left out.
    ///
    /// # Panics
    /// When `a` is `b`, one of them does not exist, or the list has another length.
    pub fn add_pair(&mut self, a: usize, b: usize, costs: Vec<f64>) {
        self.add_split_pair(a, b, costs.into_iter().map(|cost| [cost, 0.0]).collect());
    }

    /// Adds a pair of which each player bears a part: `parts[x_a][x_b]` are those of `a` and `b`.
    /// The cost of a joint move is summed player by player, each player's own costs first and then
    /// its parts by increasing number of the other player, so that players that sum separately get
    /// the same bits.
    ///
    /// # Panics
    /// The same as for [`PairwiseGame::add_pair`].
    pub fn add_split_pair(&mut self, a: usize, b: usize, parts: Vec<[f64; 2]>) {
        assert!(a != b, "a pair is two players");
        assert_eq!(
            parts.len(),
            self.strategies[a] * self.strategies[b],
            "one cost per two strategies"
        );
        if parts.iter().all(|part| *part == [0.0; 2]) {
            return;
        }
        let strategies_a = self.strategies[a];
        let strategies_b = self.strategies[b];
        let costs: Vec<f64> = parts.iter().map(|[of_a, of_b]| of_a + of_b).collect();
        let mut transposed = Vec::with_capacity(costs.len());
        for x_b in 0..strategies_b {
            transposed.extend(costs[x_b..].iter().step_by(strategies_b));
        }
        let given_a = CostTable::new(strategies_b, costs);
        let given_b = CostTable::new(strategies_a, transposed);
        let index = self.pairs.len();
        self.pairs.push(PairCosts { a, b, given_a, given_b, parts });
        self.index_pair(a, b, index);
        self.index_pair(b, a, index);
    }

    /// Adds a pair to a player's list, which is sorted by the number of the other player.
    fn index_pair(&mut self, player: usize, other: usize, index: usize) {
        let pairs = &self.pairs;
        let player_pairs = &mut self.player_pairs[player];
        let slot = player_pairs.partition_point(|&k| pairs[k].other(player) < other);
        player_pairs.insert(slot, index);
    }

    /// Returns the costs of a player's strategies for itself alone.
    pub fn own_costs(&self, player: usize) -> &[f64] {
        &self.own[player]
    }

    /// Returns the pairs that cost anything: their players `a` and `b`, and the joint costs of their strategies as for
    /// [`PairwiseGame::add_pair`].
    pub fn pair_costs(&self) -> impl Iterator<Item = (usize, usize, &[f64])> {
        self.pairs.iter().map(|pair| (pair.a, pair.b, pair.given_a.costs.as_slice()))
    }

    /// Returns the part of a joint move's cost that a player bears.
    pub fn player_cost(&self, joint: &[usize], player: usize) -> f64 {
        let mut sum = self.own[player][joint[player]];
        for &index in &self.player_pairs[player] {
            let PairCosts { a, b, parts, .. } = &self.pairs[index];
            let parts = parts[joint[*a] * self.strategies[*b] + joint[*b]];
            sum += parts[usize::from(*b == player)];
        }
        sum
    }

    /// Writes `E[G | x_i = x]`, less a part that is the same for all `x`, into `expected` (shape:
    /// strategies of player `i`), where the others play `q`: the closed form of eq. 3. Strategies that are less probable than
    /// 1e-8 do not count.
    pub fn expected_costs(&self, player: usize, q: &[Vec<f64>], expected: &mut Vec<f64>) {
        expected.clear();
        expected.extend_from_slice(&self.own[player]);
        for &index in &self.player_pairs[player] {
            let pair = &self.pairs[index];
            let other = pair.other(player);
            pair.given(other).add_expected_costs(&q[other], expected);
        }
    }

    fn pair_cost(&self, index: usize, joint: &[usize]) -> f64 {
        let PairCosts { a, b, given_a, .. } = &self.pairs[index];
        given_a.row(joint[*a])[joint[*b]]
    }
}

impl Game for PairwiseGame {
    fn strategies(&self) -> &[usize] {
        &self.strategies
    }

    fn cost(&self, joint: &[usize]) -> f64 {
        (0..self.strategies.len()).fold(0.0, |sum, player| sum + self.player_cost(joint, player))
    }

    fn private_cost(&self, joint: &[usize], player: usize) -> f64 {
        let pairs = self.player_pairs[player].iter().map(|&index| self.pair_cost(index, joint));
        self.own[player][joint[player]] + pairs.sum::<f64>()
    }

    fn as_pairwise(&self) -> Option<&PairwiseGame> {
        Some(self)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Creates a game of any shape with costs from `costs`, repeated.
    pub(crate) fn game(sizes: &[usize], costs: &[f64]) -> PairwiseGame {
        let mut costs = costs.iter().copied().cycle();
        let mut some = |n: usize| costs.by_ref().take(n).collect::<Vec<f64>>();
        let mut game = PairwiseGame::new(sizes.iter().map(|&n| some(n)).collect());
        for a in 0..sizes.len() {
            for b in a + 1..sizes.len() {
                game.add_pair(a, b, some(sizes[a] * sizes[b]));
            }
        }
        game
    }

    /// Returns all joint moves.
    pub(crate) fn joints(sizes: &[usize]) -> Vec<Vec<usize>> {
        sizes.iter().fold(vec![vec![]], |all, &n| {
            let longer = |joint: &Vec<usize>| {
                (0..n).map(|x| [joint.as_slice(), &[x]].concat()).collect::<Vec<_>>()
            };
            all.iter().flat_map(longer).collect()
        })
    }

    proptest! {
        /// Eq. 3 by enumeration of all joint moves.
        #[test]
        fn the_closed_form_is_the_expectation(
            sizes in prop::collection::vec(1usize..4, 1..5),
            costs in prop::collection::vec(-5.0f64..5.0, 7..40),
            weights in prop::collection::vec(0.01f64..1.0, 16),
        ) {
            let game = game(&sizes, &costs);
            let mut weights = weights.iter().copied().cycle();
            let q: Vec<Vec<f64>> = sizes.iter().map(|&n| {
                let row: Vec<f64> = weights.by_ref().take(n).collect();
                let sum: f64 = row.iter().sum();
                row.iter().map(|w| w / sum).collect()
            }).collect();
            for player in 0..sizes.len() {
                let mut closed = Vec::new();
                game.expected_costs(player, &q, &mut closed);
                let mut enumerated = vec![0.0; sizes[player]];
                for joint in joints(&sizes) {
                    let others = (0..sizes.len()).filter(|&j| j != player);
                    let p: f64 = others.map(|j| q[j][joint[j]]).product();
                    enumerated[joint[player]] += p * game.private_cost(&joint, player);
                }
                for (a, b) in closed.iter().zip(&enumerated) {
                    prop_assert!((a - b).abs() < 1e-9, "{closed:?} {enumerated:?}");
                }
            }
        }

        /// The part that the private cost leaves out does not depend on the player.
        #[test]
        fn private_and_joint_costs_differ_by_what_others_pay(
            sizes in prop::collection::vec(1usize..4, 2..4),
            costs in prop::collection::vec(-5.0f64..5.0, 7..40),
        ) {
            let game = game(&sizes, &costs);
            for joint in joints(&sizes) {
                for player in 0..sizes.len() {
                    let rest = |joint: &[usize]| game.cost(joint) - game.private_cost(joint, player);
                    let mut other = joint.clone();
                    other[player] = 0;
                    prop_assert!((rest(&joint) - rest(&other)).abs() < 1e-9);
                }
            }
        }
    }
}
