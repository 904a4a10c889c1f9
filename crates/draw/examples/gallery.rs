//! Draws one picture of each kind, as SVG and PNG: `gallery OUTDIR`.
//!
//! The numbers are made up; they have the shape of what a study of a robot team measures.

use std::path::{Path, PathBuf};
use std::{env, error::Error, fs};

use sidestep_draw::{
    Axis, Bar, BarChart, BarSeries, Histogram, Matrix, Options, Plot, Point, Series, Style, draw,
    to_png,
};
use sidestep_kernel::view::{
    Body, Condition, Floor, Frame, Kind, Occupancy, Place, Pose, Scenery, Shape, Trail,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or("usage: gallery OUTDIR")?);
    fs::create_dir_all(&folder)?;
    let chart = Style::CHART;
    save(&folder, "tracks", &picture(&corridor())?)?;
    save(&folder, "city", &picture(&city())?)?;
    save(&folder, "convoy", &picture(&convoy())?)?;
    save(&folder, "snake", &picture(&snake())?)?;
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

/// What a picture is made of.
type Scene = (Scenery, Frame, Vec<Trail>);

fn picture((scenery, frame, trails): &Scene) -> Result<String, Box<dyn Error>> {
    Ok(draw(scenery, frame, trails, &Options::page(scenery, "Made-up places."))?)
}

fn scenery(name: &str, dimensions: u8) -> Scenery {
    Scenery {
        name: name.into(),
        dimensions,
        cycle_s: 1.0,
        floor: None,
        bodies: Vec::new(),
        names: Vec::new(),
    }
}

fn moment(bodies: Vec<Body>) -> Frame {
    Frame { bodies, ..Frame::default() }
}

/// A corridor with rooms on both sides, three robots and two people.
fn corridor() -> Scene {
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
    let occupancy = |c| match c {
        '#' => Occupancy::Wall,
        '?' => Occupancy::Unknown,
        _ => Occupancy::Free,
    };
    let floor = Floor {
        width: 34,
        height: 14,
        box_m: 1.0,
        origin_m: [0.0; 2],
        boxes: PLAN.iter().rev().flat_map(|line| line.chars().map(occupancy)).collect(),
    };
    let body = |kind, number, (x, y): (f64, f64), (width, height): (f64, f64)| {
        let pose = Pose::at([x, y, 0.0]);
        Body::new(kind, number, pose, Shape::Cuboid { size_m: [width, height, 0.1] })
    };
    let door = |number, at: (f64, f64), width, open| {
        body(Kind::Door, number, at, (width, 1.0)).when(open, Condition::Open)
    };
    let ways = [
        &[(3.0, 12.0), (3.0, 11.0), (6.0, 7.0), (21.0, 7.0), (26.0, 8.0), (26.0, 3.0)][..],
        &[(32.0, 7.0), (23.0, 7.0), (15.0, 8.0), (8.0, 7.0), (8.0, 3.0), (4.0, 3.0)],
        &[(14.0, 12.0), (21.0, 12.0), (21.0, 11.0), (15.0, 11.0)],
    ];
    let way = |way: &[(f64, f64)]| (0..).zip(way.iter().map(|&(x, y)| [x, y, 0.0])).collect();
    let trail =
        |(k, places): (u32, &&[(f64, f64)])| Trail { of: (Kind::Robot, k, None), way: way(places) };
    let robot = |(k, places): (u32, &&[(f64, f64)])| {
        body(Kind::Robot, k, places[places.len() - 1], (2.0, 2.0))
    };
    let others = [
        door(3, (5.0, 8.5), 2.0, true),
        door(4, (17.0, 8.5), 2.0, false),
        door(5, (16.5, 4.5), 3.0, false),
        body(Kind::Person, 6, (9.5, 2.5), (1.0, 1.0)),
        body(Kind::Person, 7, (29.5, 10.5), (1.0, 1.0)),
    ];
    let bodies = (0..).zip(&ways).map(robot).chain(others).collect();
    let scenery = Scenery { floor: Some(floor), ..scenery("To and fro on the corridor", 2) };
    (scenery, moment(bodies), (0..).zip(&ways).map(trail).collect())
}

/// Blocks of houses on 2000 x 2000 boxes, with wanderers of 100 000 steps.
fn city() -> Scene {
    const SIDE: u32 = 2000;
    let house = |col: u32, row: u32| {
        let (x, y) = (col % 160, row % 125);
        let wall = |v: u32, side: u32| v == 20 || v == side - 20;
        let inside = (20..=140).contains(&x) && (20..=105).contains(&y);
        inside && (wall(x, 160) || wall(y, 125) || (x == 80 && y > 40)) && !(70..78).contains(&x)
    };
    let occupancy = |at: u32| match house(at % SIDE, at / SIDE) {
        true => Occupancy::Wall,
        false => Occupancy::Free,
    };
    let floor = Floor {
        width: SIDE,
        height: SIDE,
        box_m: 1.0,
        origin_m: [0.0; 2],
        boxes: (0..SIDE * SIDE).map(occupancy).collect(),
    };
    let trails: Vec<Trail> = (0..6).map(wanderer).collect();
    let size_m = [7.0, 7.0, 1.0];
    let robot = |trail: &Trail| {
        let (kind, number, _) = trail.of;
        let (_, at) = trail.way[trail.way.len() - 1];
        Body::new(kind, number, Pose::at(at), Shape::Cuboid { size_m })
    };
    let frame = moment(trails.iter().map(robot).collect());
    (Scenery { floor: Some(floor), ..scenery("Wanderers in a city block", 2) }, frame, trails)
}

