//! The state of a coordinator: its data about the airplanes that it serves, and the steps of the
//! algorithm on them.

use super::epoch::CoordinatorEpoch;
use crate::agents::traffic_state::StateBeacon;
use crate::agents::{ActionChoice, CommonKnowledge, Ownship, ReachedCost};
use crate::flight::{FlightLevelRange, PairPlane, Prediction};
use crate::objective::{ActionChanges, ActionPredictions, add_pair_costs, own_costs};
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Estimator, PairwiseGame, Player, optimize};
use sidestep_kernel::interrupt;

/// A coordinator's data about one airplane.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct CoordinatorMemberData {
    /// Place of the airplane in the group.
    pub place: usize,
    pub beacon: Option<StateBeacon>,
    /// Its learning player, when expectations are sampled.
    pub player: Option<Player>,
    /// Its samples of this round, with the predictions that were gathered in this tour.
    pub samples: Vec<usize>,
    pub predictions: Vec<Prediction>,
    /// Cost of the predictions to the airplane itself.
    pub own_costs: Vec<f64>,
    pub separation_m: f64,
    pub levels: FlightLevelRange,
    /// Whether it could not be reached, so that its only prediction is presumed.
    pub is_presumed: bool,
    pub decided: Option<ActionChoice>,
    /// Number of its orders that are carried out. It is sent only where actions change levels or speeds, after all else.
    #[serde(skip)]
    pub orders: u32,
}

/// The data of the algorithm up to its present round; with exact expectations one step makes all rounds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct OptimizationProgress {
    /// Number of rounds made, and of calm ones at the end of them.
    pub round: u32,
    pub calm: u32,
    pub airplanes: Vec<CoordinatorMemberData>,
    /// Whether the decisions are made.
    pub is_final: bool,
}

/// The next thing that a coordinator has to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum CoordinatorTask {
    /// Visits the airplanes of its part from this one on.
    Gather(usize),
    /// Returns to the airplane that it comes from.
    Return,
    /// Waits there for the coordinator above.
    Await,
    /// Brings airplanes from this one on their controls.
    Deliver(usize),
    /// Above others: to collect the data of the parts from this one on.
    Collect(usize),
    /// Above others: to bring the results to the parts before this one, the last one first.
    HandBack(usize),
}

/// The data of a coordinator above others about their parts.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct RootCoordinatorData {
    /// The newest known epoch of each part's coordinator, which says where that one is at home.
    pub epochs: Vec<CoordinatorEpoch>,
    /// Whether each part is left out, because its coordinator cannot be found.
    pub missing: Vec<bool>,
    /// Places of hosts that could not be reached.
    pub unreachable: Vec<usize>,
}

/// All of a coordinator: what is sent with each hop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Coordinator {
    pub task: CoordinatorTask,
    pub data: OptimizationProgress,
    /// Present only in the coordinator above others.
    pub hierarchy: Option<RootCoordinatorData>,
    /// Whether actions of the group change levels or speeds, which all know.
    #[serde(skip)]
    pub has_changes: bool,
}

/// Returns the number of samples in a round; `None` where expectations are exact.
pub(super) fn samples_per_round(common: &CommonKnowledge) -> Option<usize> {
    match common.settings.estimator {
        Estimator::Exact => None,
        Estimator::Sampled { block, .. } => Some(block),
    }
}

impl CoordinatorMemberData {
    /// Returns an airplane that is not visited yet.
    pub(super) fn new(place: usize) -> Self {
        Self { place, ..Self::default() }
    }

    /// Reads the model of the airplane that the coordinator is on.
    pub(super) fn update_from_ownship(&mut self, host: &Ownship, round: u32) {
        let options = &host.options;
        self.is_presumed = false;
        self.orders = host.known.orders;
        self.beacon = Some(host.beacon.clone());
        self.separation_m = options.separation_m;
        self.levels = options.levels;
        let costs = own_costs(&host.common.objective, options);
        let Some(block) = samples_per_round(&host.common) else {
            self.predictions.clone_from(&options.predictions);
            self.own_costs = costs;
            return;
        };
        let player = self.player.get_or_insert_with(|| Player::new(options.predictions.len()));
        self.samples = host.samples(player, u64::from(round) * block as u64, block);
        self.predictions = self.samples.iter().map(|&x| options.predictions[x].clone()).collect();
        self.own_costs = self.samples.iter().map(|&x| costs[x]).collect();
    }

