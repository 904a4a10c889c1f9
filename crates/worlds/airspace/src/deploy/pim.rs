//! The process integrated mechanism: coordinators whose state migrates.
//!
//! A coordinator visits the airplanes in turn. While it is on an airplane it can read that
//! airplane's model: it lets it predict ways, which it then carries along. Its whole state is
//! serialized for every hop, and read back on the other side; these bytes are what is counted.
//! With sampled expectations it makes a tour per round, since each round has new samples; with
//! exact ones it gathers the ways of all actions in a first tour, and can then go through the
//! rounds wherever it is. A last tour brings each airplane its control.
//!
//! `pim` has one coordinator for a group. `hierarchical-pim` (the paper's outlook) splits the
//! group by proximity into about as many parts as each has members: a coordinator tours each
//! part, side by side, and one above them migrates between the parts, gathers what they have
//! gathered, and takes back what all samples cost, from which every part learns by itself. So no
//! coordinator carries the ways of all through every airplane. The algorithm is the same, and so
//! are the controls.
//!
//! On a network that loses messages a hop is made again until it is acknowledged. An airplane
//! that cannot be reached is left out: it is presumed where it was last heard of, and decides for
//! itself. When time is up, whoever has not been told yet decides for itself too.

use super::super::airplane::{Prediction, distance_m};
use super::super::levels::Levels;
use super::super::objective::{Options, couple, own_costs};
use super::super::world::purpose;
use super::contact::Beacon;
use super::link::{Patience, bytes_of};
use super::network::{Ended, Network, Talk, Traffic};
use super::{Came, Decided, Own};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Estimator, PairwiseGame, Player, optimize};
use sidestep_kernel::distr::Chance;

/// Bytes of an acknowledgement.
const ACKNOWLEDGED: usize = 1;

/// What a coordinator has of one airplane.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Visited {
    /// Place in the group.
    place: usize,
    beacon: Option<Beacon>,
    /// Its learning player, of samples,
    player: Option<Player>,
    /// those of this round, and the ways gathered in this tour.
    samples: Vec<usize>,
    ways: Vec<Prediction>,
    /// What the ways cost the airplane itself.
    own_costs: Vec<f64>,
    separation_m: f64,
    levels: Levels,
    /// It could not be reached: its only way is presumed.
    is_presumed: bool,
    decided: Option<Decided>,
}

/// A coordinator: what it carries of the airplanes it is for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Coordinator {
    /// Place of the airplane that it starts from and returns to.
    head: usize,
    round: u32,
    calm: u32,
    airplanes: Vec<Visited>,
}

/// The network as coordinators use it: one hop after the other.
struct Carrier<'a> {
    talk: &'a Talk<'a>,
    hosts: &'a [Own<'a>],
    traffic: Traffic,
    /// Ticks gone by, and how many there are.
    gone: u64,
    most: u64,
    /// Messages so far: what tells them apart.
    sent: u32,
}

impl<'a> Carrier<'a> {
    fn new(talk: &'a Talk<'a>, hosts: &'a [Own<'a>]) -> Self {
        let (begin, end) = talk.ticks();
        Self { talk, hosts, traffic: Traffic::default(), gone: 0, most: end - begin, sent: 0 }
    }

    fn is_late(&self) -> bool {
        self.gone >= self.most
    }

    /// Whether a message arrives, after how many ticks.
    fn sends(&mut self, from: usize, to: usize, bytes: usize) -> Option<u64> {
        self.traffic.count(1, bytes);
        self.sent += 1;
        let Some(network) = self.talk.network else { return Some(1) };
        let id = |place: usize| self.hosts[place].known.slot;
        let faults = network.faults();
        let (begin, _) = self.talk.ticks();
        let words = self.talk.streams.pair(id(from), id(to), begin, purpose::NETWORK, self.sent);
        let lost = Chance::new(faults.loss).happens(words[0]) || self.talk.is_silent(id(to));
        let choices = u64::from(faults.max_delay_cycles) + 1;
        (!lost).then_some(1 + ((u64::from(words[1]) * choices) >> 32))
    }

    /// Takes a coordinator's state from one airplane to another. Whether it has arrived.
    fn hop<S: Serialize + DeserializeOwned>(&mut self, state: &mut S, way: [usize; 2]) -> bool {
        let bytes = bytes_of(state);
        let one = Patience { ticks: 0, tries: 1 };
        let patience = self.talk.network.map_or(one, Network::patience);
        let expected = self.hosts[way[0]].expects(way[1]);
        let mut arrived = false;
        for _ in 0..if expected { patience.tries } else { 1 } {
            if self.is_late() {
                break;
            }
            if let Some(ticks) = self.sends(way[0], way[1], bytes.len()) {
                arrived = true;
                self.gone += ticks;
            }
            let is_ideal = self.talk.network.is_none();
            if arrived && (is_ideal || self.sends(way[1], way[0], ACKNOWLEDGED).is_some()) {
                break;
            }
            self.gone += patience.ticks;
        }
        if arrived {
            // On the other side it is read back.
            *state = postcard::from_bytes(&bytes).expect("the state can be read");
        }
        arrived
    }
}

