//! The pictures of the scenarios are those that this program draws of them.
//!
//! `SIDESTEP_WRITE=gallery cargo test --release --workspace --lib gallery` draws them anew.

use super::SHIPPED;
use crate::worlds;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, RgbaImage};
use sidestep::kernel::view::{BodyId, Frame, FrameOptions, Trail, Vec3};
use sidestep::kernel::{Cycle, Simulation};
use sidestep::scenario::Source;
use sidestep_draw::{AnimationLook, AnimationRenderer, TrailChoice, bodies_with_trails};
use sidestep_server::ShippedScenario;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Width of a picture: twice that of its place on the page, for screens with small pixels.
const WIDTH_PX: u32 = 400;
/// Height of the line for words under a picture, which stays empty and is cut off.
const WORDS_PX: u32 = 24;
/// Number of times at which trails have a point.
const TRAIL_POINTS: Cycle = 150;
/// Maximum size of all pictures together: they are in the program.
const MAX_TOTAL_BYTES: usize = 600 << 10;
/// Largest mean difference of a channel of two pictures that are the same but for details of drawing.
const MAX_MEAN_DIFFERENCE: f64 = 4.0;

/// The scenarios whose pictures are compared: of each way of drawing one that is soon computed. Whoever changes one of
/// these ways draws all of them anew.
const COMPARED: [&str; 5] =
    ["robots/corridor", "chain/team", "chain/snake3d", "airspace/superconflict", "airspace/areas"];

/// Returns the cycle that a picture shows: one in which much has happened, and is soon computed.
fn shown_cycle(name: &str) -> Cycle {
    match name {
        "robots/office" => 200,
        "robots/one-robot" => 120,
        "chain/serpentine" => 1500,
        "chain/snake3d" | "chain/hemmed-in" => 150,
        "chain/arm" => 400,
        "chain/movers" | "chain/movers-apart" | "chain/team" => 400,
        "airspace/departures" => 400,
        "airspace/areas" => 300,
        // In the middle, before they arrive.
        "airspace/multirotors" => 26,
        "airspace/mixed-types" => 200,
        name if name.starts_with("airspace/") => 150,
        _ => 250,
    }
}

fn picture_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("gallery").join(format!("{name}.png"))
}

/// The tracks of bodies, as a run advances.
#[derive(Default)]
struct Tracks(BTreeMap<BodyId, Vec<(Cycle, Vec3)>>);

impl Tracks {
    fn add(&mut self, frame: &Frame, whose: &BTreeSet<BodyId>) {
        for body in frame.bodies.iter().filter(|body| whose.contains(&body.id())) {
            self.0.entry(body.id()).or_default().push((frame.cycle, body.pose.at_m));
        }
    }

    fn trails(self) -> Vec<Trail> {
        self.0.into_iter().map(|(of, points)| Trail { of, points }).collect()
    }
}

fn frame(run: &mut dyn Simulation) -> Frame {
    run.frame(FrameOptions::WITHOUT_SCANS)
}

/// Draws a scenario.
fn draw(shipped: &ShippedScenario) -> RgbaImage {
    let folder = picture_path(shipped.name);
    let folder = folder.parent().expect("a folder").to_path_buf();
    let source = Source::new(shipped.name, shipped.text, folder);
    let compiled = worlds().compile(&source).unwrap_or_else(|e| panic!("{}: {e}", shipped.name));
    let mut run = compiled.start(&source, 1);
    let scenery = run.scenery();
    let until = shown_cycle(shipped.name).min(run.config().cycles);
    let step = (until / TRAIL_POINTS).max(1);
    let start = frame(run.as_mut());
    let all = TrailChoice::default();
    let whose: BTreeSet<BodyId> = bodies_with_trails(&scenery, &start, &all).into_iter().collect();
    let mut tracks = Tracks::default();
    tracks.add(&start, &whose);
    while run.cycle() < until && run.advance(step) > 0 {
        tracks.add(&frame(run.as_mut()), &whose);
    }
    let end = frame(run.as_mut());
    let frames = [start, end.clone()];
    let look = AnimationLook::longer_side(WIDTH_PX);
    let view = AnimationRenderer::new(scenery, &frames, &look).expect("it can be drawn");
    let drawn = view.render(&end, &tracks.trails(), "").expect("it can be drawn");
    let (width, height) = view.size_px();
    let whole = RgbaImage::from_raw(width, height, drawn.rgba().to_vec()).expect("its size");
    image::imageops::crop_imm(&whole, 0, 0, width, height - WORDS_PX).to_image()
}