    /// Presumes an airplane that is out of reach, as seen from another one.
    pub(super) fn presume(&mut self, from: &Ownship) {
        let options = from.presumed_predictions(self.place);
        // Where all actions are compared, the presumed one counts as its only action.
        let predictions = samples_per_round(&from.common).unwrap_or(1);
        self.is_presumed = true;
        self.separation_m = options.separation_m;
        self.levels = options.levels;
        self.predictions = vec![options.predictions[0].clone(); predictions];
        self.own_costs = vec![0.0; predictions];
        self.samples.clear();
    }

    /// Returns the altitudes and the speeds that its actions lead to; none where they are turns alone, and where it is
    /// presumed.
    fn action_changes(&self, common: &CommonKnowledge) -> Option<ActionChanges> {
        let beacon = self.beacon.as_ref().filter(|_| !self.is_presumed)?;
        common.action_changes(self.place, self.orders, beacon)
    }

    /// Returns its options, where all actions are compared.
    fn options(&self, common: &CommonKnowledge) -> ActionPredictions {
        let frame = common.frame(self.place);
        let predictions = self.predictions.clone();
        let options = ActionPredictions::new(predictions, frame, self.separation_m, self.levels);
        match self.action_changes(common) {
            Some(changes) => options.with_changes(changes),
            None => options,
        }
    }

    /// Drops the predictions and the results of samples, which are no longer needed after a round: they would travel
    /// along.
    fn clear_samples(&mut self) {
        self.predictions.clear();
        self.own_costs.clear();
        self.samples.clear();
    }
}

impl OptimizationProgress {
    /// Takes the step of the algorithm for which all have been visited. `is_late` says that time is
    /// nearly up, so that sampling ends.
    pub(super) fn advance(&mut self, common: &CommonKnowledge, is_late: bool) {
        self.airplanes.sort_unstable_by_key(|airplane| airplane.place);
        match common.settings.estimator {
            Estimator::Exact => self.optimize(common),
            Estimator::Sampled { block, ageing } => {
                self.sampled_round(common, block, ageing, is_late);
            }
        }
        for airplane in &mut self.airplanes {
            airplane.clear_samples();
        }
    }

    /// Makes all rounds with exact expectations.
    fn optimize(&mut self, common: &CommonKnowledge) {
        let all: Vec<ActionPredictions> =
            self.airplanes.iter().map(|airplane| airplane.options(common)).collect();
        let own = self.airplanes.iter().map(|airplane| airplane.own_costs.clone()).collect();
        let mut game = PairwiseGame::new(own);
        for i in 0..all.len() {
            for j in i + 1..all.len() {
                add_pair_costs(&mut game, &common.objective, [i, j], [&all[i], &all[j]]);
            }
        }
        let places: Vec<usize> = self.airplanes.iter().map(|a| a.place).collect();
        let outcome = optimize(&game, &common.settings, |player: usize, k: u64| {
            common.uniform(places[player], k)
        });
        let reached = ReachedCost::from_result(&outcome);
        let each = outcome.joint.into_iter().zip(outcome.expected).zip(outcome.q);
        for (airplane, ((chosen, expected), chances)) in self.airplanes.iter_mut().zip(each) {
            let decided = ActionChoice {
                chosen,
                expected,
                rounds: outcome.rounds,
                converged: outcome.converged,
                reached,
                chances,
            };
            airplane.decided = (!airplane.is_presumed).then_some(decided);
        }
        self.is_final = true;
    }

