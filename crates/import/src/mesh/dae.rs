//! Collada meshes (DAE): the vertices of all geometries of a scene, where its nodes place them.
//!
//! As in `RViz`, the unit of the file counts and its upward axis does not: URDF has the axes of its own file. Skins,
//! and shapes that are no meshes, are not read.

use std::collections::BTreeMap;

use super::Mesh;
use crate::xml::{Element, XmlFile, XmlSource};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin};

/// The maximum size of a file in bytes: the elements of a document are kept in memory.
const MAX_DAE_BYTES: usize = 1 << 26;
/// The maximum depth of nodes in each other, also of those that refer to others.
const MAX_NODES_DEEP: usize = 64;
/// The maximum number of vertices and of places of geometries, of which files may multiply few.
const MAX_POINTS: usize = 1 << 23;
const MAX_NODES: usize = 1 << 16;

/// Returns the vertices of the mesh in `bytes`; errors call it `place`.
///
/// # Errors
/// When it is no Collada file, a reference leads nowhere, a number is none, or there is no vertex; with line and
/// column.
pub fn parse(place: &str, bytes: &[u8]) -> Result<Mesh, InputError> {
    if bytes.len() > MAX_DAE_BYTES {
        let cause = format!("has {} bytes, more than {MAX_DAE_BYTES}", bytes.len());
        return Err(InputError::new(place, cause, "save the mesh as binary STL"));
    }
    let text = String::from_utf8_lossy(bytes);
    let source = XmlSource::new(place, &text)?;
    let file = XmlFile::parse(&source)?;
    let root = file.root("COLLADA")?;
    let unit_m = unit_m(root)?;
    let scale_m = unit_m.unwrap_or(1.0);
    let mut reader = SceneReader {
        elements: BTreeMap::new(),
        geometries: BTreeMap::new(),
        nodes: 0,
        points: Vec::new(),
    };
    for element in root.descendants() {
        if let Some(id) = element.attribute("id") {
            reader.elements.insert(id.text(), element);
        }
    }
    let scale = Placement::scale([scale_m; 3]);
    for scene in reader.scenes(root)? {
        for node in scene.children("node") {
            reader.add_node(node, scale, 0)?;
        }
    }
    let mut mesh = Mesh::new(place, reader.points)?;
    mesh.unit_m = unit_m;
    let up = asset(root).and_then(|asset| asset.children("up_axis").next());
    let up =
        up.map(|up| up.text().trim().to_owned()).filter(|up| !["", "Z_UP"].contains(&up.as_str()));
    mesh.not_used.extend(up.map(|up| format!("the upward axis {}, as in RViz", up.escape_debug())));
    Ok(mesh)
}

fn asset(root: Element<'_>) -> Option<Element<'_>> {
    root.children("asset").next()
}

/// Returns the unit of the file in meters, where it gives one.
fn unit_m(root: Element) -> Result<Option<f64>, InputError> {
    let unit = asset(root).and_then(|asset| asset.children("unit").next());
    let Some(value) = unit.and_then(|unit| unit.attribute("meter")) else { return Ok(None) };
    let unit_m = value.number()?;
    if unit_m > 0.0 {
        return Ok(Some(unit_m));
    }
    Err(value.error(format!("a unit of {unit_m} m"), "write the meters of a unit, such as 0.001"))
}

/// A linear map and a displacement: the upper three rows of a matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Placement([[f64; 4]; 3]);

impl Placement {
    const IDENTITY: Self = Self::scale([1.0; 3]);

    const fn scale([x, y, z]: [f64; 3]) -> Self {
        Self([[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0]])
    }

    const fn translation([x, y, z]: [f64; 3]) -> Self {
        Self([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]])
    }

    /// Returns a turn about an axis, which needs a direction.
    fn rotation(axis: [f64; 3], angle_deg: f64) -> Option<Self> {
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let [x, y, z] = axis.map(|x| x / length);
        let s = sin(angle_deg.to_radians());
        let c = cos(angle_deg.to_radians());
        let d = 1.0 - c;
        Some(Self([
            [c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0.0],
            [y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0.0],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0.0],
        ]))
    }

    /// Returns the placement of something placed by `inner` in a frame placed by this one.
    fn compose(&self, inner: &Self) -> Self {
        Self(self.0.map(|row| {
            let column = |j: usize| (0..3).map(|k| row[k] * inner.0[k][j]).sum::<f64>();
            [column(0), column(1), column(2), column(3) + row[3]]
        }))
    }

    fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        self.0.map(|row| row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3])
    }
}

struct SceneReader<'a> {
    /// All elements by their ids.
    elements: BTreeMap<&'a str, Element<'a>>,
    /// The vertices of geometries that were read, by their ids.
    geometries: BTreeMap<&'a str, Vec<[f64; 3]>>,
    nodes: usize,
    points: Vec<[f64; 3]>,
}

