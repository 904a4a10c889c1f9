//! Tables of text: plain or gzip files, columns of numbers, and CSV with a header.

use std::fmt;
use std::path::{Path, PathBuf};

use super::report::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

/// The maximum size of a text in bytes after decompression: some 20 times the largest known log.
pub const MAX_TEXT_BYTES: u64 = 1 << 29;

/// Returns the path of the file `name` in `folder`, or of `name.gz` where only that exists.
///
/// # Errors
/// When neither exists.
pub fn find_file(folder: &Path, name: &str) -> Result<PathBuf, InputError> {
    let candidates = [folder.join(name), folder.join(format!("{name}.gz"))];
    candidates.iter().find(|path| path.is_file()).cloned().ok_or_else(|| {
        InputError::new(
            candidates[0].display(),
            "the file is missing",
            format!("put {name} or {name}.gz into the folder"),
        )
    })
}

/// The maximum size of a CSV table in bytes after decompression.
pub const MAX_CSV_BYTES: u64 = 1 << 28;

/// One word of a text, with its position.
#[derive(Debug, Clone, Copy)]
pub struct Token<'a> {
    /// The word without the blanks around it.
    pub text: &'a str,
    /// Line in the file, from 1, as editors count.
    pub line: usize,
    /// Column of its first character, from 1.
    pub column: usize,
}

impl Token<'_> {
    /// Creates an error that points at this word.
    pub fn error(&self, place: &dyn fmt::Display, cause: String, remedy: &str) -> InputError {
        InputError::new(place, cause, remedy).with_position(self.line, self.column)
    }

    /// Reads the word as a finite number.
    ///
    /// # Errors
    /// When it is not a number, or not finite.
    pub fn number(&self, place: &dyn fmt::Display) -> Result<f64, InputError> {
        match self.text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(
                place,
                format!("`{}` is not a finite number", shorten(self.text)),
                "write a decimal number such as 1.25",
            )),
        }
    }

    /// Reads the word as a whole number from 0.
    ///
    /// # Errors
    /// When it is something else.
    pub fn integer(&self, place: &dyn fmt::Display) -> Result<u32, InputError> {
        self.text.parse().map_err(|_| {
            self.error(
                place,
                format!("`{}` is not a whole number from 0", shorten(self.text)),
                "write a number such as 14",
            )
        })
    }
}

/// Returns a word as an error quotes it: its first 40 characters.
fn shorten(text: &str) -> &str {
    text.char_indices().nth(40).map_or(text, |(end, _)| &text[..end])
}

/// Returns the words of line number `line`, separated by blanks or tabs.
pub fn tokens(line: usize, text: &str) -> impl Iterator<Item = Token<'_>> {
    text.split_ascii_whitespace().map(move |word| {
        let offset = word.as_ptr() as usize - text.as_ptr() as usize;
        Token { text: word, line, column: text[..offset].chars().count() + 1 }
    })
}

/// Returns the lines that hold data, neither blank nor a `#` comment, with their numbers from 1.
pub fn data_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line));
    numbered.filter(|(_, line)| {
        let start = line.trim_start();
        !start.is_empty() && !start.starts_with('#')
    })
}

/// Returns all data lines as rows of exactly `N` words.
///
/// # Errors
/// Each item is an error where the line has more or fewer words.
pub fn rows<'a, const N: usize>(
    place: &dyn fmt::Display,
    text: &'a str,
) -> impl Iterator<Item = Result<[Token<'a>; N], InputError>> {
    data_lines(text).map(move |(line, content)| {
        // One word more than expected is enough to detect that there are too many.
        let words: Vec<Token> = tokens(line, content).take(N + 1).collect();
        let column = words.get(N).or(words.last()).map_or(1, |word| word.column);
        let comparison = if words.len() > N { "more" } else { "fewer" };
        words.try_into().map_err(|_| {
            let cause = format!("the line has {comparison} columns than {N}");
            InputError::new(place, cause, "restore the file; comments start with #")
                .with_position(line, column)
        })
    })
}

