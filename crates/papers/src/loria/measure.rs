//! One run of one variant, and its results.

use super::LoriaConfig;
use super::errors::{self, BeamCount, ErrorSpread};
use super::floor::{AvoidancePolicy, Floor, ends};
use crate::study::{Progress, run_all, setting, source};
use serde::Serialize;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{MemoryRecorder, Values};
use sidestep::scenario::Source;
use sidestep::worlds::robots::baseline::find_violation;
use sidestep::worlds::robots::effector::ObstacleRule;
use sidestep::worlds::robots::world::Regime;
use sidestep::worlds::robots::{RobotsRun, robots_run};
use std::convert::Infallible;
use std::sync::Arc;

/// The medium floor, with sensors and effectors of an equal error level.
const EQUAL_ERRORS: &str = include_str!("../../scenarios/loria/equal.toml");

/// The tables by which sensors and effectors err.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ErrorTables {
    /// The presets `sonar-ring` and `nomad`.
    Presets,
    /// Those of an equal error level, see [`errors`].
    Equal(f64, ErrorSpread, BeamCount),
}

/// The settings that differ between runs; the seed is not among them.
#[derive(Debug, Clone, Serialize)]
pub(super) struct LoriaVariant {
    /// The building with its robots and people.
    #[serde(skip)]
    pub(super) floor: Arc<Floor>,
    /// The errors that are switched on.
    pub(super) regime: Regime,
    /// The law for blocked paths.
    pub(super) obstacle_rule: ObstacleRule,
    /// The behavior of robots.
    pub(super) mind: AvoidancePolicy,
    /// The errors of sensors and effectors.
    pub(super) tables: ErrorTables,
    /// Robots cover `size` x `size` boxes.
    pub(super) size: u32,
    /// Whether robots have a camera beside the sonar ring.
    pub(super) camera: bool,
}

impl LoriaVariant {
    /// Returns a variant with robots of 2 x 2 boxes with a sonar ring, which avoid the things that
    /// it reports, under the presets and the rule `cut`.
    pub(super) fn new(floor: &Arc<Floor>, regime: Regime) -> Self {
        Self {
            floor: Arc::clone(floor),
            regime,
            obstacle_rule: ObstacleRule::Cut,
            mind: AvoidancePolicy::Avoid,
            tables: ErrorTables::Presets,
            size: 2,
            camera: false,
        }
    }

    /// Returns the scenario of a run: the floor's, with the changes of this variant.
    pub(super) fn source(&self, seed: u64) -> Source {
        let mut settings = vec![
            setting("seed", seed as i64),
            setting("regime", self.regime.name()),
            setting("obstacle_rule", self.obstacle_rule.name()),
        ];
        let mut text = self.floor.scenario;
        let mut sensors = vec!["sonar-ring"];
        if let ErrorTables::Equal(e, spread, beams) = self.tables {
            (text, sensors) = (EQUAL_ERRORS, vec!["equal-ring"]);
            settings.extend(errors::settings(e, spread, beams));
        }
        sensors.extend(self.camera.then_some("camera"));
        for (k, corridor) in self.floor.corridors().enumerate() {
            let key = |name: &str| ["robots", &k.to_string(), name].join(".");
            let [a, b] = ends(corridor, self.size).map(|end| end.to_vec());
            settings.push(setting(&key("size"), self.size));
            settings.push(setting(&key("sensors"), sensors.clone()));
            settings.push(setting(&key("behaviour.a"), a));
            settings.push(setting(&key("behaviour.b"), b));
            settings.push(setting(&key("behaviour.avoidance"), self.mind.name()));
        }
        source(text, &settings).expect("the experiments' scenarios are valid")
    }
}

/// Results of a run of a variant.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(super) struct RunMeasures {
    /// Contacts per 1000 actions, with anything.
    pub(super) contacts: Option<f64>,
    /// Contacts per 1000 actions, with walls.
    pub(super) wall_contacts: Option<f64>,
    /// Contacts per 1000 actions, with robots.
    pub(super) robot_contacts: Option<f64>,
    /// Mean cycles of a completed to-and-fro trip; absent when none was completed.
    pub(super) trip_cycles: Option<f64>,
    /// Completed trips per robot.
    pub(super) trips: Option<f64>,
    /// Net displacement divided by path length over windows of [`WINDOW_CYCLES`], on average.
    pub(super) straightness: Option<f64>,
    /// Moves with a sideways part per 1000 actions.
    pub(super) lateral_moves: Option<f64>,
    /// Whether every robot has acted once a cycle, and at the end no two bodies shared a box
    /// and none stood in a wall.
    pub(super) lawful: bool,
}

