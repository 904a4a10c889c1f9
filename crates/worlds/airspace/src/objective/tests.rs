//! Tests of the objective: against independent numbers, and of the bounds that leave pairs out.

use super::group_game::{add_pair_costs, build_group_game, own_costs, pair_costs, pairs_in_reach};
use super::*;
use crate::flight::{
    Action, AfterLastWaypoint, AircraftModel, Autopilot, ChangeAlternatives, FlightLevelRange,
    Frame, Pose2, SteadyChange, Surface, TimeDiscretization, TurnAction, WaypointRule,
};
use serde_json::Value;
use sidestep_collectives::{Game, PairwiseGame};
use sidestep_kernel::math;
use sidestep_kernel::stream::philox4x32;

/// Independent numbers of the shared data, to 1e-9 relative.
#[test]
fn the_objective_and_its_parts_are_those_of_the_oracle() {
    let root = sidestep_testing::root().join("..");
    let path = root.join("shared/data/oracle/collectives_cases.json");
    let Ok(text) = std::fs::read_to_string(&path) else {
        sidestep_testing::skip(format!("{} is not there", path.display()));
        return;
    };
    let cases: Vec<Value> = serde_json::from_str(&text).expect("JSON");
    assert_eq!(cases.len(), 5);
    cases.iter().for_each(check);
}

fn near(found: f64, expected: &Value, what: &str) {
    let expected = expected.as_f64().expect(what);
    let error = (found - expected).abs();
    assert!(error <= 1e-9 * expected.abs().max(1e-3), "{what}: {found} is not {expected}");
}

fn point(value: &Value) -> Point {
    [value[0].as_f64().expect("x"), value[1].as_f64().expect("y")]
}

fn check(case: &Value) {
    let name = case["name"].as_str().expect("a name");
    let params = &case["params"];
    let number = |key: &str| params[key].as_f64().expect("a number");
    let timing = TimeDiscretization {
        dt_s: number("dt"),
        dtau_s: number("dtau"),
        horizon: number("kmax") as usize,
    };
    let objective = Objective {
        alpha: number("alpha"),
        beta: number("beta"),
        inflation: 1.0,
        mask: params["mask"] == true,
        vertical_m: 1.0,
        level_weight: 1.0,
        speed_weight: 0.0,
    };
    let after = if params["after"] == "pursue" {
        AfterLastWaypoint::Pursue
    } else {
        AfterLastWaypoint::Straight
    };
    let passing = WaypointRule { tolerance_m: number("tol"), passes: false, passes_abeam: false };
    let expected = &case["expected"];
    let mut predictions = Vec::new();
    let planes = case["planes"].as_array().expect("planes");
    let actions = case["actions"].as_array().expect("actions");
    for (i, (plane, action)) in planes.iter().zip(actions).enumerate() {
        let number = |key: &str| plane[key].as_f64().expect("a number");
        let model = AircraftModel {
            v_m_s: number("v"),
            omega_max_rad_s: number("omega_max"),
            separation_m: number("R"),
            turns: 5,
        };
        let mission: Vec<Point> =
            plane["wps"].as_array().expect("way-points").iter().map(point).collect();
        let pilot =
            Autopilot { model: &model, mission: &mission, passing, after, dtau_s: timing.dtau_s };
        let pose = Pose2 { at: [number("x"), number("y")], heading_rad: number("psi") };
        let chosen = match action["omega"].as_f64() {
            None => TurnAction::Proceed,
            Some(omega_rad_s) if action["g"] == 0 => TurnAction::Hold { omega_rad_s },
            Some(omega_rad_s) => TurnAction::Then { omega_rad_s, hold_s: timing.dt_s },
        };
        let optimal = pilot.predict(TurnAction::Proceed, pose, 0, &timing);
        let prediction = pilot.predict(chosen, pose, 0, &timing);
        for (key, k) in [("f_k1", 0), ("f_k10", 9), ("f_kmax", timing.horizon - 1)] {
            (0..2).for_each(|c| near(prediction.points[k][c], &expected[key][i][c], name));
        }
        assert_eq!(expected["ka"][i].as_u64(), Some(prediction.counted as u64), "{name}");
        near(objective.deviation_cost(&prediction, &optimal), &expected["G_dev_i"][i], name);
        predictions.push((prediction, optimal, model.separation_m));
    }
    let mut total = [0.0; 2];
    for (i, (a, optimal, ra)) in predictions.iter().enumerate() {
        let mut own = objective.alpha * objective.deviation_cost(a, optimal);
        total[1] += objective.deviation_cost(a, optimal);
        for (j, (b, _, rb)) in predictions.iter().enumerate().filter(|(j, _)| *j != i) {
            let [of_a, _] = objective.collision_costs(&PairPlane::ONE_FRAME, a, b, [*ra, *rb]);
            near(of_a, &expected["G_col_ij"][i][j], name);
            own += of_a;
            total[0] += of_a;
        }
        near(own, &expected["G_i"][i], name);
    }
    near(total[0], &expected["G_col"], name);
    near(total[1], &expected["G_dev"], name);
    near(total[0] + objective.alpha * total[1], &expected["G"], name);
    let options: Vec<ActionPredictions> = predictions
        .iter()
        .map(|(p, optimal, r)| {
            ActionPredictions::new(
                vec![p.clone(), optimal.clone()],
                Frame::PLANE,
                *r,
                FlightLevelRange::from_level(0.0),
            )
        })
        .collect();
    let game = build_group_game(&objective, &options);
    near(game.cost(&vec![0; options.len()]), &expected["G"], name);
}

