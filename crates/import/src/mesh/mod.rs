//! Meshes as the points of which they are the surface: STL, OBJ and Collada (DAE).
//!
//! Only the vertices are read. What takes up space is their convex hull, which needs no triangles.

pub mod dae;
pub mod obj;
pub mod stl;

use std::path::Path;

use crate::extension::extension;
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_bytes;

/// The maximum size of a mesh in bytes after decompression: some 10 times the largest known.
const MAX_MESH_BYTES: u64 = 1 << 28;

/// The maximum of a coordinate: a larger one is damage, and would make all others meaningless.
const MAX_COORDINATE: f64 = 1e9;

/// The kinds of meshes that are read, by the extensions of their files.
pub const EXTENSIONS: [&str; 3] = ["stl", "obj", "dae"];

/// The vertices of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Its vertices, each once and in ascending order, in the unit of the file; in meters where that says its unit.
    pub points_m: Vec<[f64; 3]>,
    /// The unit that the file says, in meters; `None` where it says none.
    pub unit_m: Option<f64>,
    /// What of the file is not read though it has a meaning, as subjects of sentences.
    pub not_used: Vec<String>,
}

impl Mesh {
    /// Returns a mesh in meters.
    fn new(place: &str, mut points_m: Vec<[f64; 3]>) -> Result<Self, InputError> {
        let remedy = "save the mesh again as binary STL";
        if points_m.is_empty() {
            return Err(InputError::new(place, "has no triangles", remedy));
        }
        if points_m.iter().flatten().any(|x| x.is_nan() || x.abs() > MAX_COORDINATE) {
            let cause = "has a vertex with an impossible coordinate";
            return Err(InputError::new(place, cause, remedy));
        }
        points_m.iter_mut().flatten().for_each(|x| *x += 0.0);
        points_m.sort_unstable_by(|a, b| {
            let axes = (0..3).map(|i| a[i].total_cmp(&b[i]));
            axes.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        });
        points_m.dedup();
        Ok(Self { points_m, unit_m: None, not_used: Vec::new() })
    }

    /// Reads the mesh at `path`, also with gzip; its extension is one of [`EXTENSIONS`].
    ///
    /// # Errors
    /// When the extension is another one, or the file cannot be read, is none of that kind, is cut short, or has no
    /// vertex with finite coordinates.
    pub fn load(path: &Path) -> Result<Self, InputError> {
        let place = path.display().to_string();
        let parse: fn(&str, &[u8]) -> Result<Self, InputError> = match extension(path).as_str() {
            "stl" => stl::parse,
            "obj" => obj::parse,
            "dae" => dae::parse,
            _ => {
                let cause = "only STL, OBJ and DAE meshes are read";
                return Err(InputError::new(place, cause, "save the mesh as binary STL"));
            }
        };
        parse(&place, &read_bytes(path, MAX_MESH_BYTES)?)
    }

    /// Returns the lowest and the highest coordinates.
    pub fn bounds_m(&self) -> [[f64; 3]; 2] {
        let mut bounds = [self.points_m[0]; 2];
        for point in &self.points_m {
            for i in 0..3 {
                bounds[0][i] = bounds[0][i].min(point[i]);
                bounds[1][i] = bounds[1][i].max(point[i]);
            }
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_extension_says_how_to_read() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("A.OBJ"), "v 1 2 3\nv 0 0 -0\n").expect("written");
        let mesh = Mesh::load(&path("A.OBJ")).expect("a mesh");
        assert_eq!(mesh.points_m, [[0.0; 3], [1.0, 2.0, 3.0]]);
        assert_eq!(mesh.bounds_m(), [[0.0; 3], [1.0, 2.0, 3.0]]);
        assert!(Mesh::load(&path("a.ply")).expect_err("ply").cause().contains("STL, OBJ and DAE"));
        assert!(Mesh::load(&path("none.stl")).is_err());
    }

    /// Pieces of files of all three kinds.
    fn piece() -> impl Strategy<Value = &'static str> {
        prop_oneof![
            Just("solid "),
            Just("vertex "),
            Just("1 2 3 "),
            Just("endsolid "),
            Just("\nv "),
            Just("\n"),
            Just("nan "),
            Just("-1e300 "),
            Just("<COLLADA>"),
            Just("</COLLADA>"),
            Just("<node id='a'>"),
            Just("</node>"),
            Just("<library_visual_scenes><visual_scene>"),
            Just("<matrix>"),
            Just("</matrix>"),
            Just("</visual_scene></library_visual_scenes>"),
            Just("<instance_node url='#a'/>"),
            Just("<instance_geometry url='#g'/>"),
            Just("<geometry id='g'><mesh><vertices>"),
            Just("<input semantic='POSITION' source='#s'/>"),
            Just("</vertices></mesh></geometry>"),
            Just("<source id='s'><float_array>"),
            Just("</float_array></source>"),
            Just("<rotate>"),
        ]
    }

    proptest! {
        #[test]
        fn no_text_and_no_bytes_panic_the_readers(
            pieces in proptest::collection::vec(piece(), 0..40),
            bytes in proptest::collection::vec(any::<u8>(), 0..300),
        ) {
            let text = pieces.concat();
            let whole = format!("<COLLADA>{text}</COLLADA>");
            for data in [text.as_bytes(), whole.as_bytes(), &bytes] {
                for parse in [stl::parse, obj::parse, dae::parse] {
                    if let Ok(mesh) = parse("f", data) {
                        prop_assert!(mesh.points_m.iter().flatten().all(|x| x.is_finite()));
                    }
                }
            }
        }
    }
}
