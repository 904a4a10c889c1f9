//! [`Item`]s -> [`World`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::parse::{self, Entry, Item, MAX_NESTING, ModelBlock, SourcePosition, Value};
use super::{BoxObstacle, FloorPlan, MAX_WORLD_BYTES, Pose2, Robot, World};
use crate::image::Bitmap;
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, hypot, sin};
use sidestep_scenario::file::read_text;

const MAX_FILES: usize = 1000;
const MAX_MODELS: usize = 100_000;
/// The size that Stage gives to models without one, in meters.
const DEFAULT_SIZE_M: f64 = 0.1;
/// The greatest brightness of a solid pixel, as in Stage; brighter ones are free.
const MAX_SOLID_BRIGHTNESS: f64 = 127.0;

pub(super) fn world(path: &Path) -> Result<World, InputError> {
    let mut reader = WorldReader::default();
    reader.file(path)?;
    reader.world.not_used = reader.not_used.into_iter().collect();
    Ok(reader.world)
}

/// A file that has been read; positions refer to it by its number.
struct SourceFile {
    path: PathBuf,
    text: String,
}

/// A model with all properties that it inherits.
#[derive(Debug, Clone, Default)]
struct Definition {
    /// The built-in kind at its root.
    root: String,
    /// The last value of each property.
    properties: BTreeMap<String, Value>,
    children: Vec<ModelBlock>,
}

#[derive(Default)]
struct WorldReader {
    sources: Vec<SourceFile>,
    /// Files that are being read: each was included by the one before.
    open: Vec<PathBuf>,
    definitions: BTreeMap<String, Rc<Definition>>,
    models: usize,
    not_used: BTreeMap<String, usize>,
    world: World,
}

impl WorldReader {
    fn file(&mut self, path: &Path) -> Result<(), InputError> {
        let text = read_text(path, MAX_WORLD_BYTES)?;
        let canonical = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        self.open.push(canonical);
        let file = self.sources.len();
        let items = parse::items(&path.display().to_string(), &text, file)?;
        self.sources.push(SourceFile { path: path.to_owned(), text });
        for item in items {
            match item {
                Item::Include(name) => self.include(&name)?,
                Item::Define { name, model } => {
                    let definition = self.resolve(&model);
                    self.definitions.insert(name, Rc::new(definition));
                }
                Item::Entry(Entry::Property { key, .. }) => self.count_ignored(key),
                Item::Entry(Entry::Model(model)) => self.add_model(&model, Pose2::default(), 0)?,
            }
        }
        self.open.pop();
        Ok(())
    }

    fn include(&mut self, name: &Value) -> Result<(), InputError> {
        let path = self.path(name)?;
        if path.canonicalize().is_ok_and(|path| self.open.contains(&path)) {
            let cause = format!("{} includes itself", path.display());
            return Err(self.error(name.at, cause, "leave this `include` out"));
        }
        if self.sources.len() >= MAX_FILES {
            let cause = format!("more than {MAX_FILES} files are included");
            return Err(self.error(name.at, cause, "leave this `include` out"));
        }
        if !path.is_file() {
            let cause = format!("there is no file {}", path.display());
            return Err(self.error(name.at, cause, "put it there, or leave the line out"));
        }
        self.file(&path)
    }

    /// Resolves a path in a file, relative to that file.
    fn path(&self, name: &Value) -> Result<PathBuf, InputError> {
        let [file] = &name.words[..] else {
            return Err(self.error(name.at, "a list where a file's name is expected", "give one"));
        };
        let folder = self.sources[name.at.file].path.parent();
        Ok(folder.unwrap_or(Path::new("")).join(file))
    }

    fn error(&self, at: SourcePosition, cause: impl Into<String>, remedy: &str) -> InputError {
        let SourceFile { path, text } = &self.sources[at.file];
        InputError::new(path.display(), cause, remedy).with_byte_offset(text, at.offset)
    }