/// The parts left out by slices, bounds and shared pieces cost nothing, to the bit.
#[test]
fn tables_hold_what_two_predictions_cost_to_the_bit() {
    use crate::flight::{DetourAlternatives, actions};
    let model = AircraftModel { v_m_s: 35.0, omega_max_rad_s: 0.07, separation_m: 500.0, turns: 5 };
    let timing = TimeDiscretization { dt_s: 5.0, dtau_s: 1.0, horizon: 90 };
    let passing = WaypointRule { tolerance_m: 100.0, passes: true, passes_abeam: false };
    let all = [DetourAlternatives::default(), DetourAlternatives::default_preset()]
        .map(|legs| actions(&model, 5.0, &[], &legs, &ChangeAlternatives::default()));
    let mut meetings = 0;
    for (k, mask) in (0..12).flat_map(|k| [(k, true), (k, false)]) {
        let options = [0.0, 1.0].map(|side| {
            let angle = side * 0.5 * f64::from(k);
            let pose = Pose2 { at: [900.0 * side, 700.0 * side], heading_rad: angle + 3.0 * side };
            let mission = [[2000.0 - 2500.0 * side, 300.0]];
            let after = AfterLastWaypoint::Straight;
            let pilot = Autopilot { model: &model, mission: &mission, passing, after, dtau_s: 1.0 };
            let predict = |action: &Action| pilot.predict(action.turn, pose, 0, &timing);
            let predictions = all[k as usize % 2].iter().map(predict).collect();
            ActionPredictions::new(
                predictions,
                Frame::PLANE,
                model.separation_m * (1.0 - 0.1 * side),
                FlightLevelRange::from_level(0.0),
            )
        });
        let [a, b] = &options;
        let objective = Objective {
            alpha: 1.0,
            beta: 0.995,
            inflation: 1.05,
            mask,
            vertical_m: 300.0,
            level_weight: 1.0,
            speed_weight: 0.0,
        };
        let free = vec![[0.0; 2]; a.predictions.len() * b.predictions.len()];
        let table = pair_costs(&objective, a, b).unwrap_or(free);
        let pairs = a.predictions.iter().flat_map(|p| b.predictions.iter().map(move |q| (p, q)));
        let r = [a.separation_m, b.separation_m];
        for ((p, q), found) in pairs.zip(&table) {
            assert_eq!(*found, objective.collision_costs(&PairPlane::ONE_FRAME, p, q, r));
            meetings += usize::from(*found != [0.0; 2]);
        }
    }
    assert!(meetings > 500, "{meetings}");
}

