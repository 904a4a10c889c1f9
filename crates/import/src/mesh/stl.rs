//! STL meshes, binary and ASCII.
//!
//! Only the vertices are needed, for which the format is too simple for a library: 80 bytes of
//! header, the number of triangles, and 50 bytes for each; or words, of which three numbers follow
//! each `vertex`.

use super::Mesh;
use sidestep_kernel::InputError;

/// Bytes before the first triangle: 80 of any text, and the number of triangles.
const HEADER_BYTES: usize = 84;
/// Bytes of a triangle: its normal and three vertices, of three 32-bit floats each, and 2 bytes of attributes.
const TRIANGLE_BYTES: usize = 50;

/// Returns the vertices of the mesh in `bytes`; errors call it `place`.
///
/// # Errors
/// When it is no STL mesh, is cut short, or has no vertex with finite coordinates.
pub fn parse(place: &str, bytes: &[u8]) -> Result<Mesh, InputError> {
    let whole = binary(bytes, usize::eq).or_else(|| ascii(bytes));
    let is_whole = whole.is_some();
    // Some programs leave bytes of their own behind the triangles, and some count fewer triangles than there are.
    let points_m = whole.or_else(|| binary(bytes, usize::gt));
    let points_m = points_m.ok_or_else(|| {
        let remedy = "save the mesh again as binary or ASCII STL";
        InputError::new(place, "is no STL mesh, or cut short", remedy)
    })?;
    let n = points_m.len() / 3;
    let mut mesh = Mesh::new(place, points_m)?;
    if !is_whole {
        let rest = bytes.len() - HEADER_BYTES - n * TRIANGLE_BYTES;
        mesh.not_used.push(format!("{rest} bytes behind the {n} triangles that the file counts"));
    }
    Ok(mesh)
}

/// Reads a binary mesh; `None` if its size does not compare so to that of its triangles. Some start with the word
/// `solid` like ASCII ones, so only the size distinguishes the two.
fn binary(bytes: &[u8], compares: fn(&usize, &usize) -> bool) -> Option<Vec<[f64; 3]>> {
    let count = u32::from_le_bytes(bytes.get(80..HEADER_BYTES)?.try_into().ok()?) as usize;
    let end = count.checked_mul(TRIANGLE_BYTES)?.checked_add(HEADER_BYTES)?;
    if count == 0 || !compares(&bytes.len(), &end) {
        return None;
    }
    let mut vertices = Vec::with_capacity(3 * count);
    for triangle in bytes[HEADER_BYTES..end].chunks_exact(TRIANGLE_BYTES) {
        // The normal, which many programs do not fill in, is the first of the four.
        vertices.extend([12, 24, 36].map(|offset| read_vertex(&triangle[offset..])));
    }
    Some(vertices)
}

fn read_vertex(bytes: &[u8]) -> [f64; 3] {
    [0, 4, 8].map(|k| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[k + i]))))
}

/// Reads an ASCII mesh; `None` if it is not one.
fn ascii(bytes: &[u8]) -> Option<Vec<[f64; 3]>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let mut words = text.split_ascii_whitespace();
    if !words.next()?.eq_ignore_ascii_case("solid") {
        return None;
    }
    let mut vertices = Vec::new();
    // Without the last word the mesh is cut short.
    let mut has_end = false;
    while let Some(word) = words.next() {
        has_end |= word.eq_ignore_ascii_case("endsolid");
        if word.eq_ignore_ascii_case("vertex") {
            let mut number = || words.next()?.parse::<f64>().ok();
            vertices.push([number()?, number()?, number()?]);
        }
    }
    has_end.then_some(vertices)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASCII: &str = "solid wedge\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0.5\n   \
        vertex 25e-2 -2 0\n   vertex 3 0 0\n  endloop\n endfacet\nendsolid wedge\n";

    fn packed(vertices: &[[f32; 3]; 3]) -> Vec<u8> {
        // Exporters write `solid` into headers of binary files.
        let mut bytes = b"solid but binary".to_vec();
        bytes.resize(80, 0);
        bytes.extend(1u32.to_le_bytes());
        bytes.extend([0; 12]);
        bytes.extend(vertices.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
        bytes
    }

    fn points(bytes: &[u8]) -> Vec<[f64; 3]> {
        parse("mesh.stl", bytes).expect("a mesh").points_m
    }

    #[test]
    fn ascii_and_binary_meshes_have_the_same_vertices() {
        let expected = [[0.0, 0.0, 0.5], [0.25, -2.0, 0.0], [3.0, 0.0, 0.0]];
        assert_eq!(points(ASCII.as_bytes()), expected);
        assert_eq!(points(ASCII.to_uppercase().as_bytes()), expected);
        let bytes = packed(&[[0.25, -2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 0.5]]);
        assert_eq!(points(&bytes), expected);
        let with_more = [&bytes[..], b"made by hand"].concat();
        assert_eq!(points(&with_more), expected);
    }

    #[test]
    fn bytes_behind_the_triangles_that_a_file_counts_are_said() {
        let bytes = packed(&[[0.25, -2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 0.5]]);
        assert_eq!(parse("a.stl", &bytes).expect("a mesh").not_used, [""; 0]);
        let more = [&bytes[..], &[0; 50]].concat();
        let mesh = parse("a.stl", &more).expect("a mesh");
        assert_eq!(mesh.not_used, ["50 bytes behind the 1 triangles that the file counts"]);
    }

    #[test]
    fn damaged_meshes_are_errors() {
        let whole = packed(&[[0.0; 3]; 3]);
        let infinite = packed(&[[f32::INFINITY; 3]; 3]);
        let empty = [&[0u8; 84][..]].concat();
        for bytes in [&whole[..133], &whole[..20], &[], &infinite, &empty, b"solid x vertex 1 2"] {
            let error = parse("mesh.stl", bytes).expect_err("wrong");
            assert_eq!(error.place(), "mesh.stl");
        }
        let cut = &ASCII.as_bytes()[..60];
        assert!(parse("mesh.stl", cut).expect_err("wrong").cause().contains("cut short"));
    }
}
