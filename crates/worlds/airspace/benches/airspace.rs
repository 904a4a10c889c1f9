//! Speed of the airspace world and of its optimizer.
//!
//! `cargo bench -p sidestep-airspace --bench airspace [-- PART ...]` with the parts `exact`, `sampled` and `many`;
//! CPU time, and ratios taken in one run, because the machine may be noisy.

use cpu_time::ProcessTime;
use sidestep_airspace::airspace_run;
use sidestep_airspace::flight::{
    Action, AfterLastWaypoint, AircraftModel, Autopilot, ChangeAlternatives, DetourAlternatives,
    FlightLevelRange, Frame, PairPlane, Point, Pose2, TimeDiscretization, TurnAction, WaypointRule,
    actions,
};
use sidestep_airspace::objective::{ActionPredictions, Objective, build_group_game};
use sidestep_collectives::{
    Choice, Estimator, Game, LocalSearch, OptimizerConfig, StopCriterion, Update, UpdateOrder,
    Utility, optimize,
};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{Seed, Simulation};
use sidestep_scenario::Source;
use std::time::Instant;

const TIMING: TimeDiscretization = TimeDiscretization { dt_s: 5.0, dtau_s: 1.0, horizon: 125 };

/// Airplanes on a circle around the conflict, near enough for every pair to matter.
struct Conflict {
    model: AircraftModel,
    poses: Vec<Pose2>,
    goals: Vec<[Point; 1]>,
    actions: Vec<Action>,
    timing: TimeDiscretization,
    objective: Objective,
}

impl Conflict {
    fn new(n: usize, horizon: usize, legs: &DetourAlternatives, objective: Objective) -> Self {
        let model = AircraftModel {
            v_m_s: 35.0,
            omega_max_rad_s: 4f64.to_radians(),
            separation_m: 500.0,
            turns: 5,
        };
        let angle = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        let on = |radius_m: f64, angle: f64| {
            use sidestep_kernel::math::{cos, sin};
            [radius_m * cos(angle), radius_m * sin(angle)]
        };
        let turn = std::f64::consts::PI;
        let pose = |k| Pose2 { at: on(3000.0, angle(k)), heading_rad: angle(k) + turn };
        Self {
            poses: (0..n).map(pose).collect(),
            goals: (0..n).map(|k| [on(6500.0, angle(k) + turn)]).collect(),
            actions: actions(&model, TIMING.dt_s, &[], legs, &ChangeAlternatives::default()),
            timing: TimeDiscretization { horizon, ..TIMING },
            model,
            objective,
        }
    }

    fn pilot(&self, i: usize) -> Autopilot<'_> {
        Autopilot {
            model: &self.model,
            mission: &self.goals[i],
            passing: WaypointRule { tolerance_m: 100.0, passes: true, passes_abeam: false },
            after: AfterLastWaypoint::Straight,
            dtau_s: TIMING.dtau_s,
        }
    }

    fn action_predictions(&self) -> Vec<ActionPredictions> {
        let of = |i: usize| {
            let predict =
                |a: &Action| self.pilot(i).predict(a.turn, self.poses[i], 0, &self.timing);
            let predictions = self.actions.iter().map(predict).collect();
            ActionPredictions::new(
                predictions,
                Frame::PLANE,
                self.model.separation_m,
                FlightLevelRange::from_level(0.0),
            )
        };
        (0..self.poses.len()).map(of).collect()
    }
}

/// The same game, with every sample's paths predicted anew whenever they are looked at.
struct UncachedGame<'a> {
    conflict: &'a Conflict,
    strategies: Vec<usize>,
}

impl Game for UncachedGame<'_> {
    fn strategies(&self) -> &[usize] {
        &self.strategies
    }

    fn cost(&self, joint: &[usize]) -> f64 {
        let Conflict { objective, model, poses, actions, timing, .. } = self.conflict;
        let predictions: Vec<_> = joint
            .iter()
            .enumerate()
            .map(|(i, &x)| self.conflict.pilot(i).predict(actions[x].turn, poses[i], 0, timing))
            .collect();
        let r = [model.separation_m; 2];
        let mut sum = 0.0;
        for (i, a) in predictions.iter().enumerate() {
            let best = self.conflict.pilot(i).predict(TurnAction::Proceed, poses[i], 0, timing);
            sum += objective.alpha * objective.deviation_cost(a, &best);
            for b in &predictions[i + 1..] {
                sum +=
                    objective.collision_costs(&PairPlane::ONE_FRAME, a, b, r).iter().sum::<f64>();
            }
        }
        sum
    }
}

