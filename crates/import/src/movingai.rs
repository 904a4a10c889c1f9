//! MovingAI benchmarks: `.map` grids and `.scen` lists of starts and goals; and the maps of the League of Robot
//! Runners, which have two symbols of their own.
//!
//! The files count rows from the top; all rows here count from the bottom.

use std::path::Path;
use std::str::FromStr;

use sidestep_kernel::InputError;

use super::ImportedMap;
use super::char_map::{Legend, Line, MAX_TEXT_BYTES, SourceText, map_from_top};
use super::report::{Finding, ImportReport, MAX_PLACES, Treatment};
use sidestep_map::{Cell, GridMap, check_box_count};
use sidestep_scenario::file::read_text;

/// Ground (two characters), swamp, and the emitter and service points of warehouses are passable; out of bounds (two
/// characters), trees and water are not.
const LEGEND: Legend = Legend {
    cell: |character| match character {
        '.' | 'G' | 'S' | 'E' => Some(Cell::Free),
        '@' | 'O' | 'T' | 'W' => Some(Cell::Wall),
        _ => None,
    },
    remedy: "use `.`, `G`, `S`, `E` (passable) and `@`, `O`, `T`, `W` (blocked)",
    width_remedy: "give all rows as many characters as `width` says",
};

/// Symbols that mean more than free or blocked, with what becomes of them. `S` means one thing in games and another in
/// warehouses, and is passable in both.
const SYMBOLS: [(char, &str); 3] = [
    ('E', "the symbol `E` (emitter point, where goods are delivered), read as a free box"),
    (
        'S',
        "the symbol `S` (swamp, or service point, where goods are picked up), read as a free box",
    ),
    ('W', "the symbol `W` (water), read as a wall"),
];

/// The maximum size of a `.scen` file in bytes; those of the benchmark have less than 0.1 MB.
const MAX_SCEN_BYTES: u64 = 1 << 28;

/// A row of a `.scen` file: one start with one goal.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenRow {
    /// Line in the file, from 1.
    pub line: usize,
    /// Group of rows of similar length.
    pub bucket: u32,
    /// Name of the map file as written in the row.
    pub map: String,
    /// Number of columns of the map.
    pub width: u32,
    /// Number of rows of the map.
    pub height: u32,
    /// Start: column from the west and row from the south.
    pub start: (u32, u32),
    /// Goal: column from the west and row from the south.
    pub goal: (u32, u32),
    /// Length of a shortest path on 8 neighbors without cutting corners, in boxes; `None` where the file has -1, as for
    /// rows that nobody has solved.
    pub optimal_length: Option<f64>,
}

/// The content of a `.scen` file.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenFile {
    /// Its rows, in the order of the file.
    pub rows: Vec<ScenRow>,
    /// What became of the file.
    pub report: ImportReport,
}

impl ScenRow {
    /// Checks that the row fits `map`; errors name `place` and the row's line.
    ///
    /// # Errors
    /// When the map has a different size, or the start or the goal is not free.
    pub fn check_against(&self, place: &str, map: &GridMap) -> Result<(), InputError> {
        let error =
            |cause, remedy| Err(InputError::new(place, cause, remedy).with_position(self.line, 1));
        if (self.width, self.height) != (map.width(), map.height()) {
            let cause = format!(
                "a row for a map of {} x {} boxes, and the map has {} x {}",
                self.width,
                self.height,
                map.width(),
                map.height()
            );
            return error(cause, "give the map that the scenario was made for");
        }
        for (name, (col, row)) in [("start", self.start), ("goal", self.goal)] {
            if map.cell(col, row) != Cell::Free {
                // As the file counts, from the top.
                let from_top = self.height - 1 - row;
                let cause = format!("the {name}, x {col} and y {from_top}, is not free");
                return error(cause, "give the map that the scenario was made for");
            }
        }
        Ok(())
    }
}

