//! Tests of plans by their elements: where they are, and what they say.

use crate::picture::{PictureOptions, draw};
use crate::testing::{moment, open};
use sidestep_airspace::kinds::{AIRPLANE, AREA, ZONE};
use sidestep_kernel::view::{
    AreaLevels, Body, BodyCondition, BodyId, EarthChart, EarthProjection, EarthReference, Frame,
    Pose, Route, Scenery, Shape, TrafficPlan, Trail, Vec3,
};
use std::f64::consts::{FRAC_PI_2, PI};

const FOOT_M: f64 = 0.3048;
const KNOT_M_S: f64 = 1852.0 / 3600.0;

/// An airplane at a place that flies north at 450 knots and climbs, and its zone.
fn airplane(number: u32, at_m: Vec3, heading_rad: f64, state: BodyCondition) -> [Body; 2] {
    let pose = Pose::from_heading(at_m, heading_rad);
    let speed_m_s = 450.0 * KNOT_M_S;
    let velocity_m_s = [speed_m_s * heading_rad.cos(), speed_m_s * heading_rad.sin(), 10.0];
    let dart = Shape::Dart { length_m: 1500.0, width_m: 1000.0 };
    let zone = Shape::Cylinder { radius_m: 4630.0, height_m: 10.0 };
    [
        Body::new(AIRPLANE, number, pose, dart).with_velocity(velocity_m_s),
        Body::new(ZONE, number, pose, zone),
    ]
    .map(|body| body.with_condition_if(state != BodyCondition::Plain, state))
}

fn plain(number: u32, at_m: Vec3, heading_rad: f64) -> [Body; 2] {
    airplane(number, at_m, heading_rad, BodyCondition::Plain)
}

fn traffic() -> Scenery {
    let names = vec![(AIRPLANE, 0, "KLM1023".into()), (AIRPLANE, 1, "BAW5".into())];
    Scenery { names, traffic: Some(TrafficPlan::default()), ..open(3) }
}

fn on_earth(scenery: Scenery) -> Scenery {
    let chart =
        EarthChart { origin_deg: [52.0, 4.5], projection: EarthProjection::AzimuthalEquidistant };
    Scenery { earth: EarthReference { chart: Some(chart), start_utc_s: None }, ..scenery }
}

/// Two airplanes 60 km apart, one of them flying north and one flying west, 2000 feet above it.
fn two() -> Frame {
    let first = plain(0, [-30_000.0, -20_000.0, 23_000.0 * FOOT_M], FRAC_PI_2);
    let second = plain(1, [30_000.0, 20_000.0, 25_000.0 * FOOT_M], PI);
    moment([first, second].concat())
}

fn picture(scenery: &Scenery, frame: &Frame, trails: &[Trail]) -> String {
    draw(scenery, frame, trails, &PictureOptions::page(scenery, "")).unwrap()
}

/// Returns the lines of a picture with an attribute.
fn elements<'a>(svg: &'a str, with: &str) -> Vec<&'a str> {
    svg.lines().filter(|line| line.contains(with)).collect()
}

fn number(element: &str, attribute: &str) -> f64 {
    let start = format!(" {attribute}=\"");
    let value = element.split(&start).nth(1).expect(attribute).split('"').next().unwrap();
    value.parse().unwrap()
}

fn texts(svg: &str) -> Vec<&str> {
    let texts = svg.lines().filter(|line| line.starts_with("<text"));
    texts.filter_map(|line| line.split('>').nth(1)?.split('<').next()).collect()
}

