//! The steps of the proof, as properties.

use super::fallback::FallbackPath;
use super::*;
use crate::flight::{AircraftModel, FlightLevelRange, Frame, Point, Pose2, distance_m};
use proptest::prelude::*;
use std::sync::Arc;

const DTAU_S: f64 = 1.0;
const STEPS: usize = 5;
/// Enough for all kinds of fallbacks.
const MAX_LEAD_S: f64 = 60.0;
/// Seconds after which all orbit, and then have been around several times.
const ALL_ORBIT_S: usize = 400;

pub(super) fn rules(certainty: PlanCertainty) -> PlanRules {
    PlanRules { steps: STEPS, dtau_s: DTAU_S, certainty, ending: PlanEnding::AnyFallback }
}

fn choices(max_lead_s: f64) -> Arc<[Fallback]> {
    let model = AircraftModel {
        v_m_s: 35.0,
        omega_max_rad_s: 4f64.to_radians(),
        separation_m: 500.0,
        turns: 5,
    };
    Fallback::choices(&model, model.omega_max_rad_s, DTAU_S * STEPS as f64, max_lead_s)
}

pub(super) fn aircraft(x: f64, y: f64, heading_rad: f64, rank: u64) -> ShieldedAircraft {
    let pose = Pose2 { at: [x, y], heading_rad };
    ShieldedAircraft {
        id: rank as u32,
        frame: Frame::PLANE,
        pose,
        orbit_pose: pose,
        v_m_s: 35.0,
        omega_max_rad_s: 4f64.to_radians(),
        orbit_rad_s: 4f64.to_radians(),
        separation_m: 500.0,
        error_m: 0.0,
        levels: FlightLevelRange::from_level(0.0),
        drift: AirDrift::default(),
        vertical_m: 300.0,
        fallback: Fallback::default(),
        choices: choices(MAX_LEAD_S),
        dt_s: DTAU_S * STEPS as f64,
        exempt: ExemptIds::default(),
        rank,
        areas: None,
    }
}

fn some_flyers() -> impl Strategy<Value = Vec<ShieldedAircraft>> {
    prop::collection::vec((-4000.0f64..4000.0, -4000.0f64..4000.0, -3.1f64..3.1, 0.5f64..1.0), 2..9)
        .prop_map(|all| {
            let build = |(i, (x, y, psi, slow)): (usize, (f64, f64, f64, f64))| {
                // Every other airplane has a speed and turn rate of its own.
                let mut aircraft = aircraft(x, y, psi, (i * 7 % 11) as u64);
                if i % 3 == 2 {
                    aircraft.v_m_s *= slow;
                    aircraft.orbit_rad_s *= 1.0 + slow;
                }
                aircraft
            };
            all.into_iter().enumerate().map(build).collect()
        })
}

/// Airplanes with fallbacks that are apart; those that clash are left out.
pub(super) fn with_fallbacks(mut group: Vec<ShieldedAircraft>) -> Vec<ShieldedAircraft> {
    loop {
        let first = first_fallbacks(&group);
        match first.too_close.first() {
            Some(&(i, _)) => drop(group.remove(i)),
            None => {
                group
                    .iter_mut()
                    .zip(first.fallbacks)
                    .for_each(|(f, fallback)| f.fallback = fallback);
                return group;
            }
        }
    }
}

fn nearest_on_fallbacks(group: &[ShieldedAircraft], seconds: usize) -> f64 {
    let paths: Vec<FallbackPath> =
        group.iter().map(|aircraft| aircraft.fallback_path(aircraft.fallback)).collect();
    let mut nearest = f64::INFINITY;
    for t in 0..seconds * 4 {
        for (i, a) in paths.iter().enumerate() {
            for b in &paths[i + 1..] {
                let t_s = t as f64 / 4.0;
                nearest = nearest.min(distance_m(a.at(t_s), b.at(t_s)));
            }
        }
    }
    nearest
}