/// Reads a `.map` file (also with gzip); a character becomes a box with a side of `box_size_m`
/// meters (the benchmarks have no unit; 1 is customary).
///
/// # Errors
/// Those of [`parse_map`], and a file that cannot be read.
pub fn load_map(path: &Path, box_size_m: f64) -> Result<ImportedMap, InputError> {
    parse_map(&path.display().to_string(), &read_text(path, MAX_TEXT_BYTES)?, box_size_m)
}

/// Reads `text` as a `.map` file; errors name `place`.
///
/// # Errors
/// When the header or a character is wrong, or rows are missing, too many, or not as wide as the
/// header says.
pub fn parse_map(place: &str, text: &str, box_size_m: f64) -> Result<ImportedMap, InputError> {
    let source = SourceText { place, text };
    let mut lines = source.lines_of(text);
    let size = read_header(source, &mut lines)?;
    let [width, height] = size.map(|boxes| boxes as usize);
    let mut cells = Vec::new();
    let mut report = ImportReport::new("map in characters (MovingAI)");
    for line in lines.by_ref().take(height) {
        let row = Line { text: line.text.trim_end(), ..line };
        if row.text.len() < line.text.len() {
            record_rule(&mut report, (Treatment::Repaired, BLANKS, 1), source, line);
        }
        LEGEND.read_row(source, row, width, &mut cells)?;
        record_symbols(&mut report, source, row);
    }
    if cells.len() < width * height {
        let cause = format!("the map ends after {} rows, not {height}", cells.len() / width);
        return Err(source.error(text.len(), cause, ROWS_REMEDY));
    }
    if let Some(line) = lines.find(|line| !line.text.trim().is_empty()) {
        let cause = format!("text after the {height} rows of the map");
        return Err(source.error(line.offset, cause, ROWS_REMEDY));
    }
    let map = map_from_top(place, &cells, width, box_size_m)?;
    Ok(ImportedMap::of_boxes(map, report))
}

/// The rule about blanks behind a row.
const BLANKS: &str = "blanks at the ends of rows, which mean nothing";

/// Counts the symbols of a row whose meaning is not used.
fn record_symbols(report: &mut ImportReport, source: SourceText<'_>, line: Line<'_>) {
    for (symbol, rule) in SYMBOLS {
        let count = line.text.matches(symbol).count() as u64;
        if count > 0 {
            record_rule(report, (Treatment::NotUsed, rule, count), source, line);
        }
    }
}

/// Records a rule that applied some times in a row.
fn record_rule(
    report: &mut ImportReport,
    (treatment, rule, count): (Treatment, &str, u64),
    source: SourceText<'_>,
    line: Line<'_>,
) {
    let known = report.findings.iter_mut().find(|finding| finding.rule == rule);
    let Some(finding) = known else {
        report.findings.push(Finding {
            treatment,
            rule: rule.to_string(),
            count,
            places: vec![source.line_name(line)],
            remedy: String::new(),
        });
        return;
    };
    finding.count += count;
    // Counting lines takes as long as the text before is, so that it is not done for every row.
    if finding.places.len() < MAX_PLACES {
        finding.places.push(source.line_name(line));
    }
}

const ROWS_REMEDY: &str = "give as many rows as `height` says";

/// Reads the header up to and including `map`; returns the map's width and height.
fn read_header<'a>(
    source: SourceText<'_>,
    lines: &mut impl Iterator<Item = Line<'a>>,
) -> Result<[u32; 2], InputError> {
    let mut is_octile = false;
    let mut width = None;
    let mut height = None;
    // In any order, each once; words in any case, and empty lines between.
    for line in lines {
        let words = line.text.split_whitespace();
        let words: Vec<String> = words.map(str::to_ascii_lowercase).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        match words[..] {
            [] => {}
            ["type", "octile"] if !is_octile => is_octile = true,
            ["type", kind] if !is_octile => {
                let cause = format!("a map of type `{}`, not octile", kind.escape_debug());
                return Err(source.error(line.offset, cause, HEADER_REMEDY));
            }
            ["width", _] if width.is_none() => width = Some(size(source, line)?),
            ["height", _] if height.is_none() => height = Some(size(source, line)?),
            ["map"] => {
                let (Some(width), Some(height)) = (width, height) else {
                    let cause = "the header lacks the map's size";
                    return Err(source.error(line.offset, cause, HEADER_REMEDY));
                };
                let (columns, rows) = check_box_count(source.place, width, height)?;
                return Ok([columns, rows]);
            }
            _ => {
                return Err(source.error(
                    line.offset,
                    "not a line of a map's header",
                    HEADER_REMEDY,
                ));
            }
        }
    }
    Err(source.error(source.text.len(), "the header has no line `map`", HEADER_REMEDY))
}

