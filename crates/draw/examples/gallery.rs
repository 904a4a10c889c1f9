//! Draws one picture of each kind, as SVG and PNG: `gallery OUTDIR`.
//!
//! The numbers are made up; they have the shape of results from a study of a robot team.

use sidestep_robots::kinds::{DOOR, PERSON, ROBOT};
use std::path::{Path, PathBuf};
use std::{env, error::Error, fs};

use sidestep_draw::{
    Axis, Bar, BarChart, BarSeries, DrawError, PictureOptions, Plot, Point, Series, Style, draw,
    to_png,
};
use sidestep_kernel::view::{
    Body, BodyCondition, BodyId, Frame, Isometry2, Occupancy, OccupancyGrid, Pose, Scenery, Shape,
    Trail,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or("usage: gallery OUTDIR")?);
    fs::create_dir_all(&folder)?;
    let chart = Style::CHART;
    save(&folder, "tracks", &corridor()?)?;
    save(&folder, "speed-up", &speed_up().to_svg(&chart)?)?;
    save(&folder, "density", &density().to_svg(&chart)?)?;
    save(&folder, "contacts", &contacts().to_svg(&chart)?)
}

fn save(folder: &Path, name: &str, svg: &str) -> Result<(), Box<dyn Error>> {
    let path = folder.join(name);
    fs::write(path.with_extension("svg"), svg)?;
    fs::write(path.with_extension("png"), to_png(svg, 1280)?)?;
    println!("{}", path.with_extension("{svg,png}").display());
    Ok(())
}

/// A corridor with rooms on both sides, three robots and two people.
fn corridor() -> Result<String, DrawError> {
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
    let floor = OccupancyGrid {
        width: 34,
        height: 14,
        box_m: 1.0,
        plane: Isometry2::default(),
        boxes: PLAN.iter().rev().flat_map(|line| line.chars().map(occupancy)).collect(),
    };
    let body = |kind, number, (x, y): (f64, f64), (width, height): (f64, f64)| {
        let pose = Pose::from_position([x, y, 0.0]);
        Body::new(kind, number, pose, Shape::Cuboid { size_m: [width, height, 0.1] })
    };
    let door = |number, at: (f64, f64), width, open| {
        body(DOOR, number, at, (width, 1.0)).with_condition_if(open, BodyCondition::Open)
    };
    let paths = [
        &[(3.0, 12.0), (3.0, 11.0), (6.0, 7.0), (21.0, 7.0), (26.0, 8.0), (26.0, 3.0)][..],
        &[(32.0, 7.0), (23.0, 7.0), (15.0, 8.0), (8.0, 7.0), (8.0, 3.0), (4.0, 3.0)],
        &[(14.0, 12.0), (21.0, 12.0), (21.0, 11.0), (15.0, 11.0)],
    ];
    let points = |path: &[(f64, f64)]| (0..).zip(path.iter().map(|&(x, y)| [x, y, 0.0])).collect();
    let trail = |(k, places): (u32, &&[(f64, f64)])| Trail {
        of: BodyId::new(ROBOT, k, None),
        points: points(places),
    };
    let robot =
        |(k, places): (u32, &&[(f64, f64)])| body(ROBOT, k, places[places.len() - 1], (2.0, 2.0));
    let others = [
        door(3, (5.0, 8.5), 2.0, true),
        door(4, (17.0, 8.5), 2.0, false),
        door(5, (16.5, 4.5), 3.0, false),
        body(PERSON, 6, (9.5, 2.5), (1.0, 1.0)),
        body(PERSON, 7, (29.5, 10.5), (1.0, 1.0)),
    ];
    let bodies = (0..).zip(&paths).map(robot).chain(others).collect();
    let scenery = Scenery {
        name: "To and fro on the corridor".into(),
        dimensions: 2,
        cycle_s: 1.0,
        floor: Some(floor),
        bodies: Vec::new(),
        names: Vec::new(),
        groups: Vec::new(),
        earth: Default::default(),
        traffic: None,
    };
    let frame = Frame { bodies, ..Frame::default() };
    let trails: Vec<Trail> = (0..).zip(&paths).map(trail).collect();
    draw(&scenery, &frame, &trails, &PictureOptions::page(&scenery, "Made-up places."))
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