/// A CSV file with a header row, whose columns are found by name.
///
/// The separator is the one of `,`, `;`, tab and `|` that the header has most of, or the one that a first line `sep=;` names;
/// quotes `"`, blanks around fields ignored, lines that start with `#` skipped. Numbers may have decimal commas where no
/// number of the table has a decimal point.
#[derive(Debug)]
pub struct CsvTable {
    place: String,
    header: Vec<String>,
    /// Line of the header, from 1; comments may precede it.
    header_line: usize,
    /// Line of each row, from 1.
    lines: Vec<u32>,
    /// All fields of all rows in one string: a table of millions of cells allocates once.
    fields: String,
    /// The end of each field in `fields`; as many per row as the header has.
    ends: Vec<u32>,
    separator: char,
    has_decimal_commas: bool,
    misfits: Vec<MisfitRow>,
}

/// Rows of a table whose number of fields is not that of the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MisfitRow {
    /// Its line, from 1.
    pub line: usize,
    /// Number of lines that it takes: more than one where a quote is not closed.
    pub line_count: usize,
    /// Number of its fields.
    pub field_count: usize,
}

/// What becomes of rows with another number of fields than the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MisfitRule {
    Refuse,
    LeaveOut,
}

impl CsvTable {
    /// Reads a CSV file, plain or compressed with gzip.
    ///
    /// # Errors
    /// When it cannot be read or a row has another number of fields than the header.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&path.display(), &read_text(path, MAX_CSV_BYTES)?)
    }

    /// Reads the CSV file of a recording, plain or compressed with gzip, see [`parse_recording`](Self::parse_recording).
    ///
    /// # Errors
    /// When it cannot be read, or those of [`parse_recording`](Self::parse_recording).
    pub fn read_recording(path: &Path) -> Result<Self, InputError> {
        Self::parse_recording(&path.display(), &read_text(path, MAX_CSV_BYTES)?)
    }

    /// Parses the text of a CSV file; `place` is its name in errors.
    ///
    /// # Errors
    /// When a row has another number of fields than the header, there is no header, or the text
    /// is longer than [`MAX_CSV_BYTES`].
    pub fn parse(place: &dyn fmt::Display, text: &str) -> Result<Self, InputError> {
        Self::parse_rows(place, text, MisfitRule::Refuse)
    }

    /// Parses the text of a recording: rows with another number of fields than the header are left out, see
    /// [`misfits`](Self::misfits).
    ///
    /// # Errors
    /// When there is no header, or the text is longer than [`MAX_CSV_BYTES`].
    pub fn parse_recording(place: &dyn fmt::Display, text: &str) -> Result<Self, InputError> {
        Self::parse_rows(place, text, MisfitRule::LeaveOut)
    }

    fn parse_rows(
        place: &dyn fmt::Display,
        text: &str,
        misfit_rule: MisfitRule,
    ) -> Result<Self, InputError> {
        if text.len() as u64 > MAX_CSV_BYTES {
            let cause = format!("the table has more than {MAX_CSV_BYTES} bytes");
            return Err(InputError::new(place, cause, "give a part of it"));
        }
        let bare = without_frame(text);
        let text = bare.as_deref().unwrap_or(text);
        let (separator, text) = separator_of(text);
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .flexible(true)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| csv_error(place, text, &e))?;
        let header: Vec<String> = header.iter().map(str::to_owned).collect();
        if header.is_empty() {
            return Err(InputError::new(place, "the file is empty", "write a header row first"));
        }
        let mut table = Self {
            place: place.to_string(),
            header,
            header_line: data_lines(text).next().map_or(1, |(line, _)| line),
            lines: Vec::new(),
            fields: String::new(),
            ends: Vec::new(),
            separator: char::from(separator),
            has_decimal_commas: false,
            misfits: Vec::new(),
        };
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(|e| csv_error(place, text, &e))? {
            if table.fits(&record, misfit_rule) {
                table.push(text, &record);
                continue;
            }
            let misfit = misfit_row(text, &record);
            if misfit_rule == MisfitRule::Refuse {
                return Err(table.misfit_error(misfit));
            }
            table.misfits.push(misfit);
        }
        table.replace_decimal_commas();
        Ok(table)
    }

    /// Returns whether a record has one field per column. Separators at the end of a row of a recording mean nothing.
    fn fits(&self, record: &csv::StringRecord, misfit_rule: MisfitRule) -> bool {
        let columns = self.header.len();
        if misfit_rule == MisfitRule::Refuse {
            return record.len() == columns;
        }
        record.len() >= columns
            && record.iter().skip(columns).all(str::is_empty)
            && !record.iter().any(|field| self.holds_rows(field))
    }

    /// Returns whether a field of several lines has as many separators as a row: a quote that is not closed takes the
    /// rows after it into one field, while a note of several lines is a field like others.
    fn holds_rows(&self, field: &str) -> bool {
        field.contains('\n') && field.matches(self.separator).count() + 1 >= self.header.len()
    }

    fn push(&mut self, text: &str, record: &csv::StringRecord) {
        self.lines.push(record.position().map_or(0, |p| line_of(text, p) as u32));
        for field in record.iter().take(self.header.len()) {
            self.fields.push_str(field);
            // The text has at most MAX_CSV_BYTES, which fit into 32 bits.
            self.ends.push(self.fields.len() as u32);
        }
    }

    /// Returns the error of a row with another number of fields than the header.
    pub fn misfit_error(&self, misfit: MisfitRow) -> InputError {
        let columns = self.header.len();
        let cause = format!("the row has {} fields, the header {columns}", misfit.field_count);
        let remedy = format!(
            "give every row one field per column of the header, separated by `{}`",
            self.separator.escape_debug()
        );
        InputError::new(&self.place, cause, remedy).with_position(misfit.line, 1)
    }

    /// Turns decimal commas into points, where the numbers of the table have commas and none has a point: with both,
    /// one of them separates thousands, and nothing tells which.
    fn replace_decimal_commas(&mut self) {
        let mut starts = Vec::new();
        let mut start = 0;
        for &end in &self.ends {
            match decimal_mark(&self.fields[start..end as usize]) {
                Some(b',') => starts.push(start..end as usize),
                Some(_) => return,
                None => {}
            }
            start = end as usize;
        }
        if starts.is_empty() {
            return;
        }
        self.has_decimal_commas = true;
        let mut bytes = std::mem::take(&mut self.fields).into_bytes();
        for range in starts {
            for byte in &mut bytes[range] {
                if *byte == b',' {
                    *byte = b'.';
                }
            }
        }
        self.fields = String::from_utf8(bytes).expect("one ASCII character in place of another");
    }

    /// Returns the character between fields.
    pub fn separator(&self) -> char {
        self.separator
    }

    /// Returns whether commas in numbers were read as decimal commas: `1,5` as 1.5.
    pub fn has_decimal_commas(&self) -> bool {
        self.has_decimal_commas
    }

    /// Returns the rows that a recording has with another number of fields than the header, in the order of the file.
    pub fn misfits(&self) -> &[MisfitRow] {
        &self.misfits
    }

    /// Returns the names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Returns the line of the header, from 1.
    pub fn header_line(&self) -> usize {
        self.header_line
    }

    /// Records how fields and numbers are separated, where the table is not the usual one of commas and points.
    pub fn record_separators(&self, report: &mut ImportReport) {
        if self.separator != ',' {
            report.add_fact("separator", format!("`{}`", self.separator.escape_debug()));
        }
        if self.has_decimal_commas {
            let rule = "commas in numbers are decimal commas: 1,5 is 1.5";
            let remedy = "write numbers without separators of thousands";
            report.record(Treatment::Guessed, rule, "", remedy);
        }
    }

    /// Returns the name of the file in errors.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Returns the index of the column called `name`, where there is one.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// Returns the indices of the columns called `names`.
    ///
    /// # Errors
    /// When some of them are missing: all of these in one error; when one is there twice.
    pub fn columns<const N: usize>(&self, names: [&str; N]) -> Result<[usize; N], InputError> {
        let count = |name: &str| self.header.iter().filter(|column| *column == name).count();
        if let Some(twice) = names.iter().find(|name| count(name) > 1) {
            let cause = format!("the header has `{twice}` more than once");
            let error = InputError::new(&self.place, cause, "keep one of these columns");
            return Err(error.with_position(self.header_line, 1));
        }
        let missing: Vec<&str> =
            names.into_iter().filter(|name| self.find(name).is_none()).collect();
        if missing.is_empty() {
            return Ok(names.map(|name| self.find(name).expect("none of them is missing")));
        }
        let (known, other): (Vec<&str>, Vec<&str>) =
            self.header.iter().map(String::as_str).partition(|name| names.contains(name));
        let cause = format!(
            "the header lacks {}; it has {}",
            quote_names(&missing),
            describe_columns(&known, &other)
        );
        let has_one_column =
            matches!(&self.header[..], [all] if missing.iter().all(|name| all.contains(name)));
        let remedy = if has_one_column {
            "separate the columns by commas, semicolons or tabs"
        } else {
            "rename the columns that mean these, with numbers in the unit that the name has, or add them"
        };
        Err(InputError::new(&self.place, cause, remedy).with_position(self.header_line, 1))
    }

    /// Returns the rows, in the order of the file.
    pub fn rows(&self) -> impl Iterator<Item = CsvRow<'_>> {
        (0..self.lines.len()).map(|index| CsvRow { table: self, index })
    }
}

