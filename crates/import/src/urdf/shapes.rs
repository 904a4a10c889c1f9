//! Collision shapes of links, and meshes as their bounding boxes.

use super::{Model, Origin};
use crate::stl;
use std::path::{Path, PathBuf};

/// A shape that is fixed in a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Collision {
    /// The shape's frame in the link's.
    pub origin: Origin,
    /// As the model gives it; a mesh is not opened yet.
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
        /// The file as the model refers to it: by a path, or by `package://` or `file://`.
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
    /// The frame of the model's shape, in the link's.
    pub origin: Origin,
    /// Its center in that frame: zero except for the boxes of meshes.
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
    /// which are searched for next to `urdf`, the model's own file, and for `package://NAME/REST` in the
    /// folders above it. A mesh that cannot be read is left out with a remark.
    pub fn solids(&self, urdf: &Path) -> Solids {
        let mut solids = Vec::new();
        let mut mesh_boxes = 0;
        let mut left_out = Vec::new();
        for (link, shapes) in self.collisions.iter().enumerate() {
            for Collision { origin, shape } in shapes {
                let mut center_m = [0.0; 3];
                let mut shape = shape.clone();
                match &shape {
                    Shape::Mesh { file, scale } => match mesh_box(urdf, file, *scale) {
                        Ok(mesh_box) => {
                            mesh_boxes += 1;
                            center_m = mesh_box.center_m;
                            shape = Shape::Box { size_m: mesh_box.size_m };
                        }
                        Err(reason) => {
                            left_out.push(format!("`{}` ({file}: {reason})", self.links[link]));
                            continue;
                        }
                    },
                    Shape::Other { kind } => {
                        left_out.push(format!("`{}` (a {kind} is not read)", self.links[link]));
                        continue;
                    }
                    Shape::Sphere { .. } | Shape::Cylinder { .. } | Shape::Box { .. } => {}
                }
                solids.push(Solid { link, origin: *origin, center_m, shape });
            }
        }
        let mut remarks = Vec::new();
        if mesh_boxes > 0 {
            remarks.push(format!("meshes stand as their bounding boxes: {mesh_boxes}"));
        }
        if !left_out.is_empty() {
            remarks.push(format!("shapes that are left out: {}", left_out.join(", ")));
        }
        Solids { solids, remarks }
    }
}

/// The bounding box of a mesh, in the frame of its coordinates.
struct MeshBox {
    size_m: [f64; 3],
    center_m: [f64; 3],
}

/// Returns the bounding box of a mesh, or the reason why there is none.
fn mesh_box(urdf: &Path, file: &str, scale: [f64; 3]) -> Result<MeshBox, String> {
    let is_stl = Path::new(file.trim_end_matches(".gz"))
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("stl"));
    if !is_stl {
        return Err("only STL meshes are read".into());
    }
    let path = find_mesh(urdf, file).ok_or("the file is absent")?;
    let [low, high] = stl::read_bounds(&path).map_err(|error| error.cause().to_owned())?;
    let ends = [0, 1, 2].map(|i| [low[i] * scale[i], high[i] * scale[i]]);
    // A negative factor mirrors the mesh, and so swaps the ends.
    let size_m = ends.map(|[a, b]| (b - a).abs());
    let center_m = ends.map(|[a, b]| 0.5 * (a + b));
    Ok(MeshBox { size_m, center_m })
}

/// Returns the path of a mesh of a model, if it exists.
fn find_mesh(urdf: &Path, file: &str) -> Option<PathBuf> {
    let folder = urdf.parent().unwrap_or(Path::new(""));
    if let Some(path) = file.strip_prefix("file://") {
        return Some(PathBuf::from(path)).filter(|path| path.is_file());
    }
    let Some(package_path) = file.strip_prefix("package://") else {
        return Some(folder.join(file)).filter(|path| path.is_file());
    };
    // There is no index of packages without ROS: the package is a folder above the model, or a neighbor of one.
    let path_in_package = package_path.split_once('/').map_or("", |(_, rest)| rest);
    let folder = std::path::absolute(folder).ok()?;
    folder
        .ancestors()
        .flat_map(|above| [above.join(package_path), above.join(path_in_package)])
        .find(|path| path.is_file())
}