const HEADER_REMEDY: &str = "begin with the lines `type octile`, `height H`, `width W` and `map`";

/// Reads the size that is the second word of a line of the header; errors point at the word.
fn size(source: SourceText<'_>, line: Line<'_>) -> Result<u64, InputError> {
    let word = line.text.split_whitespace().nth(1).unwrap_or_default();
    word.parse().map_err(|_| {
        let cause = format!("`{}` is not a whole number", word.escape_debug());
        source.error(source.offset_of(word), cause, HEADER_REMEDY)
    })
}

/// Reads a `.scen` file (also with gzip).
///
/// # Errors
/// Those of [`parse_scen`], and a file that cannot be read.
pub fn load_scen(path: &Path) -> Result<ScenFile, InputError> {
    parse_scen(&path.display().to_string(), &read_text(path, MAX_SCEN_BYTES)?)
}

/// Reads `text` as a `.scen` file; errors name `place`. Fields are separated with tabs, or with blanks or both where
/// the map's name has no blanks.
///
/// # Errors
/// When the first line is not `version 1`, or a row does not have nine fields, a field is not a number, or a start or
/// goal is outside the map.
pub fn parse_scen(place: &str, text: &str) -> Result<ScenFile, InputError> {
    let source = SourceText { place, text };
    let numbered = source.lines_of(text).enumerate();
    let mut lines = numbered.filter(|(_, line)| !line.text.trim().is_empty());
    if !lines.next().is_some_and(|(_, line)| is_version_1(line.text)) {
        let remedy = "begin the file with the line `version 1`";
        return Err(source.error(0, "not a MovingAI scenario of version 1", remedy));
    }
    let mut rows = Vec::new();
    for (index, line) in lines {
        rows.push(scen_row(source, index + 1, line)?);
    }
    let mut report = ImportReport::new("list of starts and goals (MovingAI)");
    report.add_kept("rows", rows.len());
    record_maps(&rows, &mut report);
    let unsolved = rows.iter().filter(|row| row.optimal_length.is_none()).count();
    if unsolved > 0 {
        report.add_kept("rows without an optimal length (-1)", unsolved);
    }
    Ok(ScenFile { rows, report })
}

/// Maximum number of maps that a report lists.
const MAX_MAPS: usize = 5;

/// Records which maps the rows are for.
fn record_maps(rows: &[ScenRow], report: &mut ImportReport) {
    let mut maps: Vec<String> = Vec::new();
    for row in rows {
        let map = format!("{}, {} x {} boxes", row.map, row.width, row.height);
        if maps.len() <= MAX_MAPS && !maps.contains(&map) {
            maps.push(map);
        }
    }
    for map in maps.iter().take(MAX_MAPS) {
        report.add_fact("map", map.clone());
    }
    if maps.len() > 1 {
        let rule = "the rows are for several maps";
        report.record(Treatment::Suspicious, rule, "", "keep the rows for the map that you give");
    }
}

fn is_version_1(line: &str) -> bool {
    let mut words = line.split_whitespace();
    words.next() == Some("version") && matches!(words.next(), Some("1" | "1.0"))
}

fn scen_row(source: SourceText<'_>, line: usize, text: Line<'_>) -> Result<ScenRow, InputError> {
    let mut fields = Fields::of_row(source, text);
    let bucket = fields.number("the bucket")?;
    let map = fields.text("the map's name")?.0.to_owned();
    let width = fields.number("the map's width")?;
    let height = fields.number("its height")?;
    let start = fields.box_position("the start", width, height)?;
    let goal = fields.box_position("the goal", width, height)?;
    let optimal_length = fields.length("the optimal length")?;
    fields.finish()?;
    Ok(ScenRow { line, bucket, map, width, height, start, goal, optimal_length })
}

