//! The measures of whole runs, against encounters computed by hand and against a search without any shortcut.

use crate::encounters::EncounterCounts;
use crate::measures::{PairMeasures, RelativeState};
use crate::metrics::Metrics;
use crate::{AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::MemoryRecorder;
use sidestep_scenario::Source;
use std::collections::BTreeSet;

/// Straight flight without a shield.
const STRAIGHT: &str =
    "method = \"none\"\nshield = \"off\"\ndt_s = 1.0\ndtau_s = 1.0\nhorizon_s = 60.0";

fn run(airspace: &str, airplanes: &str, workers: usize) -> AirspaceRun {
    let text = format!(
        "format = 1\nworld = \"airspace\"\nseed = 3\ncycles = 400\n[airspace]\n{airspace}\n{airplanes}"
    );
    airspace_run(&Source::new("n", text, ""), workers).expect("a scenario")
}

fn run_to_end(airspace: &str, airplanes: &str) -> AirspaceRun {
    let mut run = run(airspace, airplanes, 1);
    run.advance(400);
    run
}

/// Returns a level airplane that flies straight for a distance.
fn airplane([x, y]: [f64; 2], heading_deg: f64, more: &str) -> String {
    let heading_rad = heading_deg.to_radians();
    let [east, north] =
        [sidestep_kernel::math::cos(heading_rad), sidestep_kernel::math::sin(heading_rad)];
    format!(
        "[[airplanes]]\nat_m = [{x:?}, {y:?}]\nheading_deg = {heading_deg:?}\n\
         way_points_m = [[{:?}, {:?}]]\n{more}\n",
        x + 20_000.0 * east,
        y + 20_000.0 * north
    )
}

fn counts(run: &AirspaceRun) -> EncounterCounts {
    run.collector().counters.encounters.counts()
}

/// Returns numbers of conflicts, intrusions, violations of well clear and near mid-air collisions.
fn numbers(run: &AirspaceRun) -> [u64; 4] {
    let EncounterCounts { conflicts, intrusions, well_clear_violations, nmacs, .. } = counts(run);
    [conflicts, intrusions, well_clear_violations, nmacs]
}

/// Two that meet head-on after 100 s, some meters beside each other.
fn head_on(aside_m: f64, more: &str) -> String {
    airplane([-3500.0, 0.0], 0.0, "") + &airplane([3500.0, aside_m], 180.0, more)
}

#[test]
fn a_head_on_pair_has_one_conflict_one_intrusion_and_one_near_mid_air_collision() {
    let run = run_to_end(STRAIGHT, &head_on(0.0, ""));
    assert_eq!(numbers(&run), [1, 1, 1, 1]);
    let metrics = run.metrics();
    assert_eq!(metrics.intrusion_prevention_rate, Some(0.0));
    assert!(metrics.max_los_severity.is_some_and(|severity| (severity - 1.0).abs() < 1e-6));
    assert_eq!(metrics.losses_of_separation, 1);
    // 200 m beside each other 300 of 500 m are lost, and no near mid-air collision.
    let run = run_to_end(STRAIGHT, &head_on(200.0, ""));
    assert_eq!(numbers(&run), [1, 1, 1, 0]);
    let severity = run.metrics().mean_los_severity.expect("an intrusion");
    assert!((severity - 0.6).abs() < 1e-6, "{severity}");
    // Past each other at the separation nothing is lost.
    assert_eq!(numbers(&run_to_end(STRAIGHT, &head_on(500.0, ""))), [0; 4]);
}

#[test]
fn an_overtaking_pair_has_one_conflict_for_as_long_as_it_lasts() {
    // 5 m/s faster from 1000 m behind, 300 m aside: below 500 m from 120 s to 280 s, predicted 60.5 s before.
    let pair = airplane([0.0, 0.0], 0.0, "v_m_s = 40.0") + &airplane([1000.0, 300.0], 0.0, "");
    let airspace = format!("{STRAIGHT}\nmeasures = {{ look_ahead_s = 60.5 }}");
    let run = run_to_end(&airspace, &pair);
    assert_eq!(numbers(&run), [1, 1, 1, 0]);
    let rows = rows(&run_recorded(&airspace, &pair));
    assert_eq!(rows.len(), 1);
    let row = &rows[0];
    assert_eq!((row["from_s"], row["until_s"]), (60.0, 280.0));
    assert!((row["nearest_m"] - 300.0).abs() < 1e-6 && (row["severity"] - 0.4).abs() < 1e-6);
}

#[test]
fn a_crossing_pair_meets_and_a_parallel_one_does_not() {
    // Both are 3000 m before the crossing; one of them 300 m more: they pass at 300/sqrt(2) m.
    let crossing = |late_m: f64| {
        airplane([-3000.0, 0.0], 0.0, "") + &airplane([0.0, -3000.0 - late_m], 90.0, "")
    };
    let run = run_to_end(STRAIGHT, &crossing(300.0));
    assert_eq!(numbers(&run), [1, 1, 1, 0]);
    let severity = run.metrics().max_los_severity.expect("an intrusion");
    assert!((severity - (1.0 - 300.0 / 2f64.sqrt() / 500.0)).abs() < 1e-6, "{severity}");
    assert_eq!(numbers(&run_to_end(STRAIGHT, &crossing(708.0))), [0; 4]);
    let parallel = airplane([0.0, 0.0], 0.0, "") + &airplane([0.0, 500.0], 0.0, "");
    assert_eq!(numbers(&run_to_end(STRAIGHT, &parallel)), [0; 4]);
}

#[test]
fn a_pair_on_two_levels_has_an_encounter_only_where_one_passes_the_level_of_the_other() {
    let above = head_on(0.0, "altitude_m = 300.0");
    assert_eq!(numbers(&run_to_end(STRAIGHT, &above)), [0; 4]);
    // Side by side, 200 m apart, one climbs from 400 m below to 400 m above at 10 m/s: 0.6 on one level.
    let climbing = airplane([0.0, 0.0], 0.0, "altitude_m = 1000.0")
        + &airplane(
            [0.0, 200.0],
            0.0,
            "altitude_m = 600.0\norders = [{ at_s = 50.0, altitude_m = 1400.0, climb_m_s = 10.0 }]",
        );
    let run = run_to_end(STRAIGHT, &climbing);
    assert_eq!(numbers(&run), [1, 1, 1, 0]);
    assert!((run.metrics().max_los_severity.unwrap_or(0.0) - 0.6).abs() < 1e-6);
}

#[test]
fn well_clear_is_measured_by_the_standard_that_the_scenario_names() {
    // 2000 m beside each other: well clear by ASTM's 2000 ft and by the separation, not by 4000 ft at 1000 m.
    let violations = |keys: &str, aside_m: f64| {
        let run =
            run_to_end(&format!("{STRAIGHT}\nwell_clear = {{ {keys} }}"), &head_on(aside_m, ""));
        numbers(&run)[2]
    };
    assert_eq!(violations("standard = \"do-365\"", 1219.0), 1);
    assert_eq!(violations("standard = \"do-365\"", 1219.3), 0);
    assert_eq!(violations("standard = \"f3442\"", 609.5), 1);
    assert_eq!(violations("standard = \"f3442\"", 609.7), 0);
    assert_eq!(violations("", 499.0), 1);
    assert_eq!(violations("", 500.0), 0);
    assert_eq!(violations("horizontal_m = 800.0", 799.0), 1);
}

#[test]
fn a_method_that_solves_its_conflicts_has_an_intrusion_prevention_rate_of_one() {
    let airspace = STRAIGHT.replace("none", "mvp") + "\nmvp = { look_ahead_s = 40.0 }";
    let run = run_to_end(&airspace, &head_on(0.0, ""));
    let metrics = run.metrics();
    assert!(metrics.conflicts.is_some_and(|conflicts| conflicts >= 1), "{metrics:?}");
    assert_eq!((metrics.intrusions, metrics.nmacs), (Some(0), Some(0)));
    assert_eq!(metrics.intrusion_prevention_rate, Some(1.0));
    assert!(metrics.maneuvers.is_some_and(|maneuvers| maneuvers >= 2), "{metrics:?}");
    assert!(metrics.maneuvers_per_flight_hour.is_some_and(|rate| rate > 0.0));
}

/// The second one is first recorded in the middle of a decision.
#[test]
fn a_recorded_airplane_that_comes_in_within_a_cycle_has_its_encounters() {
    let tracks = "[[airplanes]]\ntrack = [[0, 0, 0, 0], [200, 7000, 0, 0]]\n\
                  [[airplanes]]\ntrack = [[7, 7000, 0, 0], [207, 0, 0, 0]]\n";
    let run = run_to_end("method = \"none\"\nshield = \"off\"\ndt_s = 10.0", tracks);
    assert_eq!(numbers(&run), [1, 1, 1, 1]);
    assert!(run.metrics().max_los_severity.is_some_and(|severity| severity > 0.999));
}

#[test]
fn on_the_earth_a_head_on_pair_has_the_same_encounter() {
    // 7 km along a meridian are 0.062955 degrees at 50 degrees north.
    let pair = "[[airplanes]]\nat_deg = [50.0, 14.0]\nheading_deg = 90\nway_points_deg = [[50.2, 14.0]]\n\
                [[airplanes]]\nat_deg = [50.062955, 14.0]\nheading_deg = -90\nway_points_deg = [[49.8, 14.0]]\n";
    let run = run_to_end(STRAIGHT, pair);
    assert_eq!(numbers(&run), [1, 1, 1, 1]);
    assert!(run.metrics().max_los_severity.is_some_and(|severity| severity > 0.999));
}

#[test]
fn a_flight_alone_has_no_extra_cost_and_no_maneuver() {
    let orders = "orders = [{ at_s = 60.0, altitude_m = 500.0, climb_m_s = 5.0 }]";
    for wind in ["", "\nwind_m_s = [8.0, -5.0]"] {
        let turn = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 70\nway_points_m = [[4000, 0], [4000, 3000]]\n";
        let run = run_to_end(&format!("shield = \"off\"{wind}"), &format!("{turn}{orders}\n"));
        let metrics = run.metrics();
        assert_eq!((metrics.maneuvers, metrics.maneuver_reversals), (Some(0), Some(0)), "{wind}");
        for extra in [
            metrics.mean_extra_time_s,
            metrics.mean_extra_distance_m,
            metrics.mean_extra_distance_percent,
            metrics.mean_extra_fuel_percent,
        ] {
            // In a wind the paths over the ground in turns are sums, of other parts.
            assert!(extra.is_some_and(|extra| extra.abs() < 1e-4), "{wind}: {metrics:?}");
        }
    }
}

#[test]
fn at_constant_speed_in_still_air_the_extra_distance_is_the_delay() {
    let run = run_to_end(
        "method = \"mvp\"\nshield = \"off\"",
        "generator = { kind = \"superconflict\", n = 6, radius_m = 3000 }\n",
    );
    let metrics = run.metrics();
    assert_eq!(metrics.arrived, 6);
    let [delay, distance, fuel] = [
        metrics.mean_delay_percent,
        metrics.mean_extra_distance_percent,
        metrics.mean_extra_fuel_percent,
    ]
    .map(|mean| mean.expect("all have arrived"));
    assert!(delay > 0.1 && (delay - distance).abs() < 1e-6, "{delay} {distance}");
    assert!(fuel > distance, "turns cost more than their length: {fuel} {distance}");
}

/// Random traffic on three levels, which all change them. Each reaches its new one at the end of a second, so that its rate
/// of climb is that of whole steps.
fn crowd() -> String {
    let mut airplanes = String::new();
    for k in 0..24 {
        let angle_deg = f64::from(k) * 61.0;
        let [x, y] = [f64::from(k * 577 % 6000) - 3000.0, f64::from(k * 1301 % 6000) - 3000.0];
        let altitude_m = f64::from(k % 3) * 200.0;
        airplanes += &airplane(
            [x, y],
            angle_deg,
            &format!(
                "v_m_s = {}.0\naltitude_m = {altitude_m:?}\n\
                 orders = [{{ at_s = {}.0, altitude_m = 150.0, climb_m_s = 5.0 }}]",
                25 + k % 7 * 5,
                10 + k
            ),
        );
    }
    airplanes
}

/// Moments in a step of a second at which the comparison of all pairs looks for losses.
const LOSS_SAMPLES: u32 = 200;

/// Returns the conflicts and the violations of well clear of a run in steps of one cycle, found by comparing all pairs
/// of states.
fn counts_of_all_pairs(run: &mut AirspaceRun, cycles: u64) -> [u64; 2] {
    let mut before = [BTreeSet::new(), BTreeSet::new()];
    let mut counts = [0; 2];
    let mut altitudes_m: Vec<f64> = Vec::new();
    for _ in 0..cycles {
        let world = run.world().clone();
        let PairMeasures { look_ahead_s, well_clear, .. } = world.measures.pairs.expect("measured");
        let start = run.state().snapshot(run.cycle());
        run.advance(1);
        let after = run.state().snapshot(run.cycle());
        altitudes_m.clear();
        altitudes_m.extend(after.airplanes.iter().map(|one| one.altitude_m));
        let mut now = [BTreeSet::new(), BTreeSet::new()];
        for a in 0..start.airplanes.len() {
            for b in a + 1..start.airplanes.len() {
                let velocity = |i: usize| {
                    let [v, rad] =
                        [world.airplanes[i].model.v_m_s, start.airplanes[i].pose.heading_rad];
                    [v * sidestep_kernel::math::cos(rad), v * sidestep_kernel::math::sin(rad)]
                };
                let climb_m_s = |i: usize| altitudes_m[i] - start.airplanes[i].altitude_m;
                let [p, q] = [&start.airplanes[a], &start.airplanes[b]];
                let relative = RelativeState {
                    at: [q.pose.at[0] - p.pose.at[0], q.pose.at[1] - p.pose.at[1]],
                    velocity: [velocity(b)[0] - velocity(a)[0], velocity(b)[1] - velocity(a)[1]],
                    above_m: q.altitude_m - p.altitude_m,
                    climb_m_s: climb_m_s(b) - climb_m_s(a),
                };
                let minima =
                    crate::flight::SeparationMinima { gap_m: 500.0, vertical_m: world.vertical_m };
                let is_lost = (0..=LOSS_SAMPLES).any(|k| {
                    let t_s = f64::from(k) / f64::from(LOSS_SAMPLES);
                    let place = |i: usize| {
                        let v_m_s = world.airplanes[i].model.v_m_s;
                        let omega_rad_s = after.airplanes[i].turn_rate_rad_s;
                        start.airplanes[i].pose.step(v_m_s, omega_rad_s, t_s).at
                    };
                    let above_m = relative.above_m + relative.climb_m_s * t_s;
                    crate::flight::distance_m(place(a), place(b)) < minima.gap_m
                        && above_m.abs() < minima.vertical_m
                });
                if is_lost || relative.is_conflict(minima, look_ahead_s) {
                    now[0].insert((a, b));
                }
                if relative.violates_well_clear(&well_clear.of_pair(minima)) {
                    now[1].insert((a, b));
                }
            }
        }
        for k in 0..2 {
            counts[k] += now[k].difference(&before[k]).count() as u64;
        }
        before = now;
    }
    counts
}

#[test]
fn the_sweep_finds_what_a_comparison_of_all_pairs_finds() {
    for method in ["none", "mvp", "orca", "bands"] {
        let airspace = STRAIGHT.replace("none", method) + "\nvertical_m = 150.0";
        let mut swept = run(&airspace, &crowd(), 1);
        swept.advance(120);
        let [conflicts, intrusions, violations, nmacs] = numbers(&swept);
        let mut compared = run(&airspace, &crowd(), 1);
        let all = counts_of_all_pairs(&mut compared, 120);
        assert_eq!(conflicts, all[0], "{method}");
        assert_eq!(violations, all[1], "{method}");
        let losses = swept.metrics().losses_of_separation;
        assert!(
            intrusions <= losses && intrusions > 0 && nmacs <= intrusions,
            "{method}: {losses}"
        );
    }
}

#[test]
fn measures_do_not_depend_on_the_number_of_workers() {
    let airspace = STRAIGHT.replace("none", "mvp");
    let all = [1, 2, 5].map(|workers| {
        let mut run = run(&airspace, &crowd(), workers);
        run.advance(100);
        (run.collector().counters.encounters.clone(), comparable(run.metrics()))
    });
    assert_eq!(all[0], all[1]);
    assert_eq!(all[0], all[2]);
}

/// Returns metrics without what is measured.
fn comparable(metrics: Metrics) -> Metrics {
    Metrics { optimize_cpu_s: 0.0, ..metrics }
}

#[test]
fn a_run_that_is_resumed_in_the_middle_of_encounters_has_the_same_measures() {
    let airspace = STRAIGHT.replace("none", "mvp");
    let mut whole = run(&airspace, &crowd(), 1);
    whole.advance(30);
    assert!(counts(&whole).conflicts > 0);
    let checkpoint = whole.checkpoint();
    whole.advance(70);
    let mut resumed = run(&airspace, &crowd(), 2);
    resumed.restore(&checkpoint).expect("its own checkpoint");
    resumed.advance(70);
    assert_eq!(comparable(resumed.metrics()), comparable(whole.metrics()));
}

#[test]
fn measures_change_no_bit_of_a_run_and_are_missing_where_they_are_off() {
    for method in ["mvp", "pc"] {
        let airspace = format!("method = \"{method}\"\nshield = \"off\"\n");
        let mut measured = run(&airspace, &crowd(), 1);
        let off = "measures = { pairs = \"off\", flights = \"off\" }\n";
        let mut bare = run(&format!("{airspace}{off}"), &crowd(), 1);
        measured.advance(20);
        bare.advance(20);
        assert_eq!(measured.digest(), bare.digest());
        let metrics = bare.metrics();
        assert_eq!((metrics.conflicts, metrics.nmacs, metrics.maneuvers), (None, None, None));
        assert_eq!(metrics.maneuvers_per_flight_hour, None);
        assert!(measured.metrics().conflicts.is_some());
    }
}

/// Numbers of a row, by column.
type Row = std::collections::BTreeMap<String, f64>;

fn run_recorded(airspace: &str, airplanes: &str) -> MemoryRecorder {
    let mut run = run(airspace, airplanes, 1);
    run.start_recording();
    record_until(&mut run, 400)
}

/// Returns the rows of a run until a cycle, which ends the recording.
fn record_until(run: &mut AirspaceRun, cycle: u64) -> MemoryRecorder {
    let mut recorder = MemoryRecorder::new(&Simulation::schemas(run));
    run.advance(cycle - run.cycle());
    run.record(&mut recorder).expect("a recorder in memory");
    run.record_open(&mut recorder).expect("a recorder in memory");
    recorder
}

fn rows(recorder: &MemoryRecorder) -> Vec<Row> {
    let (schema, columns) = recorder.table("pairs").expect("the table of pairs");
    let mut rows = vec![Row::new(); recorder.row_count("pairs")];
    for (spec, values) in schema.columns.iter().zip(columns) {
        for (k, row) in rows.iter_mut().enumerate() {
            if let Some(number) = values.number(k) {
                row.insert(spec.name.to_string(), number);
            }
        }
    }
    rows
}

#[test]
fn each_encounter_is_a_row_and_the_rows_add_up_to_the_metrics() {
    let airspace = STRAIGHT.replace("none", "mvp");
    let rows = rows(&run_recorded(&airspace, &crowd()));
    let metrics = run_to_end(&airspace, &crowd()).metrics();
    let sum = |column: &str| rows.iter().map(|row| row[column]).sum::<f64>() as u64;
    assert_eq!(Some(sum("conflicts")), metrics.conflicts);
    assert_eq!(Some(sum("intrusions")), metrics.intrusions);
    assert_eq!(Some(sum("well_clear_violations")), metrics.well_clear_violations);
    assert!(rows.iter().all(|row| row["from_s"] < row["until_s"]));
    assert!(rows.iter().all(|row| (row["severity"] > 0.0) == (row["intrusions"] > 0.0)));
}

#[test]
fn an_encounter_that_lasts_has_a_row_that_says_so_and_later_one_of_its_end() {
    let mut lasting = run(STRAIGHT, &head_on(200.0, ""), 1);
    lasting.start_recording();
    let open = rows(&record_until(&mut lasting, 97));
    assert_eq!(open.len(), 1);
    assert_eq!((open[0]["open"], open[0]["cycle"], open[0]["until_s"]), (1.0, 97.0, 97.0));
    assert_eq!((open[0]["conflicts"], open[0]["intrusions"]), (1.0, 1.0));
    assert!(open[0]["nearest_m"] > 200.0 && open[0]["severity"] > 0.0);
    // What comes of it is as if nobody had asked before.
    let ended = rows(&record_until(&mut lasting, 400));
    assert_eq!(ended, rows(&run_recorded(STRAIGHT, &head_on(200.0, ""))));
    assert_eq!((ended.len(), ended[0]["open"], ended[0]["from_s"]), (1, 0.0, open[0]["from_s"]));
}

#[test]
fn rows_of_what_lasts_add_up_to_the_metrics_too() {
    let airspace = STRAIGHT.replace("none", "mvp");
    let mut crowded = run(&airspace, &crowd(), 1);
    crowded.start_recording();
    let rows = rows(&record_until(&mut crowded, 30));
    let metrics = crowded.metrics();
    let sum = |column: &str| rows.iter().map(|row| row[column]).sum::<f64>() as u64;
    assert!(rows.iter().any(|row| row["open"] > 0.0));
    assert_eq!(Some(sum("conflicts")), metrics.conflicts);
    assert_eq!(Some(sum("intrusions")), metrics.intrusions);
}
