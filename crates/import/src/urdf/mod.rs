//! Robot models: URDF (links and joints) and SRDF (groups, named postures).
//!
//! Kinematics is read (joints with their origins, axes, limits and mimicry) and the shapes of links
//! that count for collisions. Masses and visual shapes are ignored, and meshes are only opened by
//! [`Model::solids`], so a missing mesh is not an error. Lengths are meters, angles radians.
//! Formats: <https://wiki.ros.org/urdf/XML>, <https://wiki.ros.org/srdf>.
//!
//! The XML is read with `roxmltree` instead of `urdf-rs`, because errors of the latter have no
//! line, it does not read SRDF, and it would add an XML reader of its own.

pub mod joint_limits;
mod limits;
mod mesh_files;
mod numbers;
mod origin;
mod read;
mod shapes;
pub mod srdf;
#[cfg(test)]
pub(crate) mod tests;
mod tip;
mod tree;
mod unused;
mod xacro;

pub use shapes::{Collision, Shape, Solid, Solids};

use std::path::Path;

use crate::ImportReport;
use crate::xml::read_xml_text;
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

/// The maximum size of a model in bytes after decompression: some 400 times the longest known.
pub const MAX_URDF_BYTES: u64 = 1 << 24;

/// A tree of links connected by joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The robot's name.
    pub name: String,
    /// Names of the links, in the order of the file.
    pub links: Vec<String>,
    /// The shapes of each link that count for collisions, in the order of the file.
    pub collisions: Vec<Vec<Collision>>,
    /// The joints, in the order of the file. Parents and children index [`Model::links`].
    pub joints: Vec<Joint>,
    /// The link that is not the child of any joint.
    pub root: usize,
    /// What of the file was not taken as it stood.
    pub report: ImportReport,
}

/// A connection of one link to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name, which is unique among joints.
    pub name: String,
    /// The motion of the child.
    pub kind: JointKind,
    /// The link that it is mounted on, as an index of [`Model::links`].
    pub parent: usize,
    /// The link that it carries, as an index of [`Model::links`].
    pub child: usize,
    /// The joint's frame in the parent's frame.
    pub origin: Origin,
    /// Unit vector in the joint's frame, about or along which it moves; (1, 0, 0) where it has no
    /// axis.
    pub axis: [f64; 3],
    /// Lowest and highest value, in rad or m; `None` for joints without such limits. The soft limits of a
    /// `<safety_controller>` narrow them. An end that the file gives as a number beyond 1e6 is no limit, and 1e6 if
    /// only one end is so.
    pub limits: Option<Limits>,
    /// Highest speed, in rad/s or m/s; `None` where the file gives none, or what many files have for that: 0, a
    /// negative number or one beyond 1e6.
    pub max_speed: Option<f64>,
    /// The joint that this one follows.
    pub mimic: Option<Mimic>,
}

/// A frame in another: rotated by `rpy_rad`, then moved by `xyz_m`.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Origin {
    /// Displacement, in meters.
    pub xyz_m: [f64; 3],
    /// Roll, pitch and yaw about the fixed axes x, y, z in rad: R = Rz(yaw) Ry(pitch) Rx(roll).
    pub rpy_rad: [f64; 3],
}

/// The motion of a joint's child.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Rotation about the axis, between limits in rad.
    Revolute,
    /// Rotation about the axis, without limits.
    Continuous,
    /// Translation along the axis, between limits in m.
    Prismatic,
    /// Motion in all six degrees of freedom.
    Floating,
    /// Motion in the plane perpendicular to the axis.
    Planar,
}

/// A closed range, in rad or m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lowest value.
    pub lower: f64,
    /// Highest value, not below `lower`.
    pub upper: f64,
}

impl Limits {
    /// Returns whether `value` is in the range, up to the rounding of a printed value.
    pub fn contains(&self, value: f64) -> bool {
        const SLACK: f64 = 1e-9;
        (self.lower - SLACK..=self.upper + SLACK).contains(&value)
    }
}

/// A joint's value as a function of another's: `multiplier * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// Index of the other joint in [`Model::joints`].
    pub joint: usize,
    /// The factor on its value.
    pub multiplier: f64,
    /// The offset, in rad or m.
    pub offset: f64,
}

impl JointKind {
    /// Returns whether a single value determines the position of the child.
    pub fn has_one_value(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous | Self::Prismatic)
    }
}

impl Model {
    /// Reads the URDF file at `path`, plain or compressed with gzip.
    ///
    /// # Errors
    /// When the file cannot be read, has xacro where joints may need it, is not URDF, or does not describe a tree of
    /// links; with file, line and column.
    pub fn load(path: &Path) -> Result<Self, InputError> {
        let place = path.display().to_string();
        if place.trim_end_matches(".gz").ends_with(".xacro") {
            return Err(InputError::new(&place, xacro::CAUSE, xacro::REMEDY));
        }
        Self::parse(&place, &read_xml_text(path, MAX_URDF_BYTES)?)
    }

    /// Reads the text of a URDF file; `place` is its name in errors.
    ///
    /// # Errors
    /// Those of [`Model::load`], except for reading.
    pub fn parse(place: &str, text: &str) -> Result<Self, InputError> {
        read::model(place, text)
    }

    /// Returns the index of the link called `name`, which was read from `place` (a file or an
    /// option).
    ///
    /// # Errors
    /// When there is none; the error suggests the nearest name.
    pub fn link(&self, place: &str, name: &str) -> Result<usize, InputError> {
        self.links.iter().position(|link| link == name).ok_or_else(|| {
            let known: Vec<&str> = self.links.iter().map(String::as_str).collect();
            let cause = format!("`{}` has no link `{name}`", self.name);
            InputError::new(place, cause, suggestion(name, &known))
        })
    }

    /// Returns the index of the joint called `name`, which was read from `place` (a file or an
    /// option).
    ///
    /// # Errors
    /// When there is none; the error suggests the nearest name.
    pub fn joint(&self, place: &str, name: &str) -> Result<usize, InputError> {
        self.joints.iter().position(|joint| joint.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.joints.iter().map(|j| j.name.as_str()).collect();
            let cause = format!("`{}` has no joint `{name}`", self.name);
            InputError::new(place, cause, suggestion(name, &known))
        })
    }

    /// Returns the joint that carries `link`; `None` for the root.
    pub fn parent_joint(&self, link: usize) -> Option<usize> {
        self.joints.iter().position(|joint| joint.child == link)
    }
}
