//! A table of columns, as programs have them: numbers that stay where they are, and words by their number.
//!
//! Millions of rows are learned from without a copy of their numbers: each pass over the table reads them again, a block
//! of rows at a time.

use std::collections::BTreeMap;

use crate::log_table::{CellValue, LogRow, LogTable, Numbers, RowVisitor};
use sidestep_kernel::InputError;

/// Number of rows that are read at once: few enough that a block of all columns stays in the nearest cache.
pub(crate) const BLOCK_ROWS: usize = 4096;

/// Number of the empty word, which stands for a missing one.
const MISSING: u32 = 0;

/// Number of words that are compared one after the other.
const COMPARED_WORDS: usize = 8;

/// A column of words: each kind of word once, and a number for each row.
#[derive(Debug, Clone)]
pub struct Words {
    /// The empty word, then the others in the order in which they came.
    texts: Vec<String>,
    numbers: BTreeMap<String, u32>,
    rows: WordNumbers,
    /// The word that came last: most columns repeat few words.
    last: u32,
}

/// The number of the word of each row, in a byte as long as there are few words.
#[derive(Debug, Clone)]
enum WordNumbers {
    Few(Vec<u8>),
    Many(Vec<u32>),
}

impl Default for Words {
    fn default() -> Self {
        let numbers = BTreeMap::from([(String::new(), MISSING)]);
        let rows = WordNumbers::Few(Vec::new());
        Self { texts: vec![String::new()], numbers, rows, last: MISSING }
    }
}

impl Words {
    /// Adds a row with this word, without the blanks around it; `None` or an empty word where it is missing.
    pub fn push(&mut self, word: Option<&str>) {
        let number = word.map_or(MISSING, |word| self.number_of(word));
        self.push_number(number);
    }

    /// Returns the number of a word, which it gets when it is new.
    pub fn number_of(&mut self, word: &str) -> u32 {
        if self.texts[self.last as usize] == word {
            return self.last;
        }
        // Most columns have few words, which are compared faster than they are searched for.
        if let Some(number) = self.texts.iter().take(COMPARED_WORDS).position(|text| text == word) {
            self.last = number as u32;
            return self.last;
        }
        let word = word.trim();
        self.last = match self.numbers.get(word) {
            Some(number) => *number,
            None => self.add(word),
        };
        self.last
    }

    fn add(&mut self, word: &str) -> u32 {
        let number = self.texts.len() as u32;
        self.texts.push(word.to_owned());
        self.numbers.insert(word.to_owned(), number);
        if number > u32::from(u8::MAX)
            && let WordNumbers::Few(rows) = &self.rows
        {
            self.rows = WordNumbers::Many(rows.iter().map(|&number| u32::from(number)).collect());
        }
        number
    }

    /// Adds a row with the word of this number, which [`number_of`](Self::number_of) returned; 0 is a missing one.
    ///
    /// # Panics
    /// When no word has the number.
    pub fn push_number(&mut self, number: u32) {
        assert!((number as usize) < self.texts.len(), "the number of a word");
        match &mut self.rows {
            WordNumbers::Few(rows) => rows.push(number as u8),
            WordNumbers::Many(rows) => rows.push(number),
        }
    }

    /// Returns the number of rows.
    pub fn row_count(&self) -> usize {
        match &self.rows {
            WordNumbers::Few(rows) => rows.len(),
            WordNumbers::Many(rows) => rows.len(),
        }
    }

    /// Returns the word of a row; `None` where it is missing.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn word(&self, row: usize) -> Option<&str> {
        match self.value(row) {
            CellValue::Word(word) => Some(word),
            _ => None,
        }
    }

    fn value(&self, row: usize) -> CellValue<'_> {
        let number = match &self.rows {
            WordNumbers::Few(rows) => u32::from(rows[row]),
            WordNumbers::Many(rows) => rows[row],
        };
        match number {
            MISSING => CellValue::Missing,
            number => CellValue::Word(&self.texts[number as usize]),
        }
    }
}

/// The values of a column.
pub enum ColumnCells {
    /// Reals; NaN where one is missing.
    Reals(Box<dyn Numbers>),
    /// Integers; NaN where one is missing.
    Integers(Box<dyn Numbers>),
    /// Words.
    Words(Words),
}

impl ColumnCells {
    /// Returns the number of rows.
    pub fn row_count(&self) -> usize {
        match self {
            Self::Reals(numbers) | Self::Integers(numbers) => numbers.row_count(),
            Self::Words(words) => words.row_count(),
        }
    }

    fn numbers(&self) -> Option<&dyn Numbers> {
        match self {
            Self::Reals(numbers) | Self::Integers(numbers) => Some(numbers.as_ref()),
            Self::Words(_) => None,
        }
    }
}

impl Numbers for Vec<f64> {
    fn row_count(&self) -> usize {
        self.len()
    }

    fn read(&self, first_row: usize, into: &mut [f64]) {
        into.copy_from_slice(&self[first_row..first_row + into.len()]);
    }
}

/// A table of named columns of one length.
pub struct ColumnTable {
    place: String,
    names: Vec<String>,
    columns: Vec<ColumnCells>,
    row_count: usize,
}

