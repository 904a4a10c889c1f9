//! Promises that hold for every kind of picture: well-formed, nothing clipped, no overlapping text,
//! equal bytes for equal input, no panic for any numbers.

use proptest::prelude::*;
use resvg::usvg::{Group, Node, Rect};
use sidestep_airspace::kinds::{AIRPLANE, ZONE};
use sidestep_chain::kinds::{CONNECTOR, RODS};
use sidestep_robots::kinds::ROBOT;

use sidestep_kernel::view::{
    Body, BodyId, BodyKind, Frame, Isometry2, OccupancyGrid, Pose, Scenery, Shape, Trail,
};

use crate::raster::parse;
use crate::testing::{ball, moment, open, plane};
use crate::*;

/// Returns the boxes of all texts in the picture, and the picture's size.
fn texts(svg: &str) -> (Vec<(String, Rect)>, f32, f32) {
    fn walk(group: &Group, found: &mut Vec<(String, Rect)>) {
        for node in group.children() {
            match node {
                Node::Group(group) => walk(group, found),
                Node::Text(text) => {
                    let words = text.chunks().iter().map(|chunk| chunk.text()).collect();
                    found.push((words, text.abs_bounding_box()));
                }
                _ => {}
            }
        }
    }
    let tree = parse(svg, &Fonts::default()).unwrap();
    let mut found = vec![];
    walk(tree.root(), &mut found);
    (found, tree.size().width(), tree.size().height())
}

/// Checks that nothing sticks out of the picture and no two texts overlap.
fn assert_readable(name: &str, svg: &str) {
    let (found, width, height) = texts(svg);
    assert!(!found.is_empty(), "{name} has no text");
    for (index, (words, at)) in found.iter().enumerate() {
        let inside =
            at.left() >= 0.0 && at.top() >= 0.0 && at.right() <= width && at.bottom() <= height;
        assert!(inside, "{name}: {words:?} at {at:?} is clipped by {width} x {height}");
        for (other, place) in &found[index + 1..] {
            let apart = at.right() <= place.left()
                || place.right() <= at.left()
                || at.bottom() <= place.top()
                || place.bottom() <= at.top();
            assert!(apart, "{name}: {words:?} at {at:?} covers {other:?} at {place:?}");
        }
    }
}

fn long_plot() -> Plot {
    let wave = |k: u32| {
        let at = |i: u32| Point::new(f64::from(i), f64::from(i % 60) * 1e3 - 2e4 * f64::from(k));
        Series::line(format!("a series with a long name {k}"), (0..500).map(at).collect())
    };
    let plot = Plot::new("A title that says everything about the experiment and ".repeat(3))
        .x_axis(Axis::linear("time since the beginning of the experiment (s)"))
        .y_axis(Axis::linear("a vertical label longer than the picture is high ".repeat(2)))
        .ideal_line("ideal", 0.0, 1.0)
        .note("a note ".repeat(50));
    (0..9).fold(plot, |plot, k| plot.series(wave(k)))
}

fn crowded_bars() -> BarChart {
    let bar = |i: u32| {
        let value = f64::from(i) * 3.0 - 20.0;
        Bar::new(value).with_interval(value - 4.0, value + 5.0)
    };
    BarChart::new("Gain", (0..14).map(|i| format!("category number {i}")))
        .x_label("category")
        .y_axis(Axis::linear("gain (%)"))
        .series(BarSeries::new("only", (0..14).map(bar).collect()))
}

fn options(style: Style, scenery: &Scenery) -> PictureOptions {
    PictureOptions { style, ..PictureOptions::page(scenery, "Small print.") }
}

fn map(width: u32, height: u32) -> String {
    let scenery = plane(width, height);
    draw(&scenery, &Frame::default(), &[], &options(Style::MAP, &scenery)).unwrap()
}

/// Draws chains, and robots that have met in one corner.
fn bodies(dimensions: u8, n: u32, style: Style) -> String {
    let at = |k: u32| [0, 1, 2].map(|i| f64::from(k) * (1.0 - 0.3 * f64::from(i)));
    let still = |k| ball(BodyKind::OBSTACLE, k, at(k), 0.3).with_velocity([f64::from(k % 2); 3]);
    let name = |k| (CONNECTOR, k, format!("a chain with a long name {k}"));
    let scenery = Scenery {
        bodies: (0..n).map(still).collect(),
        names: (0..n).map(name).collect(),
        earth: Default::default(),
        traffic: None,
        ..open(dimensions)
    };
    let chain = |k: u32| (0..=k).map(move |part| ball(CONNECTOR, k, at(part), 0.2).with_part(part));
    let frame = moment((0..n).flat_map(chain).collect());
    let trail = |k: u32| Trail {
        of: BodyId::new(CONNECTOR, k, Some(0)),
        points: (0..20).map(|cycle| (cycle, at(k + cycle as u32))).collect(),
    };
    let trails: Vec<Trail> = (0..n).map(trail).collect();
    draw(&scenery, &frame, &trails, &options(style, &scenery)).unwrap()
}

