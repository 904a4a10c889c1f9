//! Rules by phases of flight, beside `PRIORULES` of BlueSky.

use super::*;
use crate::baseline::mvp::{
    ActiveResolutions, MvpRules, Resolution, ResolutionSettings, resolutions,
};
use crate::baseline::test_aircraft;
use crate::flight::SpeedFactors;
use crate::settings::{ReactiveSettings, Resolution as Axes};

/// Place, heading in degrees, altitude and rate of climb.
type Pose = ([f64; 2], f64, f64, f64);

/// What BlueSky commands: heading in degrees, speed, and rate of climb with the altitude that it ends at; none where it
/// keeps its rate.
type Command = (f64, f64, Option<(f64, f64)>);

/// One that cruises, and one that climbs.
const HEAD_ON: [Pose; 2] = [([0.0, 0.0], 0.0, 250.0, 0.0), ([3000.0, 0.0], 180.0, -150.0, 5.0)];
/// One that climbs, one that cruises, and one that descends.
const THREE: [Pose; 3] = [
    ([0.0, 0.0], 0.0, 0.0, 3.0),
    ([3000.0, 0.0], 180.0, 250.0, 0.0),
    ([2000.0, -1900.0], 90.0, 200.0, -4.0),
];

/// Returns what MVP commands by all that it may change, under a rule; none of one that has no conflict.
fn commands(rule: RightOfWayRule, poses: &[Pose]) -> Vec<Option<Resolution>> {
    let aircraft = |(slot, &(at, deg, altitude_m, climb_m_s)): (EntitySlot, &Pose)| {
        let flat = test_aircraft(slot, at, deg.to_radians());
        AircraftState { altitude_m, climb_m_s, ..flat }
    };
    let all: Vec<AircraftState> = (0..).zip(poses).map(aircraft).collect();
    let rules = MvpRules {
        settings: ReactiveSettings { look_ahead_s: 90.0, margin: 1.0, resolution_factor: 1.05 },
        resolution: ResolutionSettings {
            resolution: Axes::HeadingSpeedVertical,
            vertical_factor: 1.05,
            vertical_lead_s: 0.0,
            speeds: SpeedFactors { least: 0.5, largest: 2.0 },
        },
        vertical_m: 300.0,
        right_of_way: rule,
    };
    let meets = |i: usize, j: usize| rule.yielding(&all[i], &all[j]).as_minded(all[j]);
    let mut memory = vec![ActiveResolutions::default(); all.len()];
    resolutions(&all, &mut memory, &rules, meets)
}

fn assert_commands(rule: RightOfWayRule, poses: &[Pose], expected: &[Option<Command>]) {
    for ((found, pose), expected) in commands(rule, poses).iter().zip(poses).zip(expected) {
        let (Some(found), Some((deg, v_m_s, vertical))) = (found, expected) else {
            assert_eq!(found.is_some(), expected.is_some(), "{rule:?}: {found:?}");
            continue;
        };
        let off_rad = math::wrap_angle(found.heading_rad - deg.to_radians());
        assert!(off_rad.to_degrees().abs() < 1e-3, "{rule:?}: {found:?} for {deg}");
        assert!((found.v_m_s.expect("a speed") - v_m_s).abs() < 1e-3, "{rule:?}: {found:?}");
        assert_eq!(found.vertical.is_some(), vertical.is_some(), "{rule:?}: {found:?}");
        if let (Some(found), Some((climb_m_s, to_m))) = (found.vertical, vertical) {
            assert!((found.climb_m_s - climb_m_s).abs() < 1e-3, "{rule:?}: {found:?}");
            let reached_m = pose.2 + found.climb_m_s * found.within_s;
            assert!((reached_m - to_m).abs() < 2e-2, "{rule:?}: {reached_m} for {to_m}");
        }
    }
}

/// What BlueSky 1.1.1 commands after one look (`traf.cr.trk`, `tas`, `vs` and `alt`) with `RMETHH OFF` and `PRIORULES ON`
/// with each code, a zone of 500 m and 300 m, `RFACH 1.05`, `RFACV 1.05`, `DTLOOK 90` and limits that nobody comes to; as
/// degrees counterclockwise from east, and meters above the altitude 0 of the poses. With `RMETHH HDG` and `BOTH` its
/// headings and speeds are the same. To one that has right of way it commands what that flies already. Where it changes no
/// vertical speed it has that level off where the levels of the pair cross; ours flies to its own level.
#[test]
fn by_phases_each_resolves_as_bluesky_commands() {
    use RightOfWayRule as Rule;
    let by_cruising = (19.2191, 37.0658, None);
    let by_climbing = (-160.7809, 37.0658, None);
    let with_level = |(deg, v_m_s, _): Command, climb_m_s: f64, to_m: f64| {
        Some((deg, v_m_s, Some((climb_m_s, to_m))))
    };
    let cases: [(Rule, [Option<Command>; 2]); 5] = [
        (
            Rule::None,
            [with_level(by_cruising, 1.9688, 407.5), with_level(by_climbing, 3.0312, 92.5)],
        ),
        (Rule::CruisingFirst, [None, with_level(by_climbing, 3.0312, 92.5)]),
        (Rule::ClimbingFirst, [Some(by_cruising), None]),
        (Rule::CruisingFirstHorizontal, [None, Some(by_climbing)]),
        (Rule::ClimbingFirstHorizontal, [Some(by_cruising), None]),
    ];
    for (rule, expected) in cases {
        assert_commands(rule, &HEAD_ON, &expected);
    }

    // The one that climbs and the one that descends are in one phase, and both resolve.
    let climbs_beside_both = (12.2795, 29.8239, None);
    let climbs_beside_descending = (-11.3667, 29.7246, None);
    let cruises = (-160.7809, 37.0658, None);
    let descends = (81.8404, 41.2762, None);
    let descends_less = with_level(descends, 1.5125, 243.214);
    let cases: [(Rule, [Option<Command>; 3]); 5] = [
        (
            Rule::None,
            [
                with_level(climbs_beside_both, -4.4025, -125.786),
                with_level(cruises, 1.89, 407.5),
                descends_less,
            ],
        ),
        (
            Rule::CruisingFirst,
            [with_level(climbs_beside_both, -4.4025, -125.786), None, descends_less],
        ),
        (
            Rule::ClimbingFirst,
            [with_level(climbs_beside_descending, -2.5125, -71.786), Some(cruises), descends_less],
        ),
        (Rule::CruisingFirstHorizontal, [Some(climbs_beside_both), None, Some(descends)]),
        (
            Rule::ClimbingFirstHorizontal,
            [Some(climbs_beside_descending), Some(cruises), Some(descends)],
        ),
    ];
    for (rule, expected) in cases {
        assert_commands(rule, &THREE, &expected);
    }
}
