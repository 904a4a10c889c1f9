//! Models with all that they inherit, and the units of a world.

use std::collections::BTreeMap;

use super::Pose2;
use super::files::WorldFiles;
use super::parse::{Entry, Item, MAX_NESTING, ModelBlock, Value};
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;

/// The maximum number of properties and models within models, counted anew for each model that inherits them.
const MAX_ENTRIES: usize = 10_000_000;
/// The size that Stage gives to models without one, in meters.
const DEFAULT_SIZE_M: f64 = 0.1;
/// The units of lengths in files, with their meters.
const LENGTH_UNITS: [(&str, f64); 3] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001)];
/// The units of angles in files, with their radians.
const ANGLE_UNITS: [(&str, f64); 2] = [("degrees", std::f64::consts::PI / 180.0), ("radians", 1.0)];

/// What the numbers of a world stand for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Units {
    length_m: f64,
    angle_rad: f64,
}

impl Units {
    /// Returns the units of a world: the last that it gives, wherever it gives them.
    pub(super) fn of(
        items: &[Item],
        files: &WorldFiles,
        report: &mut ImportReport,
    ) -> Result<Self, InputError> {
        let unit = |key: &str| {
            items.iter().rev().find_map(|item| match item {
                Item::Entry(Entry::Property { key: other, value }) if other == key => Some(value),
                _ => None,
            })
        };
        let lengths = unit("unit_length");
        let angles = unit("unit_angle");
        let (length, length_m) = unit_of(lengths, &LENGTH_UNITS, files)?;
        let (angle, angle_rad) = unit_of(angles, &ANGLE_UNITS, files)?;
        report.add_fact("units", format!("lengths in {length}, angles in {angle}"));
        Ok(Self { length_m, angle_rad })
    }
}

fn unit_of(
    value: Option<&Value>,
    units: &[(&'static str, f64)],
    files: &WorldFiles,
) -> Result<(&'static str, f64), InputError> {
    let Some(value) = value else { return Ok(units[0]) };
    let word = value.words.join(" ");
    units.iter().find(|(name, _)| *name == word).copied().ok_or_else(|| {
        let known: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
        let cause = format!("`{word}` is no unit of Stage");
        files.error(value.at, cause, &format!("write \"{}\"", known.join("\" or \"")))
    })
}

/// A model with all that it inherits.
#[derive(Debug, Default)]
pub(super) struct Definition<'a> {
    /// The built-in kind at its root.
    pub(super) root: &'a str,
    /// The last value of each property.
    pub(super) properties: BTreeMap<&'a str, &'a Value>,
    pub(super) children: Vec<&'a ModelBlock>,
}

/// The definitions of a world that were read so far.
pub(super) struct Definitions<'a> {
    files: &'a WorldFiles,
    by_name: BTreeMap<&'a str, &'a ModelBlock>,
    /// Number of entries that were inherited.
    entries: usize,
}

impl<'a> Definitions<'a> {
    pub(super) fn new(files: &'a WorldFiles) -> Self {
        Self { files, by_name: BTreeMap::new(), entries: 0 }
    }

    /// Adds a definition; as in Stage, the first of a name holds.
    pub(super) fn add(&mut self, name: &'a str, model: &'a ModelBlock, report: &mut ImportReport) {
        if !self.by_name.contains_key(name) {
            self.by_name.insert(name, model);
            return;
        }
        let rule = format!("a second definition of `{name}`, where Stage keeps the first");
        let remedy = "keep the definition that you mean";
        report.record(Treatment::Dropped, rule, self.files.place(model.at), remedy);
    }

