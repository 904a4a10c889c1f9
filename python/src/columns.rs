//! Columns of arrays and data frames as a table that is learned from: numbers stay where they are, words are numbered.

use crate::error::argument_error;
use numpy::ndarray::{Axis, Slice};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::basic::CompareOp;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyString};
use sidestep::kernel::InputError;
use sidestep::learn::columns::{ColumnCells, ColumnTable, Words};
use sidestep::learn::log_table::Numbers;

/// Columns that are told chunk by chunk: the base of `sidestep/_columns.py`.
#[pyclass(module = "sidestep")]
#[derive(Default)]
pub(crate) struct LogColumns {
    columns: Vec<(String, Column)>,
}

enum Column {
    Numbers(ChunkedNumbers),
    Words(Words),
}

/// The numbers of a column, in arrays that belong to somebody else.
struct ChunkedNumbers {
    chunks: Vec<Box<dyn NumberChunk>>,
    /// Number of rows before each chunk.
    starts: Vec<usize>,
    row_count: usize,
    /// Whether the type is one of integers.
    is_whole: bool,
}

/// A part of a column of numbers.
trait NumberChunk: Send + Sync {
    fn row_count(&self) -> usize;

    /// Reads the numbers from a row of the chunk on; NaN where one is missing.
    fn read(&self, py: Python<'_>, first_row: usize, into: &mut [f64]);
}

impl Numbers for ChunkedNumbers {
    fn row_count(&self) -> usize {
        self.row_count
    }

    /// The arrays belong to Python, which is attached for the time of one block; other threads run between blocks.
    fn read(&self, first_row: usize, into: &mut [f64]) {
        Python::attach(|py| {
            let mut done = 0;
            while done < into.len() {
                let row = first_row + done;
                let index = self.starts.partition_point(|start| *start <= row) - 1;
                let chunk = &self.chunks[index];
                let start = self.starts[index];
                let length = (start + chunk.row_count() - row).min(into.len() - done);
                chunk.read(py, row - start, &mut into[done..done + length]);
                done += length;
            }
        });
    }
}

/// A type of numbers in arrays.
trait Real: numpy::Element + Copy + 'static {
    const IS_WHOLE: bool;

    fn as_f64(self) -> f64;
}

macro_rules! real {
    ($($ty:ty: $is_whole:literal),*) => {$(
        impl Real for $ty {
            const IS_WHOLE: bool = $is_whole;

            fn as_f64(self) -> f64 {
                self as f64
            }
        }
    )*};
}

real!(f64: false, f32: false, i64: true, u64: true, i32: true, u32: true, i16: true, u16: true, i8: true, u8: true);

/// An array of numbers, with a bit per row that is 0 where the number is missing.
struct ArrayChunk<T: Real> {
    values: Py<PyArray1<T>>,
    valid: Option<Py<PyArray1<u8>>>,
    /// The bit of the first row.
    first_bit: usize,
    row_count: usize,
}

impl<T: Real> NumberChunk for ArrayChunk<T> {
    fn row_count(&self) -> usize {
        self.row_count
    }

    fn read(&self, py: Python<'_>, first_row: usize, into: &mut [f64]) {
        // An array that became shorter meanwhile has nothing where its rows were.
        into.fill(f64::NAN);
        let end_row = first_row + into.len();
        let Ok(values) = self.values.bind(py).try_readonly() else { return };
        if values.len() < end_row {
            return;
        }
        match values.as_slice() {
            Ok(values) => copy(&values[first_row..end_row], into),
            Err(_) => {
                let view = values.as_array();
                let part = view.slice_axis(Axis(0), Slice::from(first_row..end_row));
                part.iter().zip(&mut *into).for_each(|(value, cell)| *cell = value.as_f64());
            }
        }
        let Some(Ok(bytes)) = self.valid.as_ref().map(|bits| bits.bind(py).try_readonly()) else {
            return;
        };
        let Ok(bytes) = bytes.as_slice() else { return };
        for (row, cell) in (first_row..).zip(into) {
            if !is_set(bytes, self.first_bit + row) {
                *cell = f64::NAN;
            }
        }
    }
}

fn copy<T: Real>(values: &[T], into: &mut [f64]) {
    values.iter().zip(into).for_each(|(value, cell)| *cell = value.as_f64());
}

