//! Replicas beside the run that knows all: what they know of it, and what is flown when reports are lost.

use super::*;
use crate::deploy::run_pilot_conversations;
use crate::pilot::{ConversationSchedule, Maneuver, Pilot};
use crate::{AirspaceRun, RemotePilotRun};
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

/// Returns the text of a scenario: airplanes on a ring, which the shield allows to be off by 7.5 m.
fn ring(n: usize, method: &str, network: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\nmethod = \"{method}\"\n\
         deployment = \"replica-team\"\ngroups = \"heard\"\ndt_s = 2.0\nmax_rounds = 20\n\
         [airspace.network]\ndeadline_s = 0.7\n{network}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\nradius_m = 260.0\njitter_m = 5.0\n\
         [airplane]\nv_m_s = 10.0\nomega_max_deg_s = 20.0\nseparation_m = 30.0\nnic = 11\n"
    )
}

fn compiled(text: &str) -> (CompiledAirspace, Source) {
    let source = Source::new("ring", text, "");
    (CompiledAirspace::new(&source).expect("a scenario"), source)
}

/// A flight without a server, and the run that knows all.
struct Flight {
    run: AirspaceRun,
    replicas: Vec<Replica>,
    pilots: Vec<Pilot>,
    /// The controls that are flown, for the next report of each.
    flown: Vec<Option<AirplaneControl>>,
}

impl Flight {
    fn start(text: &str) -> Self {
        let (scenario, source) = compiled(text);
        check_flight(&scenario).expect("it can be flown");
        let n = scenario.world.airplanes.len() as EntityId;
        let replicas = (0..n).map(|id| Replica::new(&scenario, id)).collect();
        let world = &scenario.world;
        let pilots = (0..n).map(|id| Pilot::new(world.clone(), id, Default::default())).collect();
        Self { replicas, pilots, flown: vec![None; n as usize], run: scenario.start(&source, 1) }
    }

    /// Sends the reports for the present cycle; those for which `is_lost` says so, by sender and receiver, do not arrive.
    fn exchange_reports(&mut self, is_lost: impl Fn(EntityId, EntityId) -> bool) {
        let reports: Vec<AirplaneReport> = self.replicas.iter().map(Replica::report).collect();
        for (to, replica) in (0..).zip(&mut self.replicas) {
            for report in reports.iter().filter(|report| report.id != to) {
                if !is_lost(report.id, to) {
                    replica.accept_report(report).expect("a true report");
                }
            }
        }
    }

    /// Decides the present cycle and flies it: those that miss a report stay on their fallbacks. Returns how many did.
    fn fly_cycle(&mut self) -> usize {
        let now = self.run.cycle();
        let world = self.run.world().clone();
        let schedule = ConversationSchedule::for_cycle(now, world.conversation_windows());
        let mut unheard = 0;
        self.flown.clear();
        for (replica, pilot) in self.replicas.iter().zip(&mut self.pilots) {
            let missing = replica.missing();
            self.flown.push(match replica.percept() {
                Some(percept) if missing.is_empty() => {
                    pilot.start_with_schedule(percept, schedule);
                    None
                }
                Some(_) => {
                    unheard += 1;
                    Some(pilot.stay_on_fallback(now, &missing))
                }
                None => None,
            });
        }
        // Those that talk with nobody are there, too, and get the others' packets.
        let state = self.run.state();
        run_pilot_conversations(&world, state, (now, schedule), &mut self.pilots);
        for (pilot, flown) in self.pilots.iter().zip(&mut self.flown) {
            let decided = pilot.control().filter(|control| control.cycle == now);
            *flown = flown.take().or(decided);
        }
        let controls = self.flown.iter().flatten().cloned().collect();
        self.run.submit(controls).expect("controls that can be flown");
        self.run.advance(1);
        for (replica, control) in self.replicas.iter_mut().zip(&self.flown) {
            replica.advance(control.clone());
        }
        unheard
    }

    /// Checks that each knows its own part as the run does.
    fn check_own_parts(&self) {
        let snapshot = self.run.state().snapshot(self.run.cycle());
        for (replica, part) in self.replicas.iter().zip(&snapshot.airplanes) {
            assert_eq!(replica.report().part, *part, "airplane {}", replica.id);
        }
    }
}

#[test]
fn whoever_hears_all_perceives_what_the_run_lets_it_perceive_and_flies_as_in_one_process() {
    for method in ["pc", "mvp", "none"] {
        let text = ring(6, method, "");
        let mut flight = Flight::start(&text);
        let mut maneuvers = 0;
        while !flight.run.is_over() && flight.run.cycle() < 60 {
            flight.exchange_reports(|_, _| false);
            let percepts = flight.run.percepts();
            let own: Vec<Percept> = flight.replicas.iter().filter_map(Replica::percept).collect();
            assert_eq!(own, percepts, "{method}");
            assert_eq!(flight.fly_cycle(), 0);
            flight.check_own_parts();
            let is_profile = |control: &AirplaneControl| control.maneuver != Maneuver::Orbit;
            maneuvers +=
                flight.flown.iter().flatten().filter(|control| is_profile(control)).count();
        }
        assert!(maneuvers > 100, "{method}: {maneuvers}");
        let (scenario, source) = compiled(&text);
        let mut alone = scenario.start(&source, 1);
        while alone.cycle() < flight.run.cycle() {
            alone.advance(1);
        }
        assert_eq!(alone.digest(), flight.run.digest(), "{method}");
    }
}

