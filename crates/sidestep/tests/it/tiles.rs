//! Tiles of robots that cannot meet, poses, and the test of fit.

use sidestep::error_models::effector::ObstacleRule;
use sidestep::exact::{ActionOutcome, GridPose};
use sidestep::kernel::Simulation;
use sidestep::scenario::Source;
use sidestep::statistics::chi_square_p_value;
use sidestep::worlds::robots::{RobotsRun, robots_run};
use std::collections::BTreeMap;

/// Chance that a simulator without fault fails one test of fit. Seeds are fixed, so that a
/// test that passes once passes always.
pub(crate) const ALPHA: f64 = 1e-4;

/// Number of the kind `wall`.
pub(crate) const WALL: u8 = 1;
/// Number of the kind `person`.
pub(crate) const PERSON: u8 = 3;

/// A drawing that is repeated `across` x `across` times, walled off from its neighbors:
/// that many robots at the same place, which know nothing of each other.
///
/// `#` is a wall, `P` a person who stands still, and one of `>^<v` the lower-left box of the
/// robot; its other boxes are drawn free.
#[derive(Debug, Clone)]
pub(crate) struct Tiles {
    art: Vec<String>,
    across: u32,
    /// Keys at the top of the scenario.
    keys: String,
    /// Sections beside map, robots and people.
    sections: String,
    /// Its lines on the robots.
    robots: String,
}

impl Tiles {
    pub(crate) fn new(art: &str, across: u32) -> Self {
        let art = art.split_whitespace().map(String::from).collect();
        Self { art, across, keys: String::new(), sections: String::new(), robots: String::new() }
    }

    /// Adds keys at the top.
    pub(crate) fn keys(mut self, text: &str) -> Self {
        self.keys += text;
        self.keys.push('\n');
        self
    }

    /// Adds sections.
    pub(crate) fn sections(mut self, text: &str) -> Self {
        self.sections += text;
        self.sections.push('\n');
        self
    }

    /// Adds keys of the robots.
    pub(crate) fn robots(mut self, text: &str) -> Self {
        self.robots += text;
        self.robots.push('\n');
        self
    }

    /// One copy only.
    pub(crate) fn single(&self) -> Self {
        Self { across: 1, ..self.clone() }
    }

    /// Sides of a tile with the wall that divides it from the next.
    fn pitch(&self) -> (u32, u32) {
        (self.art[0].len() as u32 + 1, self.art.len() as u32 + 1)
    }

    /// Column, row and character of the drawing, rows counted from the south.
    fn drawn(&self) -> impl Iterator<Item = (u32, u32, char)> + '_ {
        let numbered = self.art.iter().rev().enumerate();
        numbered.flat_map(|(r, line)| {
            line.chars().enumerate().map(move |(c, character)| (c as u32, r as u32, character))
        })
    }

    /// The start of the robot of a tile.
    pub(crate) fn start(&self) -> GridPose {
        let robot = |(col, row, character): (u32, u32, char)| {
            let heading = ['>', '^', '<', 'v'].iter().position(|&h| h == character)? as u8;
            Some(GridPose { col: col as i32, row: row as i32, heading })
        };
        self.drawn().find_map(robot).expect("a robot is drawn")
    }

    /// Kind of the thing in a box of a tile.
    pub(crate) fn kind_at(&self, col: i32, row: i32) -> u8 {
        let line = self.art.len() as i32 - 1 - row;
        let found = usize::try_from(line).ok().and_then(|line| {
            self.art.get(line)?.as_bytes().get(usize::try_from(col).ok()?).copied()
        });
        match found {
            None | Some(b'#') => WALL,
            Some(b'P') => PERSON,
            Some(_) => 0,
        }
    }

    /// The scenario.
    pub(crate) fn source(&self) -> Source {
        let text = format!(
            "format = 1\nworld = \"robots\"\n{}\n[map]\nbox_size_m = 0.25\nascii = \"\"\"\n{}\"\"\"\n\
             [robots]\nat = {}\n{}\n{}\n{}",
            self.keys,
            self.map(),
            self.places(&['>', '^', '<', 'v']),
            self.robots,
            self.people(),
            self.sections,
        );
        Source::new("tiles.toml", text, "")
    }

    fn map(&self) -> String {
        let free = |c: char| if c == '#' { '#' } else { '.' };
        let line = |l: &String| {
            (l.chars().map(free).collect::<String>() + "#").repeat(self.across as usize)
        };
        let wall = "#".repeat((self.pitch().0 * self.across) as usize);
        let tile: Vec<String> = std::iter::once(wall).chain(self.art.iter().map(line)).collect();
        (tile.join("\n") + "\n").repeat(self.across as usize)
    }

    /// Places of a character in all tiles, as TOML; a robot's with its heading.
    fn places(&self, characters: &[char]) -> String {
        let (width, height) = self.pitch();
        let mut places = Vec::new();
        for (col, row, character) in self.drawn() {
            let Some(heading) = characters.iter().position(|&c| c == character) else { continue };
            for tile in 0..self.across * self.across {
                let (c, r) =
                    (col + width * (tile % self.across), row + height * (tile / self.across));
                places.push(format!("[{c}, {r}, {heading}]"));
            }
        }
        format!("[{}]", places.join(", "))
    }

    fn people(&self) -> String {
        if !self.drawn().any(|d| d.2 == 'P') {
            return String::new();
        }
        // Due in cycle 999 999 for the first time.
        format!("[people]\nat = {}\nperiod = 1000000\nphase = 1\n", self.places(&['P']))
    }

    /// A run at its start.
    pub(crate) fn simulation(&self) -> RobotsRun {
        robots_run(&self.source(), 2).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Counts of the robots' places, seen from their tile, and the kinds they touched.
    pub(crate) fn outcomes(&self, simulation: &RobotsRun) -> BTreeMap<ActionOutcome, u64> {
        let (width, height) = self.pitch();
        let robots = simulation.agent_count();
        let mut counts = BTreeMap::new();
        for body in &simulation.snapshot().bodies[..robots] {
            let at = ((body.at.0 % width) as i32, (body.at.1 % height) as i32);
            let pose = GridPose { col: at.0, row: at.1, heading: body.facing.heading() };
            let contact = body.contact.get().map(|contact| (contact.kind, contact.side));
            *counts.entry(ActionOutcome { pose, contact }).or_insert(0) += 1;
        }
        counts
    }
}