    /// Returns whether a name is defined.
    pub(super) fn contains(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// Returns the properties of a model, its own before inherited ones. A name stands for its definition at the place
    /// where it is used, as in Stage, so that definitions may come in any order.
    pub(super) fn resolve(&mut self, model: &'a ModelBlock) -> Result<Definition<'a>, InputError> {
        let mut lineage = vec![model];
        let mut next = model;
        while let Some(base) = self.by_name.get(next.kind.as_str()) {
            if lineage.len() > MAX_NESTING {
                let cause = format!("`{}` is defined by itself", model.kind);
                let remedy = "define a model by another one, or by one of Stage's own kinds";
                return Err(self.files.error(base.at, cause, remedy));
            }
            lineage.push(base);
            next = base;
        }
        let mut definition = Definition { root: &next.kind, ..Definition::default() };
        for block in lineage.into_iter().rev() {
            self.entries += block.entries.len();
            for entry in &block.entries {
                match entry {
                    Entry::Property { key, value }
                        if ["define", "include"].contains(&key.as_str()) =>
                    {
                        let cause = format!("`{key}` within a model");
                        return Err(self.files.error(value.at, cause, "write it before the model"));
                    }
                    Entry::Property { key, value } => {
                        definition.properties.insert(key, value);
                    }
                    Entry::Model(child) => definition.children.push(child),
                }
            }
        }
        if self.entries > MAX_ENTRIES {
            let cause = format!("the models have more than {MAX_ENTRIES} properties in all");
            return Err(self.files.error(model.at, cause, "use fewer models"));
        }
        Ok(definition)
    }
}

/// Reads the values of a model.
#[derive(Clone, Copy)]
pub(super) struct Values<'a> {
    pub(super) files: &'a WorldFiles,
    pub(super) units: Units,
}

impl Values<'_> {
    pub(super) fn text(&self, def: &Definition, key: &str) -> String {
        def.properties.get(key).map(|value| value.words.join(" ")).unwrap_or_default()
    }

    pub(super) fn number(
        &self,
        def: &Definition,
        key: &str,
        default: f64,
    ) -> Result<f64, InputError> {
        let Some(value) = def.properties.get(key) else { return Ok(default) };
        match self.numbers(value)?[..] {
            [number] => Ok(number),
            _ => Err(self.files.error(value.at, format!("a list for {key}"), "give one number")),
        }
    }

    fn numbers(&self, value: &Value) -> Result<Vec<f64>, InputError> {
        let mut numbers = Vec::with_capacity(value.words.len());
        for word in &value.words {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                _ => {
                    let cause = format!("`{word}` is no number");
                    return Err(self.files.error(value.at, cause, "give finite numbers"));
                }
            }
        }
        Ok(numbers)
    }

    pub(super) fn size_m(&self, def: &Definition) -> Result<[f64; 2], InputError> {
        let Some(value) = def.properties.get("size") else { return Ok([DEFAULT_SIZE_M; 2]) };
        match self.numbers(value)?[..] {
            [x, y] | [x, y, _] if x > 0.0 && y > 0.0 => Ok([x, y].map(|x| x * self.units.length_m)),
            _ => Err(self.files.error(
                value.at,
                "no size",
                "give three lengths in m, those along x and y above 0",
            )),
        }
    }

    pub(super) fn pose(&self, def: &Definition, key: &str) -> Result<Pose2, InputError> {
        self.place(def, key).map(|place| place.pose)
    }

    /// Reads a pose with its height.
    pub(super) fn place(&self, def: &Definition, key: &str) -> Result<Place, InputError> {
        let Some(value) = def.properties.get(key) else { return Ok(Place::default()) };
        let [x, y, z, yaw] = match self.numbers(value)?[..] {
            [x, y, z, yaw] => [x, y, z, yaw],
            [x, y, z] if key == "origin" => [x, y, z, 0.0],
            _ => {
                return Err(self.files.error(
                    value.at,
                    format!("no {key}"),
                    "give four numbers: x, y and z in m, and degrees",
                ));
            }
        };
        let Units { length_m, angle_rad } = self.units;
        let pose = Pose2 { x_m: x * length_m, y_m: y * length_m, yaw_rad: yaw * angle_rad };
        Ok(Place { pose, height_m: z * length_m })
    }
}

/// A pose and the height above the ground.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) pose: Pose2,
    pub(super) height_m: f64,
}