#[test]
fn a_reference_leads_where_the_run_flies_and_its_fallback_goes_on() {
    let mut flight = Flight::start(&ring(6, "pc", ""));
    for _ in 0..20 {
        flight.exchange_reports(|_, _| false);
        let starts: Vec<Pose2> = flight.replicas.iter().map(|one| one.report().part.pose).collect();
        // The references need the controls that are decided in the cycle, so they are made on copies from before.
        let copies: Vec<AirspaceState> = flight
            .replicas
            .iter()
            .map(|one| AirspaceState::restore(&one.world, &one.state.snapshot(one.cycle)))
            .collect();
        flight.fly_cycle();
        let now = flight.run.cycle() - 1;
        for (k, (copy, start)) in copies.into_iter().zip(starts).enumerate() {
            let replica = &flight.replicas[k];
            let world = replica.world.clone();
            let positions = replica.positions.clone();
            let reported = replica.reported.clone();
            let before =
                Replica { world, id: replica.id, cycle: now, state: copy, positions, reported };
            let reference = before.reference(flight.flown[k].as_ref(), 4);
            let [first, rest @ ..] = &reference[..] else { panic!("no reference") };
            let dt_s = replica.world.timing.dt_s;
            assert!(first.points.len() >= 20 && first.points[0].pose.at == start.at);
            let end = first.points.last().expect("a point");
            assert!((end.at_s - (now + 1) as f64 * dt_s).abs() < 1e-9);
            let flown = replica.report().part.pose;
            assert!(crate::flight::distance_m(end.pose.at, flown.at) < 1e-6, "{end:?} {flown:?}");
            // What follows is the stored fallback, an orbit from there on.
            let alone =
                AirspaceState::restore(&replica.world, &replica.state.snapshot(replica.cycle));
            for cycle in rest {
                alone.set_controls(cycle.cycle, Vec::new());
                replica.fly_alone(&alone, cycle.cycle, replica.id, &mut Scratch::default());
                let at = alone.airplanes[k].pose().at;
                let end = cycle.points.last().expect("a point");
                assert!(crate::flight::distance_m(end.pose.at, at) < 1e-6);
            }
            for pair in first.points.windows(2) {
                let moved_m = crate::flight::distance_m(pair[0].pose.at, pair[1].pose.at);
                let passed_s = pair[1].at_s - pair[0].at_s;
                assert!((moved_m - 10.0 * passed_s).abs() < 0.01, "{moved_m} in {passed_s}");
            }
        }
    }
}

#[test]
fn a_report_that_cannot_be_is_refused_and_changes_nothing() {
    let flight = Flight::start(&ring(3, "pc", ""));
    let (scenario, _) = compiled(&ring(3, "pc", ""));
    let good = flight.replicas[1].report();
    let mut replica = Replica::new(&scenario, 0);
    assert!(replica.accept_report(&flight.replicas[0].report()).is_err(), "its own");
    let with = |change: &dyn Fn(&mut AirplaneReport)| {
        let mut report = good;
        change(&mut report);
        report
    };
    for report in [
        with(&|report| report.id = 9),
        with(&|report| report.cycle = 1),
        with(&|report| report.part.pose.at[0] = f64::NAN),
        with(&|report| report.part.pose.at[0] += 1.0),
        with(&|report| report.part.altitude_m = 5.0),
        with(&|report| report.part.counts[0] = 1000),
        with(&|report| report.part.orders = [1, 0]),
        with(&|report| report.orbit_pose.heading_rad = f64::INFINITY),
    ] {
        assert!(replica.accept_report(&report).is_err(), "{report:?}");
    }
    assert_eq!(replica.missing(), [1, 2]);
    replica.accept_report(&good).expect("a true report");
    assert_eq!((replica.missing(), replica.unreported()), (vec![2], vec![2]));
}

#[test]
fn one_that_was_not_heard_for_long_may_be_near_until_it_is_heard_again() {
    // A ring so wide that nobody is near in the beginning.
    let text = ring(2, "none", "").replace("radius_m = 260.0", "radius_m = 2000.0");
    let mut flight = Flight::start(&text);
    assert!(flight.replicas[0].missing().is_empty());
    let mut cycles = 0;
    while flight.replicas[0].missing().is_empty() {
        flight.fly_cycle();
        cycles += 1;
    }
    // Both fly toward each other: before they meet.
    assert!((20..100).contains(&cycles), "{cycles}");
    let report = flight.replicas[1].report();
    flight.replicas[0].accept_report(&report).expect("it flies no faster than it can");
    assert!(flight.replicas[0].missing().is_empty());
    flight.fly_cycle();
    let apart = flight.replicas[0].distance_m(1);
    assert!(apart > 400.0, "{apart}");
    // One that does not fly its reference may be anywhere around where it is.
    let at = flight.replicas[1].report().part.pose.at;
    flight.replicas[0].note_position(1, at).expect("a place");
    let is_near = !flight.replicas[0].missing().is_empty();
    assert_eq!(is_near, apart < flight.run.world().interaction_range_m(0, 1) + 0.01);
}