impl<'a> SceneReader<'a> {
    /// Returns the scene that the file shows; all scenes where it names none.
    fn scenes(&self, root: Element<'a>) -> Result<Vec<Element<'a>>, InputError> {
        let shown = root.children("scene").next();
        if let Some(shown) = shown.and_then(|scene| scene.children("instance_visual_scene").next())
        {
            return Ok(vec![self.referred(shown, "url")?.1]);
        }
        let libraries = root.children("library_visual_scenes");
        Ok(libraries.flat_map(|library| library.children("visual_scene")).collect())
    }

    /// Returns the element that an attribute refers to, and its id.
    fn referred(
        &self,
        element: Element<'a>,
        attribute: &str,
    ) -> Result<(&'a str, Element<'a>), InputError> {
        let value = element.required(attribute)?;
        let id = value.text().trim_start_matches('#');
        let found = self.elements.get_key_value(id);
        found.map(|(id, element)| (*id, *element)).ok_or_else(|| {
            let cause = format!("nothing has the id `{id}`");
            value.error(cause, "save the mesh again, with everything in one file")
        })
    }

    /// Adds the vertices of a node and of all nodes in it.
    fn add_node(
        &mut self,
        node: Element<'a>,
        outer: Placement,
        depth: usize,
    ) -> Result<(), InputError> {
        self.nodes += 1;
        if depth > MAX_NODES_DEEP || self.nodes > MAX_NODES {
            let cause = format!("more than {MAX_NODES} nodes, or {MAX_NODES_DEEP} in each other");
            return Err(node.error(cause, "save the mesh as binary STL"));
        }
        let here = outer.compose(&own_placement(node)?);
        for geometry in node.children("instance_geometry") {
            self.add_geometry(geometry, here)?;
        }
        for inner in node.children("node") {
            self.add_node(inner, here, depth + 1)?;
        }
        for instance in node.children("instance_node") {
            let inner = self.referred(instance, "url")?.1;
            self.add_node(inner, here, depth + 1)?;
        }
        Ok(())
    }

    fn add_geometry(&mut self, instance: Element<'a>, here: Placement) -> Result<(), InputError> {
        let (id, geometry) = self.referred(instance, "url")?;
        if !self.geometries.contains_key(id) {
            let points = self.points_of_geometry(geometry)?;
            self.geometries.insert(id, points);
        }
        let points = &self.geometries[id];
        if self.points.len() + points.len() > MAX_POINTS {
            let cause = format!("more than {MAX_POINTS} vertices");
            return Err(instance.error(cause, "save a mesh with fewer triangles"));
        }
        self.points.extend(points.iter().map(|point| here.apply(*point)));
        Ok(())
    }

    fn points_of_geometry(&self, geometry: Element<'a>) -> Result<Vec<[f64; 3]>, InputError> {
        let mut points = Vec::new();
        let meshes = geometry.children("mesh");
        let vertices = meshes.flat_map(|mesh| mesh.children("vertices"));
        for input in vertices.flat_map(|vertices| vertices.children("input")) {
            if input.attribute("semantic").is_some_and(|name| name.text() == "POSITION") {
                points.extend(points_of_source(self.referred(input, "source")?.1)?);
            }
        }
        Ok(points)
    }
}

/// Returns the placement of a node in the one around it: all of its transformations, the first one outermost.
fn own_placement(node: Element) -> Result<Placement, InputError> {
    let mut placement = Placement::IDENTITY;
    for element in node.child_elements() {
        let next = match element.name() {
            "matrix" => {
                let m = exact_numbers::<16>(element)?;
                Placement([0, 4, 8].map(|i| [m[i], m[i + 1], m[i + 2], m[i + 3]]))
            }
            "translate" => Placement::translation(exact_numbers(element)?),
            "scale" => Placement::scale(exact_numbers(element)?),
            "rotate" => {
                let [x, y, z, angle_deg] = exact_numbers(element)?;
                Placement::rotation([x, y, z], angle_deg).ok_or_else(|| {
                    element.error("a turn about an axis of no direction", "give three numbers")
                })?
            }
            "lookat" | "skew" => {
                let cause = format!("a node with <{}>, which is not read", element.name());
                return Err(element.error(cause, "save the mesh as binary STL"));
            }
            _ => continue,
        };
        placement = placement.compose(&next);
    }
    Ok(placement)
}

fn points_of_source(source: Element) -> Result<Vec<[f64; 3]>, InputError> {
    let Some(array) = source.children("float_array").next() else {
        return Err(source.error("vertices without a <float_array>", "save the mesh again"));
    };
    let technique = source.children("technique_common").next();
    let accessor = technique.and_then(|technique| technique.children("accessor").next());
    let integer = |name: &str, default: usize| -> Result<usize, InputError> {
        let Some(value) = accessor.and_then(|accessor| accessor.attribute(name)) else {
            return Ok(default);
        };
        value.text().parse().map_err(|_| value.error("is no whole number", "write digits"))
    };
    let stride = integer("stride", 3)?;
    let offset = integer("offset", 0)?;
    if stride < 3 {
        return Err(source.error("vertices of less than three numbers", "save the mesh again"));
    }
    let numbers = numbers(array)?;
    let whole = numbers.get(offset..).unwrap_or(&[]).chunks_exact(stride);
    Ok(whole.map(|point| [point[0], point[1], point[2]]).collect())
}

fn numbers(element: Element) -> Result<Vec<f64>, InputError> {
    let words = element.text().split_ascii_whitespace();
    let numbers = words.map(|word| word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or(word));
    numbers.collect::<Result<_, _>>().map_err(|word: &str| {
        let word: String = word.chars().take(40).collect();
        element.error(format!("`{word}` is no finite number"), "save the mesh again")
    })
}

fn exact_numbers<const N: usize>(element: Element) -> Result<[f64; N], InputError> {
    numbers(element)?.try_into().map_err(|numbers: Vec<f64>| {
        let cause = format!("<{}> has {} numbers, not {N}", element.name(), numbers.len());
        element.error(cause, "save the mesh again")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle, which the node in a node places.
    const DAE: &str = r##"<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.5"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0  1 0 0  0 2 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"/></technique_common></source>
<source id="n"><float_array id="b" count="3">9 9 9</float_array></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="outer">
<translate>0 0 4</translate>
<node><rotate>0 0 2 90</rotate><scale>2 1 1</scale><instance_geometry url="#g"/></node>
</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"##;

    fn read(text: &str) -> Result<Mesh, InputError> {
        parse("a.dae", text.as_bytes())
    }

    #[test]
    fn nodes_place_a_geometry_in_the_unit_of_the_file() {
        let mesh = read(DAE).expect("a mesh");
        assert_eq!(mesh.unit_m, Some(0.5));
        let expected = [[-1.0, 0.0, 2.0], [0.0, 0.0, 2.0], [0.0, 1.0, 2.0]];
        assert_eq!(mesh.points_m.len(), expected.len());
        for (point, expected) in mesh.points_m.iter().zip(expected) {
            let error_m = (0..3).map(|i| (point[i] - expected[i]).abs()).fold(0.0, f64::max);
            assert!(error_m < 1e-15, "{:?}", mesh.points_m);
        }
        let plain = read(&DAE.replace("0.5\"", "1\"")).expect("a mesh");
        assert_eq!(
            (plain.unit_m, plain.not_used),
            (Some(1.0), vec!["the upward axis Y_UP, as in RViz".to_string()])
        );
        let unsaid = read(&DAE.replace(" meter=\"0.5\"", "")).expect("a mesh");
        assert_eq!(unsaid.unit_m, None);
        // The same by a matrix, and by a node of a library.
        let matrix = "<matrix>0 -1 0 0  2 0 0 0  0 0 1 0  0 0 0 1</matrix>";
        let by_matrix = DAE.replace("<rotate>0 0 2 90</rotate><scale>2 1 1</scale>", matrix);
        assert_eq!(read(&by_matrix).expect("a mesh").bounds_m(), [expected[0], expected[2]]);
        let nodes = "<library_nodes><node id=\"l\"><instance_geometry url=\"#g\"/></node></library_nodes><scene>";
        let by_library = by_matrix
            .replace("<instance_geometry url=\"#g\"/>", "<instance_node url=\"#l\"/>")
            .replace("<scene>", nodes);
        assert_eq!(read(&by_library), read(&by_matrix));
    }

    #[test]
    fn damaged_meshes_are_errors_with_their_places() {
        for (old, new, cause) in [
            ("url=\"#g\"", "url=\"#h\"", "nothing has the id `h`"),
            ("source=\"#p\"", "source=\"#q\"", "nothing has the id `q`"),
            ("0 2 0<", "0 2 x<", "`x` is no finite number"),
            ("0 2 0<", "0 2 nan<", "`nan` is no finite number"),
            ("<translate>0 0 4", "<translate>0 0", "<translate> has 2 numbers"),
            ("<rotate>0 0 2", "<rotate>0 0 0", "no direction"),
            ("meter=\"0.5\"", "meter=\"0\"", "a unit of 0 m"),
            ("stride=\"3\"", "stride=\"2\"", "less than three numbers"),
            ("<instance_geometry url=\"#g\"/>", "", "no triangles"),
            ("<scale>2 1 1</scale>", "<skew>1</skew>", "<skew>, which is not read"),
            ("<instance_geometry url=\"#g\"/>", "<instance_node url=\"#outer\"/>", "in each other"),
            ("COLLADA", "robot", "<robot>, not <COLLADA>"),
        ] {
            let error = read(&DAE.replace(old, new)).expect_err(cause);
            assert!(error.cause().contains(cause), "{error}");
        }
    }
}