/// What programs write as the length of a row that they have not solved.
const UNSOLVED_LENGTH: f64 = -1.0;

/// Number of fields of a row.
const FIELD_COUNT: usize = 9;

/// What stands between the fields of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Separator {
    /// One tab, as in the files of the benchmark: a name may have blanks.
    Tab,
    /// Blanks or tabs, any number of them, as other programs write: the benchmark's own reader takes word by word.
    Whitespace,
}

impl Separator {
    /// Nine words are the nine fields, whatever stands between them. Otherwise tabs say where a name with blanks ends.
    fn of_row(row: &str) -> Self {
        let is_in_words = row.split_whitespace().count() == FIELD_COUNT;
        if is_in_words || !row.contains('\t') { Self::Whitespace } else { Self::Tab }
    }

    /// Splits the first field off the rest of a row, and returns it with what is behind it, if anything.
    fn split(self, rest: &str) -> (&str, Option<&str>) {
        match self {
            Self::Tab => match rest.split_once('\t') {
                Some((field, next)) => (field, Some(next)),
                None => (rest, None),
            },
            Self::Whitespace => match rest.split_once(char::is_whitespace) {
                Some((field, next)) => (field, Some(next.trim_start()).filter(|n| !n.is_empty())),
                None => (rest, None),
            },
        }
    }
}

/// The fields of a row, taken one by one.
struct Fields<'a> {
    source: SourceText<'a>,
    line: Line<'a>,
    separator: Separator,
    /// The byte offset of the rest of the row in the text.
    offset: usize,
    /// The rest of the row; `None` after the last field.
    next: Option<&'a str>,
}

const FIELDS_REMEDY: &str = "write bucket, map, width, height, start x, start y, goal x, goal y and \
                      optimal length, with a tab between each two, or with blanks if the map's name has none";

impl<'a> Fields<'a> {
    fn of_row(source: SourceText<'a>, line: Line<'a>) -> Self {
        let separator = Separator::of_row(line.text);
        let first = match separator {
            Separator::Tab => line.text,
            Separator::Whitespace => line.text.trim_start(),
        };
        Self { source, line, separator, offset: source.offset_of(first), next: Some(first) }
    }

    /// Reads the next field; returns it with its byte offset.
    fn text(&mut self, name: &str) -> Result<(&'a str, usize), InputError> {
        let rest = self.next.ok_or_else(|| {
            let end = self.line.offset + self.line.text.len();
            self.source.error(end, format!("the row ends before {name}"), FIELDS_REMEDY)
        })?;
        let offset = self.offset;
        let (field, next) = self.separator.split(rest);
        self.next = next;
        self.offset = next.map_or(offset + field.len(), |next| self.source.offset_of(next));
        Ok((field, offset))
    }

    fn number<T: FromStr>(&mut self, name: &str) -> Result<T, InputError> {
        let (field, offset) = self.text(name)?;
        field.trim().parse().map_err(|_| {
            let cause = format!("`{}`, {name}, is not such a number", field.escape_debug());
            self.source.error(offset, cause, FIELDS_REMEDY)
        })
    }

    /// Reads the column and, counted from the bottom, the row of a box.
    fn box_position(
        &mut self,
        name: &str,
        width: u32,
        height: u32,
    ) -> Result<(u32, u32), InputError> {
        let offset = self.offset;
        let x: u32 = self.number(name)?;
        let y: u32 = self.number(name)?;
        if x < width && y < height {
            return Ok((x, height - 1 - y));
        }
        let cause = format!("{name}, ({x}, {y}), is outside the map of {width} x {height}");
        Err(self.source.error(offset, cause, "count columns and rows from 0"))
    }

