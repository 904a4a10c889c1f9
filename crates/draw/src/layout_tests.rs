//! Promises that hold for every kind of picture: well-formed, nothing clipped, no text on text,
//! equal bytes for equal input, no panic whatever the numbers are.

use proptest::prelude::*;
use resvg::usvg::{Group, Node, Rect};

use crate::raster::parse;
use crate::*;

/// The boxes of all texts in the picture, and the picture's size.
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
    let tree = parse(svg).unwrap();
    let mut found = vec![];
    walk(tree.root(), &mut found);
    (found, tree.size().width(), tree.size().height())
}

/// Nothing sticks out of the picture and no two texts overlap.
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

fn matrix(side: usize) -> Matrix {
    let names = || (0..side).map(|i| format!("observation {i}")).collect();
    let values = (0..side * side).map(|i| (i * 7919 % 1000) as f64 / 1000.0).collect();
    Matrix::new("Confusion", names(), names(), values).unwrap().titles("true", "reported")
}

fn scene(width: u32, height: u32) -> GridScene {
    let cells = vec![CellShade::Free; (width * height) as usize];
    let title = "A title that wraps where the map is small, as it is here".into();
    GridScene { width, height, box_size_m: 0.1, cells, title, ..GridScene::default() }
}

fn bodies<const D: usize>(n: u32) -> BodyScene<D> {
    let at = |k: u32| std::array::from_fn(|i| f64::from(k) * (1.0 - 0.3 * i as f64));
    let ball = |k| Obstacle {
        shape: Shape::Ball { center: at(k), radius_m: 0.3 },
        velocity_m_s: [f64::from(k % 2); D],
    };
    let strand = |k: u32| Strand {
        points: (0..k + 1).map(at).collect(),
        connector_radius_m: 0.2,
        rod_radius_m: 0.1,
        label: format!("a chain with a long name {k}"),
    };
    BodyScene {
        obstacles: (0..n).map(ball).collect(),
        strands: (0..n).map(strand).collect(),
        trails: vec![],
        view_m: None,
        title: "A title that wraps where the picture is small, as it is here".into(),
        caption: "Small print.".into(),
    }
}

fn gallery() -> Vec<(&'static str, String)> {
    let (chart, map) = (Style::CHART, Style::MAP);
    let small = Style { width_px: 240.0, height_px: 180.0, font_px: 9.0 };
    let tight_ticks = Axis::linear("x").ticks([1.0, 1.01, 1.02, 50.0]);
    let histogram = |y| {
        let histogram = Histogram::from_values("Times", &[1.0, 2.0, 2.1, 9.0], 12).unwrap();
        histogram.y_axis(y).to_svg(&chart).unwrap()
    };
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
        ("histogram", histogram(Axis::linear("count"))),
        ("log histogram", histogram(Axis::log("count"))),
        ("one cell", matrix(1).to_svg(&chart).unwrap()),
        ("matrix", matrix(5).to_svg(&chart).unwrap()),
        ("large matrix", matrix(24).to_svg(&chart).unwrap()),
        ("small map", to_svg(&scene(5, 4), &map).unwrap()),
        ("low map", to_svg(&scene(300, 1), &map).unwrap()),
        ("narrow map", to_svg(&scene(1, 400), &map).unwrap()),
        ("large map", to_svg(&scene(1500, 900), &map).unwrap()),
        ("bodies", bodies::<2>(7).to_svg(&map).unwrap()),
        ("small bodies", bodies::<2>(7).to_svg(&small).unwrap()),
        ("no bodies", bodies::<2>(0).to_svg(&map).unwrap()),
        ("bodies in space", bodies::<3>(7).to_svg(&map).unwrap()),
        ("small bodies in space", bodies::<3>(7).to_svg(&small).unwrap()),
        ("no bodies in space", bodies::<3>(0).to_svg(&map).unwrap()),
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
        assert!(to_svg(&scene(3, 3), &style).is_err());
    }
}

#[test]
fn lists_that_do_not_match_are_refused() {
    let length =
        |result: Result<String, DrawError>| matches!(result, Err(DrawError::Length { .. }));
    let bars = BarChart::new("", ["a", "b"]).series(BarSeries::new("", vec![Bar::new(1.0)]));
    assert!(length(bars.to_svg(&Style::CHART)));
    assert!(Histogram::from_counts("", vec![0.0, 1.0], vec![1, 2]).is_err());
    assert!(Histogram::from_counts("", vec![0.0, f64::NAN], vec![1]).is_err());
    assert!(Histogram::from_values("", &[1.0], 0).is_err());
    assert!(Histogram::from_values("", &[1.0], usize::MAX).is_err());
    assert!(Matrix::new("", vec!["a".into()], vec!["b".into()], vec![]).is_err());
    assert!(Matrix::new("", vec![], vec![], vec![]).is_err());
    let torn = GridScene { cells: vec![], ..scene(2, 2) };
    assert!(length(to_svg(&torn, &Style::MAP)));
    let empty = GridScene { box_size_m: 1.0, ..GridScene::default() };
    assert!(to_svg(&empty, &Style::MAP).is_err());
    let huge = GridScene { width: u32::MAX, height: u32::MAX, ..scene(1, 1) };
    assert!(matches!(to_svg(&huge, &Style::MAP), Err(DrawError::TooLarge { .. })));
}

