//! One run of one variant, and its results.

use super::LoriaConfig;
use super::errors::{self, BeamCount, ErrorSpread};
use super::floor::{AvoidancePolicy, Floor, ends};
use crate::study::{Progress, run_all, setting, source};
use serde::Serialize;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{ColumnValues, MemoryRecorder};
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
    /// How robots deal with obstacles.
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
            text = EQUAL_ERRORS;
            sensors = vec!["equal-ring"];
            settings.extend(errors::settings(e, spread, beams));
        }
        if self.camera {
            sensors.push("camera");
        }
        for (k, corridor) in self.floor.corridors().enumerate() {
            let [a, b] = ends(corridor, self.size).map(|end| end.to_vec());
            settings.push(setting(&format!("robots.{k}.size"), self.size));
            settings.push(setting(&format!("robots.{k}.sensors"), sensors.clone()));
            settings.push(setting(&format!("robots.{k}.behaviour.a"), a));
            settings.push(setting(&format!("robots.{k}.behaviour.b"), b));
            let avoidance = self.mind.name();
            settings.push(setting(&format!("robots.{k}.behaviour.avoidance"), avoidance));
        }
        source(text, &settings).expect("the experiments' scenarios are valid")
    }
}

/// Results of one run of a variant, by which the paper's claims are judged.
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

/// One number of an outcome; `None` where the run does not have it.
pub(super) type Measure = fn(&RunMeasures) -> Option<f64>;

/// One value per run, in the order of `outcomes`.
pub(super) fn values(outcomes: &[RunMeasures], measure: Measure) -> Vec<Option<f64>> {
    outcomes.iter().map(measure).collect()
}

/// Length of the windows in which straightness is measured, in cycles: long enough for a zigzag of single steps, short beside
/// a trip along a corridor, of which the turns are no zigzag.
pub(super) const WINDOW_CYCLES: usize = 20;

/// Shortest path of a window that has a meaningful shape, in boxes: a robot that hardly moves goes two or three boxes, which
/// are straight by chance.
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
    let mut runs: Vec<(&LoriaVariant, u64)> = Vec::new();
    for variant in variants {
        for seed in 1..=plan.seeds as u64 {
            runs.push((variant, seed));
        }
    }
    let Ok(outcomes) = run_all(
        &runs,
        plan.workers,
        |share| report(what, share),
        |(variant, seed)| Ok::<_, Infallible>(measure(variant, *seed, plan.cycles)),
    );
    outcomes.chunks(plan.seeds).map(<[RunMeasures]>::to_vec).collect()
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
    let mut tracks = vec![Track::with_capacity(cycles as usize); simulation.agent_count()];
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
    let bodies = trajectory_column(recorder, "body");
    let cols = trajectory_column(recorder, "col_boxes");
    let rows = trajectory_column(recorder, "row_boxes");
    let headings = trajectory_column(recorder, "heading");
    for (row, &body) in bodies.iter().enumerate() {
        // Robots have the first ids; people have no track.
        if let Some(track) = tracks.get_mut(body as usize) {
            track.push((cols[row], rows[row], headings[row] as u8));
        }
    }
}

fn trajectory_column<'a>(recorder: &'a MemoryRecorder, name: &str) -> &'a [u32] {
    match recorder.column("trajectories", name) {
        Some(ColumnValues::U32(values) | ColumnValues::Label(values)) => &values[..],
        _ => &[],
    }
}

fn run_measures(simulation: &RobotsRun, tracks: &[Track]) -> RunMeasures {
    let total = simulation.metrics().total;
    let wall_contacts = total.contacts_by_kind.get("wall").copied().unwrap_or(0);
    let robot_contacts = total.contacts_by_kind.get("robot").copied().unwrap_or(0);
    let lateral_moves = tracks.iter().map(|track| lateral_moves(track)).sum();
    RunMeasures {
        contacts: per_1000(total.contacts, total.actions),
        wall_contacts: per_1000(wall_contacts, total.actions),
        robot_contacts: per_1000(robot_contacts, total.actions),
        trip_cycles: total.trip_cycles_mean,
        trips: Some(total.trips as f64 / tracks.len() as f64),
        straightness: straightness(tracks),
        lateral_moves: per_1000(lateral_moves, total.actions),
        lawful: total.actions == simulation.cycle() * simulation.agent_count() as u64
            && find_violation(simulation.world(), &simulation.snapshot()).is_none(),
    }
}

fn per_1000(n: u64, actions: u64) -> Option<f64> {
    (actions > 0).then(|| 1e3 * n as f64 / actions as f64)
}

/// Returns the mean over all windows of all tracks of net displacement divided by path length: 1
/// for a straight line, less for a zigzag.
fn straightness(tracks: &[Track]) -> Option<f64> {
    let windows = tracks.iter().flat_map(|track| track.chunks_exact(WINDOW_CYCLES + 1));
    let shares: Vec<f64> = windows.filter_map(straightness_of).collect();
    sidestep::statistics::mean(&shares)
}

fn straightness_of(window: &[(u32, u32, u8)]) -> Option<f64> {
    let path: f64 = window.windows(2).map(|pair| distance_boxes(pair[0], pair[1])).sum();
    let net = distance_boxes(*window.first()?, *window.last()?);
    (path >= MIN_PATH_BOXES).then(|| net / path)
}

fn distance_boxes(a: (u32, u32, u8), b: (u32, u32, u8)) -> f64 {
    let dx = f64::from(b.0.abs_diff(a.0));
    let dy = f64::from(b.1.abs_diff(a.1));
    (dx * dx + dy * dy).sqrt()
}

/// Returns the number of moves between two cycles that lead aside from the heading before.
fn lateral_moves(track: &[(u32, u32, u8)]) -> u64 {
    track.windows(2).filter(|pair| is_lateral(pair[0], pair[1])).count() as u64
}

fn is_lateral(
    (col, row, heading): (u32, u32, u8),
    (next_col, next_row, _): (u32, u32, u8),
) -> bool {
    // Headings are east, north, west, south: an even one is along a row.
    if heading.is_multiple_of(2) { next_row != row } else { next_col != col }
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