/// One row of a [`CsvTable`]; its fields are not copied.
#[derive(Debug, Clone, Copy)]
pub struct CsvRow<'a> {
    table: &'a CsvTable,
    index: usize,
}

impl<'a> CsvRow<'a> {
    /// Returns the field in the column at `index`, which [`CsvTable::columns`] returned.
    ///
    /// # Panics
    /// When the header has no such column.
    pub fn field(&self, index: usize) -> Token<'a> {
        assert!(index < self.table.header.len(), "a column of the header");
        // Quotes and trimmed blanks are not kept, so the column may be off by these.
        let before: usize = (0..index).map(|i| self.text(i).chars().count() + 1).sum();
        Token { text: self.text(index), line: self.line(), column: before + 1 }
    }

    /// Returns the name of the file in errors.
    pub fn place(&self) -> &'a str {
        &self.table.place
    }

    /// Returns the line of the row, from 1.
    pub fn line(&self) -> usize {
        self.table.lines[self.index] as usize
    }

    /// Returns the text in the column at `index`, without its position in the file.
    ///
    /// # Panics
    /// When the header has no such column.
    pub fn text(&self, index: usize) -> &'a str {
        let slot = self.index * self.table.header.len() + index;
        let start = slot.checked_sub(1).map_or(0, |previous| self.table.ends[previous]);
        &self.table.fields[start as usize..self.table.ends[slot] as usize]
    }
}