/// Two fly toward each other, and one of them may climb.
#[test]
fn airplanes_cost_each_other_at_the_steps_at_which_their_levels_meet_alone() {
    let straight = |from_m: f64, v_m_s: f64| {
        let points: Vec<Point> = (1..=60).map(|k| [from_m + v_m_s * f64::from(k), 0.0]).collect();
        Prediction { counted: points.len(), points }
    };
    let options = |from_m: f64, v_m_s: f64, altitudes: Option<Vec<SteadyChange>>| {
        let count = altitudes.as_ref().map_or(1, Vec::len);
        let predictions = vec![straight(from_m, v_m_s); count];
        let levels = FlightLevelRange::from_level(0.0);
        let options = ActionPredictions::new(predictions, Frame::PLANE, 500.0, levels);
        match altitudes {
            None => options,
            Some(altitudes) => options.with_changes(ActionChanges {
                speeds: vec![SteadyChange::constant(35.0); count],
                altitudes,
                dtau_s: 1.0,
                horizon_s: 60.0,
            }),
        }
    };
    let objective = Objective {
        alpha: 0.001,
        beta: 0.995,
        inflation: 1.0,
        mask: true,
        vertical_m: 300.0,
        level_weight: 2.0,
        speed_weight: 0.0,
    };
    let climb = SteadyChange { from: 0.0, to: 400.0, rate_s: 10.0 };
    let level = SteadyChange::constant(0.0);
    let a = options(-1400.0, 35.0, Some(vec![climb, level]));
    let b = options(1400.0, -35.0, None);
    let table = pair_costs(&objective, &a, &b).expect("they meet");
    // Above 300 m, from 30 s on, they are 700 m and less apart.
    let each = objective.collision_costs(
        &PairPlane::ONE_FRAME,
        &a.predictions[1],
        &b.predictions[0],
        [500.0; 2],
    );
    assert_eq!(table[1], each);
    assert!(each[0] > 1e5, "{each:?}");
    assert_eq!(table[0], [0.0; 2]);
    // From a slower climb there is a part left: that before it is 300 m above the other one.
    let slow = SteadyChange { rate_s: 8.0, ..climb };
    let a = options(-1400.0, 35.0, Some(vec![slow, level]));
    let table = pair_costs(&objective, &a, &b).expect("they meet");
    assert!(table[0][0] > 0.0 && table[0][0] < 0.3 * each[0], "{table:?}");
    let costs = own_costs(&objective, &a);
    assert_eq!(costs, [0.001 * 2.0 * 400.0 * 400.0, 0.0]);
    // On levels far apart nothing costs anything.
    let far = options(1400.0, -35.0, Some(vec![SteadyChange::constant(900.0)]));
    let mut game = PairwiseGame::new(vec![vec![0.0; 2], vec![0.0]]);
    add_pair_costs(&mut game, &objective, [0, 1], [&a, &far]);
    assert_eq!(game.pair_costs().count(), 0);
}

/// Airplanes of all separations over an area that each crosses in part, in the plane and about a pole of the earth.
#[test]
fn pairs_that_are_left_out_of_a_group_cost_nothing() {
    const AIRPLANES: u32 = 200;
    let objective = Objective {
        alpha: 0.001,
        beta: 0.995,
        inflation: 1.12,
        mask: false,
        vertical_m: 300.0,
        level_weight: 1.0,
        speed_weight: 0.0,
    };
    for surface in [Surface::Plane, Surface::Earth] {
        let options = |i: u32| {
            let draws =
                philox4x32([i, 0, 0, 0], [7, 0]).map(|draw| f64::from(draw) / 4_294_967_296.0);
            let [x, y, heading, separation] = draws;
            let heading_rad = std::f64::consts::TAU * heading;
            let [place, start_m] = match surface {
                Surface::Plane => [[0.0; 2], [20_000.0 * x, 20_000.0 * y]],
                Surface::Earth => [[6.0 * x, std::f64::consts::FRAC_PI_2 - 0.002 * y], [0.0; 2]],
            };
            let after = |k: u32| {
                let way_m = 35.0 * f64::from(k);
                [
                    start_m[0] + way_m * math::cos(heading_rad),
                    start_m[1] + way_m * math::sin(heading_rad),
                ]
            };
            let points: Vec<Point> = (1..=90).map(after).collect();
            let prediction = Prediction { counted: points.len(), points };
            let separation_m = 200.0 + 800.0 * separation;
            let levels = FlightLevelRange::from_level(0.0);
            ActionPredictions::new(vec![prediction], surface.frame_at(place), separation_m, levels)
        };
        let group: Vec<ActionPredictions> = (0..AIRPLANES).map(options).collect();
        let own = || group.iter().map(|options| own_costs(&objective, options)).collect();
        let mut all_pairs = PairwiseGame::new(own());
        for (i, a) in group.iter().enumerate() {
            for (j, b) in group.iter().enumerate().skip(i + 1) {
                add_pair_costs(&mut all_pairs, &objective, [i, j], [a, b]);
            }
        }
        let game = build_group_game(&objective, &group);
        let found: Vec<_> = game.pair_costs().collect();
        assert_eq!(found, all_pairs.pair_costs().collect::<Vec<_>>(), "{surface:?}");
        let tried = pairs_in_reach(&objective, &group).len();
        assert!(found.len() > 100 && tried < 10_000, "{surface:?}: {} of {tried}", found.len());
    }
}
