//! The process integrated mechanism: coordinators whose state migrates.
//!
//! A coordinator visits the airplanes in turn. While it is on an airplane it can read that
//! airplane's model: it predicts ways with it, which it then carries along. Its whole state is
//! serialized for every hop, and read back on the other side; these are the bytes that are counted.
//! With sampled expectations it makes a tour per round, because each round has new samples; with
//! exact ones it gathers the ways of all actions in a first tour, and can then compute the rounds
//! on any airplane. A last tour brings each airplane its control.
//!
//! `pim` has one coordinator for a group. `hierarchical-pim` (the paper's outlook) splits the group
//! by proximity into about as many parts as each has members: a coordinator tours each part, all at
//! the same time, and one above them migrates between the parts, gathers their data, and brings
//! back the costs of all samples, from which every part learns on its own. So no coordinator
//! carries the ways of all through every airplane. The algorithm is the same, and so are the
//! controls.
//!
//! A hop is a message like any other, over the [`Transport`](sidestep_kernel::ports::Transport) that is handed in. On a network that
//! loses messages it is repeated until it is acknowledged. An airplane that cannot be reached is
//! left out: it is presumed where it was last heard, and decides for itself. When time is up, an
//! airplane without a control decides for itself too.

mod migration;

use super::contact::Beacon;
use super::link::Ended;
use super::network::Traffic;
use super::own_ship::OwnShip;
use super::{Conclusion, Decided};
use crate::flight::{Levels, Prediction, distance_m};
use crate::objective::{Options, couple, own_costs};
pub use migration::{Journey, Migration};
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Estimator, PairwiseGame, Player, optimize};
use sidestep_kernel::interrupt;

/// A coordinator's data about one airplane.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Visited {
    /// Place of the airplane in the group.
    place: usize,
    beacon: Option<Beacon>,
    /// Its learning player, when expectations are sampled.
    player: Option<Player>,
    /// Its samples of this round; the ways gathered in this tour are beside them.
    samples: Vec<usize>,
    ways: Vec<Prediction>,
    /// Cost of the ways to the airplane itself.
    own_costs: Vec<f64>,
    separation_m: f64,
    levels: Levels,
    /// Whether it could not be reached, so that its only way is presumed.
    is_presumed: bool,
    decided: Option<Decided>,
}

/// A coordinator with its data about the airplanes that it serves.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Coordinator {
    /// Place of the airplane that it starts from and returns to.
    head: usize,
    round: u32,
    calm: u32,
    airplanes: Vec<Visited>,
}

/// Runs the coordinators of a group, one for each part of it. Returns each airplane's conclusion,
/// and the traffic on the network.
pub fn run(
    mut migration: Migration<'_>,
    parts: &[Vec<usize>],
) -> (Vec<Ended<Conclusion>>, Traffic) {
    let parts = parts.iter().filter_map(|part| Coordinator::new(&migration, part));
    let mut team: Vec<Coordinator> = parts.collect();
    match migration.settings().estimator {
        _ if team.is_empty() => {}
        Estimator::Exact => exact(&mut team, &mut migration),
        Estimator::Sampled { block, ageing } => {
            sampled(&mut team, (block, ageing), &mut migration);
        }
    }
    let nothing = Ended { outcome: None, unheard: Vec::new(), late: false };
    let mut told = vec![nothing; migration.hosts.len()];
    deliver(team, &mut migration, &mut told);
    let late = migration.is_late();
    told.iter_mut().filter(|ended| ended.outcome.is_none()).for_each(|ended| ended.late = late);
    (told, Traffic { ticks: migration.gone, ..migration.traffic })
}

impl Coordinator {
    /// Returns the coordinator of a part; none where all radios are dead.
    fn new(migration: &Migration<'_>, part: &[usize]) -> Option<Self> {
        let can_hear = |place: &usize| !migration.silent[*place];
        let head = part.iter().copied().find(can_hear)?;
        let airplane = |&place: &usize| Visited { place, ..Visited::default() };
        Some(Self { head, airplanes: part.iter().map(airplane).collect(), ..Self::default() })
    }

    /// Visits all airplanes of the part, and returns.
    fn tour(&mut self, migration: &mut Migration<'_>, block: Option<usize>) {
        let (head, hosts) = (self.head, migration.hosts);
        let mut at = head;
        for k in 0..self.airplanes.len() {
            let place = self.airplanes[k].place;
            let given_up = self.airplanes[k].is_presumed;
            let is_there = place == at || (!given_up && migration.hop(self, [at, place]));
            let airplane = &mut self.airplanes[k];
            if is_there {
                at = place;
                airplane.see(&hosts[place], self.round, block);
            } else {
                airplane.presume(&hosts[at], block);
            }
        }
        if at != head {
            // It continues from there if it cannot return.
            self.head = if migration.hop(self, [at, head]) { head } else { at };
        }
    }

