//! Silence of any kind, wherever and whenever: dead radios, partitions, links that work one way
//! only, bursts of losses and a short range. No airplane comes near another one that it does not
//! hear.

use crate::airspace_run;
use crate::shield::guarantee_tests::lost_and_named;
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use sidestep_kernel::{Seed, Simulation};
use sidestep_scenario::Source;

/// Time in seconds that each scenario is flown.
const RUN_S: f64 = 300.0;

/// Random scenarios, each made of the draws of its own seed.
pub(super) struct RandomScenario {
    draws: Draws,
    n: u32,
}

impl RandomScenario {
    pub(super) fn new(seed: u64) -> Self {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(900));
        let n = 2 + draws.uniform_below(7);
        Self { draws, n }
    }

    fn happens(&mut self, chance: f64) -> bool {
        self.draws.uniform() < chance
    }

    fn uniform(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.draws.uniform()
    }

    /// Returns a period of any length, as keys.
    fn span(&mut self) -> String {
        let from_s = self.uniform(0.0, 0.7 * RUN_S);
        let until_s = from_s + self.uniform(2.0, RUN_S);
        format!("from_s = {from_s:.1}, until_s = {until_s:.1}")
    }

    /// Returns a partition into two or three sides; some airplanes may be on none.
    fn partition(&mut self) -> String {
        let sides = 2 + self.draws.uniform_below(2);
        let mut members = vec![Vec::new(); sides as usize + 1];
        for id in 0..self.n {
            let side = if self.happens(0.15) { sides } else { self.draws.uniform_below(sides) };
            members[side as usize].push(id);
        }
        members.truncate(sides as usize);
        let while_ = self.span();
        format!("{{ sides = {members:?}, {while_} }}")
    }

    fn one_way(&mut self) -> String {
        let sender = self.draws.uniform_below(self.n);
        let receiver = (sender + 1 + self.draws.uniform_below(self.n - 1)) % self.n;
        let while_ = self.span();
        format!("{{ sender = {sender}, receiver = {receiver}, {while_} }}")
    }

    fn dead(&mut self) -> String {
        let airplane = self.draws.uniform_below(self.n);
        let while_ = self.span();
        format!("{{ airplane = {airplane}, {while_} }}")
    }

    fn list(&mut self, most: u32, one: fn(&mut Self) -> String) -> String {
        let k = self.draws.uniform_below(most + 1);
        let all: Vec<String> = (0..k).map(|_| one(self)).collect();
        format!("[{}]", all.join(", "))
    }

    fn network(&mut self) -> String {
        let partitions = self.list(2, Self::partition);
        let (one_way, silent) = (self.list(3, Self::one_way), self.list(1, Self::dead));
        let loss = if self.happens(0.5) { 0.0 } else { self.uniform(0.0, 0.7) };
        let delay_s = if self.happens(0.5) { 0.0 } else { self.uniform(0.0, 0.02) };
        let mut keys = format!(
            "loss = {loss:.3}\nmax_delay_s = {delay_s:.4}\npartitions = {partitions}\n\
             one_way = {one_way}\nsilent = {silent}\n"
        );
        if self.happens(0.3) {
            let (lasts_s, every_s) = (self.uniform(0.5, 60.0), self.uniform(0.5, 60.0));
            let loss = self.uniform(0.5, 1.0);
            keys += &format!(
                "bursts = {{ loss = {loss:.2}, lasts_s = {lasts_s:.1}, every_s = {every_s:.1} }}\n"
            );
        }
        if self.happens(0.3) {
            keys += &format!("range_m = {:.0}\n", self.uniform(500.0, 6000.0));
        }
        keys
    }

    /// Returns an airplane that comes in later, from the edge to the other side.
    fn late(&mut self) -> String {
        let (x, appears_s) = (self.uniform(-4000.0, 4000.0), self.uniform(0.0, 0.5 * RUN_S));
        format!(
            "[[airplanes]]\nat_m = [{x:.0}, 5000]\nheading_deg = -90\nappears_s = {appears_s:.1}\n\
             way_points_m = [[{:.0}, -5000]]\n",
            -x
        )
    }

    /// Returns the scenario.
    pub(super) fn text(&mut self) -> String {
        let late = if self.happens(0.5) { self.late() } else { String::new() };
        let deployment = ["team", "compact-team", "pim"][self.draws.uniform_below(3) as usize];
        let method = ["none", "none", "mvp", "orca", "pc"][self.draws.uniform_below(5) as usize];
        let (kind, least_m) = match self.happens(0.7) {
            true => ("superconflict", 350.0 * f64::from(self.n)),
            false => ("random", 1300.0 * f64::from(self.n).sqrt()),
        };
        let radius_m = least_m + self.uniform(1000.0, 4000.0);
        let (seed, generated) = (self.draws.next_u32(), self.n);
        // Those that come in later have the ids after the generated ones.
        self.n += u32::from(!late.is_empty());
        let network = self.network();
        format!(
            "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\nmethod = \"{method}\"\n\
             deployment = \"{deployment}\"\n[airspace.network]\n{network}[airspace.generator]\n\
             kind = \"{kind}\"\nn = {generated}\nradius_m = {radius_m:.0}\n{late}"
        )
    }
}

/// Flies the scenario of a seed. Returns the pairs that lose separation without being named, if there are any.
fn fault(seed: u64) -> Option<String> {
    let text = RandomScenario::new(seed).text();
    let mut run = airspace_run(&Source::new("silence", text.clone(), ""), 1).expect("a scenario");
    run.advance((RUN_S / 5.0) as u64);
    let (lost, named) = lost_and_named(&run);
    (!lost.is_subset(&named))
        .then(|| format!("seed {seed}: {lost:?} lost, {named:?} named\n{text}"))
}

/// Flies scenarios until one is wrong.
fn nobody_is_lost(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        if let Some(fault) = fault(seed) {
            panic!("{fault}");
        }
        if seed % 500 == 0 {
            println!("nobody is lost up to seed {seed}");
        }
    }
}

#[test]
fn nobody_comes_near_one_that_it_does_not_hear() {
    nobody_is_lost(0..16);
}

#[test]
#[ignore = "five minutes of processor time; 10,000 scenarios with the other half"]
fn nobody_comes_near_one_that_it_does_not_hear_in_5_000_scenarios() {
    nobody_is_lost(16..5_016);
}

#[test]
#[ignore = "five minutes of processor time; 10,000 scenarios with the other half"]
fn nobody_comes_near_one_that_it_does_not_hear_in_5_000_more_scenarios() {
    nobody_is_lost(5_016..10_016);
}
