//! OBJ meshes: lines of which those with `v` are vertices, and those with `f` say which of them are of the surface.

use super::Mesh;
use sidestep_kernel::InputError;

/// Returns the vertices of the mesh in `bytes` that faces, lines or points have, or all where there are none of these;
/// errors call it `place`.
///
/// # Errors
/// When a vertex has no three numbers, or a face a vertex that is not there, with its line, or there is no vertex.
pub fn parse(place: &str, bytes: &[u8]) -> Result<Mesh, InputError> {
    let mut points_m = Vec::new();
    let mut used: Vec<usize> = Vec::new();
    for (k, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        // Names of materials need not be UTF-8, numbers are ASCII.
        let line = line.trim_ascii_start();
        if let Some(rest) = line.strip_prefix(b"f").filter(|rest| is_vertex(rest)) {
            add_face(rest, points_m.len(), &mut used).map_err(|word| {
                let cause =
                    format!("a face with the vertex `{}`, which is not there", word.escape_debug());
                InputError::new(place, cause, "count vertices from 1, or from -1 backward")
                    .with_position(k + 1, 1)
            })?;
            continue;
        }
        let Some(rest) = line.strip_prefix(b"v").filter(|rest| is_vertex(rest)) else { continue };
        let point = vertex(rest).ok_or_else(|| {
            let remedy = "write a vertex as `v X Y Z`, or save the mesh again";
            InputError::new(place, "a vertex that is not three numbers", remedy)
                .with_position(k + 1, 1)
        })?;
        points_m.push(point);
    }
    if used.is_empty() {
        return Mesh::new(place, points_m);
    }
    used.sort_unstable();
    used.dedup();
    if let Some(last) = used.last().filter(|last| **last >= points_m.len()) {
        let cause = format!("a face with the vertex {}, of {}", last + 1, points_m.len());
        return Err(InputError::new(place, cause, "save the mesh again"));
    }
    let stray = points_m.len() - used.len();
    let points_m = used.into_iter().map(|k| points_m[k]).collect();
    let mut mesh = Mesh::new(place, points_m)?;
    if stray > 0 {
        mesh.not_used.push(format!("{stray} vertices that no face has"));
    }
    Ok(mesh)
}

/// Adds the vertices of a face to those that are used, by their index from 0; `n` vertices are before it. Returns a word that
/// is none as an error.
fn add_face(rest: &[u8], n: usize, used: &mut Vec<usize>) -> Result<(), String> {
    let text = String::from_utf8_lossy(rest);
    for word in text.split_ascii_whitespace() {
        let number = word.split('/').next().and_then(|number| number.parse::<i64>().ok());
        // Faces may come before their vertices, but not those that count backward.
        let index = match number {
            Some(number) if number > 0 => usize::try_from(number - 1).ok(),
            Some(number) if number < 0 => usize::try_from(n as i64 + number).ok(),
            _ => None,
        };
        used.push(index.ok_or_else(|| word.chars().take(20).collect::<String>())?);
    }
    Ok(())
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
    fn vertices_that_no_face_has_are_not_of_the_mesh() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 50 50 50\n";
        for face in ["f 1 2 3\n", "f 1/1/1 2//4 3/7\n", "f -4 -3 -2\n"] {
            let mesh = parse("a.obj", format!("{text}{face}").as_bytes()).expect("a mesh");
            assert_eq!((mesh.points_m.len(), mesh.bounds_m()[1]), (3, [1.0, 1.0, 0.0]), "{face}");
            assert_eq!(mesh.not_used, ["1 vertices that no face has"]);
        }
        let cloud = parse("a.obj", text.as_bytes()).expect("points alone");
        assert_eq!((cloud.points_m.len(), cloud.not_used.len()), (4, 0));
        for (face, line) in [("f 0 1 2\n", Some(5)), ("f -9 1 2\n", Some(5)), ("f 1 2 99\n", None)]
        {
            let error = parse("a.obj", format!("{text}{face}").as_bytes()).expect_err(face);
            assert_eq!(error.line_and_column().map(|(line, _)| line), line, "{error}");
        }
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