/// Any double: also NaN, infinities, subnormals and the very large.
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
        prop_assert!(parse(&plot.to_svg(&Style::CHART).unwrap()).is_ok());
    }

    #[test]
    fn bars_and_bins_of_any_numbers_are_a_picture(
        y in axis(),
        values in prop::collection::vec((number(), number(), number()), 0..9),
        bins in 1usize..40,
    ) {
        let bar = |&(value, low, high): &_| Bar::new(value).with_interval(low, high);
        let chart = BarChart::new("", values.iter().map(|_| "name"))
            .y_axis(y.clone())
            .series(BarSeries::new("s", values.iter().map(bar).collect()));
        prop_assert!(parse(&chart.to_svg(&Style::CHART).unwrap()).is_ok());
        let values: Vec<f64> = values.iter().map(|v| v.0).collect();
        let histogram = Histogram::from_values("", &values, bins).unwrap().y_axis(y);
        prop_assert!(parse(&histogram.to_svg(&Style::CHART).unwrap()).is_ok());
    }

    #[test]
    fn a_matrix_of_any_numbers_is_a_picture(
        values in prop::collection::vec(number(), 1..30),
        digits in any::<usize>(),
    ) {
        let names = (0..values.len()).map(|i| i.to_string()).collect();
        let matrix = Matrix::new("m", vec!["row".into()], names, values).unwrap().digits(digits);
        prop_assert!(parse(&matrix.to_svg(&Style::CHART).unwrap()).is_ok());
    }

    #[test]
    fn a_scene_of_any_numbers_is_a_picture_or_an_error(
        width in 1u32..20,
        height in 1u32..20,
        (box_size_m, x, y, width_boxes) in (number(), number(), number(), number()),
        points in prop::collection::vec((number(), number()), 0..30),
        place in (any::<u32>(), any::<u32>(), any::<u32>(), any::<u32>(), any::<u8>()),
    ) {
        let (col, row, wide, high, quarters) = place;
        let heading = Some(quarters);
        let shade = BodyShade::Robot(usize::from(quarters));
        let scene = GridScene {
            box_size_m,
            origin_m: [x, y],
            doors: vec![DoorRect { col, row, width: wide, height: high, open: wide > high }],
            bodies: vec![BodyRect { col, row, width: wide, height: high, heading, shade }],
            tracks: vec![Track { width_boxes, points, label: "t".into(), highlighted: false }],
            ..scene(width, height)
        };
        if let Ok(svg) = to_svg(&scene, &Style::MAP) {
            prop_assert!(parse(&svg).is_ok());
        }
    }

    #[test]
    fn bodies_of_any_numbers_are_a_picture_or_an_error(
        points in prop::collection::vec(prop::array::uniform3(number()), 3..12),
        (radius_m, half_m, speed) in (number(), number(), number()),
        has_view in any::<bool>(),
    ) {
        let [a, b, c] = [points[0], points[1], points[2]];
        let plane = |p: [f64; 3]| [p[0], p[1]];
        let shapes_2 = [
            Shape::Ball { center: plane(a), radius_m },
            Shape::Capsule { ends: [plane(a), plane(b)], radius_m },
            Shape::Cuboid { center: plane(a), axes: [plane(b), plane(c)], half_m: [half_m; 2] },
        ];
        let shapes_3 = [
            Shape::Ball { center: a, radius_m },
            Shape::Capsule { ends: [a, b], radius_m },
            Shape::Cuboid { center: a, axes: [a, b, c], half_m: [half_m; 3] },
        ];
        let view_2 = has_view.then_some([plane(b), plane(c)]);
        let view_3 = has_view.then_some([b, c]);
        let in_plane = any_bodies(&shapes_2, speed, points.iter().map(|p| plane(*p)), view_2);
        let in_space = any_bodies(&shapes_3, speed, points.iter().copied(), view_3);
        for svg in [in_plane.to_svg(&Style::MAP), in_space.to_svg(&Style::MAP)].iter().flatten() {
            prop_assert!(parse(svg).is_ok());
        }
    }
}

fn any_bodies<const D: usize>(
    shapes: &[Shape<D>],
    speed: f64,
    points: impl Iterator<Item = [f64; D]> + Clone,
    view_m: Option<[[f64; D]; 2]>,
) -> BodyScene<D> {
    let obstacle = |&shape| Obstacle { shape, velocity_m_s: [speed; D] };
    BodyScene {
        obstacles: shapes.iter().map(obstacle).collect(),
        strands: vec![Strand {
            points: points.clone().collect(),
            connector_radius_m: 0.1,
            rod_radius_m: 0.0,
            label: "s".into(),
        }],
        trails: vec![Trail { points: points.collect(), color: 9, label: "t".into() }],
        view_m,
        ..BodyScene::default()
    }
}