    /// Forgets the ways of others and the results of their samples, which are no longer needed.
    fn drop_ways(&mut self) {
        for airplane in &mut self.airplanes {
            airplane.ways.clear();
            airplane.own_costs.clear();
            airplane.samples.clear();
        }
    }
}

impl Visited {
    /// Reads the model of the airplane that it is on.
    fn see(&mut self, host: &OwnShip, round: u32, block: Option<usize>) {
        let options = &host.options;
        self.is_presumed = false;
        self.beacon = Some(host.beacon.clone());
        (self.separation_m, self.levels) = (options.separation_m, options.levels);
        let costs = own_costs(&host.briefing.objective, options);
        let Some(block) = block else {
            self.ways.clone_from(&options.predictions);
            self.own_costs = costs;
            return;
        };
        let player = self.player.get_or_insert_with(|| Player::new(options.predictions.len()));
        self.samples = host.samples(player, u64::from(round) * block as u64, block);
        self.ways = self.samples.iter().map(|&x| options.predictions[x].clone()).collect();
        self.own_costs = self.samples.iter().map(|&x| costs[x]).collect();
    }

    /// Presumes an airplane that is out of reach, as seen from another one.
    fn presume(&mut self, from: &OwnShip, block: Option<usize>) {
        let options = from.presumed(self.place);
        self.is_presumed = true;
        (self.separation_m, self.levels) = (options.separation_m, options.levels);
        self.ways = vec![options.predictions[0].clone(); block.unwrap_or(1)];
        self.own_costs = vec![0.0; block.unwrap_or(1)];
        self.samples.clear();
    }
}

/// Tours all parts, all at the same time, and gathers their data: by a coordinator above them,
/// which goes from head to head and ends on the last.
fn gather(
    team: &mut [Coordinator],
    migration: &mut Migration<'_>,
    block: Option<usize>,
) -> Coordinator {
    let began = migration.gone;
    let mut longest = began;
    for part in team.iter_mut() {
        migration.gone = began;
        part.tour(migration, block);
        longest = longest.max(migration.gone);
    }
    migration.gone = longest;
    let mut above = team[0].clone();
    for part in &team[1..] {
        let way = [above.head, part.head];
        if migration.hop(&mut above, way) {
            above.head = part.head;
            above.airplanes.extend(part.airplanes.iter().cloned());
        } else {
            let unreached = part.airplanes.iter().cloned().map(|mut airplane| {
                airplane.presume(&migration.hosts[above.head], block);
                airplane
            });
            above.airplanes.extend(unreached);
        }
    }
    above.airplanes.sort_unstable_by_key(|airplane| airplane.place);
    above
}

/// Brings the results back to all parts.
fn hand_back(mut above: Coordinator, team: &mut [Coordinator], migration: &mut Migration<'_>) {
    above.drop_ways();
    for part in team.iter_mut().rev() {
        if part.head != above.head {
            let way = [above.head, part.head];
            if !migration.hop(&mut above, way) {
                continue;
            }
            above.head = part.head;
        }
        (part.round, part.calm) = (above.round, above.calm);
        for airplane in &mut part.airplanes {
            let of_it = above.airplanes.iter().find(|a| a.place == airplane.place);
            airplane.clone_from(of_it.expect("it was gathered"));
        }
    }
}

fn exact(team: &mut [Coordinator], migration: &mut Migration<'_>) {
    let mut above = gather(team, migration, None);
    let hosts = migration.hosts;
    let options = |a: &Visited| Options::new(a.ways.clone(), a.separation_m, a.levels);
    let all: Vec<Options> = above.airplanes.iter().map(options).collect();
    let mut game = PairwiseGame::new(above.airplanes.iter().map(|a| a.own_costs.clone()).collect());
    let objective = migration.objective();
    for i in 0..all.len() {
        for j in i + 1..all.len() {
            couple(&mut game, objective, (i, &all[i]), (j, &all[j]));
        }
    }
    let places: Vec<usize> = above.airplanes.iter().map(|a| a.place).collect();
    let outcome =
        optimize(&game, &migration.settings(), |player, k| hosts[places[player]].uniform(k));
    let each = outcome.joint.into_iter().zip(outcome.expected).zip(outcome.q);
    for (airplane, ((chosen, expected), chances)) in above.airplanes.iter_mut().zip(each) {
        let (rounds, converged) = (outcome.rounds, outcome.converged);
        let decided = Decided { chosen, expected, rounds, converged, chances };
        airplane.decided = (!airplane.is_presumed).then_some(decided);
    }
    hand_back(above, team, migration);
}