fn settings(estimator: Estimator, cooling: f64, max_rounds: u32) -> OptimizerConfig {
    let exact = estimator == Estimator::Exact;
    OptimizerConfig {
        estimator,
        update: Update::NearestNewton { step: 0.5 },
        order: if exact { UpdateOrder::Sequence } else { UpdateOrder::Parallel },
        utility: Utility::Joint,
        cooling,
        stop: StopCriterion { threshold: 1e-3, calm_rounds: 3, max_rounds },
        choice: Choice::Argmax,
        local_search: if exact { LocalSearch::Pairs } else { LocalSearch::None },
        random_starts: 8,
    }
}

fn uniform(player: usize, k: u64) -> f64 {
    let words = Streams::new(Seed(1)).block(player as u32, k, Purpose(1), 0);
    f64::from(words[0]) / 4_294_967_296.0
}

/// CPU seconds of the best of `n` repeats.
fn best_s(n: usize, mut work: impl FnMut()) -> f64 {
    let mut once = || {
        let started = ProcessTime::now();
        work();
        started.elapsed().as_secs_f64()
    };
    (0..n).map(|_| once()).fold(f64::INFINITY, f64::min)
}

fn exact() {
    let preset = |inflation| Objective {
        alpha: 0.001,
        beta: 0.995,
        inflation,
        mask: true,
        vertical_m: 300.0,
        level_weight: 1.0,
        speed_weight: 0.0,
    };
    for (name, horizon, legs, inflation, cooling) in [
        ("the paper's actions", 125, DetourAlternatives::default(), 1.05, 0.8),
        ("the default preset", 100, DetourAlternatives::default_preset(), 1.08, 0.5),
    ] {
        let objective = preset(inflation);
        let conflict = Conflict::new(10, horizon, &legs, objective);
        let predict_s = best_s(20, || drop(conflict.action_predictions()));
        let options = conflict.action_predictions();
        let tables_s = best_s(20, || drop(build_group_game(&objective, &options)));
        let built = build_group_game(&objective, &options);
        let settings = settings(Estimator::Exact, cooling, 200);
        let rounds_s = best_s(20, || drop(optimize(&built, &settings, uniform)));
        let rounds = optimize(&built, &settings, uniform).rounds;
        println!(
            "exact, 10 airplanes, {name}: {:.2} ms (predictions {:.2}, tables {:.2}, {rounds} rounds {:.2}) [1 ms]",
            1e3 * (predict_s + tables_s + rounds_s),
            1e3 * predict_s,
            1e3 * tables_s,
            1e3 * rounds_s,
        );
    }
}

fn sampled() {
    let objective = Objective {
        alpha: 1.0,
        beta: 0.995,
        inflation: 1.0,
        mask: true,
        vertical_m: 300.0,
        level_weight: 1.0,
        speed_weight: 0.0,
    };
    let conflict = Conflict::new(10, 125, &DetourAlternatives::default(), objective);
    let settings = settings(Estimator::Sampled { block: 20, ageing: 0.7 }, 0.8, 50);
    let shared_s = best_s(5, || {
        let built = build_group_game(&objective, &conflict.action_predictions());
        drop(optimize(&built, &settings, uniform));
    });
    let strategies = vec![conflict.actions.len(); 10];
    let anew = UncachedGame { conflict: &conflict, strategies };
    let anew_s = best_s(2, || drop(optimize(&anew, &settings, uniform)));
    println!(
        "sampled, 10 airplanes, 50 rounds of 20: {:.2} ms, {:.0} times faster than predicting anew [20 times]",
        1e3 * shared_s,
        anew_s / shared_s
    );
}

/// Random traffic of one airplane per 100 square kilometres.
fn many() {
    let mut per_airplane = Vec::new();
    for n in [500usize, 5_000] {
        let radius_m = (n as f64 * 1e8 / std::f64::consts::PI).sqrt();
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"random\"\nn = {n}\n\
             radius_m = {radius_m}\n"
        );
        let workers = sidestep_kernel::workers::available_workers();
        let mut run = airspace_run(&Source::new("many", text, ""), workers).expect("valid");
        run.advance(4);
        let (cpu, wall, cycles) = (ProcessTime::now(), Instant::now(), 10);
        run.advance(cycles);
        let wall_s = wall.elapsed().as_secs_f64() / cycles as f64;
        let cpu_s = cpu.elapsed().as_secs_f64() / cycles as f64;
        per_airplane.push(cpu_s / n as f64);
        println!(
            "{n} airplanes at 1 per 100 km2: {wall_s:.2} s per optimization of all on {workers} workers [5 s], {:.3} ms CPU per airplane",
            1e3 * cpu_s / n as f64
        );
    }
    println!("cost per airplane, 5000 over 500: {:.2} [1.5]", per_airplane[1] / per_airplane[0]);
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let parts: [(&str, fn()); 3] = [("exact", exact), ("sampled", sampled), ("many", many)];
    for (name, part) in parts {
        if asked.is_empty() || asked.iter().any(|a| a == name) {
            part();
        }
    }
}