proptest! {
    /// All of a group are cleared in turn, some to the level of others: the invariant holds with all on the levels that they
    /// pass, and who is held is held by somebody.
    #[test]
    fn changes_of_level_are_cleared_as_far_as_fallbacks_are_apart(
        group in some_flyers(), levels_m in prop::collection::vec((0.0f64..2000.0, 0.0f64..2000.0), 9),
        exempt in any::<bool>(),
    ) {
        let mut group = group;
        for (one, (level_m, _)) in group.iter_mut().zip(&levels_m) {
            one.levels = FlightLevelRange::from_level(*level_m);
        }
        let mut group = with_fallbacks(group);
        if exempt && group.len() > 1 {
            let ids = [group[0].id, group[1].id];
            group[0].exempt = [ids[1]].into();
            group[1].exempt = [ids[0]].into();
        }
        for (k, (_, to_m)) in levels_m.iter().enumerate().take(group.len()) {
            let changing = group[k].clone();
            let from_m = changing.levels.low_m;
            let (altitude_m, fallback) = next_altitude(&changing, *to_m, &group, |_| AirDrift::default(), |_| *to_m);
            prop_assert!((from_m.min(*to_m)..=from_m.max(*to_m)).contains(&altitude_m), "{from_m} {altitude_m} {to_m}");
            let is_safe = |altitude_m: f64, fallback: Fallback| {
                let levels = FlightLevelRange::between(from_m, altitude_m);
                let passing = ShieldedAircraft { levels, ..changing.clone() };
                group.iter().filter(|other| passing.is_protected_from(other))
                    .all(|other| passing.do_fallbacks_stay_apart(fallback, other, other.fallback))
            };
            let left_m = to_m - altitude_m;
            if left_m.abs() > 0.05 {
                let on_m = altitude_m + left_m.clamp(-0.05, 0.05);
                prop_assert!(changing.choices.iter().all(|&choice| !is_safe(on_m, choice)), "{on_m} is free");
            }
            group[k].levels = FlightLevelRange::between(from_m, altitude_m);
            group[k].fallback = fallback;
        }
        for (i, a) in group.iter().enumerate() {
            for b in group[..i].iter().filter(|b| a.is_protected_from(b)) {
                prop_assert!(a.do_fallbacks_stay_apart(a.fallback, b, b.fallback), "{a:?} {b:?}");
            }
        }
    }
}

