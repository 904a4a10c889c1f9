//! OBJ meshes: lines of which those with `v` are vertices.

use super::Mesh;
use sidestep_kernel::InputError;

/// Returns the vertices of the mesh in `bytes`; errors call it `place`. All count, also those that no face has.
///
/// # Errors
/// When a vertex has no three numbers, with its line, or there is none.
pub fn parse(place: &str, bytes: &[u8]) -> Result<Mesh, InputError> {
    let mut points_m = Vec::new();
    for (k, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        // Names of materials need not be UTF-8, numbers are ASCII.
        let line = line.trim_ascii_start();
        let Some(rest) = line.strip_prefix(b"v").filter(|rest| is_vertex(rest)) else { continue };
        let point = vertex(rest).ok_or_else(|| {
            let remedy = "write a vertex as `v X Y Z`, or save the mesh again";
            InputError::new(place, "a vertex that is not three numbers", remedy)
                .with_position(k + 1, 1)
        })?;
        points_m.push(point);
    }
    Mesh::new(place, points_m)
}

/// Returns whether the word `v` ends there: `vn` and `vt` are no vertices.
fn is_vertex(rest: &[u8]) -> bool {
    rest.first().is_some_and(u8::is_ascii_whitespace)
}

fn vertex(rest: &[u8]) -> Option<[f64; 3]> {
    let text = std::str::from_utf8(rest).ok()?;
    let mut words = text.split_ascii_whitespace();
    let mut number = || words.next()?.parse::<f64>().ok();
    // A weight or a color may follow.
    Some([number()?, number()?, number()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_read_and_nothing_else() {
        let text = "# cube\nmtllib a.mtl\no \u{e9}\nv 1 2 3\r\n  v -1e-1 0 0 1.0\nv\t0 0 0 0.5 0.5 0.5\n\
                    vn 9 9 9\nvt 9 9\nf 1 2 3\nv 1 2 3\n";
        let mesh = parse("a.obj", text.as_bytes()).expect("a mesh");
        assert_eq!(mesh.points_m, [[-0.1, 0.0, 0.0], [0.0; 3], [1.0, 2.0, 3.0]]);
        assert_eq!(mesh.bounds_m(), [[-0.1, 0.0, 0.0], [1.0, 2.0, 3.0]]);
    }

    #[test]
    fn damaged_meshes_are_errors() {
        let error = parse("a.obj", b"v 0 0 0\nv 1 2\n").expect_err("two numbers");
        assert_eq!(error.line_and_column(), Some((2, 1)));
        for text in ["", "f 1 2 3", "v 1 2 x", "v 1 2 nan", "v 1 2 1e300"] {
            assert!(parse("a.obj", text.as_bytes()).is_err(), "{text}");
        }
    }
}
