//! Collision shapes of links, and meshes as their bounding boxes.

use super::{Model, Origin};
use crate::stl;
use std::path::{Path, PathBuf};

/// A shape that is fixed in a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Collision {
    /// The shape's frame in the link's.
    pub origin: Origin,
    /// The shape.
    pub shape: Shape,
}

/// A shape as the model gives it, its center at the origin of its frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Radius in m.
        radius_m: f64,
    },
    /// A cylinder about the axis z.
    Cylinder {
        /// Radius in m.
        radius_m: f64,
        /// Length along the axis in m.
        length_m: f64,
    },
    /// A box along the axes.
    Box {
        /// Lengths of its edges in m.
        size_m: [f64; 3],
    },
    /// A mesh in a file.
    Mesh {
        /// The file as the model names it: a path, or `package://` or `file://`.
        file: String,
        /// Factors of its coordinates, which are then in m.
        scale: [f64; 3],
    },
    /// A kind that is not read, such as a capsule.
    Other {
        /// Its name in the file.
        kind: String,
    },
}

/// A shape that takes up space: a ball, a cylinder about z or a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Index of its link in [`Model::links`].
    pub link: usize,
    /// The frame of the shape that the model gives, in the link's.
    pub origin: Origin,
    /// Its center in that frame: zero but for the boxes of meshes.
    pub center_m: [f64; 3],
    /// The shape; never a mesh.
    pub shape: Shape,
}

/// The solids of a model, and remarks on shapes that are not among them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solids {
    /// All solids, in the order of links.
    pub solids: Vec<Solid>,
    /// Sentences for people: meshes that became boxes, and shapes that could not be read.
    pub remarks: Vec<String>,
}

impl Model {
    /// Returns the solids of all links. Meshes are replaced by their bounding boxes: STL files,
    /// which are looked for beside `urdf`, the model's own file, and for `package://NAME/REST` in the
    /// folders above it. A mesh that cannot be read is left out with a remark.
    pub fn solids(&self, urdf: &Path) -> Solids {
        let mut found = Solids::default();
        let (mut boxes, mut lost) = (0, Vec::new());
        for (link, shapes) in self.collisions.iter().enumerate() {
            for Collision { origin, shape } in shapes {
                let (shape, center_m) = match shape {
                    Shape::Mesh { file, scale } => match mesh_box(urdf, file, *scale) {
                        Ok(found) => {
                            boxes += 1;
                            found
                        }
                        Err(why) => {
                            lost.push(format!("`{}` ({file}: {why})", self.links[link]));
                            continue;
                        }
                    },
                    Shape::Other { kind } => {
                        lost.push(format!("`{}` (a {kind} is not read)", self.links[link]));
                        continue;
                    }
                    solid => (solid.clone(), [0.0; 3]),
                };
                found.solids.push(Solid { link, origin: *origin, center_m, shape });
            }
        }
        if boxes > 0 {
            found.remarks.push(format!("meshes stand as their bounding boxes: {boxes}"));
        }
        if !lost.is_empty() {
            found.remarks.push(format!("shapes that are left out: {}", lost.join(", ")));
        }
        found
    }
}

/// Returns the bounding box of a mesh and its center, or the reason why there is none.
fn mesh_box(urdf: &Path, file: &str, scale: [f64; 3]) -> Result<(Shape, [f64; 3]), String> {
    let is_stl = Path::new(file.trim_end_matches(".gz"))
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("stl"));
    if !is_stl {
        return Err("only STL meshes are read".into());
    }
    let path = find_mesh(urdf, file).ok_or("the file is absent")?;
    let [low, high] = stl::read_bounds(&path).map_err(|error| error.cause().to_owned())?;
    let ends = [0, 1, 2].map(|i| [low[i] * scale[i], high[i] * scale[i]]);
    let size_m = ends.map(|[a, b]| (b - a).abs());
    Ok((Shape::Box { size_m }, ends.map(|[a, b]| 0.5 * (a + b))))
}

/// Returns the path of a mesh that a model names, if it exists.
fn find_mesh(urdf: &Path, file: &str) -> Option<PathBuf> {
    let folder = urdf.parent().unwrap_or(Path::new(""));
    let is_there = |path: &PathBuf| path.is_file();
    if let Some(path) = file.strip_prefix("file://") {
        return Some(PathBuf::from(path)).filter(is_there);
    }
    let Some(named) = file.strip_prefix("package://") else {
        return Some(folder.join(file)).filter(is_there);
    };
    // The package is a folder above the model, or stands beside one.
    let rest = named.split_once('/').map_or("", |(_, rest)| rest);
    let folder = std::path::absolute(folder).ok()?;
    folder.ancestors().flat_map(|above| [above.join(named), above.join(rest)]).find(is_there)
}