/// Numbers that were read from objects.
struct OwnChunk(Vec<f64>);

impl NumberChunk for OwnChunk {
    fn row_count(&self) -> usize {
        self.0.len()
    }

    fn read(&self, _py: Python<'_>, first_row: usize, into: &mut [f64]) {
        Numbers::read(&self.0, first_row, into);
    }
}

/// Returns a bit of a bitmap, the lowest of each byte first.
fn is_set(bytes: &[u8], bit: usize) -> bool {
    bytes.get(bit / 8).is_some_and(|byte| byte >> (bit % 8) & 1 == 1)
}

/// Which rows of a chunk have a value: a bitmap, and the bit of the first row. All have one where there is no bitmap.
#[derive(FromPyObject)]
struct Validity<'py>(Option<PyReadonlyArray1<'py, u8>>, usize);

impl Validity<'_> {
    fn has(&self, row: usize) -> bool {
        let Self(bits, first_bit) = self;
        bits.as_ref()
            .and_then(|bits| bits.as_slice().ok())
            .is_none_or(|bytes| is_set(bytes, first_bit + row))
    }

    fn word<'w>(&self, row: usize, word: Option<&'w str>) -> Option<&'w str> {
        word.filter(|_| self.has(row))
    }
}

#[pymethods]
impl LogColumns {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Adds an array of numbers to a column, which is kept and not copied.
    fn add_numbers(
        &mut self,
        name: &str,
        values: &Bound<'_, PyAny>,
        valid: Validity<'_>,
    ) -> PyResult<()> {
        macro_rules! add_as {
            ($($ty:ty),*) => {$(
                if let Ok(values) = values.cast::<PyArray1<$ty>>() {
                    return self.add_array::<$ty>(name, values, &valid);
                }
            )*};
        }
        add_as!(f64, f32, i64, u64, i32, u32, i16, u16, i8, u8);
        let what = values.get_type().name()?;
        let cause = format!("the column `{name}` is no array of numbers, but {what}");
        Err(argument_error("columns", cause, "give a column of numbers or words, one per row"))
    }

    /// Adds text to a column as Arrow has it: all characters, and where each word begins and ends.
    fn add_texts(
        &mut self,
        name: &str,
        offsets: PyReadonlyArray1<'_, i64>,
        characters: PyReadonlyArray1<'_, u8>,
        valid: Validity<'_>,
    ) -> PyResult<()> {
        let words = self.words(name)?;
        let offsets = offsets.as_slice()?;
        let characters = characters.as_slice()?;
        for (row, ends) in offsets.windows(2).enumerate() {
            let word = characters.get(ends[0] as usize..ends[1] as usize).and_then(as_text);
            words.push(valid.word(row, word));
        }
        Ok(())
    }

    /// Adds text to a column as views of Arrow: 16 bytes per row, with the word itself or the place of it in a buffer.
    fn add_views(
        &mut self,
        name: &str,
        views: PyReadonlyArray2<'_, u8>,
        buffers: Vec<PyReadonlyArray1<'_, u8>>,
        valid: Validity<'_>,
    ) -> PyResult<()> {
        let words = self.words(name)?;
        let buffers = buffers.iter().map(|b| b.as_slice()).collect::<Result<Vec<_>, _>>()?;
        for (row, view) in views.as_slice()?.chunks_exact(16).enumerate() {
            let word = view_bytes(view, &buffers).and_then(as_text);
            words.push(valid.word(row, word));
        }
        Ok(())
    }

    /// Adds words to a column by their places in a list; None in it is a missing one.
    fn add_codes(
        &mut self,
        name: &str,
        codes: PyReadonlyArray1<'_, i64>,
        texts: Vec<Option<String>>,
        valid: Validity<'_>,
    ) -> PyResult<()> {
        let words = self.words(name)?;
        let number = |text: &Option<String>| text.as_ref().map_or(0, |text| words.number_of(text));
        let numbers: Vec<u32> = texts.iter().map(number).collect();
        for (row, code) in codes.as_array().iter().enumerate() {
            let number = usize::try_from(*code).ok().and_then(|code| numbers.get(code));
            let is_valid = valid.has(row);
            words.push_number(number.copied().filter(|_| is_valid).unwrap_or(0));
        }
        Ok(())
    }