#[test]
fn a_node_that_returns_is_on_the_fallback_of_its_last_report() {
    let mut flight = Flight::start(&ring(4, "pc", ""));
    for _ in 0..8 {
        flight.exchange_reports(|_, _| false);
        flight.fly_cycle();
    }
    let last = flight.replicas[2].report();
    let (scenario, _) = compiled(&ring(4, "pc", ""));
    let mut returned = Replica::new(&scenario, 2);
    assert!(returned.resume(&flight.replicas[1].report()).is_err(), "of another airplane");
    returned.resume(&last).expect("its own report");
    assert_eq!(returned.report(), last);
    for _ in 0..3 {
        flight.replicas[2].advance(None);
        returned.advance(None);
    }
    assert_eq!(returned.report(), flight.replicas[2].report());
}

#[test]
fn scenarios_that_cannot_be_flown_without_a_server_say_what_to_change() {
    let refused = |text: &str| {
        let limit = check_flight(&compiled(text).0).expect_err(text);
        format!("{}: {}", limit.cause, limit.remedy)
    };
    let good = ring(3, "pc", "");
    // With a network a scenario of one process does not compile.
    let without_network: Vec<&str> = good
        .lines()
        .filter(|line| !line.contains("network") && !line.contains("deadline_s"))
        .collect();
    let alone = without_network.join("\n").replace("replica-team", "direct");
    let alone = alone.replace("groups = \"heard\"\n", "");
    let more = |keys: &str| good.replace("dt_s = 2.0", &format!("dt_s = 2.0\n{keys}"));
    for (text, words) in [
        (alone, "deployment="),
        (good.replace("groups = \"heard\"", ""), "airspace.groups=heard"),
        (more("shield = \"off\""), "airspace.shield=on"),
        (good.replace("deadline_s = 0.7", ""), "airspace.network.deadline_s=0.7"),
        (ring(3, "pc", "range_m = 900.0"), "leave out range_m"),
        (more("position_noise_m = 1.0"), "leave out position_noise_m"),
        (ring(12, "pc", "").replace("radius_m = 260.0", "radius_m = 40.0"), "farther apart"),
    ] {
        let said = refused(&text);
        assert!(said.contains(words), "{words}: {said}");
    }
    let one = |keys: &str| {
        format!(
            "{good}\n[[airplanes]]\nat_m = [3000.0, 3000.0]\nheading_deg = 0.0\n\
             way_points_m = [[4000.0, 3000.0]]\n{keys}\n"
        )
    };
    for (keys, words) in [
        ("appears_s = 10.0", "leave out appears_s"),
        ("non_cooperative = true", "has no node"),
        ("orders = [{ at_s = 10.0, heading_deg = 5.0 }]", "leave out its orders"),
    ] {
        let said = refused(&one(keys));
        assert!(said.contains(words), "{words}: {said}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// Whatever is lost of reports and packets, for whomever, no pair loses separation, with the errors for which the shield
    /// allows on top.
    #[test]
    fn no_loss_of_reports_makes_any_pair_lose_separation(
        seed in 0u64..1000, share in 0.05f64..0.7, dead in prop::option::of(0u32..6), loss in 0.0f64..0.4,
    ) {
        let text = ring(6, "mvp", &format!("loss = {loss:.2}")).replace("seed = 3", &format!("seed = {seed}"));
        let mut flight = Flight::start(&text);
        let mut state = seed;
        let mut unheard = 0;
        while !flight.run.is_over() && flight.run.cycle() < 70 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let cycle = flight.run.cycle();
            let is_lost = |from: EntityId, to: EntityId| {
                // An even hash of the link and the cycle; a dead one is not heard for a while, and hears nobody.
                let mut bits = state ^ (u64::from(from) << 32 | u64::from(to));
                bits = (bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                let is_drawn = ((bits ^ (bits >> 32)) % 1000) as f64 / 1000.0 < share;
                let is_dead = |id| dead == Some(id) && (10..20).contains(&cycle);
                is_drawn || is_dead(from) || is_dead(to)
            };
            flight.exchange_reports(is_lost);
            unheard += flight.fly_cycle();
            flight.check_own_parts();
        }
        prop_assert!(unheard > 0);
        let metrics = flight.run.metrics();
        prop_assert_eq!(metrics.losses_of_separation, 0);
        // The gap that errors need is kept, too.
        let nearest_m = metrics.min_separation_m.unwrap_or(f64::INFINITY);
        prop_assert!(nearest_m >= 30.0 + 2.0 * 7.5 - 1e-6, "{}", nearest_m);
    }
}