/// Draws airplanes that have met in one place, each with its name.
fn meeting(dimensions: u8, n: u32, apart_m: f64) -> String {
    let dart = Shape::Dart { length_m: 500.0, width_m: 300.0 };
    let at = |k: u32| [apart_m * f64::from(k % 4), apart_m * f64::from(k / 4), 3000.0];
    let airplane = |k| Body::new(AIRPLANE, k, Pose::from_position(at(k)), dart.clone());
    let zone = |k| ball(ZONE, k, at(k), 2000.0);
    let frame = moment((0..n).flat_map(|k| [airplane(k), zone(k)]).collect());
    let from = |k: u32| [30_000.0 - 900.0 * f64::from(k), 20_000.0 * f64::from(k % 2), 3000.0];
    let trail =
        |k| Trail { of: BodyId::new(AIRPLANE, k, None), points: vec![(0, from(k)), (90, at(k))] };
    let trails: Vec<Trail> = (0..n).map(trail).collect();
    let scenery = open(dimensions);
    draw(&scenery, &frame, &trails, &options(Style::MAP, &scenery)).unwrap()
}

fn gallery() -> Vec<(&'static str, String)> {
    let chart = Style::CHART;
    let small = Style { width_px: 240.0, height_px: 180.0, font_px: 9.0 };
    let tight_ticks = Axis::linear("x").ticks([1.0, 1.01, 1.02, 50.0]);
    vec![
        ("empty plot", Plot::new("").to_svg(&chart).unwrap()),
        ("long plot", long_plot().to_svg(&chart).unwrap()),
        ("small plot", long_plot().to_svg(&small).unwrap()),
        (
            "close ticks",
            Plot::new("t").x_axis(tight_ticks.clone()).y_axis(tight_ticks).to_svg(&chart).unwrap(),
        ),
        ("crowded bars", crowded_bars().to_svg(&chart).unwrap()),
        ("small bars", crowded_bars().to_svg(&small).unwrap()),
        ("small map", map(5, 4)),
        ("low map", map(300, 1)),
        ("narrow map", map(1, 400)),
        ("large map", map(1500, 900)),
        ("bodies", bodies(2, 7, Style::MAP)),
        ("small bodies", bodies(2, 7, small)),
        ("no bodies", bodies(2, 0, Style::MAP)),
        ("bodies in space", bodies(3, 7, Style::MAP)),
        ("small bodies in space", bodies(3, 7, small)),
        ("no bodies in space", bodies(3, 0, Style::MAP)),
        ("airplanes", meeting(2, 12, 9000.0)),
        ("airplanes on one spot", meeting(2, 12, 10.0)),
        ("airplanes in space", meeting(3, 12, 100.0)),
        ("many airplanes", meeting(2, 70, 1000.0)),
    ]
}

#[test]
fn no_text_is_clipped_or_covered() {
    for (name, svg) in gallery() {
        assert_readable(name, &svg);
    }
}

#[test]
fn equal_input_gives_equal_bytes() {
    for ((_, first), (_, second)) in gallery().into_iter().zip(gallery()) {
        assert_eq!(first, second);
    }
    let svg = long_plot().to_svg(&Style::CHART).unwrap();
    assert_eq!(to_png(&svg, 300).unwrap(), to_png(&svg, 300).unwrap());
}

#[test]
fn impossible_styles_are_refused() {
    for (width_px, height_px, font_px) in
        [(f64::NAN, 400.0, 12.0), (400.0, -1.0, 12.0), (400.0, 1e9, 12.0), (400.0, 400.0, 0.0)]
    {
        let style = Style { width_px, height_px, font_px };
        assert!(Plot::new("").to_svg(&style).is_err());
        let scenery = plane(3, 3);
        let options = options(style, &scenery);
        assert!(draw(&scenery, &Frame::default(), &[], &options).is_err());
    }
}