    fn count_ignored(&mut self, name: impl Into<String>) {
        *self.not_used.entry(name.into()).or_default() += 1;
    }

    /// Returns the properties of a model, its own before inherited ones.
    fn resolve(&self, model: &ModelBlock) -> Definition {
        let mut definition = match self.definitions.get(&model.kind) {
            Some(base) => (**base).clone(),
            None => Definition { root: model.kind.clone(), ..Definition::default() },
        };
        for entry in &model.entries {
            match entry {
                Entry::Property { key, value } => {
                    definition.properties.insert(key.clone(), value.clone());
                }
                Entry::Model(child) => definition.children.push(child.clone()),
            }
        }
        definition
    }

    fn add_model(
        &mut self,
        model: &ModelBlock,
        parent: Pose2,
        depth: usize,
    ) -> Result<(), InputError> {
        self.models += 1;
        if self.models > MAX_MODELS || depth > MAX_NESTING {
            let cause = format!("more than {MAX_MODELS} models, or {MAX_NESTING} in each other");
            return Err(self.error(model.at, cause, "use fewer"));
        }
        let definition = self.resolve(model);
        match definition.root.as_str() {
            "position" => self.add_robot(model, &definition, parent),
            "model" => self.add_obstacle(model, &definition, parent, depth),
            _ if definition.properties.contains_key("bitmap") => {
                // A floor plan whose definition is in a file that is missing.
                self.add_obstacle(model, &definition, parent, depth)
            }
            root => {
                self.count_ignored(root);
                Ok(())
            }
        }
    }

    fn add_robot(
        &mut self,
        model: &ModelBlock,
        def: &Definition,
        parent: Pose2,
    ) -> Result<(), InputError> {
        let size_m = self.size_m(def)?;
        let origin = self.pose(def, "origin")?;
        let robot = Robot {
            name: self.text(def, "name"),
            kind: model.kind.clone(),
            pose: self.pose(def, "pose")?.transformed_by(parent),
            size_m,
            radius_m: radius_m(size_m, origin),
        };
        self.world.robots.push(robot);
        self.count_unused(def);
        Ok(())
    }

    fn add_obstacle(
        &mut self,
        model: &ModelBlock,
        def: &Definition,
        parent: Pose2,
        depth: usize,
    ) -> Result<(), InputError> {
        let pose = self.pose(def, "pose")?.transformed_by(parent);
        let center = self.pose(def, "origin")?.transformed_by(pose);
        let size_m = self.size_m(def)?;
        let name = self.text(def, "name");
        if let Some(bitmap) = def.properties.get("bitmap") {
            let has_boundary = self.number(def, "boundary", 0.0)? != 0.0;
            let plan = self.floor_plan(bitmap)?;
            let plan = FloorPlan { name, size_m, pose: center, has_boundary, ..plan };
            self.world.floor_plans.push(plan);
        } else if self.is_obstacle(def)? {
            self.world.boxes.push(BoxObstacle { name, pose: center, size_m });
        } else {
            self.count_ignored(&model.kind);
        }
        self.count_unused(def);
        def.children.iter().try_for_each(|child| self.add_model(child, pose, depth + 1))
    }

    fn is_obstacle(&self, def: &Definition) -> Result<bool, InputError> {
        let is_hit = self.number(def, "obstacle_return", 1.0)? != 0.0;
        Ok(is_hit || self.number(def, "ranger_return", 1.0)? >= 0.0)
    }

    /// Reads the pixels of a bitmap, rows from the bottom; its size in meters follows from the model.
    fn floor_plan(&self, bitmap: &Value) -> Result<FloorPlan, InputError> {
        let image = Bitmap::load(&self.path(bitmap)?)?;
        let from_top = image.map_brightness(|brightness| brightness <= MAX_SOLID_BRIGHTNESS);
        // Image rows run from the top, those of the plan from the bottom.
        let rows = from_top.rchunks(image.width() as usize);
        Ok(FloorPlan {
            name: String::new(),
            width: image.width(),
            height: image.height(),
            solid: rows.flatten().copied().collect(),
            size_m: [0.0; 2],
            pose: Pose2::default(),
            has_boundary: false,
        })
    }