    /// Makes one round from samples, and the decisions if it is the last one.
    fn sampled_round(
        &mut self,
        common: &CommonKnowledge,
        block: usize,
        ageing: f64,
        is_late: bool,
    ) {
        interrupt::check();
        let stop = common.settings.stop;
        let change = self.learn_from_samples(common, block, ageing);
        self.calm = stop.count_calm_rounds(self.calm, change);
        self.round += 1;
        let is_over = self.calm >= stop.calm_rounds || self.round >= stop.max_rounds;
        if is_over || is_late {
            for airplane in self.airplanes.iter_mut().filter(|a| !a.is_presumed) {
                let Some(player) = &airplane.player else { continue };
                airplane.decided =
                    common.action_choice(airplane.place, player, self.round, self.calm);
            }
            self.is_final = true;
        }
    }

    /// Computes the costs once all predictions of a round are known, summed in the same order as everywhere
    /// else, and updates every player. Returns the largest change of a probability.
    fn learn_from_samples(&mut self, common: &CommonKnowledge, block: usize, ageing: f64) -> f64 {
        let mut total = Vec::with_capacity(block);
        let levels = SampleLevels::new(&self.airplanes, common);
        for k in 0..block {
            let parts = (0..self.airplanes.len())
                .map(|i| self.airplane_cost_in_sample(common, &levels, i, k));
            total.push(parts.fold(0.0, |sum, part| sum + part));
        }
        let settings = common.settings;
        let mut max_change: f64 = 0.0;
        for airplane in &mut self.airplanes {
            let CoordinatorMemberData { player: Some(player), samples, .. } = airplane else {
                continue;
            };
            if samples.is_empty() {
                continue;
            }
            player.learn(samples, &total, ageing);
            max_change = max_change.max(player.update(settings.update, settings.cooling));
        }
        max_change
    }

    /// Returns the part of an airplane in the cost of the joint sample `k`.
    fn airplane_cost_in_sample(
        &self,
        common: &CommonKnowledge,
        levels: &SampleLevels,
        i: usize,
        k: usize,
    ) -> f64 {
        let objective = &common.objective;
        let own = &self.airplanes[i];
        let mut cost = own.own_costs[k];
        for (j, other) in self.airplanes.iter().enumerate() {
            if other.place == own.place || !other.levels.overlaps(&own.levels, objective.vertical_m)
            {
                continue;
            }
            // Others are to keep farther away from one that is presumed.
            let other_separation_m = if other.is_presumed { other.separation_m } else { 0.0 };
            let r = own.separation_m.max(other_separation_m);
            let plane = PairPlane::between(common.frame(own.place), common.frame(other.place));
            let pair = [own, other].map(|one| &one.predictions[k]);
            let meets = |step: usize| {
                let [own, other] = [i, j].map(|i| levels.of_step(&self.airplanes[i], (i, k), step));
                own.overlaps(&other, objective.vertical_m)
            };
            let meets = |step: usize| levels.are_constant || meets(step);
            cost += objective.collision_costs_where(&plane, pair, [r, r], meets)[0];
        }
        cost
    }
}

/// The levels of samples, where actions change them.
struct SampleLevels {
    /// Whether no action changes any.
    are_constant: bool,
    /// The altitudes that the actions of each airplane lead to; none of one whose actions are turns alone.
    changes: Vec<Option<ActionChanges>>,
}

impl SampleLevels {
    fn new(airplanes: &[CoordinatorMemberData], common: &CommonKnowledge) -> Self {
        let are_constant = !common.has_changes();
        let changing = airplanes.iter().filter(|_| !are_constant);
        Self { are_constant, changes: changing.map(|one| one.action_changes(common)).collect() }
    }

    /// Returns the levels of the airplane number `i` in a step of its sample `k`.
    fn of_step(
        &self,
        airplane: &CoordinatorMemberData,
        (i, k): (usize, usize),
        step: usize,
    ) -> FlightLevelRange {
        match (&self.changes[i], airplane.samples.get(k)) {
            (Some(changes), Some(&action)) => changes.step_levels(action, step),
            _ => airplane.levels,
        }
    }
}
