//! Draws one picture of each kind, as SVG and PNG: `gallery OUTDIR`.
//!
//! The numbers are made up; they have the shape of what a study of a robot team measures.

use std::path::{Path, PathBuf};
use std::{env, error::Error, fs};

use sidestep_draw::{
    Axis, Bar, BarChart, BarSeries, BodyRect, BodyScene, BodyShade, CellShade, DoorRect, GridScene,
    Histogram, Matrix, Obstacle, Plot, Point, Series, Shape, Strand, Style, Track, Trail, to_png,
    to_svg,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or("usage: gallery OUTDIR")?);
    fs::create_dir_all(&folder)?;
    let (chart, map) = (Style::CHART, Style::MAP);
    save(&folder, "tracks", &to_svg(&corridor(), &map)?)?;
    save(&folder, "city", &to_svg(&city(), &map)?)?;
    save(&folder, "convoy", &convoy().to_svg(&map)?)?;
    save(&folder, "snake", &snake().to_svg(&map)?)?;
    save(&folder, "speed-up", &speed_up().to_svg(&chart)?)?;
    save(&folder, "density", &density().to_svg(&chart)?)?;
    save(&folder, "contacts", &contacts().to_svg(&chart)?)?;
    save(&folder, "groups", &group_sizes()?.to_svg(&chart)?)?;
    save(&folder, "confusion", &confusion()?.to_svg(&chart)?)
}

fn save(folder: &Path, name: &str, svg: &str) -> Result<(), Box<dyn Error>> {
    let path = folder.join(name);
    fs::write(path.with_extension("svg"), svg)?;
    fs::write(path.with_extension("png"), to_png(svg, 1280)?)?;
    println!("{}", path.with_extension("{svg,png}").display());
    Ok(())
}

/// A corridor with rooms on both sides, three robots and two people.
fn corridor() -> GridScene {
    const PLAN: [&str; 14] = [
        "##################################",
        "#          #          #          #",
        "#          #          #          #",
        "#          #          #          #",
        "#          #          #          #",
        "####  ##########  ########  ######",
        "#                                #",
        "#                                #",
        "#                                #",
        "######  #######   ######  ########",
        "#          #          #     #????#",
        "#          #          #     #????#",
        "#          #          #     #????#",
        "##################################",
    ];
    let shade = |c| match c {
        '#' => CellShade::Wall,
        '?' => CellShade::Unknown,
        _ => CellShade::Free,
    };
    let door = |col, row, width, open| DoorRect { col, row, width, height: 1, open };
    let person = |col, row| BodyRect {
        col,
        row,
        width: 1,
        height: 1,
        heading: None,
        shade: BodyShade::Active,
    };
    let robot = |col, row, quarters, index| BodyRect {
        col,
        row,
        width: 2,
        height: 2,
        heading: Some(quarters),
        shade: BodyShade::Robot(index),
    };
    GridScene {
        width: 34,
        height: 14,
        box_size_m: 0.25,
        origin_m: [-2.0, 1.5],
        cells: PLAN.iter().rev().flat_map(|line| line.chars().map(shade)).collect(),
        doors: vec![
            door(4, 8, 2, true),
            door(16, 8, 2, false),
            door(26, 8, 2, true),
            door(6, 4, 2, true),
            door(15, 4, 3, false),
            door(24, 4, 2, true),
        ],
        tracks: vec![
            track(
                "robot 1",
                true,
                &[
                    (2., 11.),
                    (2., 10.),
                    (5., 10.),
                    (5., 6.),
                    (20., 6.),
                    (20., 7.),
                    (25., 7.),
                    (25., 3.),
                    (26., 3.),
                ],
            ),
            track(
                "robot 2",
                false,
                &[
                    (31., 6.),
                    (22., 6.),
                    (22., 7.),
                    (14., 7.),
                    (14., 6.),
                    (7., 6.),
                    (7., 2.),
                    (3., 2.),
                ],
            ),
            track("robot 3", false, &[(13., 11.), (20., 11.), (20., 10.), (14., 10.)]),
        ],
        bodies: vec![person(9, 2), person(29, 10), robot(25, 2, 3, 0), robot(13, 9, 2, 2)],
        title: "To and fro on the corridor, one run of 2000 cycles".into(),
        caption: "Robots are 0.5 m wide; ribbons are as wide as the robot. Robot 1 waited at the \
                  closed door for 40 cycles."
            .into(),
    }
}

