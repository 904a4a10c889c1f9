//! OBJ meshes: statements of which those with `v` are vertices, and those with `f`, `l` and `p` say which of them are of
//! the faces, lines and points. A statement is a line up to `#`, and goes on in the next line behind `\`.

use super::Mesh;
use sidestep_kernel::InputError;
use std::borrow::Cow;

/// What has vertices, by the word before their numbers.
const ELEMENTS: [(&[u8], &str); 3] = [(b"f", "face"), (b"l", "line"), (b"p", "point")];

/// Returns the vertices of the mesh in `bytes` that faces, lines or points have, or all where there are none of these;
/// errors call it `place`.
///
/// # Errors
/// When a vertex has no three numbers, or a face, a line or a point a vertex that is not there, with its line, or there is no vertex.
pub fn parse(place: &str, bytes: &[u8]) -> Result<Mesh, InputError> {
    let mut points_m = Vec::new();
    let mut used: Vec<usize> = Vec::new();
    let mut lines = bytes.split(|byte| *byte == b'\n').enumerate();
    while let Some((k, line)) = lines.next() {
        // Names of materials need not be UTF-8, numbers are ASCII.
        let line = statement(line, &mut lines);
        let element = ELEMENTS.iter().find_map(|(word, noun)| {
            let rest = line.strip_prefix(*word).filter(|rest| is_word_end(rest))?;
            Some((rest, noun))
        });
        if let Some((rest, noun)) = element {
            add_vertices(rest, points_m.len(), &mut used).map_err(|word| {
                let word = word.escape_debug();
                let cause = format!("a {noun} with the vertex `{word}`, which is not there");
                InputError::new(place, cause, "count vertices from 1, or from -1 backward")
                    .with_position(k + 1, 1)
            })?;
            continue;
        }
        let Some(rest) = line.strip_prefix(b"v").filter(|rest| is_word_end(rest)) else {
            continue;
        };
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
        mesh.not_used.push(format!("{stray} vertices that no face, line or point has"));
    }
    Ok(mesh)
}

/// Returns the statement that begins in a line, and takes the further lines that it has.
fn statement<'a>(
    line: &'a [u8],
    lines: &mut impl Iterator<Item = (usize, &'a [u8])>,
) -> Cow<'a, [u8]> {
    let mut text = Cow::Borrowed(without_note(line).trim_ascii_start());
    // Paths in other statements may end with this character.
    let has_numbers = matches!(text.first(), Some(b'v' | b'f' | b'l' | b'p'));
    while has_numbers && text.ends_with(b"\\") {
        let (_, line) = lines.next().unwrap_or_default();
        let whole = text.to_mut();
        whole.pop();
        whole.push(b' ');
        whole.extend_from_slice(without_note(line));
    }
    text
}

/// Returns a line without what stands behind `#`, and without space at its end.
fn without_note(line: &[u8]) -> &[u8] {
    line.split(|byte| *byte == b'#').next().unwrap_or(line).trim_ascii_end()
}

/// Adds the vertices of an element to those that are used, by their index from 0; `n` vertices are before it. Returns a word that
/// is none as an error.
fn add_vertices(rest: &[u8], n: usize, used: &mut Vec<usize>) -> Result<(), String> {
    let text = String::from_utf8_lossy(rest);
    for word in text.split_ascii_whitespace() {
        let number = word.split('/').next().and_then(|number| number.parse::<i64>().ok());
        // Elements may come before their vertices, but not those that count backward.
        let index = match number {
            Some(number) if number > 0 => usize::try_from(number - 1).ok(),
            Some(number) if number < 0 => usize::try_from(n as i64 + number).ok(),
            _ => None,
        };
        used.push(index.ok_or_else(|| word.chars().take(20).collect::<String>())?);
    }
    Ok(())
}

/// Returns whether a word ends there: `vn` and `vt` are no vertices.
fn is_word_end(rest: &[u8]) -> bool {
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
            assert_eq!(mesh.not_used, ["1 vertices that no face, line or point has"]);
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
    fn notes_and_continued_lines_are_no_vertices() {
        let text = "# C:\\meshes\\\nv 0 0 0 # origin\nv 1 \\\r\n 0 0\nv 0 1 0\nv 5 5 5\nusemtl a\\\nf 1 2 3 # note\n";
        for faces in ["", "f 1 \\\n2 \\\n 3\n", "f 3 2 \\\r\n1#note\n", "f 1 2 3 \\"] {
            let mesh = parse("a.obj", format!("{text}{faces}").as_bytes()).expect(faces);
            assert_eq!((mesh.points_m.len(), mesh.bounds_m()[1]), (3, [1.0, 1.0, 0.0]), "{faces}");
        }
        let wrong = format!("{text}f 1 \\\n 2 9x\n");
        let error = parse("a.obj", wrong.as_bytes()).expect_err("no number");
        assert_eq!(error.line_and_column(), Some((9, 1)), "the line of its begin");
    }

    #[test]
    fn lines_and_points_have_their_vertices() {
        let text =
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 7\nv 0 9 0\nv 50 50 50\nf 1 2 3\nl 1/1 4/2\np -2\n";
        let mesh = parse("a.obj", text.as_bytes()).expect("a mesh");
        assert_eq!((mesh.points_m.len(), mesh.bounds_m()[1]), (5, [1.0, 9.0, 7.0]));
        let error = parse("a.obj", b"v 0 0 0\nl 1 x\n").expect_err("no number");
        assert!(error.cause().starts_with("a line with the vertex `x`"), "{error}");
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