/// A behavior that does one action again and again.
pub(crate) fn repeating(action: &str) -> String {
    format!("behaviour = {{ kind = \"replay\", actions = [\"{action}\"], repeat = true }}")
}

/// The key that chooses a law.
pub(crate) fn law(rule: ObstacleRule) -> String {
    format!("obstacle_rule = \"{}\"", rule.name())
}

/// The chance of counts that fit `expected` as badly as these or worse: Pearson's chi-square
/// test, cells with fewer than five expected counts pooled. 0 where something impossible was
/// counted.
pub(crate) fn p_value<K: Ord>(counts: &BTreeMap<K, u64>, expected: &BTreeMap<K, f64>) -> f64 {
    let possible = |key: &K| expected.get(key).is_some_and(|&p| p > 0.0);
    if !counts.iter().all(|(key, &n)| n == 0 || possible(key)) {
        return 0.0;
    }
    let n: u64 = counts.values().sum();
    let cell = |(key, p): (&K, &f64)| (counts.get(key).copied().unwrap_or(0) as f64, p * n as f64);
    let (large, rare): (Vec<_>, Vec<_>) = expected.iter().map(cell).partition(|c| c.1 >= 5.0);
    let pooled = rare.iter().fold((0.0, 0.0), |sum, c| (sum.0 + c.0, sum.1 + c.1));
    let cells: Vec<_> = large.into_iter().chain((pooled.1 > 0.0).then_some(pooled)).collect();
    let statistic: f64 = cells.iter().map(|(o, e)| (o - e) * (o - e) / e).sum();
    if cells.len() < 2 { 1.0 } else { chi_square_p_value(statistic, cells.len() - 1) }
}

/// Fails when `counts` do not fit `expected` at the significance [`ALPHA`].
pub(crate) fn assert_fits<K: Ord + std::fmt::Debug>(
    what: &str,
    counts: &BTreeMap<K, u64>,
    expected: &BTreeMap<K, f64>,
) {
    let p = p_value(counts, expected);
    assert!(p > ALPHA, "{what}: p = {p:e}\ncounted {counts:?}\nexpected {expected:?}");
}

#[test]
fn the_test_of_fit_tells_a_fair_die_from_a_loaded_one() {
    let fair: BTreeMap<u8, f64> = (0..6).map(|face| (face, 1.0 / 6.0)).collect();
    let counts = |sixes: u64| (0..6).map(|f| (f, if f == 5 { sixes } else { 100 })).collect();
    assert!(p_value(&counts(104), &fair) > 0.9);
    assert!(p_value(&counts(200), &fair) < 1e-6);
    assert_eq!(p_value(&BTreeMap::from([(7, 1)]), &fair), 0.0);
}
