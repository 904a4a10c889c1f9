//! Tables of text: plain or gzip files, columns of numbers, and CSV with a header.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use crate::kernel::InputError;

/// The longest text that is read, in bytes after unpacking: some 20 times the largest known log.
pub const TEXT_BYTES_MAX: u64 = 1 << 29;

/// The text of a file; a name that ends in `.gz` is unpacked.
///
/// # Errors
/// When the file cannot be read, is no UTF-8, or holds more than [`TEXT_BYTES_MAX`] bytes.
pub fn read_text(path: &Path) -> Result<String, InputError> {
    let text = File::open(path).and_then(|file| {
        let packed = path.extension().is_some_and(|e| e == "gz");
        let source: Box<dyn Read> =
            if packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
        read_limited(source, TEXT_BYTES_MAX)
    });
    text.map_err(|e| {
        InputError::new(path.display(), format!("cannot be read: {e}"), "name a readable text file")
    })
}

/// Reads at most `limit` bytes, so that a packed file cannot fill the memory.
fn read_limited(source: impl Read, limit: u64) -> std::io::Result<String> {
    let mut text = String::new();
    let read = source.take(limit + 1).read_to_string(&mut text)? as u64;
    if read > limit {
        return Err(std::io::Error::other(format!("holds more than {limit} bytes of text")));
    }
    Ok(text)
}

/// The file `name` in `folder`, or `name.gz` where only that exists.
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

/// One word of a text and where it stands.
#[derive(Debug, Clone, Copy)]
pub struct Word<'a> {
    /// The word without the blanks around it.
    pub text: &'a str,
    /// Line, from 1.
    pub line: usize,
    /// Column of its first character, from 1.
    pub column: usize,
}

impl Word<'_> {
    /// An error that points at this word.
    pub fn error(&self, place: &dyn fmt::Display, cause: String, remedy: &str) -> InputError {
        InputError::new(place, cause, remedy).at(self.line, self.column)
    }

    /// The word as a finite number.
    ///
    /// # Errors
    /// When it is no number, infinite or not a number.
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

    /// The word as a whole number from 0.
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

/// A word as it is quoted in an error: its first 40 characters.
fn shorten(text: &str) -> &str {
    text.char_indices().nth(40).map_or(text, |(end, _)| &text[..end])
}

/// The words of line number `line`, separated by blanks or tabs.
pub fn words(line: usize, text: &str) -> impl Iterator<Item = Word<'_>> {
    text.split_ascii_whitespace().map(move |word| {
        let offset = word.as_ptr() as usize - text.as_ptr() as usize;
        Word { text: word, line, column: text[..offset].chars().count() + 1 }
    })
}

/// The lines that hold data: neither blank nor a `#` comment. Numbered from 1.
pub fn data_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line));
    numbered.filter(|(_, line)| {
        let start = line.trim_start();
        !start.is_empty() && !start.starts_with('#')
    })
}

/// All data lines as rows of exactly `N` words.
///
/// # Errors
/// When a line has more or fewer words.
pub fn rows<'a, const N: usize>(
    place: &dyn fmt::Display,
    text: &'a str,
) -> Result<Vec<[Word<'a>; N]>, InputError> {
    data_lines(text)
        .map(|(line, content)| {
            let found: Vec<Word> = words(line, content).collect();
            let count = found.len();
            let past = found.get(N).or(found.last()).map_or(1, |word| word.column);
            found.try_into().map_err(|_| {
                InputError::new(
                    place,
                    format!("the line has {count} columns instead of {N}"),
                    "restore the file; comments start with #",
                )
                .at(line, past)
            })
        })
        .collect()
}

/// A CSV file with a header row: fields are found by the name of their column.
///
/// Separator `,`, quotes `"`, blanks around fields ignored, lines that start with `#` skipped.
#[derive(Debug)]
pub struct CsvTable {
    place: String,
    header: Vec<String>,
    /// Line of each record, from 1, and its fields.
    records: Vec<(usize, csv::StringRecord)>,
}