#[test]
fn lists_that_do_not_match_are_refused() {
    let length =
        |result: Result<String, DrawError>| matches!(result, Err(DrawError::Length { .. }));
    let bars = BarChart::new("", ["a", "b"]).series(BarSeries::new("", vec![Bar::new(1.0)]));
    assert!(length(bars.to_svg(&Style::CHART)));
    let picture = |floor: OccupancyGrid| {
        let scenery = Scenery { floor: Some(floor), ..open(2) };
        draw(&scenery, &Frame::default(), &[], &options(Style::MAP, &scenery))
    };
    let floor = |width, height| OccupancyGrid { width, height, ..plane(2, 2).floor.unwrap() };
    assert!(picture(floor(2, 2)).is_ok());
    assert!(length(picture(floor(2, 3))));
    assert!(picture(OccupancyGrid { boxes: vec![], ..floor(0, 0) }).is_err());
    assert!(matches!(picture(floor(u32::MAX, u32::MAX)), Err(DrawError::TooLarge { .. })));
}

/// Any double, including NaN, infinities, subnormals and very large ones.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), -10.0..10.0, Just(0.0), Just(f64::NAN), Just(f64::INFINITY)]
}

fn axis() -> impl Strategy<Value = Axis> {
    let ticks = prop::option::of(prop::collection::vec(number(), 0..4));
    (any::<bool>(), ticks).prop_map(|(log, ticks)| {
        let axis = if log { Axis::log("a <&> b") } else { Axis::linear("") };
        match ticks {
            Some(ticks) => axis.ticks(ticks),
            None => axis,
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn a_plot_of_any_numbers_is_a_picture(
        x in axis(),
        y in axis(),
        points in prop::collection::vec((number(), number(), number(), number()), 0..20),
        ideal in (number(), number()),
    ) {
        let point = |&(x, y, low, high): &_| Point::new(x, y).with_interval(low, high);
        let points: Vec<Point> = points.iter().map(point).collect();
        let plot = Plot::new("\u{0}<b>")
            .x_axis(x)
            .y_axis(y)
            .ideal_line("i", ideal.0, ideal.1)
            .series(Series::line("l", points.clone()))
            .series(Series::points("p", points));
        prop_assert!(parse(&plot.to_svg(&Style::CHART).unwrap(), &Fonts::default()).is_ok());
    }

    #[test]
    fn bars_of_any_numbers_are_a_picture(
        y in axis(),
        values in prop::collection::vec((number(), number(), number()), 0..9),
    ) {
        let bar = |&(value, low, high): &_| Bar::new(value).with_interval(low, high);
        let chart = BarChart::new("", values.iter().map(|_| "name"))
            .y_axis(y)
            .series(BarSeries::new("s", values.iter().map(bar).collect()));
        prop_assert!(parse(&chart.to_svg(&Style::CHART).unwrap(), &Fonts::default()).is_ok());
    }

    #[test]
    fn what_is_seen_of_any_numbers_is_a_picture_or_an_error(
        points in prop::collection::vec(prop::array::uniform3(number()), 3..12),
        (radius_m, side_m, speed) in (number(), number(), number()),
        turn in prop::array::uniform4(number()),
        (dimensions, has_floor) in (2u8..4, any::<bool>()),
        (box_m, width) in (number(), 1u32..20),
    ) {
        let kinds = [
            (ROBOT, Shape::Cuboid { size_m: [side_m, radius_m, 1.0] }),
            (ZONE, Shape::Cylinder { radius_m, height_m: side_m }),
            (CONNECTOR, Shape::Sphere { radius_m }),
            (RODS, Shape::Line { points_m: points.clone(), thickness_m: side_m }),
            (AIRPLANE, Shape::Dart { length_m: radius_m, width_m: side_m }),
            (BodyKind::OBSTACLE, Shape::Cuboid { size_m: [side_m; 3] }),
        ];
        let body = |(k, (kind, shape)): (usize, (BodyKind, Shape))| {
            let pose = Pose { at_m: points[k % 3], turn };
            Body::new(kind, k as u32, pose, shape).with_velocity([speed; 3])
        };
        let bodies: Vec<Body> = kinds.into_iter().enumerate().map(body).collect();
        let floor = OccupancyGrid { box_m, plane: Isometry2 { origin_m: [speed, 0.0], yaw_rad: 0.0 }, ..plane(width, 3).floor.unwrap() };
        let scenery = Scenery {
            floor: has_floor.then_some(floor),
            bodies: bodies.clone(),
            ..open(dimensions)
        };
        let way = |k: usize| (0..).zip(points.iter().skip(k).copied()).collect();
        let trails = [
            Trail { of: BodyId::new(ROBOT, 0, None), points: way(0) },
            Trail { of: BodyId::new(CONNECTOR, 2, None), points: way(1) },
        ];
        let drawn = draw(&scenery, &moment(bodies), &trails, &options(Style::MAP, &scenery));
        if let Ok(svg) = drawn {
            prop_assert!(parse(&svg, &Fonts::default()).is_ok());
        }
    }
}