/// A measure of an outcome.
pub(super) type Measure = fn(&RunMeasures) -> Option<f64>;

/// Returns the values of a measure by run.
pub(super) fn values(outcomes: &[RunMeasures], measure: Measure) -> Vec<Option<f64>> {
    outcomes.iter().map(measure).collect()
}

/// Length of the windows in which straightness is measured, in cycles.
pub(super) const WINDOW_CYCLES: usize = 20;

/// Shortest path of a window that has a meaningful shape, in boxes.
const MIN_PATH_BOXES: f64 = 10.0;

/// Runs every variant with the seeds of a plan, from 1 on; the outcomes are by variant, then by seed.
///
/// All variants use the same seeds: starts, and every draw that a variant does not itself change,
/// are the same, so that differences between variants are paired by seed.
pub(super) fn measure_all(
    variants: &[LoriaVariant],
    plan: &LoriaConfig,
    what: &str,
    report: &mut Progress<'_>,
) -> Vec<Vec<RunMeasures>> {
    let &LoriaConfig { seeds, cycles, workers, .. } = plan;
    let run = |i: &usize| {
        let (v, seed) = (i / seeds, (i % seeds) as u64 + 1);
        Ok::<_, Infallible>(measure(&variants[v], seed, cycles))
    };
    let numbers: Vec<usize> = (0..variants.len() * seeds).collect();
    let Ok(outcomes) = run_all(&numbers, workers, |share| report(what, share), run);
    outcomes.chunks(seeds).map(<[RunMeasures]>::to_vec).collect()
}

/// Runs one variant once, on one worker.
pub(super) fn measure(variant: &LoriaVariant, seed: u64, cycles: u64) -> RunMeasures {
    let (simulation, tracks) = run_recorded(variant, seed, cycles);
    run_measures(&simulation, &tracks)
}

/// Returns a variant's run at its end, and the poses of its robots by entity id.
pub(super) fn run_recorded(
    variant: &LoriaVariant,
    seed: u64,
    cycles: u64,
) -> (RobotsRun, Vec<Track>) {
    let run = robots_run(&variant.source(seed), 1);
    let mut simulation = run.expect("the experiments' scenarios are valid");
    let tracks = record(&mut simulation, cycles);
    (simulation, tracks)
}

/// Column, row and heading by cycle.
pub(super) type Track = Vec<(u32, u32, u8)>;

/// Runs and keeps the poses of the robots, by entity id.
fn record(simulation: &mut RobotsRun, cycles: u64) -> Vec<Track> {
    simulation.start_recording();
    let schemas = simulation.schemas();
    let mut tracks = vec![Track::with_capacity(cycles as usize); simulation.agents()];
    let mut done = 0;
    while done < cycles {
        done += simulation.advance(cycles - done);
        // One recorder per stretch, so that memory does not grow with the run.
        let mut recorder = MemoryRecorder::new(&schemas);
        simulation.record(&mut recorder).expect("memory takes every row of its schema");
        append_poses(&mut tracks, &recorder);
    }
    tracks
}

fn append_poses(tracks: &mut [Track], recorder: &MemoryRecorder) {
    let column = |name| match recorder.column("trajectories", name) {
        Some(Values::U32(values) | Values::Label(values)) => &values[..],
        _ => &[],
    };
    let places = column("col_boxes").iter().zip(column("row_boxes")).zip(column("heading"));
    for (&body, ((&col, &row), &heading)) in column("body").iter().zip(places) {
        if let Some(track) = tracks.get_mut(body as usize) {
            track.push((col, row, heading as u8));
        }
    }
}