impl CsvTable {
    /// Reads a file, `.csv` or `.csv.gz`.
    ///
    /// # Errors
    /// When it cannot be read or a row has another number of fields than the header.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&path.display(), &read_text(path)?)
    }

    /// Parses text; `place` is named in errors.
    ///
    /// # Errors
    /// When a row has another number of fields than the header, or there is no header.
    pub fn parse(place: &dyn fmt::Display, text: &str) -> Result<Self, InputError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
        let header = reader.headers().map_err(|e| csv_error(place, &e))?;
        let header: Vec<String> = header.iter().map(str::to_owned).collect();
        if header.is_empty() {
            return Err(InputError::new(place, "the file is empty", "write a header row first"));
        }
        let numbered = |record: csv::StringRecord| {
            (record.position().map_or(0, |p| p.line() as usize), record)
        };
        let records = reader.records().map(|r| r.map(numbered)).collect::<Result<_, _>>();
        let records = records.map_err(|e| csv_error(place, &e))?;
        Ok(Self { place: place.to_string(), header, records })
    }

    /// The file, as errors name it.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// The position of the column called `name`, where there is one.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// The position of the column called `name`.
    ///
    /// # Errors
    /// When there is none.
    pub fn column(&self, name: &str) -> Result<usize, InputError> {
        self.find(name).ok_or_else(|| {
            let found = self.header.join(",");
            let cause = format!("no column `{name}` in the header `{}`", shorten(&found));
            InputError::new(&self.place, cause, format!("add a column named {name}")).at(1, 1)
        })
    }

    /// The rows, in the order of the file.
    pub fn rows(&self) -> impl Iterator<Item = CsvRow<'_>> {
        self.records.iter().map(|(line, fields)| CsvRow { line: *line, fields })
    }
}

/// One row of a [`CsvTable`].
#[derive(Debug, Clone, Copy)]
pub struct CsvRow<'a> {
    line: usize,
    fields: &'a csv::StringRecord,
}

impl<'a> CsvRow<'a> {
    /// The field in the column at `index`, which [`CsvTable::column`] gave.
    pub fn field(&self, index: usize) -> Word<'a> {
        // Quotes and trimmed blanks are not in the record, so the column may be off by those.
        let before: usize =
            self.fields.iter().take(index).map(|field| field.chars().count() + 1).sum();
        let text = self.fields.get(index).unwrap_or_default();
        Word { text, line: self.line, column: before + 1 }
    }
}

fn csv_error(place: &dyn fmt::Display, error: &csv::Error) -> InputError {
    let line = error.position().map_or(1, |p| p.line() as usize);
    let cause = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("the row has {len} fields, the header {expected_len}")
        }
        _ => error.to_string(),
    };
    InputError::new(place, cause, "give every row one field per column of the header").at(line, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_wrong_column_count_names_line_and_column() {
        let error = rows::<2>(&"f.dat", "# head\n1 2\n 1 2 3\n").unwrap_err();
        assert_eq!(error.position(), Some((3, 6)));
        assert!(error.cause().contains("3 columns instead of 2"));
        assert_eq!(rows::<2>(&"f.dat", "1 \t").unwrap_err().position(), Some((1, 1)));
    }

    #[test]
    fn a_bad_number_names_line_and_column() {
        let parsed = rows::<2>(&"f.dat", "1 2\n3 \tx4\n").unwrap();
        let error = parsed[1][1].number(&"f.dat").unwrap_err();
        assert_eq!(error.position(), Some((2, 4)));
        for word in ["nan", "inf", "1e999", "", "-"] {
            assert!(Word { text: word, line: 1, column: 1 }.number(&"f").is_err(), "{word}");
        }
        assert!(Word { text: "-1", line: 1, column: 1 }.integer(&"f").is_err());
    }

    #[test]
    fn a_packed_file_reads_like_a_plain_one_and_is_found_by_its_plain_name() {
        let folder = tempfile::tempdir().unwrap();
        let packed = File::create(folder.path().join("a.dat.gz")).unwrap();
        let mut encoder = flate2::write::GzEncoder::new(packed, flate2::Compression::fast());
        encoder.write_all(b"1 2\n").unwrap();
        encoder.finish().unwrap();
        let path = find_file(folder.path(), "a.dat").unwrap();
        assert_eq!(read_text(&path).unwrap(), "1 2\n");
        assert!(find_file(folder.path(), "b.dat").unwrap_err().cause().contains("missing"));
    }

    #[test]
    fn a_damaged_packed_file_and_a_too_long_text_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gz");
        std::fs::write(&path, b"not packed").unwrap();
        assert!(read_text(&path).is_err());
        assert!(read_limited(&b"12345"[..], 4).is_err());
        assert_eq!(read_limited(&b"1234"[..], 4).unwrap(), "1234");
    }

    #[test]
    fn csv_fields_are_found_by_name_and_errors_by_line() {
        let table = CsvTable::parse(&"f.csv", "b, a\n# note\n1, 2\n").unwrap();
        let a = table.column("a").unwrap();
        assert_eq!(table.rows().next().unwrap().field(a).number(&"f").unwrap(), 2.0);
        assert!(table.column("c").unwrap_err().cause().contains("no column `c`"));
        let error = CsvTable::parse(&"f.csv", "a,b\n1,2\n1\n").unwrap_err();
        assert_eq!(error.position(), Some((3, 1)));
        assert!(CsvTable::parse(&"f.csv", "").is_err());
        let row = CsvTable::parse(&"f.csv", "a,b\n1,x\n").unwrap();
        let error = row.rows().next().unwrap().field(1).number(&"f.csv").unwrap_err();
        assert_eq!(error.position(), Some((2, 3)));
    }
}
