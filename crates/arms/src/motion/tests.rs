//! Filtered motions against closed forms and against the rates themselves.

use super::*;
use crate::kinematics::SerialChain;
use proptest::prelude::*;
use sidestep_import::urdf::Model;
use sidestep_import::urdf::joint_limits::{GivenRates, JointRates as RatesByName};
use sidestep_kernel::math;

fn rates(speed: f64, acceleration: f64, jerk: f64) -> JointRates {
    JointRates { speed, acceleration, jerk }
}

/// An arm whose second joint turns `multiplier` times as far as its first; `limits` are their attributes.
fn mimicking(multiplier: f64, [first, second]: [&str; 2]) -> SerialChain {
    let text = format!(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\
         <joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>\
         <limit lower='-1' upper='1' {first}/></joint>\
         <joint name='k' type='revolute'><parent link='b'/><child link='c'/><axis xyz='0 0 1'/>\
         <limit lower='-9' upper='9' {second}/><mimic joint='j' multiplier='{multiplier}'/></joint></robot>"
    );
    let model = Model::parse("r", &text).expect("a model");
    SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("an arm")
}

#[test]
fn assumed_speeds_are_told_of_joints_that_mimic_others_where_they_limit() {
    let named = |multiplier, limits| {
        let chain = mimicking(multiplier, limits);
        let assumed = assumed_speeds(&chain, &RatesByName::new(), GivenRates::default());
        assumed.into_iter().map(|assumed| assumed.joint).collect::<Vec<_>>()
    };
    let given = "velocity='1'";
    // Half a turn a second of the second joint is a tenth of that of the first.
    assert_eq!(named(10.0, [given, ""]), ["k"]);
    // A fifth of the first joint's own speed would be enough for it.
    assert_eq!(named(0.2, [given, ""]), [""; 0]);
    // 1 rad/s of the second joint lets the first reach 0.1 rad/s, whatever it may by itself.
    assert_eq!(named(10.0, ["", given]), [""; 0]);
    assert_eq!(named(0.1, ["", given]), ["j"]);
    assert_eq!(named(1.0, ["", ""]), ["j", "k"]);
    let at_most = GivenRates { speed: Some(1.0), ..GivenRates::default() };
    let chain = mimicking(10.0, ["", ""]);
    assert_eq!(assumed_speeds(&chain, &RatesByName::new(), at_most), []);
}

#[test]
fn the_key_that_limits_a_joint_is_known_also_through_one_that_mimics_it() {
    let chain = mimicking(10.0, ["velocity='1'", "velocity='9'"]);
    let cut = |acceleration, jerk| {
        let at_most = GivenRates { speed: None, acceleration, jerk };
        rates_cut_by(&chain, &RatesByName::new(), at_most)[0]
    };
    assert_eq!(cut(None, None), CutRates::default());
    // The second joint's 0.5 rad/s2 are 0.05 rad/s2 of the first.
    let lower = CutRates { acceleration: true, jerk: false };
    assert_eq!(cut(Some(0.5), None), lower);
    assert_eq!(cut(Some(1e3), Some(1e9)), CutRates::default());
    assert!(cut(Some(1e3), Some(1.0)).jerk);
}

/// The position at time `t` of a motion from rest to rest by seven segments of constant jerk: in closed form, with the
/// durations of its acceleration (`ramp`), of its changes of acceleration (`jerk_s`) and of its start to the start of
/// its braking (`cruise`).
fn seven_segments(speed: f64, [ramp, jerk_s, cruise]: [f64; 3], t: f64) -> f64 {
    let jerk = speed / (ramp * jerk_s);
    let cube = |from: f64| {
        let since = (t - from).max(0.0);
        since * since * since / 6.0
    };
    let mut position = 0.0;
    for (from, sign) in [(0.0, 1.0), (jerk_s, -1.0), (ramp, -1.0), (ramp + jerk_s, 1.0)] {
        position += sign * jerk * (cube(from) - cube(from + cruise));
    }
    position
}