/// Largest number of columns that an error lists; a table without a header may have very many.
const MAX_LISTED: usize = 16;

/// Returns the columns of a header as an error lists them: the expected ones, then the others.
fn describe_columns(known: &[&str], other: &[&str]) -> String {
    match (known, other) {
        (known, []) => quote_names(known),
        ([], other) => format!("none of the expected ones, but {}", quote_names(other)),
        (known, other) => format!("{}, and others: {}", quote_names(known), quote_names(other)),
    }
}

/// Returns names as an error lists them.
fn quote_names(names: &[&str]) -> String {
    let quoted = names.iter().take(MAX_LISTED).map(|name| format!("`{}`", shorten(name)));
    let text = quoted.collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MAX_LISTED) {
        0 if names.is_empty() => "nothing else".into(),
        0 => text,
        more => format!("{text} and {more} more"),
    }
}

/// Returns the line of the record at `position`, which is where its reader started to search for it: comments and
/// empty lines may follow.
fn line_of(text: &str, position: &csv::Position) -> usize {
    let rest = text.get(position.byte() as usize..).unwrap_or("").lines();
    let skipped = rest.take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() as usize + skipped
}

fn csv_error(place: &dyn fmt::Display, text: &str, error: &csv::Error) -> InputError {
    let line = error.position().map_or(1, |p| line_of(text, p));
    let remedy = "give every row one field per column of the header";
    InputError::new(place, error.to_string(), remedy).with_position(line, 1)
}

