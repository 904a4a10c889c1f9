//! Areas in a plane, and paths beside them.

use super::*;
use crate::flight::Pose2;
use proptest::prelude::*;

/// A polygon with corners at several distances around its center: it may be concave.
pub(crate) fn some_star() -> impl Strategy<Value = AreaShape> {
    prop::collection::vec(300.0f64..2500.0, 3..9).prop_map(|radii_m| {
        let step_rad = std::f64::consts::TAU / radii_m.len() as f64;
        let corner = |(k, radius_m): (usize, &f64)| {
            let (sin, cos) = math::sin_cos(k as f64 * step_rad);
            [radius_m * cos, radius_m * sin]
        };
        AreaShape::from_rings(vec![radii_m.iter().enumerate().map(corner).collect()])
    })
}

fn some_shape() -> impl Strategy<Value = AreaShape> {
    prop_oneof![some_star(), (200.0f64..2500.0).prop_map(|radius_m| AreaShape::Circle { radius_m })]
}

fn some_area() -> impl Strategy<Value = Area> {
    let place = || [-4000.0f64..4000.0, -4000.0f64..4000.0];
    let velocity = prop_oneof![Just([0.0; 2]), [-20.0f64..20.0, -20.0f64..20.0]];
    (
        some_shape(),
        any::<bool>(),
        place(),
        velocity,
        prop::option::of((0.0f64..100.0, 20.0f64..300.0)),
    )
        .prop_map(|(shape, is_out, center, velocity_m_s, times)| Area {
            name: None,
            kind: if is_out { AreaKind::Out } else { AreaKind::In },
            shape,
            center,
            levels: FlightLevelRange::ALL,
            from_s: times.map_or(0.0, |(from_s, _)| from_s),
            until_s: times.map_or(f64::INFINITY, |(from_s, lasts_s)| from_s + lasts_s),
            velocity_m_s,
        })
}

fn some_path() -> impl Strategy<Value = Vec<PathPiece>> {
    let piece = (-0.07f64..0.07, any::<bool>(), 1.0f64..40.0);
    (prop::collection::vec(piece, 0..4), -3.1f64..3.1, 10.0f64..60.0, any::<bool>()).prop_map(
        |(pieces, heading_rad, v_m_s, is_left)| {
            let mut pose = Pose2 { at: [0.0; 2], heading_rad };
            let mut from_s = 0.0;
            let mut path = Vec::new();
            let mut add = |omega_rad_s: f64, lasts_s: f64| {
                path.push(PathPiece {
                    start: pose,
                    v_m_s,
                    omega_rad_s,
                    from_s,
                    until_s: from_s + lasts_s,
                });
                pose = pose.step(v_m_s, omega_rad_s, lasts_s.min(1e6));
                from_s += lasts_s;
            };
            for (omega_rad_s, is_straight, lasts_s) in pieces {
                add(if is_straight { 0.0 } else { omega_rad_s }, lasts_s);
            }
            add(if is_left { 0.06 } else { -0.06 }, f64::INFINITY);
            path
        },
    )
}

fn at(path: &[PathPiece], t_s: f64) -> Point {
    let piece = path.iter().rev().find(|piece| piece.from_s <= t_s).expect("a path begins at once");
    piece.start.step(piece.v_m_s, piece.omega_rad_s, t_s - piece.from_s).at
}

fn areas(area: Area) -> Areas {
    vec![Arc::new(area)].into()
}