#[test]
fn north_is_up_and_east_is_right() {
    let svg = picture(&traffic(), &two(), &[]);
    let vectors = elements(&svg, r#"class="vector""#);
    assert_eq!(vectors.len(), 2, "{svg}");
    let [dx, dy] = [["x1", "x2"], ["y1", "y2"]]
        .map(|ends| number(vectors[0], ends[1]) - number(vectors[0], ends[0]));
    assert!(dy < -10.0 && dx.abs() < 0.1, "it flies north: {dx} {dy}");
    let west = number(vectors[1], "x2") - number(vectors[1], "x1");
    assert!((west - dy).abs() < 0.1, "as fast to the west");
    assert!(number(vectors[0], "x1") < number(vectors[1], "x1"), "the second one is in the east");
    assert!(number(vectors[0], "y1") > number(vectors[1], "y1"), "and in the north");
    assert_eq!(elements(&svg, r#"class="north""#).len(), 1);
}

#[test]
fn data_blocks_have_call_sign_level_climb_and_speed_in_the_units_of_the_field() {
    let svg = picture(&on_earth(traffic()), &two(), &[]);
    let words = texts(&svg);
    for expected in ["KLM1023", "FL230\u{2191} 450 kt", "BAW5", "FL250\u{2191} 450 kt"] {
        assert!(words.contains(&expected), "{expected}: {words:?}");
    }
    let words = picture(&traffic(), &two(), &[]);
    let words = texts(&words);
    assert!(
        words.contains(&"7010 m\u{2191} 232 m/s"),
        "meters without a place on earth: {words:?}"
    );
}

#[test]
fn a_plan_on_earth_has_latitudes_and_longitudes_and_others_have_distances() {
    let svg = picture(&on_earth(traffic()), &two(), &[]);
    let words = texts(&svg);
    assert!(words.contains(&"52\u{b0}00\u{2032}N") || words.contains(&"52\u{b0}N"), "{words:?}");
    assert!(words.iter().any(|word| word.ends_with("\u{2032}E")), "{words:?}");
    assert!(!words.iter().any(|word| word.contains("(km)")));
    assert!(words.iter().any(|word| word.ends_with(" NM")), "the scale bar: {words:?}");
    let svg = picture(&traffic(), &two(), &[]);
    let words = texts(&svg);
    assert!(words.contains(&"east (km)") && words.contains(&"north (km)"), "{words:?}");
}

#[test]
fn the_middle_of_a_chart_is_where_its_latitude_and_longitude_cross() {
    let frame = moment(plain(0, [0.0, 0.0, 7000.0], 0.0).to_vec());
    let corners = [[-40_000.0, -40_000.0, 7000.0], [40_000.0, 40_000.0, 7000.0]];
    let trail = Trail {
        of: BodyId::new(AIRPLANE, 0, None),
        points: vec![(0, corners[0]), (1, corners[1])],
    };
    let svg = picture(&on_earth(traffic()), &frame, &[trail]);
    let symbol = elements(&svg, r#"class="vector""#)[0];
    let tick = svg.lines().find(|line| line.contains(">52\u{b0}00\u{2032}N<")).expect("52 degrees");
    // Text is drawn by its baseline, a third of a letter below its middle.
    let middle = number(tick, "y") - 0.365 * number(tick, "font-size");
    // At the western edge, 40 km away, the parallel lies 160 m farther north on the chart.
    let off = number(symbol, "y1") - middle;
    assert!((0.5..3.0).contains(&off), "{off}: {tick} {symbol}");
    let tick = svg.lines().find(|line| line.contains(">4\u{b0}30\u{2032}E<")).expect("4.5 degrees");
    assert!((number(tick, "x") - number(symbol, "x1")).abs() < 0.5, "{tick} {symbol}");
}

#[test]
fn zones_are_circles_and_red_where_separation_is_lost() {
    let near =
        |number, y_m: f64| airplane(number, [0.0, y_m, 7000.0], 0.0, BodyCondition::Touching);
    let far = plain(2, [60_000.0, 0.0, 7000.0], 0.0);
    let frame = moment([near(0, 0.0), near(1, 6000.0), far].concat());
    let svg = picture(&traffic(), &frame, &[]);
    let lost = elements(&svg, r#"class="zone-lost""#);
    assert_eq!(lost.len(), 2);
    assert!(lost.iter().all(|zone| zone.contains("#D01010")), "{lost:?}");
    assert_eq!(elements(&svg, r#"class="zone""#).len(), 1);
    assert!(texts(&svg).contains(&"separation lost"), "the legend says it");
    let km = |zone: &str| number(zone, "r");
    assert!((km(lost[0]) - km(elements(&svg, r#"class="zone""#)[0])).abs() < 0.1);
}

fn border(number: u32, part: u32, level_m: f64) -> Body {
    let corners = [[0.0, 0.0], [20_000.0, 0.0], [20_000.0, 10_000.0], [0.0, 0.0]];
    let points_m = corners.map(|[x, y]| [x, y, level_m]).to_vec();
    let pose = Pose::from_position([0.0; 3]);
    Body::new(AREA, number, pose, Shape::Line { points_m, thickness_m: 100.0 }).with_part(part)
}

#[test]
fn areas_are_filled_once_with_their_limits_and_fences_are_open() {
    let area = |number, is_fence| AreaLevels {
        area: BodyId::new(AREA, number, None),
        is_fence,
        low_m: None,
        high_m: Some(10_000.0 * FOOT_M),
    };
    let bodies = vec![border(0, 0, 0.0), border(0, 1, 3048.0), border(1, 0, 3048.0)];
    let names = vec![(AREA, 0, "EHR 4".into())];
    let areas = vec![area(0, false), area(1, true)];
    let traffic = Some(TrafficPlan { areas, routes: Vec::new() });
    let scenery = on_earth(Scenery { bodies, names, traffic, ..open(3) });
    let svg = picture(&scenery, &two(), &[]);
    let shapes = elements(&svg, r#"class="area""#);
    assert_eq!(shapes.len(), 2, "one for each area, not for each level: {shapes:?}");
    assert!(shapes[0].contains("fill-opacity") && shapes[1].contains(r#"fill="none""#));
    assert!(shapes[0].contains('Z') && svg.contains("url(#area-hatch)"));
    let words = texts(&svg);
    assert!(words.contains(&"EHR 4") && words.contains(&"GND\u{2013}FL100"), "{words:?}");
    assert!(words.contains(&"area to stay out of") && words.contains(&"area to stay inside of"));
    assert_eq!(elements(&svg, r#"class="area-band""#).len(), 2, "in the profile, too");
}

#[test]
fn a_profile_is_aligned_with_the_plan_and_higher_traffic_is_higher() {
    let svg = picture(&on_earth(traffic()), &two(), &[]);
    let plan = elements(&svg, r#"class="plan""#)[0];
    let profile = elements(&svg, r#"class="profile""#)[0];
    assert_eq!(number(plan, "x"), number(profile, "x"));
    assert_eq!(number(plan, "width"), number(profile, "width"));
    assert!(number(profile, "y") > number(plan, "y") + number(plan, "height"));
    let dots = elements(&svg, r#"class="aircraft-level""#);
    assert_eq!(dots.len(), 2);
    let vectors = elements(&svg, r#"class="vector""#);
    for (dot, vector) in dots.iter().zip(&vectors) {
        assert!((number(dot, "cx") - number(vector, "x1")).abs() < 0.05, "{dot} {vector}");
    }
    assert!(number(dots[1], "cy") < number(dots[0], "cy") - 5.0, "2000 feet higher");
    assert!(texts(&svg).contains(&"FL240"), "{svg}");
}

#[test]
fn traffic_on_one_level_has_no_profile() {
    let frame = moment(plain(0, [0.0, 0.0, 3000.0], 0.0).to_vec());
    assert!(elements(&picture(&traffic(), &frame, &[]), r#"class="profile""#).is_empty());
}

#[test]
fn data_blocks_cover_neither_each_other_nor_the_symbols() {
    let row = |k: u32| plain(k, [9000.0 * f64::from(k), 500.0 * f64::from(k), 7000.0], 0.0);
    let frame = moment((0..12).flat_map(row).collect());
    let svg = picture(&Scenery { names: Vec::new(), ..traffic() }, &frame, &[]);
    let names: Vec<&str> =
        svg.lines().filter(|line| line.contains(">airplane ") && line.contains("bold")).collect();
    assert!(names.len() >= 10, "{names:?}");
    let size = number(names[0], "font-size");
    let at: Vec<[f64; 2]> =
        names.iter().map(|name| [number(name, "x"), number(name, "y")]).collect();
    for (k, [x, y]) in at.iter().enumerate() {
        for [other_x, other_y] in &at[k + 1..] {
            // Two lines high, and wider than eight letters are.
            let is_apart = (x - other_x).abs() > 4.0 * size || (y - other_y).abs() > 2.0 * size;
            assert!(is_apart, "{x} {y} and {other_x} {other_y}");
        }
    }
}

#[test]
fn routes_are_thin_lines_with_way_points_and_end_with_their_aircraft() {
    let route = |number| Route {
        agent: BodyId::new(AIRPLANE, number, None),
        points_m: vec![[0.0, 0.0, 7000.0], [9000.0, 0.0, 7000.0], [9000.0, 9000.0, 7000.0]],
    };
    let traffic_plan = TrafficPlan { areas: Vec::new(), routes: vec![route(0), route(7)] };
    let scenery = Scenery { traffic: Some(traffic_plan), ..traffic() };
    let svg = picture(&scenery, &two(), &[]);
    assert_eq!(elements(&svg, r#"class="route""#).len(), 1, "airplane 7 is not there");
    let marks = elements(&svg, r#"class="way-point""#)[0];
    assert_eq!(marks.matches('Z').count(), 2, "a triangle at each way-point");
}

#[test]
fn aircraft_that_are_gone_leave_their_trail_with_its_name() {
    let points = vec![(0, [0.0, 0.0, 7000.0]), (5, [30_000.0, 0.0, 7000.0])];
    let trail = Trail { of: BodyId::new(AIRPLANE, 0, None), points };
    let start = Body::new(
        sidestep_airspace::kinds::START,
        0,
        Pose::from_position([0.0, 0.0, 7000.0]),
        Shape::Cylinder { radius_m: 1000.0, height_m: 10.0 },
    );
    let scenery = Scenery { bodies: vec![start], ..traffic() };
    let svg = picture(&scenery, &moment(Vec::new()), &[trail]);
    assert!(texts(&svg).contains(&"KLM1023"), "{svg}");
    assert_eq!(elements(&svg, r#"class="trail""#).len(), 1);
    assert!(elements(&svg, r#"class="vector""#).is_empty());
}

#[test]
fn in_a_wide_picture_the_legend_stands_beside_the_plan_which_is_larger_for_it() {
    let drawn = |size_px| {
        let page = PictureOptions::page(&traffic(), "");
        let options = PictureOptions { size_px: Some(size_px), ..page };
        draw(&traffic(), &two(), &[], &options).unwrap()
    };
    let legend_place = |svg: &str| {
        let entries = elements(svg, "velocity: where it is in");
        let plan = elements(svg, r#"class="plan""#);
        let right = number(plan[0], "x") + number(plan[0], "width");
        (number(entries[0], "x") > right, number(plan[0], "width"))
    };
    let (is_beside, _) = legend_place(&drawn([700, 900]));
    assert!(!is_beside, "a high picture has more room below");
    let (is_beside, width_px) = legend_place(&drawn([1600, 700]));
    assert!(is_beside && width_px > 500.0, "{width_px}");
}