/// Returns a picture as a small file.
fn to_png(picture: &RgbaImage) -> Vec<u8> {
    let opaque = image::DynamicImage::from(picture.clone()).into_rgb8();
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
        .write_image(&opaque, opaque.width(), opaque.height(), ExtendedColorType::Rgb8)
        .expect("it can be written");
    bytes
}

/// Returns the mean difference of the channels of two pictures; none if their sizes differ.
fn mean_difference(a: &RgbaImage, b: &RgbaImage) -> Option<f64> {
    if a.dimensions() != b.dimensions() {
        return None;
    }
    let pairs = a.as_raw().iter().zip(b.as_raw());
    let sum: u64 = pairs.map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    Some(sum as f64 / a.as_raw().len() as f64)
}

#[test]
fn pictures_are_those_of_the_scenarios() {
    let is_renewed = std::env::var("SIDESTEP_WRITE").is_ok_and(|what| what == "gallery");
    let mut wrong = Vec::new();
    let chosen = SHIPPED.iter().filter(|shipped| is_renewed || COMPARED.contains(&shipped.name));
    let mut compared = 0;
    for shipped in chosen {
        compared += 1;
        let drawn = draw(shipped);
        if is_renewed {
            std::fs::write(picture_path(shipped.name), to_png(&drawn)).expect("written");
            continue;
        }
        let kept = image::load_from_memory(shipped.picture_png).expect("a picture").into_rgba8();
        let difference = mean_difference(&kept, &drawn);
        if difference.is_none_or(|difference| difference > MAX_MEAN_DIFFERENCE) {
            wrong.push(format!("{}: {difference:?}", shipped.name));
        }
    }
    assert!(compared >= COMPARED.len(), "{compared} scenarios have such names");
    assert!(
        wrong.is_empty(),
        "draw them anew by `SIDESTEP_WRITE=gallery cargo test --release --workspace --lib gallery`: {wrong:?}"
    );
}

#[test]
fn a_picture_shows_more_than_an_empty_ground_and_all_are_small() {
    let mut total = 0;
    for ShippedScenario { name, picture_png, .. } in &SHIPPED {
        total += picture_png.len();
        let picture = image::load_from_memory(picture_png).expect("a picture").into_rgb8();
        let drawn = picture.pixels().filter(|pixel| pixel.0 != [255; 3]).count();
        let share = drawn as f64 / f64::from(picture.width() * picture.height());
        assert!(share > 0.005, "{name} has {share} of its pixels drawn");
    }
    assert!(total < MAX_TOTAL_BYTES, "{total} bytes");
}

#[test]
fn every_shipped_scenario_but_the_defaults_is_carried() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let Ok(worlds_there) = std::fs::read_dir(&root) else { return };
    let mut expected = BTreeSet::new();
    for world in worlds_there.flatten().filter(|entry| entry.path().is_dir()) {
        let world_name = world.file_name().into_string().expect("text");
        if worlds().find(&world_name).is_none() {
            continue;
        }
        for file in std::fs::read_dir(world.path()).expect("a folder").flatten() {
            let path = file.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("text");
            if path.extension().is_some_and(|ending| ending == "toml") && stem != "default" {
                expected.insert(format!("{world_name}/{stem}"));
            }
        }
    }
    let carried: BTreeSet<String> = SHIPPED.iter().map(|shipped| shipped.name.into()).collect();
    assert_eq!(carried, expected);
}
