//! Collision shapes of links, and meshes as their convex hulls.

use super::mesh_files::find_mesh;
use super::{Model, Origin};
use crate::mesh::Mesh;
use crate::{ImportReport, Treatment};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A shape that is fixed in a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Collision {
    /// The shape's frame in the link's.
    pub origin: Origin,
    /// As the model gives it; a mesh is not opened yet.
    pub shape: Shape,
}

/// A shape as the model gives it, its center at the origin of its frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// The convex hull of points, in place of a mesh that was read.
    Hull {
        /// The points in m, about the middle of the box around them.
        points_m: Vec<[f64; 3]>,
    },
    /// A kind that is not read, such as a capsule.
    Other {
        /// Its name in the file.
        kind: String,
    },
}

/// A shape that takes up space: a ball, a cylinder about z, a box or a convex hull.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Solid {
    /// Index of its link in [`Model::links`].
    pub link: usize,
    /// The frame of the model's shape, in the link's.
    pub origin: Origin,
    /// Its center in that frame: zero except for meshes.
    pub center_m: [f64; 3],
    /// The shape; never a mesh.
    pub shape: Shape,
}

impl Solid {
    /// Returns whether all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        let own = self.origin.xyz_m.iter().chain(&self.origin.rpy_rad).chain(&self.center_m);
        let shape: Vec<f64> = match &self.shape {
            Shape::Sphere { radius_m } => vec![*radius_m],
            Shape::Cylinder { radius_m, length_m } => vec![*radius_m, *length_m],
            Shape::Box { size_m } => size_m.to_vec(),
            Shape::Hull { points_m } => points_m.concat(),
            Shape::Mesh { scale, .. } => scale.to_vec(),
            Shape::Other { .. } => Vec::new(),
        };
        own.copied().chain(shape).all(f64::is_finite)
    }
}

/// The solids of a model, and what is said of shapes that are not among them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solids {
    /// All solids, in the order of links.
    pub solids: Vec<Solid>,
    /// Shapes that could not be read, and choices that were made.
    pub report: ImportReport,
}

/// The lengths in m beyond which a mesh is in millimeters, and has no scale that says so.
const MAX_MESH_M: f64 = 50.0;

/// The maximum number of points of all meshes of a model.
const MAX_POINTS: usize = 1 << 23;

impl Model {
    /// Returns the solids of all links. Meshes (STL, OBJ and DAE) are replaced by their convex hulls. They are searched
    /// for next to `urdf`, the model's own file, and for `package://NAME/REST` in the folders above it; they have to
    /// lie in the package of the model, or in the one that they name. A mesh that cannot be read is left out and said.
    pub fn solids(&self, urdf: &Path) -> Solids {
        let mut reader = SolidReader {
            urdf,
            meshes: BTreeMap::new(),
            points: 0,
            solids: Vec::new(),
            report: ImportReport::new("collision shapes"),
        };
        for (link, shapes) in self.collisions.iter().enumerate() {
            for collision in shapes {
                reader.add(link, &self.links[link], collision);
            }
        }
        let SolidReader { solids, mut report, .. } = reader;
        let hulls = solids.iter().filter(|solid| matches!(solid.shape, Shape::Hull { .. }));
        report.add_kept("meshes", hulls.count());
        report.add_kept("shapes", solids.len());
        Solids { solids, report }
    }
}

struct SolidReader<'a> {
    urdf: &'a Path,
    /// The meshes that were read, by the names in the model: links share them.
    meshes: BTreeMap<String, Result<Mesh, String>>,
    /// Number of points of all solids.
    points: usize,
    solids: Vec<Solid>,
    report: ImportReport,
}

