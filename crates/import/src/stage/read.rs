//! [`Item`]s -> [`World`].

use std::path::Path;

use super::bitmap::{PlanFrame, floor_plan};
use super::definitions::{Definition, Definitions, Units, Values};
use super::files::WorldFiles;
use super::parse::{Entry, Item, MAX_NESTING, ModelBlock, Value};
use super::unused::record_unused;
use super::{BoxObstacle, Pose2, Robot, World};
use crate::image::Bitmap;
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, hypot, sin};

const MAX_MODELS: usize = 100_000;

/// Kinds of models of Stage that are no obstacles: sensors, lamps, tools and windows.
const OTHER_KINDS: [&str; 11] = [
    "actuator",
    "blinkenlight",
    "blobfinder",
    "bumper",
    "camera",
    "fiducial",
    "gripper",
    "lightindicator",
    "ranger",
    "sensor",
    "window",
];

pub(super) fn world(path: &Path) -> Result<World, InputError> {
    let mut report = ImportReport::new("Stage world");
    let (files, items) = WorldFiles::read(path, &mut report)?;
    report.add_fact("files", files.count().to_string());
    let units = Units::of(&items, &files, &mut report)?;
    let mut reader = WorldReader {
        files: &files,
        values: Values { files: &files, units },
        definitions: Definitions::new(&files),
        models: 0,
        world: World::default(),
        report,
    };
    for item in &items {
        match item {
            Item::Include(_) => {}
            Item::Define { name, model } => {
                reader.definitions.add(name, model, &mut reader.report);
            }
            Item::Entry(Entry::Property { key, value }) => {
                super::unused::record_setting(key, value, &files, &mut reader.report);
            }
            Item::Entry(Entry::Model(model)) => reader.add_model(model, &Parent::WORLD)?,
        }
    }
    Ok(reader.finish())
}

/// What models within a model take from it.
struct Parent {
    pose: Pose2,
    name: String,
    depth: usize,
}

impl Parent {
    const WORLD: Self =
        Self { pose: Pose2 { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 }, name: String::new(), depth: 0 };
}

struct WorldReader<'a> {
    files: &'a WorldFiles,
    values: Values<'a>,
    definitions: Definitions<'a>,
    models: usize,
    world: World,
    report: ImportReport,
}

impl<'a> WorldReader<'a> {
    fn finish(mut self) -> World {
        let World { floor_plans, boxes, robots, .. } = &self.world;
        let poses = floor_plans.iter().map(|plan| (plan.pose, plan.size_m));
        let poses = poses.chain(boxes.iter().map(|body| (body.pose, body.size_m)));
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for (pose, size_m) in poses.chain(robots.iter().map(|robot| (robot.pose, robot.size_m))) {
            let half_m = half_extent_m(pose.yaw_rad, size_m);
            for (i, at) in [pose.x_m, pose.y_m].into_iter().enumerate() {
                low[i] = low[i].min(at - half_m[i]);
                high[i] = high[i].max(at + half_m[i]);
            }
        }
        if low[0] <= high[0] {
            // Rounded first: adding 0 turns a negative zero into a positive one.
            let [x0, y0, x1, y1] =
                [low[0], low[1], high[0], high[1]].map(|x: f64| (100.0 * x).round() / 100.0 + 0.0);
            let extent = format!("x {x0:.2} to {x1:.2} m, y {y0:.2} to {y1:.2} m");
            self.report.add_fact("extent", extent);
        }
        self.report.add_kept("floor plans", floor_plans.len());
        self.report.add_kept("boxes", boxes.len());
        self.report.add_kept("robots", robots.len());
        World { report: self.report, ..self.world }
    }

    fn record(&mut self, treatment: Treatment, rule: String, model: &ModelBlock, remedy: &str) {
        self.report.record(treatment, rule, self.files.place(model.at), remedy);
    }

    fn add_model(&mut self, model: &'a ModelBlock, parent: &Parent) -> Result<(), InputError> {
        self.models += 1;
        if self.models > MAX_MODELS || parent.depth > MAX_NESTING {
            let cause = format!("more than {MAX_MODELS} models, or {MAX_NESTING} in each other");
            return Err(self.files.error(model.at, cause, "use fewer"));
        }
        let definition = self.definitions.resolve(model)?;
        match definition.root {
            "position" => self.add_robot(model, &definition, parent),
            "model" => self.add_obstacle(model, &definition, parent),
            root if OTHER_KINDS.contains(&root) => {
                self.record(Treatment::NotUsed, format!("models of the kind `{root}`"), model, "");
                Ok(())
            }
            root if definition.properties.contains_key("bitmap") => {
                let rule = format!(
                    "`{root}`, which nothing defines, is an obstacle because it has a bitmap"
                );
                let remedy = format!("write `define {root} model ( )` before it");
                self.record(Treatment::Guessed, rule, model, &remedy);
                self.add_obstacle(model, &definition, parent)
            }
            root => {
                let rule = format!("models of the kind `{root}`, which nothing defines");
                let remedy = "include the file that defines it";
                self.record(Treatment::Dropped, rule, model, remedy);
                Ok(())
            }
        }
    }