fn misfit_row(text: &str, record: &csv::StringRecord) -> MisfitRow {
    let line_ends: usize = record.iter().map(|field| field.matches('\n').count()).sum();
    MisfitRow {
        line: record.position().map_or(1, |p| line_of(text, p)),
        line_count: 1 + line_ends,
        field_count: record.len(),
    }
}

/// Characters that separate fields, the usual one first.
const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b'|'];

/// Returns a table that is drawn with `+---+` and `|`, as shells of databases print it, without its frame; `None` for
/// any other text. Lines keep their numbers.
fn without_frame(text: &str) -> Option<String> {
    let is_border = |line: &str| {
        line.starts_with("+-") && line.bytes().all(|b| matches!(b, b'+' | b'-' | b' ' | b'\r'))
    };
    let (_, first) = data_lines(text).next()?;
    if !is_border(first.trim_start()) {
        return None;
    }
    let mut bare = String::with_capacity(text.len());
    for line in text.lines() {
        let line = line.trim();
        if !is_border(line) {
            let inner = line.strip_prefix('|').unwrap_or(line);
            bare.push_str(inner.strip_suffix('|').unwrap_or(inner));
        }
        bare.push('\n');
    }
    Some(bare)
}

/// Returns the separator of a table, and its text: without a first line `sep=;`, which spreadsheets write, but with the
/// end of that line, so that lines are counted as in the file.
fn separator_of(text: &str) -> (u8, &str) {
    let first = text.lines().next().unwrap_or("");
    if let Some([separator]) = first.trim_end().strip_prefix("sep=").map(str::as_bytes)
        && SEPARATORS.contains(separator)
    {
        return (*separator, &text[first.len()..]);
    }
    let header = data_lines(text).next().map_or("", |(_, line)| line);
    let mut best = SEPARATORS[0];
    for separator in SEPARATORS {
        if unquoted_count(header, separator) > unquoted_count(header, best) {
            best = separator;
        }
    }
    (best, text)
}

/// Returns how often a line has a character outside of quotes.
fn unquoted_count(line: &str, wanted: u8) -> usize {
    let mut is_quoted = false;
    let mut count = 0;
    for byte in line.bytes() {
        is_quoted ^= byte == b'"';
        count += usize::from(byte == wanted && !is_quoted);
    }
    count
}