impl ColumnTable {
    /// Creates a table; `place` is its name in errors.
    ///
    /// # Errors
    /// When the columns differ in length.
    pub fn new(place: &str, columns: Vec<(String, ColumnCells)>) -> Result<Self, InputError> {
        let row_count = columns.first().map_or(0, |(_, cells)| cells.row_count());
        if columns.iter().any(|(_, cells)| cells.row_count() != row_count) {
            let lengths =
                columns.iter().map(|(name, cells)| format!("{name} has {}", cells.row_count()));
            let cause = format!("their lengths differ: {}", lengths.collect::<Vec<_>>().join(", "));
            return Err(InputError::new("columns", cause, "give one value of each per row"));
        }
        let (names, columns) = columns.into_iter().unzip();
        Ok(Self { place: place.to_owned(), names, columns, row_count })
    }
}

impl LogTable for ColumnTable {
    fn place(&self) -> &str {
        &self.place
    }

    fn header(&self) -> &[String] {
        &self.names
    }

    fn row_count(&self) -> usize {
        self.row_count
    }

    fn require(&self, names: [&str; 4]) -> Result<[usize; 4], InputError> {
        let is_missing = |name: &&str| self.find(name).is_none();
        let missing: Vec<&str> = names.into_iter().filter(is_missing).collect();
        if missing.is_empty() {
            return Ok(names.map(|name| self.find(name).expect("none of them is missing")));
        }
        let cause = format!("columns are missing: {}", quoted(&missing));
        let remedy = format!("give each of {}, with one value per row", quoted(&names));
        Err(InputError::new(&self.place, cause, remedy))
    }

    fn visit_rows(&self, columns: &[usize], visit: &mut RowVisitor<'_>) -> Result<(), InputError> {
        let mut row = BlockRow {
            table: self,
            numbers: vec![Vec::new(); self.columns.len()],
            first_row: 0,
            offset: 0,
        };
        for first_row in (0..self.row_count).step_by(BLOCK_ROWS) {
            let length = BLOCK_ROWS.min(self.row_count - first_row);
            row.first_row = first_row;
            for &column in columns {
                let Some(numbers) = self.columns[column].numbers() else { continue };
                row.numbers[column].resize(length, f64::NAN);
                numbers.read(first_row, &mut row.numbers[column]);
            }
            for offset in 0..length {
                row.offset = offset;
                visit(first_row + offset, &row)?;
            }
        }
        Ok(())
    }

    fn numbers(&self, column: usize) -> Option<&dyn Numbers> {
        self.columns[column].numbers()
    }

    fn option(&self, _flag: &str, keyword: &str, value: &str) -> String {
        format!("{keyword}={value:?}")
    }

    fn option_name<'n>(&self, _flag: &'n str, keyword: &'n str) -> &'n str {
        keyword
    }
}

fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// One row of the block of a table that was read last.
struct BlockRow<'t> {
    table: &'t ColumnTable,
    /// The numbers of the block by column; empty where they were not asked for.
    numbers: Vec<Vec<f64>>,
    first_row: usize,
    offset: usize,
}

impl LogRow for BlockRow<'_> {
    fn value(&self, column: usize) -> CellValue<'_> {
        match &self.table.columns[column] {
            ColumnCells::Words(words) => words.value(self.first_row + self.offset),
            ColumnCells::Reals(_) => number_or_missing(self.numbers[column][self.offset], false),
            ColumnCells::Integers(_) => number_or_missing(self.numbers[column][self.offset], true),
        }
    }

    fn error(&self, column: usize, cause: String, remedy: &str) -> InputError {
        let name = &self.table.names[column];
        let row = self.first_row + self.offset;
        let place = format!("{}, column `{name}`, row {row} (from 0)", self.table.place);
        InputError::new(place, cause, remedy)
    }
}

fn number_or_missing<'t>(number: f64, is_whole: bool) -> CellValue<'t> {
    if number.is_nan() {
        CellValue::Missing
    } else if is_whole {
        CellValue::Whole(number)
    } else {
        CellValue::Real(number)
    }
}

/// The numbers of a column that is read again: where the table has words, those that were read from them are kept.
pub(crate) enum NumberColumn<'t> {
    /// As the table has them.
    Table(&'t dyn Numbers),
    /// As they were read from words; anything in a row that is left out.
    Own(Vec<f64>),
}

impl<'t> NumberColumn<'t> {
    pub(crate) fn new(table: &'t dyn LogTable, column: usize) -> Self {
        match table.numbers(column) {
            Some(numbers) => Self::Table(numbers),
            None => Self::Own(Vec::with_capacity(table.row_count())),
        }
    }

    /// Adds the number of the next row.
    pub(crate) fn push(&mut self, number: f64) {
        if let Self::Own(own) = self {
            own.push(number);
        }
    }

    pub(crate) fn read(&self, first_row: usize, into: &mut [f64]) {
        match self {
            Self::Table(numbers) => numbers.read(first_row, into),
            Self::Own(numbers) => numbers.read(first_row, into),
        }
    }
}

/// The number of the robot of each row, for which most tables need no memory: they are of robot 0 alone.
#[derive(Debug, Clone)]
pub(crate) struct RobotColumn {
    /// Empty as long as all rows are of robot 0.
    robots: Vec<u32>,
    rows: usize,
    expected_rows: usize,
}

impl RobotColumn {
    pub(crate) fn new(expected_rows: usize) -> Self {
        Self { robots: Vec::new(), rows: 0, expected_rows }
    }

    /// Adds the robot of the next row.
    pub(crate) fn push(&mut self, robot: u32) {
        if robot != 0 && self.robots.is_empty() {
            self.robots.reserve_exact(self.expected_rows);
            self.robots.resize(self.rows, 0);
        }
        if robot != 0 || !self.robots.is_empty() {
            self.robots.push(robot);
        }
        self.rows += 1;
    }

    pub(crate) fn get(&self, row: usize) -> u32 {
        self.robots.get(row).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests;