/// What a run comes to, for each airplane, and what went over the network.
pub(super) type Run = (Vec<Ended<Came>>, Traffic);

/// Runs coordinators over a group, one for each part of it.
pub(super) fn run(talk: &Talk<'_>, hosts: &[Own<'_>], parts: Vec<Vec<usize>>) -> Run {
    let mut carrier = Carrier::new(talk, hosts);
    let mut team: Vec<Coordinator> =
        parts.iter().filter_map(|part| Coordinator::new(talk, hosts, part)).collect();
    match hosts[0].settings().estimator {
        _ if team.is_empty() => {}
        Estimator::Exact => exact(&mut team, &mut carrier),
        Estimator::Sampled { block, ageing } => sampled(&mut team, (block, ageing), &mut carrier),
    }
    let mut told = vec![Ended { outcome: None, unheard: Vec::new(), late: false }; hosts.len()];
    deliver(team, &mut carrier, &mut told);
    let late = carrier.is_late();
    told.iter_mut().filter(|ended| ended.outcome.is_none()).for_each(|ended| ended.late = late);
    (told, carrier.traffic)
}

impl Coordinator {
    /// The coordinator of a part; none where all radios are dead.
    fn new(talk: &Talk<'_>, hosts: &[Own<'_>], part: &[usize]) -> Option<Self> {
        let can_hear = |place: &usize| !talk.is_silent(hosts[*place].known.slot);
        let head = part.iter().copied().find(can_hear)?;
        let airplane = |&place: &usize| Visited { place, ..Visited::default() };
        Some(Self { head, airplanes: part.iter().map(airplane).collect(), ..Self::default() })
    }

    /// Visits all airplanes of the part, and returns.
    fn tour(&mut self, carrier: &mut Carrier<'_>, block: Option<usize>) {
        let (head, hosts) = (self.head, carrier.hosts);
        let mut at = head;
        for k in 0..self.airplanes.len() {
            let place = self.airplanes[k].place;
            let given_up = self.airplanes[k].is_presumed;
            let is_there = place == at || (!given_up && carrier.hop(self, [at, place]));
            let airplane = &mut self.airplanes[k];
            if is_there {
                at = place;
                airplane.see(&hosts[place], self.round, block);
            } else {
                airplane.presume(&hosts[at], block);
            }
        }
        if at != head {
            // It goes on from there if it cannot return.
            self.head = if carrier.hop(self, [at, head]) { head } else { at };
        }
    }

    /// The others' ways are known: forgets them, and what has become of their samples.
    fn drop_ways(&mut self) {
        for airplane in &mut self.airplanes {
            airplane.ways.clear();
            airplane.own_costs.clear();
            airplane.samples.clear();
        }
    }
}

