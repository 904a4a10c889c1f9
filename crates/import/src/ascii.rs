//! Maps drawn with characters, in a scenario or in a `.txt` file: `#` wall, `.` or a blank free,
//! `?` unknown. The first line is the north edge; each character is one box.

use std::ops::Range;
use std::path::Path;

use sidestep_kernel::InputError;

use super::char_map::{Legend, MAX_TEXT_BYTES, SourceText, map_from_top};
use sidestep_map::{Cell, GridMap};
use sidestep_scenario::file::read_text;

const LEGEND: Legend = Legend {
    cell: |character| match character {
        '#' => Some(Cell::Wall),
        '.' | ' ' => Some(Cell::Free),
        '?' => Some(Cell::Unknown),
        _ => None,
    },
    remedy: "draw with `#` (wall), `.` or a blank (free) and `?` (unknown)",
    width_remedy: "give all rows the same number of characters",
};

/// Reads the file at `path` (also with gzip) as a map of boxes with a side of `box_size_m` meters.
///
/// # Errors
/// Those of [`parse`], and a file that cannot be read.
pub fn load(path: &Path, box_size_m: f64) -> Result<GridMap, InputError> {
    parse(&path.display().to_string(), &read_text(path, MAX_TEXT_BYTES)?, box_size_m)
}

/// Reads `art` as a map of boxes with a side of `box_size_m` meters. An empty first line (as after
/// an opening quote) and empty last lines do not count.
///
/// # Errors
/// When a character is unknown, the rows differ in length, there is no row or there are too many
/// boxes. Errors name `place` and count lines and columns in `art`.
pub fn parse(place: &str, art: &str, box_size_m: f64) -> Result<GridMap, InputError> {
    parse_within(place, art, 0..art.len(), box_size_m)
}

/// Reads a drawing that is the part `art` (in bytes) of a larger `document`, as [`parse`] does;
/// errors count lines and columns in the document.
///
/// # Errors
/// Those of [`parse`].
///
/// # Panics
/// When `art` is not a range of whole characters of `document`.
pub fn parse_within(
    place: &str,
    document: &str,
    art: Range<usize>,
    box_size_m: f64,
) -> Result<GridMap, InputError> {
    let source = SourceText { place, text: document };
    let art = &document[art];
    let body = art.strip_prefix("\r\n").or(art.strip_prefix('\n')).unwrap_or(art);
    let body = body.trim_end_matches(['\r', '\n']);
    let width = body.lines().next().map_or(0, |line| line.chars().count());
    let mut cells = Vec::with_capacity(body.len());
    for line in source.lines_of(body) {
        LEGEND.read_row(source, line, width, &mut cells)?;
    }
    map_from_top(place, &cells, width, box_size_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Cell::{Free, Unknown, Wall};

    #[test]
    fn the_first_line_is_the_north_edge() {
        let map = parse("map", "##\n. \n?#\n", 0.5).expect("a map");
        assert_eq!((map.width(), map.height(), map.box_size_m), (2, 3, 0.5));
        assert_eq!(map.cells(), [Unknown, Wall, Free, Free, Wall, Wall]);
    }

    #[test]
    fn line_ends_of_both_kinds_and_empty_edge_lines_do_not_matter() {
        let plain = parse("map", "#.\n.#", 1.0).expect("a map");
        assert_eq!(parse("map", "\r\n#.\r\n.#\r\n\r\n", 1.0), Ok(plain));
    }

    #[test]
    fn a_character_without_meaning_is_pointed_at() {
        let error = parse("map", "#.\n.x", 1.0).expect_err("an x");
        assert_eq!(error.line_and_column(), Some((2, 2)));
        assert!(error.cause().contains("`x`"), "{error}");
        let tab = parse("map", "#\t", 1.0).expect_err("a tab");
        assert!(tab.cause().contains(r"`\t`"), "{tab}");
    }

    #[test]
    fn ragged_rows_are_pointed_at_where_they_should_end() {
        let short = parse("map", "###\n#\n", 1.0).expect_err("short");
        assert_eq!(short.line_and_column(), Some((2, 2)));
        let long = parse("map", "##\n####", 1.0).expect_err("long");
        assert_eq!(long.line_and_column(), Some((2, 3)));
        assert!(parse("map", "##\n\n##", 1.0).is_err(), "an empty row inside");
    }

    #[test]
    fn a_drawing_within_a_document_has_its_errors_at_the_places_of_the_document() {
        let document = "size = 1\nart = '''\n#.\n.x\n'''\n";
        let art =
            document.find("#.").expect("the drawing")..document.rfind("'''").expect("its end");
        let error = parse_within("s.toml", document, art.clone(), 1.0).expect_err("an x");
        assert_eq!((error.place(), error.line_and_column()), ("s.toml", Some((4, 2))));
        let corrected = document.replace('x', "#");
        let map = parse_within("s.toml", &corrected, art, 1.0);
        assert_eq!(map, parse("art", "#.\n.#", 1.0));
    }

    #[test]
    fn no_row_and_no_box_size_are_errors() {
        for art in ["", "\n", "\n\n\n"] {
            assert!(parse("map", art, 1.0).is_err(), "{art:?}");
        }
        assert!(parse("map", "#", 0.0).is_err());
    }
}