    fn length(&mut self, name: &str) -> Result<Option<f64>, InputError> {
        let offset = self.offset;
        let length: f64 = self.number(name)?;
        if length == UNSOLVED_LENGTH {
            return Ok(None);
        }
        if length.is_finite() && length >= 0.0 {
            return Ok(Some(length));
        }
        let cause = format!("{name} is {length}");
        Err(self.source.error(offset, cause, "give a length of 0 or more, or -1 if it is unknown"))
    }

    fn finish(&self) -> Result<(), InputError> {
        match self.next {
            Some(rest) if !rest.trim().is_empty() => {
                Err(self.source.error(self.offset, "a tenth field", FIELDS_REMEDY))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Cell::{Free, Wall};
    use proptest::prelude::*;

    const MAP: &str = "type octile\nheight 2\nwidth 7\nmap\n.GS@OTW\n.......\n";

    #[test]
    fn the_first_row_of_the_file_is_the_top() {
        let map = parse_map("m", MAP, 1.0).expect("a map").map;
        assert_eq!((map.width(), map.height()), (7, 2));
        assert_eq!(map.cells()[..7], [Free; 7]);
        assert_eq!(map.cells()[7..], [Free, Free, Free, Wall, Wall, Wall, Wall]);
    }

    #[test]
    fn line_ends_the_order_of_the_sizes_and_empty_last_lines_do_not_matter() {
        let other = "type octile\r\nwidth 7\r\nheight 2\r\nmap\r\n.GS@OTW\r\n.......\r\n\r\n";
        assert_eq!(parse_map("m", other, 1.0), parse_map("m", MAP, 1.0));
    }

    /// A warehouse of the League of Robot Runners.
    const WAREHOUSE: &str = "type octile\nheight 3\nwidth 6\nmap\n@.E..E\n..SS..\n..E..@\n";

    #[test]
    fn emitter_and_service_points_are_free_and_reported() {
        let read = parse_map("m", WAREHOUSE, 1.0).expect("a map");
        assert_eq!((read.map.count(Free), read.map.count(Wall)), (16, 2));
        let findings: Vec<_> = read.report.findings.iter().map(ToString::to_string).collect();
        assert_eq!(
            findings,
            [
                "not used: the symbol `E` (emitter point, where goods are delivered), read as a free \
                 box (3 times), line 5, line 7",
                "not used: the symbol `S` (swamp, or service point, where goods are picked up), read \
                 as a free box (2 times), line 6",
            ]
        );
        let plain = parse_map("m", &WAREHOUSE.replace(['E', 'S'], "."), 1.0).expect("a map");
        assert_eq!(plain.report.findings, []);
        assert_eq!(plain.map, read.map);
    }

    #[test]
    fn the_remedy_for_a_character_names_all_that_mean_something() {
        let error = parse_map("m", &WAREHOUSE.replace('E', "#"), 1.0).expect_err("a #");
        let named: Vec<char> =
            error.remedy().split('`').skip(1).step_by(2).flat_map(str::chars).collect();
        for symbol in named {
            let map = parse_map("m", &WAREHOUSE.replace('E', &symbol.to_string()), 1.0);
            assert!(map.is_ok(), "{symbol}");
        }
    }

    #[test]
    fn case_empty_lines_and_blanks_change_nothing_and_blanks_behind_rows_are_said() {
        let odd = "\n Type  Octile \nHEIGHT\t2\n\nwidth 7 \nMAP\n.GS@OTW \n.......\t\n \n";
        let read = parse_map("m", odd, 1.0).expect("a map");
        let plain = parse_map("m", MAP, 1.0).expect("a map");
        assert_eq!(read.map, plain.map);
        let blanks = read.report.findings[0].to_string();
        assert!(blanks.starts_with("repaired: blanks at the ends of rows"), "{blanks}");
        assert!(blanks.contains("(2 times), line 7, line 8"), "{blanks}");
        let tiles = parse_map("m", "type tile\n", 1.0).expect_err("tiles");
        assert!(tiles.cause().contains("of type `tile`, not octile"), "{tiles}");
        let rows = "version 1\n0 m 6 4 0 0 5 3 8\n";
        let odd = parse_scen("s", &format!("\n\n{rows}")).expect("a scenario").rows;
        assert_eq!((odd[0].line, odd.len()), (4, 1));
    }

    fn map_error(text: &str) -> (usize, usize) {
        parse_map("m", text, 1.0).expect_err(text).line_and_column().expect("a position")
    }

    #[test]
    fn errors_of_a_map_are_pointed_at() {
        let head = "type octile\nheight 1\nwidth 2\nmap\n";
        for (rest, position) in [("..\n..\n", (6, 1)), (".#\n", (5, 2)), (".\n", (5, 2))] {
            assert_eq!(map_error(&format!("{head}{rest}")), position, "{rest:?}");
        }
        assert_eq!(map_error(head), (5, 1), "no rows");
        assert_eq!(map_error("type tile\n"), (1, 1));
        assert_eq!(map_error("type octile\nheight -1\n"), (2, 8));
        assert_eq!(map_error("type octile\nheight 1\nheight 1\n"), (3, 1), "twice");
        assert_eq!(map_error("type octile\nheight 1\nmap\n.\n"), (3, 1), "no width");
        assert_eq!(map_error(""), (1, 1));
    }

    #[test]
    fn absurd_sizes_are_refused_at_the_header() {
        let text = "type octile\nheight 4000000000\nwidth 4000000000\nmap\n";
        let error = parse_map("m", text, 1.0).expect_err("absurd");
        assert!(error.cause().contains("boxes"), "{error}");
    }

    #[test]
    fn a_scenario_counts_rows_from_the_bottom_and_keeps_blanks_in_names() {
        let text = "version 1\n3\ta map.map\t10\t20\t1\t0\t9\t19\t2.5\n\n";
        let rows = parse_scen("s", text).expect("a scenario").rows;
        let expected = ScenRow {
            line: 2,
            bucket: 3,
            map: "a map.map".into(),
            width: 10,
            height: 20,
            start: (1, 19),
            goal: (9, 0),
            optimal_length: Some(2.5),
        };
        assert_eq!(rows, [expected]);
    }

    #[test]
    fn rows_with_blanks_between_the_fields_are_those_with_tabs() {
        let tabs = "version 1\n0\topen.map\t6\t4\t0\t0\t5\t3\t6.41421356\n";
        let rows = parse_scen("s", tabs).expect("a scenario");
        for row in [
            "0 open.map 6 4 0 0 5 3 6.41421356",
            " 0  open.map   6 4 0 0 5 3 6.41421356 ",
            "0\topen.map 6 4\t0 0\t5 3 6.41421356",
            "0\t\topen.map\t6\t4\t0\t0\t5\t3\t6.41421356\t",
        ] {
            assert_eq!(
                parse_scen("s", &format!("version 1\n{row}\n")).as_ref(),
                Ok(&rows),
                "{row}"
            );
        }
    }

    #[test]
    fn a_row_that_nobody_has_solved_has_no_length() {
        let text =
            "version 1\n0 m 6 4 0 0 5 3 -1\n0\tm\t6\t4\t0\t0\t5\t3\t-1.0\n0 m 6 4 0 0 5 3 8\n";
        let scen = parse_scen("s", text).expect("a scenario");
        let lengths: Vec<_> = scen.rows.iter().map(|row| row.optimal_length).collect();
        assert_eq!(lengths, [None, None, Some(8.0)]);
        let kept: Vec<_> =
            scen.report.kept.iter().map(|kept| (kept.noun.as_str(), kept.count)).collect();
        assert_eq!(kept, [("rows", 3), ("rows without an optimal length (-1)", 2)]);
    }

    #[test]
    fn a_row_of_another_map_is_found_out() {
        let map = parse_map("m", MAP, 1.0).expect("a map").map;
        let row = |size: &str, ends: &str| {
            let text = format!("version 1\n0\tm\t{size}\t{ends}\t1\n");
            parse_scen("s", &text).expect("a scenario").rows.remove(0).check_against("s", &map)
        };
        assert_eq!(row("7\t2", "0\t0\t6\t1"), Ok(()));
        for wrong in
            [row("7\t3", "0\t1\t6\t1"), row("7\t2", "3\t0\t0\t0"), row("7\t2", "0\t0\t6\t0")]
        {
            assert_eq!(wrong.expect_err("another map").line_and_column(), Some((2, 1)));
        }
    }

    proptest! {
        #[test]
        fn no_text_panics_the_readers(
            head in prop_oneof![Just("type octile\nheight 2\nwidth 2\nmap\n"), Just("version 1\n"), Just("")],
            pieces in proptest::collection::vec(
                prop_oneof![
                    Just("\n"), Just("\r\n"), Just("\t"), Just(" "), Just("."), Just("@"), Just("é"),
                    Just("map"), Just("width "), Just("7"), Just("-1"), Just("99999999999"),
                ],
                0..40,
            ),
        ) {
            let text = head.to_owned() + &pieces.concat();
            let _ = (parse_map("m", &text, 1.0).is_ok(), parse_scen("s", &text).is_ok());
        }
    }

    fn scen_error(row: &str) -> (usize, usize) {
        let text = format!("version 1.0\r\n{row}\r\n");
        parse_scen("s", &text).expect_err(row).line_and_column().expect("a position")
    }

    #[test]
    fn rows_of_another_width_than_the_header_says_have_a_remedy_that_helps() {
        let text = "type octile\nheight 2\nwidth 3\nmap\n..\n..\n";
        let error = parse_map("m.map", text, 1.0).expect_err("narrow");
        assert_eq!(error.remedy(), "give all rows as many characters as `width` says");
        assert!(parse_map("m.map", &text.replace("width 3", "width 2"), 1.0).is_ok());
    }

    #[test]
    fn the_maps_of_a_list_are_told_and_several_are_suspicious() {
        let row = |map: &str| format!("0\t{map}\t6\t4\t0\t0\t5\t3\t6.4\n");
        let one = parse_scen("s.scen", &format!("version 1\n{}{}", row("a.map"), row("a.map")))
            .expect("read");
        assert_eq!(
            (one.report.facts[0].value.as_str(), one.report.findings.len()),
            ("a.map, 6 x 4 boxes", 0)
        );
        let two = parse_scen("s.scen", &format!("version 1\n{}{}", row("a.map"), row("b.map")))
            .expect("read");
        assert_eq!(two.report.findings[0].rule, "the rows are for several maps");
    }

    #[test]
    fn errors_of_a_scenario_are_pointed_at() {
        assert_eq!(scen_error("0\tm\t10\t20\t1\t2\t3"), (2, 16), "too few fields");
        assert_eq!(scen_error("0 m 10 20 1 2 3"), (2, 16), "too few words");
        assert_eq!(scen_error("0 a map 10 20 1 2 3 4 5.0"), (2, 5), "a name with blanks");
        assert_eq!(scen_error("0 m 10 20 1 2 3 4 5 6"), (2, 21), "ten words");
        assert_eq!(scen_error("  0 m  10 20  10 2 3 4 5"), (2, 15), "start outside");
        assert_eq!(scen_error("0\tm\t10\t20\t1\t2\t3\t4\t-2"), (2, 19), "less than nothing");
        assert_eq!(scen_error("0\tm\t10\t20\t1\t-2\t3\t4\t5"), (2, 13), "negative");
        assert_eq!(scen_error("0\tm\t10\t20\t10\t2\t3\t4\t5"), (2, 11), "start outside");
        assert_eq!(scen_error("0\tm\t10\t20\t1\t2\t3\t20\t5"), (2, 15), "goal outside");
        assert_eq!(scen_error("0\tm\t10\t20\t1\t2\t3\t4\tNaN"), (2, 19), "no length");
        assert_eq!(scen_error("0\tm\t10\t20\t1\t2\t3\t4\t5\t6"), (2, 21), "ten fields");
        let other = parse_scen("s", "version 2\n").expect_err("another version");
        assert_eq!(other.line_and_column(), Some((1, 1)));
        assert!(parse_scen("s", "").is_err());
    }
}