proptest! {
    /// Step 1 of the proof: first fallbacks without clashes stay apart forever.
    #[test]
    fn first_fallbacks_stay_apart(group in some_flyers()) {
        let group = with_fallbacks(group);
        prop_assert!(nearest_on_fallbacks(&group, ALL_ORBIT_S) >= 500.0);
    }

    /// Steps 2 to 4: for any wishes, the motions flown keep apart, and the stored fallbacks keep the
    /// invariant. Mixable plans do in every mixture with fallbacks.
    #[test]
    fn a_filtered_step_keeps_separation_and_the_invariant(
        group in some_flyers(),
        wishes in prop::collection::vec(prop::collection::vec(-1.0f64..1.0, 0..4), 9),
        follow in prop::collection::vec(any::<bool>(), 9),
        mixable in any::<bool>(),
    ) {
        let group = with_fallbacks(group);
        let candidates: Vec<Vec<TurnProfile>> = group.iter().zip(&wishes).map(|(f, wishes)| {
            let profile = |part: &f64| TurnProfile { omegas_rad_s: vec![part * f.orbit_rad_s; STEPS] };
            wishes.iter().map(profile).collect()
        }).collect();
        let certainty = if mixable { PlanCertainty::Mixable } else { PlanCertainty::Sure };
        let mut decisions = filter_maneuvers(&group, &candidates, rules(certainty));
        if mixable {
            for ((decision, follows), aircraft) in decisions.iter_mut().zip(follow).zip(&group) {
                if !follows {
                    let rest = aircraft.fallback.after_cycle();
                    *decision = ShieldDecision::from_fallback(rest);
                }
            }
        }
        let omega = |i: usize, k: usize| match decisions[i].candidate {
            Some(c) => candidates[i][c].omegas_rad_s[k],
            None => group[i].fallback.omega_rad_s(group[i].orbit_rad_s),
        };
        let mut now = group.clone();
        for k in 0..STEPS {
            for part in 1..=20 {
                let t_s = DTAU_S * f64::from(part) / 20.0;
                let at: Vec<Point> = now.iter().enumerate()
                    .map(|(i, f)| f.pose.step(f.v_m_s, omega(i, k), t_s).at).collect();
                for i in 0..at.len() {
                    for j in i + 1..at.len() {
                        prop_assert!(distance_m(at[i], at[j]) >= 500.0);
                    }
                }
            }
            for (i, f) in now.iter_mut().enumerate() {
                f.pose = f.pose.step(f.v_m_s, omega(i, k), DTAU_S);
                f.orbit_pose = f.pose;
            }
        }
        now.iter_mut().zip(&decisions).for_each(|(f, d)| f.fallback = d.fallback);
        prop_assert!(nearest_on_fallbacks(&now, ALL_ORBIT_S) >= 500.0);
    }

    /// A plan that is clear of another airplane does not need its consent: however that one flies
    /// for `dt`, and to whichever side it turns then, the two keep apart.
    #[test]
    fn a_plan_clear_of_another_keeps_apart_whatever_that_one_does(
        x in 1200.0f64..3000.0, bearing in -3.1f64..3.1, psi in -3.1f64..3.1,
        part in -1.0f64..1.0, others in prop::collection::vec(-1.0f64..1.0, STEPS),
        slow in 0.5f64..1.0, left in any::<bool>(), own_left in any::<bool>(),
    ) {
        let own = aircraft(0.0, 0.0, 0.0, 0);
        let at = Pose2 { at: [0.0; 2], heading_rad: bearing }.step(x, 0.0, 1.0).at;
        let other = ShieldedAircraft { orbit_rad_s: slow * own.omega_max_rad_s, ..aircraft(at[0], at[1], psi, 1) };
        let plan = |of: &ShieldedAircraft, parts: &[f64], left: bool| {
            let omegas_rad_s = parts.iter().map(|part| part * of.omega_max_rad_s).collect();
            SafeManeuver::new(of.clone(), &TurnProfile { omegas_rad_s }, DTAU_S, Fallback::from_side(OrbitSide::BOTH[usize::from(left)]))
        };
        let clear = plan(&own, &[part; STEPS], own_left);
        if clear.is_clear_of(&other) {
            prop_assert!(clear.is_compatible(&plan(&other, &others, left)));
        }
    }

    /// An airplane that is far from all others flies its wish.
    #[test]
    fn nobody_falls_back_without_need(x in 20_000.0f64..1e6, part in -1.0f64..1.0) {
        let group = [aircraft(0.0, 0.0, 0.0, 0), aircraft(x, 0.0, 3.0, 1)];
        let profile = || TurnProfile { omegas_rad_s: vec![part * group[0].orbit_rad_s; STEPS] };
        let wishes = [vec![profile()], vec![profile()]];
        let decisions = filter_maneuvers(&group, &wishes, rules(PlanCertainty::Sure));
        prop_assert!(decisions.iter().all(|d| d.candidate == Some(0)));
    }
}