/// Leads one joint at the highest speed from 0 to `to`, and until it rests.
fn lead(filter: &MotionFilter, to: f64) -> Vec<f64> {
    let mut state = MotionState::default();
    let mut joints = vec![0.0];
    let mut positions = Vec::new();
    let unlimited = [[f64::NEG_INFINITY, f64::INFINITY]];
    loop {
        let [lower, upper] = filter.reference_ranges(&state, &joints, &unlimited)[0];
        joints = filter.advance(&mut state, &joints, &[to.clamp(lower, upper)]).joints;
        if state.is_at_rest() {
            return positions;
        }
        positions.push(joints[0]);
    }
}

#[test]
fn a_motion_from_rest_to_rest_has_seven_segments() {
    let dt_s = 1e-3;
    let filter =
        MotionFilter::new(vec![rates(1.0, 4.0, 100.0)], dt_s).expect("windows of few cycles");
    // 1.0 / 4.0 s, 2 * 4.0 / 100.0 s, and 1.5 rad at 1 rad/s.
    let times_s = [0.25, 0.08, 1.5];
    let positions = lead(&filter, 1.5);
    for (k, position) in positions.iter().enumerate() {
        // Three sums, one for each order of a difference, are together a cycle ahead of the three integrals.
        let expected = seven_segments(1.0, times_s, (k + 2) as f64 * dt_s);
        assert!((position - expected).abs() < 3e-6, "{k}: {position} {expected}");
    }
    let lasts_s = positions.len() as f64 * dt_s;
    assert!((lasts_s - 1.83).abs() < 4.0 * dt_s, "{lasts_s}");
    assert_eq!(positions.last(), Some(&1.5));
}

#[test]
fn without_a_jerk_limit_the_profile_is_a_trapezoid() {
    let dt_s = 1e-3;
    let filter =
        MotionFilter::new(vec![rates(0.5, 2.0, 1e9)], dt_s).expect("windows of few cycles");
    for (k, position) in lead(&filter, 1.0).into_iter().enumerate() {
        let t = (k + 1) as f64 * dt_s;
        // 0.5 rad/s after 0.25 s, braking from 2 s on.
        let [up, down] = [0.0, 2.0].map(|from: f64| {
            let ramp = (t - from).clamp(0.0, 0.25);
            0.5 * 2.0 * ramp * ramp + 0.5 * (t - from - 0.25).max(0.0)
        });
        // The sampled mean is half a cycle ahead of the continuous one.
        assert!((position - (up - down)).abs() < 0.6 * 0.5 * dt_s, "{k}: {position}");
    }
}

#[test]
fn a_slow_drive_is_led_more_slowly_instead_of_late() {
    let filter =
        MotionFilter::new(vec![rates(2.0, 0.5, 1e9)], 0.02).expect("windows of few cycles");
    let speeds: Vec<f64> = filter.reference_speeds().collect();
    assert!((speeds[0] - 0.25).abs() < 1e-5, "{speeds:?}");
    // Half a second in cycles of 20 ms: with the last of 25 postures the joints are at a reference that rests.
    assert_eq!(filter.stop_postures(&MotionState::default(), &[0.0], &[0.001]).len(), 25);
}

#[test]
fn a_cycle_too_short_for_the_windows_is_refused_with_one_that_is_long_enough() {
    let with_dt_s = |dt_s: f64| MotionFilter::new(vec![rates(1.0, 4.0, 100.0)], dt_s);
    for dt_s in [1e-300, 1e-8] {
        let error = with_dt_s(dt_s).expect_err("too short");
        assert!(error.cause().contains("0.330 s, more than 4096 cycles"), "{}", error.cause());
        assert!(error.remedy().contains("chain.dt_s = 0.000081 or more"), "{}", error.remedy());
    }
    let filter = with_dt_s(0.000_081).expect("long enough");
    let stop = filter.stop_postures(&MotionState::default(), &[0.0], &[1e-6]);
    assert_eq!(stop.last(), Some(&vec![1e-6]));
}