/// A track of a body two boxes wide through these corners, box by box.
fn track(label: &str, highlighted: bool, corners: &[(f64, f64)]) -> Track {
    let mut points = vec![corners[0]];
    for pair in corners.windows(2) {
        let steps = (pair[1].0 - pair[0].0).abs().max((pair[1].1 - pair[0].1).abs()) as u32;
        let part = |step| f64::from(step) / f64::from(steps);
        let on_the_way = |from: f64, to: f64, step| from + (to - from) * part(step);
        points.extend((1..=steps).map(|step| {
            (on_the_way(pair[0].0, pair[1].0, step), on_the_way(pair[0].1, pair[1].1, step))
        }));
    }
    Track { width_boxes: 2.0, points, label: label.into(), highlighted }
}

/// Blocks of houses on 2000 x 2000 boxes, with wanderers of 100 000 steps.
fn city() -> GridScene {
    const SIDE: u32 = 2000;
    let house = |col: u32, row: u32| {
        let (x, y) = (col % 160, row % 125);
        let wall = |v: u32, side: u32| v == 20 || v == side - 20;
        let inside = (20..=140).contains(&x) && (20..=105).contains(&y);
        inside && (wall(x, 160) || wall(y, 125) || (x == 80 && y > 40)) && !(70..78).contains(&x)
    };
    let shade = |at: u32| match house(at % SIDE, at / SIDE) {
        true => CellShade::Wall,
        false => CellShade::Free,
    };
    GridScene {
        width: SIDE,
        height: SIDE,
        box_size_m: 0.1,
        cells: (0..SIDE * SIDE).map(shade).collect(),
        tracks: (0..14).map(wanderer).collect(),
        title: "Fourteen wanderers in a city block".into(),
        ..GridScene::default()
    }
}

/// A walk along the streets of the city, turning by a small fixed rule.
fn wanderer(number: u32) -> Track {
    let (mut x, mut y) =
        (f64::from(160 * (number % 12)) + 3.5, f64::from(125 * (number % 15)) + 3.5);
    let mut state = number * 7919 + 1;
    let mut points = vec![(x, y)];
    while points.len() < 100_000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let (dx, dy, steps) = match state >> 30 {
            0 => (1.0, 0.0, 160),
            1 => (0.0, 1.0, 125),
            2 => (-1.0, 0.0, 160),
            _ => (0.0, -1.0, 125),
        };
        let (end_x, end_y) = (x + dx * f64::from(steps), y + dy * f64::from(steps));
        if !(0.0..2000.0).contains(&end_x) || !(0.0..2000.0).contains(&end_y) {
            continue;
        }
        points.extend((1..=steps).map(|k| (x + dx * f64::from(k), y + dy * f64::from(k))));
        (x, y) = (end_x, end_y);
    }
    Track { width_boxes: 7.0, points, label: format!("w{number}"), highlighted: number == 0 }
}

const WORKERS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

fn speed_up() -> Plot {
    let measured = |overhead: f64| {
        let at = |workers: f64| {
            let value = workers / (1.0 + overhead * (workers - 1.0));
            Point::new(workers, value).with_interval(value * 0.95, value * 1.05)
        };
        WORKERS.map(at).to_vec()
    };
    Plot::new("Speed-up by number of workers")
        .x_axis(Axis::log("workers").ticks(WORKERS))
        .y_axis(Axis::log("speed-up").ticks(WORKERS))
        .series(Series::line("100 robots", measured(0.11)))
        .series(Series::line("1000 robots", measured(0.04)))
        .series(Series::line("10 000 robots", measured(0.01)))
        .ideal_line("ideal", 0.0, 1.0)
        .note("Error bars: 95 % confidence intervals of the mean over 20 runs.")
}