    /// Adds text to a column as NumPy has it: characters of 32 bits, zeros behind the last.
    fn add_characters(
        &mut self,
        name: &str,
        characters: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<()> {
        let words = self.words(name)?;
        let mut known: Vec<(Vec<u32>, u32)> = Vec::new();
        for row in characters.as_array().rows() {
            let Some(letters) = row.to_slice() else { return Err(mixed(name)) };
            if let Some((_, number)) = known.iter().find(|(word, _)| word == letters) {
                words.push_number(*number);
                continue;
            }
            let is_letter = |letter: &&u32| **letter != 0;
            let of_word = letters.iter().take_while(is_letter);
            let text: String = of_word.filter_map(|letter| char::from_u32(*letter)).collect();
            let number = words.number_of(&text);
            words.push_number(number);
            // Where there are more, a search through all of them takes longer than to read the word.
            if known.len() < MAX_KNOWN_WORDS {
                known.push((letters.to_vec(), number));
            }
        }
        Ok(())
    }

    /// Adds an array of objects to a column: numbers, words, and None or NaN where one is missing.
    fn add_objects(
        &mut self,
        name: &str,
        objects: PyReadonlyArray1<'_, Py<PyAny>>,
    ) -> PyResult<()> {
        let py = objects.py();
        let objects = objects.as_array();
        let mut kind = ObjectKind::Missing;
        for object in objects {
            kind = kind.with(ObjectKind::of(object.bind(py)));
            if kind == ObjectKind::Other {
                break;
            }
        }
        if matches!(kind, ObjectKind::Integers | ObjectKind::Reals) {
            let number = |object: &Py<PyAny>| object.bind(py).extract().unwrap_or(f64::NAN);
            let chunk = OwnChunk(objects.iter().map(number).collect());
            return self.push_chunk(name, Box::new(chunk), kind == ObjectKind::Integers);
        }
        let words = self.words(name)?;
        for object in objects {
            push_object(words, object.bind(py))?;
        }
        Ok(())
    }

    /// Returns the names of the columns.
    fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Returns the cells of a column as text; None where one is missing. There must be such a column.
    fn texts(&self, name: &str) -> Vec<Option<String>> {
        let Some((_, column)) = self.columns.iter().find(|(known, _)| known == name) else {
            return Vec::new();
        };
        match column {
            Column::Words(words) => {
                (0..words.row_count()).map(|row| words.word(row).map(str::to_owned)).collect()
            }
            Column::Numbers(numbers) => {
                let mut cells = vec![f64::NAN; numbers.row_count];
                numbers.read(0, &mut cells);
                cells.iter().map(|cell| number_text(*cell, numbers.is_whole)).collect()
            }
        }
    }
}

/// Number of kinds of words that are looked for by their characters.
const MAX_KNOWN_WORDS: usize = 16;

impl LogColumns {
    /// Takes all columns as a table; `place` is its name in errors.
    pub(crate) fn take_table(&mut self, place: &str) -> Result<ColumnTable, InputError> {
        let columns = std::mem::take(&mut self.columns).into_iter();
        let cells = columns.map(|(name, column)| {
            let cells = match column {
                Column::Words(words) => ColumnCells::Words(words),
                Column::Numbers(numbers) if numbers.is_whole => {
                    ColumnCells::Integers(Box::new(numbers))
                }
                Column::Numbers(numbers) => ColumnCells::Reals(Box::new(numbers)),
            };
            (name, cells)
        });
        ColumnTable::new(place, cells.collect())
    }

    fn add_array<T: Real>(
        &mut self,
        name: &str,
        values: &Bound<'_, PyArray1<T>>,
        valid: &Validity<'_>,
    ) -> PyResult<()> {
        let Validity(bits, first_bit) = valid;
        let chunk = ArrayChunk {
            row_count: values.len(),
            values: values.clone().unbind(),
            valid: bits.as_ref().map(|bits| (**bits).clone().unbind()),
            first_bit: *first_bit,
        };
        self.push_chunk(name, Box::new(chunk), T::IS_WHOLE)
    }