#[test]
fn a_step_of_the_reference_is_followed_as_the_mean_of_means() {
    let filter =
        MotionFilter::new(vec![rates(1.0, 4.0, 100.0)], 0.01).expect("windows of few cycles");
    // 0.25 s and 0.08 s.
    let [first, second] = [25, 8];
    let followed = filter.stop_postures(&MotionState::default(), &[0.0], &[1.0]);
    assert_eq!(followed.len(), first + second - 1);
    for (k, posture) in followed.iter().enumerate() {
        let pairs = (0..first).flat_map(|a| (0..second).map(move |b| a + b));
        let share = pairs.filter(|sum| *sum <= k).count() as f64 / (first * second) as f64;
        assert!((posture[0] - share).abs() < 1e-12, "{k}: {posture:?} {share}");
    }
}

/// By their definition, from any recent motion.
#[test]
fn the_coming_postures_are_the_weighted_means_of_their_references() {
    for dt_s in [0.02, 0.004] {
        let filter = MotionFilter::new(vec![rates(1.0, 4.0, 100.0); 2], dt_s).expect("windows");
        let mut state = MotionState::default();
        let mut joints = vec![0.0, 0.5];
        for k in 0..40 {
            let wave = f64::from(k) * 0.37;
            let reference = [0.003 * f64::from(k), 0.5 + 0.002 * math::sin(wave)];
            let coming = filter.stop_postures(&state, &joints, &reference);
            // Advanced by resting at the reference.
            let mut later = state.clone();
            let mut at = joints.clone();
            for (cycle, posture) in coming.iter().enumerate() {
                at = filter.advance(&mut later, &at, &reference).joints;
                for (one, other) in posture.iter().zip(&at) {
                    assert!((one - other).abs() < 1e-12, "{dt_s} {k} {cycle}: {posture:?} {at:?}");
                }
            }
            assert_eq!(coming[0], filter.advance(&mut state.clone(), &joints, &reference).joints);
            assert_eq!(coming[coming.len() - 1], reference);
            joints = filter.advance(&mut state, &joints, &reference).joints;
        }
    }
}

#[test]
fn states_survive_their_rows() {
    let filter =
        MotionFilter::new(vec![rates(1.0, 4.0, 100.0); 2], 0.01).expect("windows of few cycles");
    let mut state = MotionState::default();
    assert_eq!(MotionState::from_rows(&state.to_rows(), 2), Some(MotionState::default()));
    filter.advance(&mut state, &[0.0, 1.0], &[0.004, 1.0]);
    assert_eq!(MotionState::from_rows(&state.to_rows(), 2), Some(state.clone()));
    assert_eq!(MotionState::from_rows(&state.to_rows(), 3), None);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// References that go anywhere in their ranges, and turn back at random.
    #[test]
    fn no_joint_exceeds_its_rates_whatever_its_reference_does(
        limits in (0.1..4.0, 0.5..40.0, 5.0..5000.0),
        dt_s in 0.001..0.05,
        ways in prop::collection::vec(-1.0_f64..1.0, 1..120),
    ) {
        let (speed, acceleration, jerk) = limits;
        let allowed = rates(speed, acceleration, jerk);
        let filter = MotionFilter::new(vec![allowed], dt_s).expect("windows of few cycles");
        let mut state = MotionState::default();
        let mut joints = vec![0.3];
        let range = [[-0.5, 0.5]];
        for way in ways {
            let [lower, upper] = filter.reference_ranges(&state, &joints, &range)[0];
            let last = state.reference(&joints)[0];
            prop_assert!((lower..=upper).contains(&last));
            // Most of them at the ends of the range.
            let share: f64 = (2.0 * way).clamp(-1.0, 1.0);
            let to = if share > 0.0 { last + share * (upper - last) } else { last - share * (lower - last) };
            let stops = filter.stop_postures(&state, &joints, &[to]);
            prop_assert_eq!(&stops[stops.len() - 1], &vec![to]);
            let MotionStep { joints: next, rates: used } = filter.advance(&mut state, &joints, &[to]);
            prop_assert_eq!(&next, &stops[0]);
            prop_assert!(used[0].speed <= speed && used[0].acceleration <= acceleration && used[0].jerk <= jerk,
                "{:?} beyond {:?}", used[0], allowed);
            prop_assert!(next[0].abs() <= 0.5 + 1e-12);
            joints = next;
        }
    }
}