fn density() -> Plot {
    let measured = |base: f64, growth: f64| {
        let at = |k: u32| {
            let density = 0.01 * f64::from(k);
            let time = base * (growth * density).exp();
            Point::new(density, time).with_interval(time * 0.9, time * 1.12)
        };
        (0..=10).map(at).collect()
    };
    Plot::new("Time of a trip by density")
        .x_axis(Axis::linear("density (robots per m²)"))
        .y_axis(Axis::log("to-and-fro time (s)"))
        .series(Series::line("reliable", measured(30.0, 12.0)))
        .series(Series::line("unreliable effectors", measured(38.0, 16.0)))
        .series(Series::line("unreliable sensors", measured(45.0, 22.0)))
        .series(Series::points("both", measured(60.0, 30.0)))
        .note("Error bars: 95 % confidence intervals of the mean over 20 runs.")
}

fn contacts() -> BarChart {
    let bars = |values: [f64; 4]| {
        values.map(|v| Bar::new(v).with_interval(v - 0.4 - 0.08 * v, v + 0.4 + 0.08 * v)).to_vec()
    };
    let regimes = ["reliable", "unreliable effectors", "unreliable sensors", "both unreliable"];
    BarChart::new("Contacts by regime and by what was hit", regimes)
        .x_label("regime")
        .y_axis(Axis::linear("contacts per robot and 1000 cycles"))
        .series(BarSeries::new("wall", bars([0.6, 9.1, 14.2, 21.0])))
        .series(BarSeries::new("robot", bars([1.1, 4.2, 8.8, 12.4])))
        .series(BarSeries::new("person", bars([2.0, 2.9, 6.1, 7.7])))
        .series(BarSeries::new("door", bars([0.5, 1.5, 2.4, 4.4])))
        .note("Means over 20 seeds with 95 % confidence intervals.")
}

fn group_sizes() -> Result<Histogram, Box<dyn Error>> {
    let edges = (0..=20).map(|k| f64::from(k) + 0.5).collect();
    let counts = (0..20).map(|k| 400_000_u64 >> (k * 9 / 10)).collect();
    let title = "Bodies in conflict: sizes of groups";
    Ok(Histogram::from_counts(title, edges, counts)?
        .x_axis(Axis::linear("bodies in the group"))
        .y_axis(Axis::log("groups")))
}

fn confusion() -> Result<Matrix, Box<dyn Error>> {
    let names = || ["nothing", "wall", "door", "person", "robot"].map(String::from).to_vec();
    #[rustfmt::skip]
    let values = vec![
        0.91, 0.04, 0.02, 0.02, 0.01,
        0.05, 0.88, 0.05, 0.01, 0.01,
        0.06, 0.21, 0.70, 0.02, 0.01,
        0.09, 0.03, 0.02, 0.74, 0.12,
        f64::NAN, f64::NAN, f64::NAN, f64::NAN, f64::NAN,
    ];
    let counts = [[8214; 5], [5120; 5], [611; 5], [287; 5], [0; 5]];
    let counts = counts.iter().flatten().zip(&values);
    let counts = counts.map(|(&n, p)| format!("{:.0}", f64::from(n) * p.max(0.0))).collect();
    Ok(Matrix::new("Sonar: what is reported for what is there", names(), names(), values)?
        .titles("true", "reported")
        .subscripts(counts)?
        .note("Small: counts. No robot was seen in the log."))
}