/// A walk along the streets of the city, turning by a small fixed rule.
fn wanderer(number: u32) -> Trail {
    let (mut x, mut y) =
        (f64::from(160 * (number % 12)) + 3.5, f64::from(125 * (number % 15)) + 3.5);
    let mut state = number * 7919 + 1;
    let mut way = vec![(0, [x, y, 0.0])];
    while way.len() < 100_000 {
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
        for k in 1..=steps {
            way.push((way.len() as u64, [x + dx * f64::from(k), y + dy * f64::from(k), 0.0]));
        }
        (x, y) = (end_x, end_y);
    }
    Trail { of: (Kind::Robot, number, None), way }
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

/// Connectors and the rods between them.
fn chain(places: impl Iterator<Item = Place>, radius_m: f64, thickness_m: f64) -> Vec<Body> {
    let points_m: Vec<Place> = places.collect();
    let ball = |(part, at): (u32, &Place)| {
        Body::new(Kind::Connector, 0, Pose::at(*at), Shape::Sphere { radius_m }).part(part)
    };
    let connectors: Vec<Body> = (0..).zip(&points_m).map(ball).collect();
    let rods = Shape::Line { points_m, thickness_m };
    [Body::new(Kind::Rods, 0, Pose::at([0.0; 3]), rods)].into_iter().chain(connectors).collect()
}

fn obstacle(number: u32, at: Place, shape: Shape) -> Body {
    Body::new(Kind::Obstacle, number, Pose::at(at), shape)
}

/// A leader and its followers in a bent corridor.
fn convoy() -> Scene {
    // A place so far along the middle of the corridor and to its left: a quarter circle, then
    // straight on.
    let line = |s_m: f64, aside_m: f64| -> Place {
        let angle = s_m / 4.0 - std::f64::consts::FRAC_PI_2;
        let (r, turned) = (4.0 - aside_m, angle.min(0.0));
        [r * turned.cos(), r * turned.sin() + 4.0 * angle.max(0.0), 0.0]
    };
    let wall = |aside_m: f64| {
        let points_m = (0..=70).map(|k| line(0.2 * f64::from(k), aside_m)).collect();
        obstacle(0, [0.0; 3], Shape::Line { points_m, thickness_m: 0.0 })
    };
    let disc = |at, velocity| {
        obstacle(2, at, Shape::Cylinder { radius_m: 0.3, height_m: 0.1 }).moving(velocity)
    };
    let mut frame = moment(chain((0..16).map(|k| line(12.0 - 0.7 * f64::from(k), 0.0)), 0.25, 0.1));
    let movers = [([1.2, 0.4, 0.0], [0.5, 0.4, 0.0]), ([4.4, 6.6, 0.0], [-0.3, -0.9, 0.0])];
    frame.bodies.extend(movers.map(|(at, velocity)| disc(at, velocity)));
    let scenery = Scenery {
        bodies: vec![
            wall(-1.0),
            wall(1.0),
            obstacle(1, [1.0, 2.5, 0.0], Shape::Cuboid { size_m: [1.6, 0.8, 0.1] }),
        ],
        names: vec![(Kind::Connector, 0, "leader and 15 followers".into())],
        ..scenery("A convoy in a bent corridor", 2)
    };
    let way =
        (0..120u32).map(|k| (k.into(), line(0.1 * f64::from(k), 0.2 * (0.4 * f64::from(k)).sin())));
    (scenery, frame, vec![Trail { of: (Kind::Connector, 0, Some(0)), way: way.collect() }])
}

/// 450 connectors among 1000 spheres.
fn snake() -> Scene {
    let at = |k: u32| {
        let t = f64::from(k) * 0.03;
        [5.5 * (0.5 * t).cos(), 5.0 * (0.37 * t).sin(), 4.5 * (0.23 * t).sin()]
    };
    let sphere = |k: u32| {
        let at = [0, 1, 2].map(|axis| 12.0 * scatter(k, axis) - 6.0);
        let velocity = if k.is_multiple_of(100) { [0.8, 0.5, 0.6] } else { [0.0; 3] };
        obstacle(k, at, Shape::Sphere { radius_m: 0.35 }).moving(velocity)
    };
    let boxes = [[-5.0, 5.0, 5.5], [5.0, -5.0, -3.0]]
        .map(|at| obstacle(0, at, Shape::Cuboid { size_m: [1.6, 1.2, 2.0] }));
    let scenery = Scenery {
        bodies: (0..1000).map(sphere).chain(boxes).collect(),
        names: vec![(Kind::Connector, 0, "450 connectors".into())],
        ..scenery("A snake in space", 3)
    };
    (scenery, moment(chain((0..450).map(at), 0.06, 0.08)), Vec::new())
}