#[test]
fn who_enters_chooses_a_side_apart_from_the_stored_ones_and_nobody_else_does() {
    // On its left the newcomer would orbit over the other, on its right it would not.
    let stored = aircraft(0.0, 2002.0, std::f64::consts::PI, 0);
    let [left, right] = OrbitSide::BOTH.map(Fallback::from_side);
    let group = [stored.clone(), aircraft(0.0, 0.0, 0.0, 1)];
    let found = entry_fallbacks(&group, &[EntryRole::Yield, EntryRole::Enter]);
    assert_eq!((found.fallbacks, found.too_close), (vec![left, right], vec![]));
    let near = [stored.clone(), aircraft(100.0, 2002.0, 0.0, 1), aircraft(50.0, 2030.0, 0.0, 2)];
    let roles = [EntryRole::Yield, EntryRole::Yield, EntryRole::Enter];
    let found = entry_fallbacks(&near, &roles);
    assert_eq!(found.fallbacks[..2], [left; 2]);
    assert_eq!(found.too_close, [(0, 2), (1, 2)], "the pair that was there before is not named");
}

#[test]
fn two_that_came_in_too_close_are_left_to_the_method_and_nobody_else_is() {
    let close = |x: f64, rank: u64, named: u32| ShieldedAircraft {
        exempt: [named].into(),
        ..aircraft(x, 0.0, 0.0, rank)
    };
    let straight = || vec![TurnProfile { omegas_rad_s: vec![0.0; STEPS] }];
    let wishes = [straight(), straight()];
    let of_each_other = [close(0.0, 0, 1), close(100.0, 1, 0)];
    let wanted = filter_maneuvers(&of_each_other, &wishes, rules(PlanCertainty::Sure));
    assert!(wanted.iter().all(|d| d.candidate == Some(0)), "{wanted:?}");
    // In each other's way, and both are named with others.
    let mut of_others = [close(0.0, 0, 7), close(0.0, 1, 8)];
    let pose = Pose2 { at: [0.0, 620.0], heading_rad: -std::f64::consts::FRAC_PI_2 };
    (of_others[1].pose, of_others[1].orbit_pose) = (pose, pose);
    of_others.iter_mut().for_each(|f| f.fallback = Fallback::from_side(OrbitSide::Right));
    assert!(nearest_on_fallbacks(&of_others, ALL_ORBIT_S) > 500.0);
    assert!(of_others[0].is_safe_with(&of_others[1]));
    let kept = filter_maneuvers(&of_others, &wishes, rules(PlanCertainty::Sure));
    assert!(kept.iter().any(|d| d.candidate.is_none()), "{kept:?}");
}

#[test]
fn a_change_is_refused_when_no_fallback_is_apart() {
    let quick_turns = 6f64.to_radians();
    let other = ShieldedAircraft { orbit_rad_s: quick_turns, ..aircraft(1500.0, -100.0, 0.0, 0) };
    let slow = ShieldedAircraft { choices: choices(0.0), ..aircraft(0.0, 0.0, 0.0, 1) };
    let left = Fallback::from_side(OrbitSide::Left);
    let beside =
        |changed: &ShieldedAircraft| safe_fallback(changed, changed, [other.clone()].into_iter());
    let fast = ShieldedAircraft { v_m_s: 150.0, ..slow.clone() };
    assert_eq!((beside(&slow), beside(&fast)), (Some(left), None));
    let above = ShieldedAircraft { levels: FlightLevelRange::from_level(1000.0), ..fast.clone() };
    assert_eq!(beside(&above), Some(left));
    // Named with another one, and then with this one.
    assert_eq!(beside(&ShieldedAircraft { exempt: [7].into(), ..fast.clone() }), None);
    assert_eq!(beside(&ShieldedAircraft { exempt: [0, 7].into(), ..fast }), Some(left));
    let climbing = ShieldedAircraft { levels: FlightLevelRange::between(0.0, 1000.0), ..above };
    assert_eq!(beside(&climbing), None);
}

#[test]
fn airplanes_that_start_too_close_are_named() {
    let group =
        [aircraft(0.0, 0.0, 0.0, 0), aircraft(5e4, 0.0, 0.0, 1), aircraft(100.0, 0.0, 0.0, 2)];
    assert_eq!(first_fallbacks(&group).too_close, [(0, 2)]);
}