/// Numbers from 0 to 1 that look random (the mixing step of splitmix64).
fn scatter(k: u32, stream: u32) -> f64 {
    let mut z = (u64::from(k) << 8 | u64::from(stream)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z >> 40) as f64 / f64::from(1 << 24)
}

/// Sixteen robots in a bent corridor, and two discs that cross their way.
fn convoy() -> BodyScene<2> {
    // A quarter of a circle of 4 m around the origin, then straight on.
    let line = |s_m: f64, aside_m: f64| {
        let angle = s_m / 4.0 - std::f64::consts::FRAC_PI_2;
        let (r, turned) = (4.0 - aside_m, angle.min(0.0));
        let on = 4.0 * angle.max(0.0);
        [r * turned.cos(), r * turned.sin() + on]
    };
    let wall = |aside_m: f64| {
        let piece = move |k: u32| {
            let ends = [k, k + 1].map(|k| line(0.2 * f64::from(k), aside_m));
            Obstacle { shape: Shape::Capsule { ends, radius_m: 0.0 }, velocity_m_s: [0.0; 2] }
        };
        (0..70).map(piece)
    };
    let disc = |center, velocity_m_s| Obstacle {
        shape: Shape::Ball { center, radius_m: 0.3 },
        velocity_m_s,
    };
    let box_ =
        Shape::Cuboid { center: [1.0, 2.5], axes: [[0.8, 0.6], [-0.6, 0.8]], half_m: [0.8, 0.4] };
    let column = Shape::Capsule { ends: [[0.0, 6.0], [1.5, 6.5]], radius_m: 0.2 };
    let still = [box_, column].map(|shape| Obstacle { shape, velocity_m_s: [0.0; 2] });
    let moving = [disc([1.2, 0.4], [0.5, 0.4]), disc([4.4, 6.6], [-0.3, -0.9])];
    BodyScene {
        obstacles: wall(-1.0).chain(wall(1.0)).chain(still).chain(moving).collect(),
        strands: vec![Strand {
            points: (0..16).map(|k| line(12.0 - 0.7 * f64::from(k), 0.0)).collect(),
            connector_radius_m: 0.25,
            rod_radius_m: 0.05,
            label: "leader and 15 followers".into(),
        }],
        trails: vec![Trail {
            points: (0..120)
                .map(|k| line(0.1 * f64::from(k), 0.2 * (0.4 * f64::from(k)).sin()))
                .collect(),
            color: 1,
            label: "way of the leader".into(),
        }],
        title: "A convoy in a bent corridor".into(),
        caption: "Made-up places. Seed 1.".into(),
        ..BodyScene::default()
    }
}

/// 450 connectors among 1000 spheres.
fn snake() -> BodyScene<3> {
    let at = |k: u32| {
        let t = f64::from(k) * 0.03;
        [5.5 * (0.5 * t).cos(), 5.0 * (0.37 * t).sin(), 4.5 * (0.23 * t).sin()]
    };
    let sphere = |k: u32| Obstacle {
        shape: Shape::Ball {
            center: [0, 1, 2].map(|axis| 12.0 * scatter(k, axis) - 6.0),
            radius_m: 0.35,
        },
        velocity_m_s: if k.is_multiple_of(100) { [0.8, 0.5, 0.6] } else { [0.0; 3] },
    };
    let boxes = [[-5.0, 5.0, 5.5], [5.0, -5.0, -3.0]].map(|center| Obstacle {
        shape: Shape::Cuboid {
            center,
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            half_m: [0.8, 0.6, 1.0],
        },
        velocity_m_s: [0.0; 3],
    });
    BodyScene {
        obstacles: (0..1000).map(sphere).chain(boxes).collect(),
        strands: vec![Strand {
            points: (0..450).map(at).collect(),
            connector_radius_m: 0.06,
            rod_radius_m: 0.04,
            label: "450 connectors".into(),
        }],
        title: "A snake in space".into(),
        caption: "Made-up places.".into(),
        ..BodyScene::default()
    }
}