fn sampled(team: &mut [Coordinator], (block, ageing): (usize, f64), migration: &mut Migration<'_>) {
    let hosts = migration.hosts;
    let settings = migration.settings();
    loop {
        interrupt::look();
        let mut above = gather(team, migration, Some(block));
        let change = learn(&mut above, &hosts[0], (block, ageing));
        above.calm = settings.stop.calm(above.calm, change);
        above.round += 1;
        let converged = above.calm >= settings.stop.calm_rounds;
        let ends = converged || above.round >= settings.stop.max_rounds || migration.is_late();
        if ends {
            for airplane in above.airplanes.iter_mut().filter(|a| !a.is_presumed) {
                let Some(player) = &airplane.player else { continue };
                airplane.decided = hosts[airplane.place].decided(player, above.round, above.calm);
            }
        }
        hand_back(above, team, migration);
        if ends {
            return;
        }
    }
}

/// Computes the costs once all ways of a round are known, summed in the same order as everywhere
/// else, and updates every player.
fn learn(above: &mut Coordinator, host: &OwnShip, (block, ageing): (usize, f64)) -> f64 {
    let objective = &host.briefing.objective;
    let all = &above.airplanes;
    let part = |i: usize, k: usize| {
        let own = &all[i];
        let minds = |other: &&Visited| {
            other.place != own.place && other.levels.meets(&own.levels, objective.vertical_m)
        };
        all.iter().filter(minds).fold(own.own_costs[k], |sum, other| {
            // Others are to keep farther away from one that is presumed.
            let wanted_m = if other.is_presumed { other.separation_m } else { 0.0 };
            let r = own.separation_m.max(wanted_m);
            sum + objective.collision(&own.ways[k], &other.ways[k], [r, r])[0]
        })
    };
    let total: Vec<f64> =
        (0..block).map(|k| (0..all.len()).fold(0.0, |sum, i| sum + part(i, k))).collect();
    let settings = host.settings();
    let update = |airplane: &mut Visited| {
        let Visited { player: Some(player), samples, .. } = airplane else { return 0.0 };
        if samples.is_empty() {
            return 0.0;
        }
        player.learn(samples, &total, ageing);
        player.update(settings.update, settings.cooling)
    };
    above.airplanes.iter_mut().map(update).fold(0.0, f64::max)
}

/// Lets every part's coordinator bring its airplanes their controls.
fn deliver(team: Vec<Coordinator>, migration: &mut Migration<'_>, told: &mut [Ended<Conclusion>]) {
    let began = migration.gone;
    let mut longest = began;
    for mut part in team {
        migration.gone = began;
        let mut at = part.head;
        let places: Vec<usize> = part.airplanes.iter().map(|a| a.place).collect();
        for (k, place) in places.into_iter().enumerate() {
            let given_up = part.airplanes[k].is_presumed;
            if place != at && (given_up || !migration.hop(&mut part, [at, place])) {
                continue;
            }
            at = place;
            let mut beacons = vec![None; told.len()];
            for airplane in &part.airplanes {
                beacons[airplane.place].clone_from(&airplane.beacon);
            }
            let presumed = part.airplanes.iter().filter(|a| a.is_presumed);
            told[place] = Ended {
                unheard: presumed.map(|a| a.place).collect(),
                outcome: Some(Conclusion { decided: part.airplanes[k].decided.clone(), beacons }),
                late: false,
            };
        }
        longest = longest.max(migration.gone);
    }
    migration.gone = longest;
}

/// Splits a group by proximity into parts of about as many members as there are parts: each time
/// the first that is left and those nearest to it.
pub fn parts(hosts: &[OwnShip]) -> Vec<Vec<usize>> {
    let size = (hosts.len() as f64).sqrt().ceil() as usize;
    let mut left: Vec<usize> = (0..hosts.len()).collect();
    let mut parts = Vec::new();
    while let Some(&head) = left.first() {
        let from = |place: usize| distance_m(hosts[head].known.pose.at, hosts[place].known.pose.at);
        left.sort_by(|&a, &b| from(a).total_cmp(&from(b)).then(a.cmp(&b)));
        let mut part: Vec<usize> = left.drain(..size.min(left.len())).collect();
        part.sort_unstable();
        parts.push(part);
        left.sort_unstable();
    }
    parts
}