    fn add_robot(
        &mut self,
        model: &'a ModelBlock,
        def: &Definition<'a>,
        parent: &Parent,
    ) -> Result<(), InputError> {
        let size_m = self.values.size_m(def)?;
        let origin = self.values.pose(def, "origin")?;
        let robot = Robot {
            name: self.name(def, parent),
            kind: model.kind.clone(),
            pose: self.values.pose(def, "pose")?.transformed_by(parent.pose),
            size_m,
            radius_m: radius_m(size_m, origin),
        };
        self.world.robots.push(robot);
        if let Some(bitmap) = def.properties.get("bitmap") {
            let rule = "bitmaps of robots, whose bodies are the box of `size`";
            self.report.record(Treatment::NotUsed, rule, self.files.place(bitmap.at), "");
        }
        self.record_blocks(def);
        record_unused(def, self.files, &mut self.report);
        for child in &def.children {
            let root = self.definitions.resolve(child)?.root;
            if root != "block" {
                let rule = format!("models of the kind `{root}` on robots");
                self.record(Treatment::NotUsed, rule, child, "");
            }
        }
        Ok(())
    }

    fn add_obstacle(
        &mut self,
        model: &'a ModelBlock,
        def: &Definition<'a>,
        parent: &Parent,
    ) -> Result<(), InputError> {
        let place = self.values.place(def, "pose")?;
        let pose = place.pose.transformed_by(parent.pose);
        let center = self.values.pose(def, "origin")?.transformed_by(pose);
        let size_m = self.values.size_m(def)?;
        let name = self.name(def, parent);
        let is_obstacle = self.is_obstacle(model, def)?;
        if is_obstacle && place.height_m != 0.0 {
            let rule = "the heights (z) of obstacles, which all stand on the ground";
            self.record(Treatment::NotUsed, rule.to_owned(), model, "");
        }
        if !is_obstacle {
            // Recorded by then.
        } else if let Some(bitmap) = def.properties.get("bitmap") {
            let has_boundary = self.values.number(def, "boundary", 0.0)? != 0.0;
            let place = self.files.place(bitmap.at);
            let image = self.image(bitmap)?;
            let frame = PlanFrame { name: name.clone(), size_m, pose: center, has_boundary, place };
            let plan = floor_plan(&image, frame, &mut self.report);
            self.world.floor_plans.push(plan);
        } else {
            self.world.boxes.push(BoxObstacle { name: name.clone(), pose: center, size_m });
        }
        self.record_blocks(def);
        record_unused(def, self.files, &mut self.report);
        let here = Parent { pose, name, depth: parent.depth + 1 };
        let models = def.children.iter().filter(|child| !self.is_block(child));
        let models: Vec<&'a ModelBlock> = models.copied().collect();
        models.into_iter().try_for_each(|child| self.add_model(child, &here))
    }

    /// Returns whether a model takes up space, and records where that is a choice or where it does not.
    fn is_obstacle(&mut self, model: &ModelBlock, def: &Definition) -> Result<bool, InputError> {
        let has_blocks = def.children.iter().any(|child| self.is_block(child));
        let has_shape = has_blocks || def.properties.contains_key("bitmap");
        if self.values.number(def, "noblocks", 0.0)? != 0.0 && !has_shape {
            let rule = "models without a body (`noblocks 1`)".to_owned();
            self.record(Treatment::NotUsed, rule, model, "");
            return Ok(false);
        }
        if self.values.number(def, "obstacle_return", 1.0)? != 0.0 {
            return Ok(true);
        }
        if self.values.number(def, "ranger_return", 1.0)? < 0.0 {
            let rule = "models that neither robots touch nor rangers see \
                        (`obstacle_return 0`, `ranger_return` below 0)";
            self.record(Treatment::NotUsed, rule.to_owned(), model, "");
            return Ok(false);
        }
        let rule = "models that rangers see and robots pass (`obstacle_return 0`) are obstacles";
        let remedy = "write `ranger_return -1` if they are none, `obstacle_return 1` if they are";
        self.record(Treatment::Guessed, rule.to_owned(), model, remedy);
        Ok(true)
    }

    /// Returns whether a part of a model is a shape of it, and no model that has `block` as its name.
    fn is_block(&self, child: &ModelBlock) -> bool {
        child.kind == "block" && !self.definitions.contains("block")
    }

    fn record_blocks(&mut self, def: &Definition) {
        let has_bitmap = def.properties.contains_key("bitmap");
        for child in &def.children {
            if self.is_block(child) {
                let rule = if has_bitmap {
                    "shapes (`block`) beside a bitmap"
                } else {
                    "shapes (`block`), for which the box of `size` stands"
                };
                self.record(Treatment::NotUsed, rule.to_owned(), child, "");
            }
        }
    }

    /// Returns the name of a model: within that of its parent, unless it begins with a slash.
    fn name(&self, def: &Definition, parent: &Parent) -> String {
        let name = self.values.text(def, "name");
        match name.strip_prefix('/') {
            Some(global) => global.to_owned(),
            None if name.is_empty() || parent.name.is_empty() => name,
            None => format!("{}.{name}", parent.name),
        }
    }

    fn image(&mut self, bitmap: &Value) -> Result<Bitmap, InputError> {
        Bitmap::load(&self.files.find(bitmap, &mut self.report)?)
    }
}

/// Returns half of the extent of a box along the axes of the world.
fn half_extent_m(yaw_rad: f64, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
    let s = sin(yaw_rad).abs();
    let c = cos(yaw_rad).abs();
    [0.5 * (c * x_m + s * y_m), 0.5 * (s * x_m + c * y_m)]
}

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
