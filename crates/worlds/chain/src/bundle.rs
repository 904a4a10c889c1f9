//! A scenario of chains that needs no other file: what a run folder keeps.
//!
//! Floors go along as the program saw them, so that a later version of an importer cannot change
//! what is replayed. Scripts and models of arms go along as they are.

use serde_json::Value;
use sidestep_import::stage::{self, Body, FloorPlan, Pose};
use sidestep_import::{PixelMap, rosmap};
use sidestep_kernel::InputError;
use sidestep_map::Cell;
use sidestep_scenario::file::read_bytes;
use sidestep_scenario::{Resolved, Source};
use std::path::Path;

/// Where the files are, seen from the scenario.
const FOLDER: &str = "inputs";
/// Largest script or model.
const MAX_BYTES: u64 = 64 << 20;
/// Keys whose values name files that go along as they are.
const PLAIN: [&str; 3] = ["script_file", "urdf", "srdf"];

/// The scenario, of this seed and number of cycles, with every file that it names beside it.
///
/// # Errors
/// When such a file cannot be read any more.
pub fn resolve(source: &Source, (seed, cycles): (u64, u64)) -> Result<Resolved, InputError> {
    let file: Value = source.parse()?;
    let said = vec![format!("seed={seed}"), format!("cycles={cycles}")];
    let mut bundle = Bundle { source, overrides: said, files: Vec::new() };
    bundle.add_plain(&file["chains"], "chains")?;
    bundle.add_map(&file["ground"]["map"])?;
    bundle.add_stage(&file["ground"]["stage"])?;
    let text = source.clone().with(&bundle.overrides)?.text;
    Ok(Resolved { text: format!("{}{text}", source.heading()), files: bundle.files })
}

struct Bundle<'a> {
    source: &'a Source,
    overrides: Vec<String>,
    files: Vec<(String, Vec<u8>)>,
}

impl Bundle<'_> {
    /// Adds all files that are named below a key.
    fn add_plain(&mut self, value: &Value, key: &str) -> Result<(), InputError> {
        match value {
            Value::Array(items) => items
                .iter()
                .enumerate()
                .try_for_each(|(k, item)| self.add_plain(item, &format!("{key}.{k}"))),
            Value::Object(table) => table.iter().try_for_each(|(name, item)| {
                let key = format!("{key}.{name}");
                match item.as_str().filter(|_| PLAIN.contains(&name.as_str())) {
                    Some(path) => self.add_as_it_is(&key, path),
                    None => self.add_plain(item, &key),
                }
            }),
            _ => Ok(()),
        }
    }

    fn add_as_it_is(&mut self, key: &str, path: &str) -> Result<(), InputError> {
        let bytes = read_bytes(&self.source.path(Path::new(path)), MAX_BYTES)?;
        let file = Path::new(path).file_name().unwrap_or_default().display().to_string();
        let name = format!("{FOLDER}/{}-{file}", self.files.len());
        self.overrides.push(format!("{key}={name:?}"));
        self.files.push((name, bytes));
        Ok(())
    }

    fn add_map(&mut self, path: &Value) -> Result<(), InputError> {
        let Some(path) = path.as_str() else { return Ok(()) };
        let map = rosmap::load(&self.source.path(Path::new(path)))?;
        self.overrides.push(format!("ground.map=\"{FOLDER}/map.yaml\""));
        self.files.push((format!("{FOLDER}/map.yaml"), map_yaml(&map).into_bytes()));
        self.files.push((format!("{FOLDER}/map.pgm"), map_pgm(&map)));
        Ok(())
    }

    fn add_stage(&mut self, path: &Value) -> Result<(), InputError> {
        let Some(path) = path.as_str() else { return Ok(()) };
        let world = stage::load(&self.source.path(Path::new(path)))?;
        self.overrides.push(format!("ground.stage=\"{FOLDER}/stage.world\""));
        let mut text = String::from("# The world as the simulation saw it.\n");
        for (k, plan) in world.floor_plans.iter().enumerate() {
            let bitmap = format!("floor-{k}.pgm");
            text.push_str(&floor_plan(plan, &bitmap));
            self.files.push((format!("{FOLDER}/{bitmap}"), floor_pgm(plan)));
        }
        text.extend(world.boxes.iter().map(solid));
        self.files.push((format!("{FOLDER}/stage.world"), text.into_bytes()));
        Ok(())
    }
}

fn map_yaml(map: &PixelMap) -> String {
    let [x, y] = map.origin_m();
    format!(
        "# The map as the simulation saw it.\nimage: map.pgm\nresolution: {:?}\n\
         origin: [{x:?}, {y:?}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        map.resolution_m()
    )
}

/// Binary PGM with the gray values of `map_server`; the first row is the north edge.
fn map_pgm(map: &PixelMap) -> Vec<u8> {
    let gray = |cell: &Cell| match cell {
        Cell::Free => 254,
        Cell::Unknown => 205,
        Cell::Wall => 0,
    };
    pgm(map.width(), map.height(), map.pixels().iter().map(gray).collect())
}

/// Binary PGM of a floor plan: black is in the way.
fn floor_pgm(plan: &FloorPlan) -> Vec<u8> {
    let gray = |solid: &bool| if *solid { 0 } else { 255 };
    pgm(plan.width, plan.height, plan.solid.iter().map(gray).collect())
}

/// Binary PGM of rows that begin at the bottom.
fn pgm(width: u32, height: u32, rows: Vec<u8>) -> Vec<u8> {
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    for row in rows.chunks_exact(width.max(1) as usize).rev() {
        bytes.extend_from_slice(row);
    }
    bytes
}

/// Stage wants degrees; these numbers are read back as the angle that they were.
fn pose(pose: &Pose) -> String {
    format!("[{:?} {:?} 0.0 {:?}]", pose.x_m, pose.y_m, pose.yaw_rad.to_degrees())
}

fn floor_plan(plan: &FloorPlan, bitmap: &str) -> String {
    let [width_m, height_m] = plan.size_m;
    format!(
        "model\n(\n  bitmap \"{bitmap}\"\n  size [{width_m:?} {height_m:?} 1.0]\n  pose {}\n  \
         boundary {}\n)\n",
        pose(&plan.pose),
        u8::from(plan.has_boundary)
    )
}

fn solid(body: &Body) -> String {
    let [x_m, y_m] = body.size_m;
    format!("model\n(\n  size [{x_m:?} {y_m:?} 1.0]\n  pose {}\n)\n", pose(&body.pose))
}