/// Returns the mark, a comma or a point, within a number of plain digits; `None` for other texts.
fn decimal_mark(text: &str) -> Option<u8> {
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text).as_bytes();
    let at = digits.iter().position(|byte| !byte.is_ascii_digit())?;
    let (before, after) = (&digits[..at], &digits[at + 1..]);
    let is_number = !before.is_empty() && !after.is_empty() && after.iter().all(u8::is_ascii_digit);
    (is_number && matches!(digits[at], b',' | b'.')).then_some(digits[at])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_column_count_names_line_and_column() {
        let wrong = |text| rows::<2>(&"f.dat", text).find_map(Result::err).unwrap();
        let error = wrong("# head\n1 2\n 1 2 3\n");
        assert_eq!(error.line_and_column(), Some((3, 6)));
        assert!(error.cause().contains("more columns than 2"));
        assert_eq!(wrong("1 \t").line_and_column(), Some((1, 1)));
    }

    #[test]
    fn a_bad_number_names_line_and_column() {
        let parsed: Vec<_> = rows::<2>(&"f.dat", "1 2\n3 \tx4\n").collect();
        let error = parsed[1].as_ref().unwrap()[1].number(&"f.dat").unwrap_err();
        assert_eq!(error.line_and_column(), Some((2, 4)));
        for word in ["nan", "inf", "1e999", "", "-"] {
            assert!(Token { text: word, line: 1, column: 1 }.number(&"f").is_err(), "{word}");
        }
        assert!(Token { text: "-1", line: 1, column: 1 }.integer(&"f").is_err());
    }

    #[test]
    fn a_file_is_found_packed_or_plain_by_its_plain_name() {
        let folder = tempfile::tempdir().unwrap();
        let packed = folder.path().join("a.dat.gz");
        std::fs::write(&packed, "").unwrap();
        assert_eq!(find_file(folder.path(), "a.dat"), Ok(packed));
        assert!(find_file(folder.path(), "b.dat").unwrap_err().cause().contains("missing"));
    }

    #[test]
    fn csv_fields_are_found_by_name_and_errors_by_line() {
        let table = CsvTable::parse(&"f.csv", "b, a\n# note\n1, 2\n").unwrap();
        let [a] = table.columns(["a"]).unwrap();
        assert_eq!(table.rows().next().unwrap().field(a).number(&"f").unwrap(), 2.0);
        let error = CsvTable::parse(&"f.csv", "a,b\n1,2\n1\n").unwrap_err();
        assert_eq!(error.line_and_column(), Some((3, 1)));
        assert!(CsvTable::parse(&"f.csv", "").is_err());
        let row = CsvTable::parse(&"f.csv", "a,b\n1,x\n").unwrap();
        let error = row.rows().next().unwrap().field(1).number(&"f.csv").unwrap_err();
        assert_eq!(error.line_and_column(), Some((2, 3)));
        let noted = CsvTable::parse(&"f.csv", "# a\n\nb,c\n1,2\n# d\n\n3,4\n").unwrap();
        let lines: Vec<usize> = noted.rows().map(|row| row.field(0).line).collect();
        assert_eq!(lines, [4, 7], "comments and empty lines count");
        let error = CsvTable::parse(&"f.csv", "a,b\r\n1,2\r\n# c\r\n1\r\n").unwrap_err();
        assert_eq!(error.line_and_column(), Some((4, 1)));
    }

    #[test]
    fn all_columns_that_a_header_lacks_are_told_at_once_beside_those_it_has() {
        let table = CsvTable::parse(&"f.csv", "# a note\nx,lat,lon\n1,2,3\n").unwrap();
        let error = table.columns(["x", "lat_deg", "lon_deg"]).unwrap_err();
        assert_eq!(error.line_and_column(), Some((2, 1)), "the header's line");
        let cause = "the header lacks `lat_deg`, `lon_deg`; it has `x`, and others: `lat`, `lon`";
        assert_eq!(error.cause(), cause);
        let other = table.columns(["a"]).unwrap_err();
        assert!(other.cause().ends_with("it has none of the expected ones, but `x`, `lat`, `lon`"));
        let wide = (0..40).map(|k| format!("c{k}")).collect::<Vec<_>>().join(",");
        let error = CsvTable::parse(&"f.csv", &wide).unwrap().columns(["a"]).unwrap_err();
        assert!(error.cause().ends_with("`c15` and 24 more"), "{}", error.cause());
    }

    fn values(text: &str) -> Vec<f64> {
        let table = CsvTable::parse(&"f.csv", text).unwrap();
        let row = table.rows().next().unwrap();
        (0..table.header().len()).map(|k| row.field(k).number(&"f.csv").unwrap()).collect()
    }

    #[test]
    fn tables_of_semicolons_and_tabs_are_read_with_decimal_commas_or_points() {
        assert_eq!(values("a;b\n1,5;-2\n"), [1.5, -2.0]);
        assert_eq!(values("a;b\n1.5;-2\n"), [1.5, -2.0]);
        assert_eq!(values("a\tb\n1,5\t+0,25\n"), [1.5, 0.25]);
        assert_eq!(values("sep=;\r\na;b\r\n1,5;2\r\n"), [1.5, 2.0]);
        assert_eq!(values("\"a;x\",b\n\"1,5\",2\n"), [1.5, 2.0]);
    }

    #[test]
    fn tables_of_databases_are_read_without_their_frames() {
        assert_eq!(values("a|b\n1.5|-2\n"), [1.5, -2.0]);
        let drawn = "+-----+----+\n| a   | b  |\n+-----+----+\n| 1.5 | -2 |\n+-----+----+\n";
        assert_eq!(values(drawn), [1.5, -2.0]);
        let table = CsvTable::parse(&"f.csv", drawn).unwrap();
        assert_eq!(table.rows().next().unwrap().line(), 4, "borders are lines, too");
    }

    #[test]
    fn a_field_of_several_lines_is_no_quote_that_was_left_open() {
        let text = "a,b,c\n1,\"two\nlines\",3\n4,5,6\n";
        let table = CsvTable::parse_recording(&"f.csv", text).unwrap();
        assert_eq!((table.rows().count(), table.misfits().len()), (2, 0));
        assert_eq!(table.rows().next().unwrap().text(1), "two\nlines");
    }

    #[test]
    fn where_commas_may_separate_thousands_they_are_no_part_of_a_number() {
        let table = CsvTable::parse(&"f.csv", "alt;lat\n35,000;47.25\n").unwrap();
        let error = table.rows().next().unwrap().field(0).number(&"f.csv").unwrap_err();
        assert!(error.cause().contains("35,000"), "{error}");
        assert!(!table.has_decimal_commas());
    }

    #[test]
    fn the_report_names_the_separator_and_the_decimal_commas() {
        let table = CsvTable::parse(&"f.csv", "a;b\n1,5;2\n").unwrap();
        let mut report = ImportReport::new("CSV");
        table.record_separators(&mut report);
        assert_eq!(report.facts[0].value, "`;`");
        assert_eq!(report.findings[0].treatment, Treatment::Guessed);
        let mut usual = ImportReport::new("CSV");
        CsvTable::parse(&"f.csv", "a,b\n1.5,2\n").unwrap().record_separators(&mut usual);
        assert_eq!(usual, ImportReport::new("CSV"));
    }

    #[test]
    fn a_column_that_is_there_twice_is_refused_where_it_is_read() {
        let table = CsvTable::parse(&"f.csv", "a,b,a\n1,2,3\n").unwrap();
        assert_eq!(table.columns(["b"]), Ok([1]));
        let error = table.columns(["a"]).unwrap_err();
        assert!(error.cause().contains("`a` more than once"), "{error}");
    }

    #[test]
    fn a_recording_goes_on_after_rows_that_do_not_fit() {
        let text = "a,b\n1,2,\n1\n\"3,4\n5,6\n7,8\n";
        let table = CsvTable::parse_recording(&"f.csv", text).unwrap();
        assert_eq!(table.rows().count(), 1, "a separator at the end of a row means nothing");
        let short = MisfitRow { line: 3, line_count: 1, field_count: 1 };
        assert_eq!(table.misfits()[0], short);
        let swallowed: usize = table.misfits().iter().map(|row| row.line_count).sum();
        assert!(swallowed >= 4, "{:?}", table.misfits());
        let error = CsvTable::parse(&"f.csv", "a;b\n1,5\n").unwrap_err();
        assert!(error.remedy().contains("separated by `;`"), "{error}");
    }
}