    fn count_unused(&mut self, def: &Definition) {
        for key in def.properties.keys() {
            if !KNOWN_PROPERTIES.contains(&key.as_str()) {
                self.count_ignored(key);
            }
        }
    }

    fn text(&self, def: &Definition, key: &str) -> String {
        def.properties.get(key).map(|value| value.words.join(" ")).unwrap_or_default()
    }

    fn number(&self, def: &Definition, key: &str, default: f64) -> Result<f64, InputError> {
        let Some(value) = def.properties.get(key) else { return Ok(default) };
        match self.numbers(value)?[..] {
            [number] => Ok(number),
            _ => Err(self.error(value.at, format!("a list for {key}"), "give one number")),
        }
    }

    fn numbers(&self, value: &Value) -> Result<Vec<f64>, InputError> {
        let mut numbers = Vec::with_capacity(value.words.len());
        for word in &value.words {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                _ => {
                    let cause = format!("`{word}` is no number");
                    return Err(self.error(value.at, cause, "give finite numbers"));
                }
            }
        }
        Ok(numbers)
    }

    fn size_m(&self, def: &Definition) -> Result<[f64; 2], InputError> {
        let Some(value) = def.properties.get("size") else { return Ok([DEFAULT_SIZE_M; 2]) };
        match self.numbers(value)?[..] {
            [x, y] | [x, y, _] if x > 0.0 && y > 0.0 => Ok([x, y]),
            _ => Err(self.error(
                value.at,
                "no size",
                "give three lengths in m, those along x and y above 0",
            )),
        }
    }

    fn pose(&self, def: &Definition, key: &str) -> Result<Pose2, InputError> {
        let Some(value) = def.properties.get(key) else { return Ok(Pose2::default()) };
        match self.numbers(value)?[..] {
            [x_m, y_m, _, yaw_deg] => Ok(Pose2 { x_m, y_m, yaw_rad: yaw_deg.to_radians() }),
            [x_m, y_m, _] if key == "origin" => Ok(Pose2 { x_m, y_m, yaw_rad: 0.0 }),
            _ => Err(self.error(
                value.at,
                format!("no {key}"),
                "give four numbers: x, y and z in m, and degrees",
            )),
        }
    }
}

/// The properties that have an effect here; all others are counted as not used.
const KNOWN_PROPERTIES: [&str; 8] =
    ["name", "pose", "origin", "size", "bitmap", "boundary", "obstacle_return", "ranger_return"];

/// Returns the radius of the smallest disc about a robot's reference point that contains its body, or an upper bound.
fn radius_m(size_m: [f64; 2], origin: Pose2) -> f64 {
    if origin.yaw_rad == 0.0 {
        let reach_m = |offset_m: f64, size_m: f64| offset_m.abs() + 0.5 * size_m;
        hypot(reach_m(origin.x_m, size_m[0]), reach_m(origin.y_m, size_m[1]))
    } else {
        // A bound, because the corners of a rotated body are not computed.
        hypot(origin.x_m, origin.y_m) + 0.5 * hypot(size_m[0], size_m[1])
    }
}

impl Pose2 {
    /// Transforms a pose from the frame of `parent` into the frame of that one's parent.
    fn transformed_by(self, parent: Self) -> Self {
        let s = sin(parent.yaw_rad);
        let c = cos(parent.yaw_rad);
        Self {
            x_m: parent.x_m + c * self.x_m - s * self.y_m,
            y_m: parent.y_m + s * self.x_m + c * self.y_m,
            yaw_rad: parent.yaw_rad + self.yaw_rad,
        }
    }
}