impl Visited {
    /// On the airplane: reads its model.
    fn see(&mut self, host: &Own<'_>, round: u32, block: Option<usize>) {
        let options = &host.options;
        self.is_presumed = false;
        self.beacon = Some(host.beacon());
        (self.separation_m, self.levels) = (options.separation_m, options.levels);
        let costs = own_costs(&host.world.objective, options);
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

    /// Out of reach, as seen from another airplane.
    fn presume(&mut self, from: &Own<'_>, block: Option<usize>) {
        let options = from.presumed(self.place);
        self.is_presumed = true;
        (self.separation_m, self.levels) = (options.separation_m, options.levels);
        self.ways = vec![options.predictions[0].clone(); block.unwrap_or(1)];
        self.own_costs = vec![0.0; block.unwrap_or(1)];
        self.samples.clear();
    }
}

/// Tours all parts, side by side, and gathers what they have: by a coordinator above them, which
/// goes from head to head and ends on the last.
fn gather(
    team: &mut [Coordinator],
    carrier: &mut Carrier<'_>,
    block: Option<usize>,
) -> Coordinator {
    let began = carrier.gone;
    let mut longest = began;
    for part in team.iter_mut() {
        carrier.gone = began;
        part.tour(carrier, block);
        longest = longest.max(carrier.gone);
    }
    carrier.gone = longest;
    let mut above = team[0].clone();
    for part in &team[1..] {
        let way = [above.head, part.head];
        if carrier.hop(&mut above, way) {
            above.head = part.head;
            above.airplanes.extend(part.airplanes.iter().cloned());
        } else {
            let unreached = part.airplanes.iter().cloned().map(|mut airplane| {
                airplane.presume(&carrier.hosts[above.head], block);
                airplane
            });
            above.airplanes.extend(unreached);
        }
    }
    above.airplanes.sort_unstable_by_key(|airplane| airplane.place);
    above
}

/// Takes what has become of it back to all parts.
fn hand_back(mut above: Coordinator, team: &mut [Coordinator], carrier: &mut Carrier<'_>) {
    above.drop_ways();
    for part in team.iter_mut().rev() {
        if part.head != above.head {
            let way = [above.head, part.head];
            if !carrier.hop(&mut above, way) {
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

fn exact(team: &mut [Coordinator], carrier: &mut Carrier<'_>) {
    let mut above = gather(team, carrier, None);
    let hosts = carrier.hosts;
    let options = |a: &Visited| Options::new(a.ways.clone(), a.separation_m, a.levels);
    let all: Vec<Options> = above.airplanes.iter().map(options).collect();
    let mut game = PairwiseGame::new(above.airplanes.iter().map(|a| a.own_costs.clone()).collect());
    let world = hosts[0].world;
    for i in 0..all.len() {
        for j in i + 1..all.len() {
            couple(&mut game, &world.objective, (i, &all[i]), (j, &all[j]));
        }
    }
    let places: Vec<usize> = above.airplanes.iter().map(|a| a.place).collect();
    let outcome = optimize(&game, &world.settings, |player, k| hosts[places[player]].uniform(k));
    let each = outcome.joint.into_iter().zip(outcome.expected);
    for (airplane, (chosen, expected)) in above.airplanes.iter_mut().zip(each) {
        let (rounds, converged) = (outcome.rounds, outcome.converged);
        airplane.decided =
            (!airplane.is_presumed).then_some(Decided { chosen, expected, rounds, converged });
    }
    hand_back(above, team, carrier);
}

fn sampled(team: &mut [Coordinator], (block, ageing): (usize, f64), carrier: &mut Carrier<'_>) {
    let hosts = carrier.hosts;
    let settings = *hosts[0].settings();
    loop {
        let mut above = gather(team, carrier, Some(block));
        let change = learn(&mut above, &hosts[0], (block, ageing));
        above.calm = settings.stop.calm(above.calm, change);
        above.round += 1;
        let converged = above.calm >= settings.stop.calm_rounds;
        let ends = converged || above.round >= settings.stop.max_rounds || carrier.is_late();
        if ends {
            for airplane in above.airplanes.iter_mut().filter(|a| !a.is_presumed) {
                let Some(player) = &airplane.player else { continue };
                airplane.decided = hosts[airplane.place].decided(player, above.round, above.calm);
            }
        }
        hand_back(above, team, carrier);
        if ends {
            return;
        }
    }
}

/// All ways of a round are known: costs, summed as everywhere else, and everybody's update.
fn learn(above: &mut Coordinator, host: &Own<'_>, (block, ageing): (usize, f64)) -> f64 {
    let objective = &host.world.objective;
    let all = &above.airplanes;
    let part = |i: usize, k: usize| {
        let own = &all[i];
        let minds = |other: &&Visited| {
            other.place != own.place && other.levels.meets(&own.levels, objective.vertical_m)
        };
        all.iter().filter(minds).fold(own.own_costs[k], |sum, other| {
            // One that is presumed wants to be kept farther away from.
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

/// Every part's coordinator brings its airplanes their controls.
fn deliver(team: Vec<Coordinator>, carrier: &mut Carrier<'_>, told: &mut [Ended<Came>]) {
    let began = carrier.gone;
    for mut part in team {
        carrier.gone = began;
        let mut at = part.head;
        let places: Vec<usize> = part.airplanes.iter().map(|a| a.place).collect();
        for (k, place) in places.into_iter().enumerate() {
            let given_up = part.airplanes[k].is_presumed;
            if place != at && (given_up || !carrier.hop(&mut part, [at, place])) {
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
                outcome: Some(Came { decided: part.airplanes[k].decided.clone(), beacons }),
                late: false,
            };
        }
    }
}

/// Splits a group by proximity into parts of about as many members as there are parts: the first
/// that is left and those nearest to it.
pub(super) fn parts(hosts: &[Own<'_>]) -> Vec<Vec<usize>> {
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