    fn push_chunk(
        &mut self,
        name: &str,
        chunk: Box<dyn NumberChunk>,
        is_whole: bool,
    ) -> PyResult<()> {
        let new = || {
            Column::Numbers(ChunkedNumbers {
                chunks: Vec::new(),
                starts: Vec::new(),
                row_count: 0,
                is_whole,
            })
        };
        let Column::Numbers(numbers) = self.column(name, new) else { return Err(mixed(name)) };
        if chunk.row_count() > 0 {
            numbers.starts.push(numbers.row_count);
            numbers.row_count += chunk.row_count();
            numbers.chunks.push(chunk);
        }
        numbers.is_whole &= is_whole;
        Ok(())
    }

    fn words(&mut self, name: &str) -> PyResult<&mut Words> {
        match self.column(name, || Column::Words(Words::default())) {
            Column::Words(words) => Ok(words),
            Column::Numbers(_) => Err(mixed(name)),
        }
    }

    fn column(&mut self, name: &str, new: impl FnOnce() -> Column) -> &mut Column {
        let known = self.columns.iter().position(|(known, _)| known == name);
        let index = known.unwrap_or(self.columns.len());
        if known.is_none() {
            self.columns.push((name.to_owned(), new()));
        }
        &mut self.columns[index].1
    }
}

fn number_text(number: f64, is_whole: bool) -> Option<String> {
    if number.is_nan() {
        return None;
    }
    Some(if is_whole { format!("{number}") } else { format!("{number:?}") })
}

fn mixed(name: &str) -> PyErr {
    let cause = format!("the column `{name}` has numbers in some chunks and words in others");
    argument_error("columns", cause, "give all of its values one type")
}

fn as_text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

/// Returns the bytes of a view of Arrow: its length, and up to 12 bytes of text or else four of text, the number of a
/// buffer and the place in it.
fn view_bytes<'v>(view: &'v [u8], buffers: &[&'v [u8]]) -> Option<&'v [u8]> {
    let word = |at: usize| {
        let bytes: [u8; 4] = view[at..at + 4].try_into().expect("four bytes");
        u32::from_le_bytes(bytes) as usize
    };
    let length = word(0);
    if length <= 12 {
        return Some(&view[4..4 + length]);
    }
    buffers.get(word(8))?.get(word(12)..word(12) + length)
}

/// The kind of the objects of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ObjectKind {
    /// None or NaN alone.
    Missing,
    Integers,
    Reals,
    /// Words, or several kinds.
    Other,
}

impl ObjectKind {
    fn of(object: &Bound<'_, PyAny>) -> Self {
        if object.is_none() {
            Self::Missing
        } else if let Ok(number) = object.cast::<PyFloat>() {
            if number.value().is_nan() { Self::Missing } else { Self::Reals }
        } else if object.is_exact_instance_of::<PyInt>() && object.extract::<i32>().is_ok() {
            Self::Integers
        } else {
            Self::Other
        }
    }

    fn with(self, other: Self) -> Self {
        match (self, other) {
            (kind, Self::Missing) | (Self::Missing, kind) => kind,
            (one, other) if one == other => one,
            _ => Self::Other,
        }
    }
}

/// Adds an object as the word that a table of text would have.
fn push_object(words: &mut Words, object: &Bound<'_, PyAny>) -> PyResult<()> {
    if let Ok(text) = object.cast::<PyString>() {
        words.push(Some(text.to_str()?));
        return Ok(());
    }
    if let Ok(value) = object.cast::<PyBool>() {
        words.push(Some(if value.is_true() { "yes" } else { "no" }));
        return Ok(());
    }
    if object.is_none() || is_missing(object) {
        words.push(None);
        return Ok(());
    }
    // A number of NumPy, whose text is none that a table has.
    if object.hasattr("dtype")? && !object.is_instance_of::<PyFloat>() {
        let item = object.call_method0("item")?;
        if !item.hasattr("dtype")? {
            return push_object(words, &item);
        }
    }
    let text = if object.is_instance_of::<PyFloat>() {
        object.extract::<f64>()?.into_pyobject(object.py())?.into_any().str()?
    } else {
        object.str()?
    };
    words.push(Some(text.to_str()?));
    Ok(())
}

/// Returns whether an object is not equal to itself, as NaN; what has no truth value in comparisons is the missing value of data frames.
fn is_missing(object: &Bound<'_, PyAny>) -> bool {
    let differs =
        object.rich_compare(object, CompareOp::Ne).and_then(|differs| differs.is_truthy());
    differs.unwrap_or(true)
}