fn run_measures(simulation: &RobotsRun, tracks: &[Track]) -> RunMeasures {
    let total = simulation.metrics().total;
    let per_1000 = |n: u64| (total.actions > 0).then(|| 1e3 * n as f64 / total.actions as f64);
    let of_kind = |kind: &str| per_1000(total.contacts_by_kind.get(kind).copied().unwrap_or(0));
    RunMeasures {
        contacts: per_1000(total.contacts),
        wall_contacts: of_kind("wall"),
        robot_contacts: of_kind("robot"),
        trip_cycles: total.trip_cycles_mean,
        trips: Some(total.trips as f64 / tracks.len() as f64),
        straightness: straightness(tracks),
        lateral_moves: per_1000(tracks.iter().map(|track| lateral_moves(track)).sum()),
        lawful: total.actions == simulation.cycle() * simulation.agents() as u64
            && find_violation(simulation.world(), &simulation.snapshot()).is_none(),
    }
}

/// Returns the mean over all windows of all tracks of net displacement divided by path length: 1
/// for a straight line, less for a zigzag.
fn straightness(tracks: &[Track]) -> Option<f64> {
    let windows = tracks.iter().flat_map(|track| track.chunks_exact(WINDOW_CYCLES + 1));
    let shares: Vec<f64> = windows.filter_map(straightness_of).collect();
    sidestep::statistics::mean(&shares)
}

fn straightness_of(window: &[(u32, u32, u8)]) -> Option<f64> {
    let distance = |a: (u32, u32, u8), b: (u32, u32, u8)| {
        let (dx, dy) = (f64::from(b.0.abs_diff(a.0)), f64::from(b.1.abs_diff(a.1)));
        (dx * dx + dy * dy).sqrt()
    };
    let path: f64 = window.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
    let net = distance(*window.first()?, *window.last()?);
    (path >= MIN_PATH_BOXES).then(|| net / path)
}

/// Returns the number of moves between two cycles that lead aside from the heading before.
fn lateral_moves(track: &[(u32, u32, u8)]) -> u64 {
    let aside = |pair: &&[(u32, u32, u8)]| {
        let ((x, y, heading), (u, v, _)) = (pair[0], pair[1]);
        if heading % 2 == 0 { v != y } else { u != x }
    };
    track.windows(2).filter(aside).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_straight_and_a_staircase_is_not() {
        let line: Track = (0..42).map(|x| (x, 0, 0)).collect();
        assert_eq!(straightness(std::slice::from_ref(&line)), Some(1.0));
        assert_eq!(lateral_moves(&line), 0);
        let stairs: Track = (0..42u32).map(|k| (k.div_ceil(2), k / 2, 0)).collect();
        let share = straightness(std::slice::from_ref(&stairs)).unwrap();
        assert!((share - 0.5_f64.sqrt()).abs() < 1e-3, "{share}");
        assert_eq!(lateral_moves(&stairs), 20);
        assert_eq!(straightness(&[vec![(3, 3, 1); 100]]), None, "who stands has no path");
    }

    #[test]
    fn where_all_is_perfect_nobody_moves_sideways() {
        let floor = Arc::new(Floor::small());
        for mind in AvoidancePolicy::ALL {
            let variant = LoriaVariant { mind, ..LoriaVariant::new(&floor, Regime::Reliable) };
            let outcome = measure(&variant, 1, 600);
            assert_eq!(outcome.lateral_moves, Some(0.0));
            assert!(outcome.trips > Some(0.5), "{outcome:?}");
        }
        let level_0 = LoriaVariant {
            tables: ErrorTables::Equal(0.0, ErrorSpread::Blind, BeamCount::Sixteen),
            ..LoriaVariant::new(&floor, Regime::Both)
        };
        let reliable = LoriaVariant { regime: Regime::Reliable, ..level_0.clone() };
        let [a, b] = [level_0, reliable].map(|v| measure(&v, 1, 300));
        assert_eq!(a, b, "errors of level 0 are none");
    }

    #[test]
    fn outcomes_do_not_depend_on_how_many_runs_are_done_at_once() {
        let floor = Arc::new(Floor::small());
        let variants = [Regime::Reliable, Regime::Both].map(|r| LoriaVariant::new(&floor, r));
        let plan = |workers| LoriaConfig { seeds: 3, cycles: 200, workers, ..LoriaConfig::quick() };
        let all = |workers| measure_all(&variants, &plan(workers), "", &mut |_, _| {});
        let (one, three) = (all(1), all(3));
        assert_eq!(one, three);
        assert!(one[0] != one[1] && one[1].len() == 3);
        assert!(one.iter().flatten().all(|outcome| outcome.lawful));
    }
}