#[test]
fn a_place_is_inside_of_a_polygon_with_a_hole_where_it_is_inside_of_one_ring() {
    let square = |half: f64| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
    let shape = AreaShape::from_rings(vec![square(1000.0), square(400.0)]);
    for (at, is_inside) in
        [([0.0, 0.0], false), ([500.0, 0.0], true), ([1200.0, 0.0], false), ([0.0, -700.0], true)]
    {
        assert_eq!(shape.contains(at), is_inside, "{at:?}");
    }
    assert_eq!(shape.border_distance_m([500.0, 0.0]), 100.0);
    assert_eq!(find_crossing(&shape), None);
    let bow =
        AreaShape::from_rings(vec![vec![[0.0, 0.0], [100.0, 100.0], [100.0, 0.0], [0.0, 100.0]]]);
    assert!(find_crossing(&bow).is_some());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    /// Never wrongly clear: dense sampling finds no place beyond the border, and none nearer to it than the margin.
    #[test]
    fn a_path_that_is_found_clear_of_an_area_is_clear_of_it(
        area in some_area(), path in some_path(), margin_m in 0.0f64..50.0, now_s in 0.0f64..60.0,
        wind_m_s in prop_oneof![Just([0.0; 2]), [-8.0f64..8.0, -8.0f64..8.0]],
    ) {
        let all = areas(area.clone());
        let context = AreaContext { areas: &all, surface: Surface::Plane, wind_m_s, now_s, look_ahead_s: 200.0 };
        let conflict_s = match context.near(Frame::PLANE, [0.0; 2], 1e5) {
            Some(near) => near[0].conflict_s(path.iter().copied(), margin_m),
            None => f64::INFINITY,
        };
        let moves = area.velocity_m_s != [0.0; 2] || wind_m_s != [0.0; 2];
        for k in 0..2000 {
            let t_s = 0.2 * f64::from(k);
            let is_considered = now_s + t_s >= area.from_s && now_s + t_s < area.until_s && (t_s < 200.0 || !moves);
            if t_s >= conflict_s || !is_considered {
                continue;
            }
            let over_ground = add_scaled(at(&path, t_s), wind_m_s, t_s);
            let clearance_m = area.clearance_m(area.plane_at(Surface::Plane, now_s + t_s).to_area(over_ground));
            prop_assert!(clearance_m >= margin_m - 1e-6, "{clearance_m} after {t_s} s, conflict {conflict_s}");
        }
    }

    /// Wrongly in conflict only near the border.
    #[test]
    fn a_path_that_stays_far_from_a_border_is_found_clear(area in some_area(), path in some_path()) {
        let area = Area { from_s: 0.0, until_s: f64::INFINITY, velocity_m_s: [0.0; 2], ..area };
        let nearest_m = (0..4000)
            .map(|k| area.clearance_m(area.plane_at(Surface::Plane, 0.0).to_area(at(&path, 0.1 * f64::from(k)))))
            .fold(f64::INFINITY, f64::min);
        let all = areas(area);
        let context =
            AreaContext { areas: &all, surface: Surface::Plane, wind_m_s: [0.0; 2], now_s: 0.0, look_ahead_s: 90.0 };
        // Samples are up to 6 m apart.
        if nearest_m > 10.0
            && let Some(near) = context.near(Frame::PLANE, [0.0; 2], 1e5)
        {
            prop_assert_eq!(near[0].conflict_s(path.iter().copied(), nearest_m - 8.0), f64::INFINITY);
        }
    }

    /// Of an area of many corners only the edges near an airplane are kept: that changes no answer.
    #[test]
    fn far_edges_that_are_left_out_change_nothing(
        path in some_path(), center in [-9000.0f64..9000.0, -9000.0f64..9000.0], reach_m in 3000.0f64..9000.0,
    ) {
        let corner = |k: usize| {
            let (sin, cos) = math::sin_cos(std::f64::consts::TAU * k as f64 / 400.0);
            let radius_m = if k.is_multiple_of(2) { 8000.0 } else { 7000.0 };
            [radius_m * cos, radius_m * sin]
        };
        let shape = AreaShape::from_rings(vec![(0..400).map(corner).collect()]);
        let area = Area {
            name: None,
            kind: AreaKind::Out,
            shape,
            center,
            levels: FlightLevelRange::ALL,
            from_s: 0.0,
            until_s: f64::INFINITY,
            velocity_m_s: [0.0; 2],
        };
        let all = areas(area);
        let context =
            AreaContext { areas: &all, surface: Surface::Plane, wind_m_s: [0.0; 2], now_s: 0.0, look_ahead_s: 90.0 };
        let farthest_m = (0..600).map(|k| distance_m([0.0; 2], at(&path, 0.5 * f64::from(k)))).fold(0.0, f64::max);
        let [near, wide] = [reach_m.max(farthest_m + 100.0), 1e6].map(|reach_m| {
            context.near(Frame::PLANE, [0.0; 2], reach_m)
                .map_or(f64::INFINITY, |near| near[0].conflict_s(path.iter().copied(), 5.0))
        });
        prop_assert!(near == wide || (near - wide).abs() < 1e-3, "{near} {wide}");
    }

    /// A detour keeps clear of all areas, and is not needlessly long.
    #[test]
    fn a_detour_is_clear_of_all_areas(
        shapes in prop::collection::vec((some_star(), [-6000.0f64..6000.0, -6000.0f64..6000.0]), 1..5),
        to in [8000.0f64..9000.0, -9000.0f64..9000.0],
    ) {
        let all: Vec<Area> = shapes
            .into_iter()
            .map(|(shape, center)| Area {
                name: None,
                kind: AreaKind::Out,
                shape,
                center,
                levels: FlightLevelRange::ALL,
                from_s: 0.0,
                until_s: f64::INFINITY,
                velocity_m_s: [0.0; 2],
            })
            .collect();
        let from = [-9000.0, 0.0];
        let planner = DetourPlanner { surface: Surface::Plane, areas: all.iter().collect(), gap_m: 100.0 };
        let detour = planner.way_points(from, to);
        let is_clear = |line: [Point; 2]| {
            (0..=400).all(|k| {
                let place = sidestep_kernel::geometry::lerp(line[0], line[1], f64::from(k) / 400.0);
                all.iter().all(|area| !area.forbids(area.plane_at(Surface::Plane, 0.0).to_area(place)))
            })
        };
        let ends_are_free = [from, to].iter().all(|&end| is_clear([end, end]));
        if ends_are_free && !detour.is_empty() {
            let route = [vec![from], detour, vec![to]].concat();
            for line in route.windows(2) {
                prop_assert!(is_clear([line[0], line[1]]), "{route:?}");
            }
        } else if ends_are_free && is_clear([from, to]) {
            prop_assert!(detour.is_empty());
        }
    }
}