impl SolidReader<'_> {
    fn add(&mut self, link: usize, name: &str, collision: &Collision) {
        let Collision { origin, shape } = collision;
        let (center_m, shape) = match shape {
            Shape::Mesh { file, scale } => match self.hull(file, *scale) {
                Ok(hull) => hull,
                Err(reason) => {
                    let place = format!("`{name}` ({file}: {reason})");
                    let remedy = "put the mesh there, as STL, OBJ or DAE";
                    let rule = "collision shapes whose mesh is not read";
                    self.report.record(Treatment::Dropped, rule, place, remedy);
                    return;
                }
            },
            Shape::Other { kind } => {
                let place = format!("`{name}` (a {kind} is not read)");
                let rule = "collision shapes of a kind that is not read";
                self.report.record(Treatment::Dropped, rule, place, "");
                return;
            }
            known => ([0.0; 3], known.clone()),
        };
        self.solids.push(Solid { link, origin: *origin, center_m, shape });
    }

    /// Returns the convex hull of a mesh and its center, or the reason why there is none.
    fn hull(&mut self, file: &str, scale: [f64; 3]) -> Result<([f64; 3], Shape), String> {
        let urdf = self.urdf;
        let mesh = self.meshes.entry(file.to_owned()).or_insert_with(|| {
            let path = find_mesh(urdf, file)?;
            Mesh::load(&path).map_err(|error| error.cause().to_owned())
        });
        let mesh = mesh.as_ref().map_err(Clone::clone)?;
        self.points += mesh.points_m.len();
        if self.points > MAX_POINTS {
            return Err(format!("the meshes have more than {MAX_POINTS} points in all"));
        }
        for what in &mesh.not_used {
            self.report.record(
                Treatment::NotUsed,
                format!("of a mesh, {what}"),
                format!("`{file}`"),
                "",
            );
        }
        if let Some(unit_m) = mesh.unit_m.filter(|unit_m| *unit_m != 1.0) {
            let rule = format!("the unit of a mesh, {unit_m} m, counts as in RViz");
            let remedy = "save the mesh in meters, because some programs ignore its unit";
            self.report.record(Treatment::Guessed, rule, format!("`{file}`"), remedy);
        }
        if scale.contains(&0.0) {
            let rule = "meshes with a scale of 0, which have no inside";
            self.report.record(Treatment::Suspicious, rule, format!("`{file}`"), "");
        }
        let [low, high] = mesh.bounds_m();
        let ends = [0, 1, 2].map(|i| [low[i] * scale[i], high[i] * scale[i]]);
        if ends.iter().any(|[a, b]| (b - a).abs() > MAX_MESH_M) {
            let rule = format!("meshes larger than {MAX_MESH_M} m, which look like millimeters");
            let remedy = "write scale=\"0.001 0.001 0.001\" into <mesh>";
            self.report.record(Treatment::Suspicious, rule, format!("`{file}`"), remedy);
        }
        let center_m = ends.map(|[a, b]| 0.5 * (a + b));
        let place = |point: &[f64; 3]| [0, 1, 2].map(|i| point[i] * scale[i] - center_m[i]);
        Ok((center_m, Shape::Hull { points_m: mesh.points_m.iter().map(place).collect() }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJ: &str = "v 0 0 0\nv 1000 0 0\nv 0 2000 0\nv 0 0 4000\n";
    const DAE: &str = "<COLLADA><asset><unit meter='0.001'/></asset><geometry id='g'><mesh>\
        <source id='s'><float_array>0 0 0 1000 0 0 0 2000 0 0 0 4000</float_array></source>\
        <vertices><input semantic='POSITION' source='#s'/></vertices></mesh></geometry>\
        <library_visual_scenes><visual_scene><node><instance_geometry url='#g'/></node></visual_scene>\
        </library_visual_scenes></COLLADA>";

    /// The solids of a link with these shapes, in a folder with meshes.
    fn solids(shapes: &str) -> (Vec<Solid>, Vec<String>) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in [("a.obj", OBJ), ("a.dae", DAE), ("cut.stl", "solid"), ("a.ply", "")] {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        let text = format!("<robot name='r'><link name='l'>{shapes}</link></robot>");
        let model = Model::parse("r.urdf", &text).expect("a model");
        let Solids { solids, report } = model.solids(&folder.path().join("r.urdf"));
        (solids, report.findings.iter().map(ToString::to_string).collect())
    }

    fn mesh(file: &str, scale: &str) -> String {
        format!(
            "<collision><geometry><mesh filename='{file}' scale='{scale}'/></geometry></collision>"
        )
    }

    #[test]
    fn a_mesh_is_the_hull_of_its_points_about_their_middle_in_the_scale_of_the_model() {
        let (solids, said) = solids(&mesh("a.obj", "0.001 0.001 -0.001"));
        let [Solid { center_m, shape: Shape::Hull { points_m }, .. }] = &solids[..] else {
            panic!("{solids:?}")
        };
        assert_eq!(*center_m, [0.5, 1.0, -2.0]);
        assert_eq!(points_m.len(), 4);
        assert!(points_m.contains(&[-0.5, -1.0, -2.0]), "{points_m:?}");
        assert_eq!(said, [""; 0]);
    }

    #[test]
    fn what_is_odd_about_a_mesh_is_said() {
        let (found, said) = solids(&mesh("a.dae", "1 1 1"));
        assert_eq!(found[0].center_m, [0.5, 1.0, 2.0]);
        assert!(said[0].starts_with("guessed: the unit of a mesh, 0.001 m, counts"), "{said:?}");
        let (_, said) = solids(&mesh("a.obj", "1 1 1"));
        assert!(said[0].starts_with("suspicious: meshes larger than 50 m"), "{said:?}");
        let (_, said) = solids(&mesh("a.obj", "0 0.001 0.001"));
        assert!(said[0].starts_with("suspicious: meshes with a scale of 0"), "{said:?}");
    }

    #[test]
    fn shapes_that_are_not_read_are_named_with_the_reason() {
        let missing = mesh("package://no/such.stl", "1 1 1");
        let other = mesh("a.ply", "1 1 1");
        let capsule = "<collision><geometry><capsule radius='1'/></geometry></collision>";
        let (solids, said) =
            solids(&[&missing, &other, &mesh("cut.stl", "1 1 1"), capsule].concat());
        assert!(solids.is_empty());
        assert!(
            said[0].starts_with("dropped: collision shapes whose mesh is not read (3 times)"),
            "{said:?}"
        );
        for reason in ["such.stl: the file is absent", "only STL, OBJ and DAE", "cut short"] {
            assert!(said[0].contains(reason), "{said:?}");
        }
        assert!(said[1].contains("`l` (a capsule is not read)"), "{said:?}");
    }
}
