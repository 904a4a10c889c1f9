//! Numbers that check themselves on reading.
//!
//! A field of such a type holds a valid number, or the file was refused:
//! [`Source::parse`](crate::Source::parse) points to the invalid number and gives the remedy. A
//! type for a later check that needs the position too is wrapped: `Spanned<Positive>`.
//!
//! ```
//! use sidestep_scenario::{Fraction, Integer, Positive, Source};
//!
//! #[derive(Debug, serde::Deserialize)]
//! struct Radio {
//!     range_m: Positive,
//!     loss: Option<Fraction>,
//!     channels: Integer<1, 16>,
//! }
//! let read = |text: &str| Source::new("s.toml", text, "").parse::<Radio>();
//! let radio = read("range_m = 4\nchannels = 2").expect("right");
//! assert_eq!((radio.range_m.get(), radio.loss, radio.channels.get()), (4.0, None, 2));
//! let error = read("range_m = 4\nloss = nan\nchannels = 2").expect_err("not a fraction");
//! assert_eq!(error.line_and_column(), Some((2, 8)));
//! assert_eq!((error.cause(), error.remedy()), ("loss = NaN", "give 0 to 1"));
//! ```

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use std::fmt;
use std::marker::PhantomData;

/// A rule for valid numbers.
pub trait Rule {
    /// Returns whether a number is valid.
    fn allows(number: f64) -> bool;

    /// Returns the valid numbers in words that follow "give", e.g. "a number above 0".
    fn description() -> String;

    /// Returns the valid numbers in terms of JSON Schema, e.g. `{ "exclusiveMinimum": 0 }`.
    fn limits() -> Value;

    /// Returns the valid points in words that follow "give".
    fn point_description(dimensions: usize) -> String {
        format!("{dimensions} numbers, each {}", Self::description())
    }
}

/// Every finite number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnyFinite;

impl Rule for AnyFinite {
    fn allows(number: f64) -> bool {
        number.is_finite()
    }

    fn description() -> String {
        "a finite number".into()
    }

    fn limits() -> Value {
        json!({})
    }
}

/// Finite numbers above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AboveZero;

impl Rule for AboveZero {
    fn allows(number: f64) -> bool {
        number > 0.0 && number.is_finite()
    }

    fn description() -> String {
        "a number above 0".into()
    }

    fn limits() -> Value {
        json!({ "exclusiveMinimum": 0 })
    }
}

/// Finite numbers from 0 on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtLeastZero;

impl Rule for AtLeastZero {
    fn allows(number: f64) -> bool {
        number >= 0.0 && number.is_finite()
    }

    fn description() -> String {
        "a number of at least 0".into()
    }

    fn limits() -> Value {
        json!({ "minimum": 0 })
    }
}

/// Numbers from `MIN` to `MAX`; the last two parameters say whether the bounds themselves are
/// valid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval<const MIN: i64, const MAX: i64, const HAS_MIN: bool, const HAS_MAX: bool>;

/// Numbers from `MIN` to `MAX`, both included.
pub type Closed<const MIN: i64, const MAX: i64> = Interval<MIN, MAX, true, true>;
/// Numbers above `MIN`, up to `MAX`.
pub type LeftOpen<const MIN: i64, const MAX: i64> = Interval<MIN, MAX, false, true>;
/// Numbers from `MIN` on, below `MAX`.
pub type RightOpen<const MIN: i64, const MAX: i64> = Interval<MIN, MAX, true, false>;
/// Numbers above `MIN` and below `MAX`.
pub type Open<const MIN: i64, const MAX: i64> = Interval<MIN, MAX, false, false>;

impl<const MIN: i64, const MAX: i64, const HAS_MIN: bool, const HAS_MAX: bool> Rule
    for Interval<MIN, MAX, HAS_MIN, HAS_MAX>
{
    fn allows(number: f64) -> bool {
        let low = MIN as f64;
        let high = MAX as f64;
        (low..=high).contains(&number) && (HAS_MIN || number > low) && (HAS_MAX || number < high)
    }

    fn description() -> String {
        let low = format_bound(MIN);
        let high = format_bound(MAX);
        match (HAS_MIN, HAS_MAX) {
            (true, true) => format!("{low} to {high}"),
            (false, true) => format!("a number above {low} and at most {high}"),
            (true, false) => format!("{low} or more and less than {high}"),
            (false, false) => format!("more than {low} and less than {high}"),
        }
    }

    fn limits() -> Value {
        let minimum = if HAS_MIN { "minimum" } else { "exclusiveMinimum" };
        let maximum = if HAS_MAX { "maximum" } else { "exclusiveMaximum" };
        json!({ minimum: MIN, maximum: MAX })
    }
}

/// A bound in short form: 1e6 rather than 1000000.
fn format_bound(bound: i64) -> String {
    if bound.abs() < 1_000_000 { bound.to_string() } else { format!("{bound:e}") }
}

/// A number that is valid under a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number<R>(f64, PhantomData<R>);

/// A number above 0.
pub type Positive = Number<AboveZero>;
/// A number of at least 0.
pub type NonNegative = Number<AtLeastZero>;
/// A number from 0 to 1, such as a share or a probability.
pub type Fraction = Number<Closed<0, 1>>;

impl<R: Rule> Number<R> {
    /// Returns the number, which its rule allows.
    pub fn get(self) -> f64 {
        self.0
    }

    fn checked<E: Error>(number: f64) -> Result<Self, E> {
        if R::allows(number) {
            Ok(Self(number, PhantomData))
        } else {
            Err(invalid_value(number, &format!("give {}", R::description())))
        }
    }
}

impl<R> From<Number<R>> for f64 {
    fn from(number: Number<R>) -> Self {
        number.0
    }
}

/// The check is inside the visitor, so that the reader knows the position even in an array.
impl<'de, R: Rule> Deserialize<'de> for Number<R> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberVisitor<R>(PhantomData<R>);

        impl<R: Rule> Visitor<'_> for NumberVisitor<R> {
            type Value = Number<R>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number")
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
                Number::checked(number)
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                Number::checked(number as f64)
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
                Number::checked(number as f64)
            }
        }
        deserializer.deserialize_f64(NumberVisitor(PhantomData))
    }
}

/// A whole number from `MIN` to `MAX`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Integer<const MIN: u64, const MAX: u64 = { u64::MAX }>(u64);

impl<const MIN: u64, const MAX: u64> Integer<MIN, MAX> {
    /// Returns the number, from `MIN` to `MAX`.
    pub fn get(self) -> u64 {
        self.0
    }

    /// Reads such a number into a field of a plain type, by `deserialize_with`.
    ///
    /// # Errors
    /// The same as for reading `Self`.
    pub fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        Self::deserialize(deserializer).map(Self::get)
    }

    /// Returns the remedy in words, without a maximum beyond all practical numbers.
    fn remedy(is_below: bool) -> String {
        if is_below && MAX >= u64::from(u32::MAX) {
            format!("give {MIN} or more")
        } else {
            format!("give {MIN} to {MAX}")
        }
    }
}

impl<'de, const MIN: u64, const MAX: u64> Deserialize<'de> for Integer<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct IntegerVisitor<const MIN: u64, const MAX: u64>;

        impl<const MIN: u64, const MAX: u64> Visitor<'_> for IntegerVisitor<MIN, MAX> {
            type Value = Integer<MIN, MAX>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a whole number")
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                match u64::try_from(number) {
                    Ok(number) => self.visit_u64(number),
                    Err(_) => Err(invalid_value(number, &Self::Value::remedy(true))),
                }
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
                if (MIN..=MAX).contains(&number) {
                    Ok(Integer(number))
                } else {
                    Err(invalid_value(number, &Self::Value::remedy(number < MIN)))
                }
            }
        }
        deserializer.deserialize_u64(IntegerVisitor)
    }
}

/// A point: one number per dimension, each of them valid under a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point<const D: usize, R = AnyFinite>([f64; D], PhantomData<R>);

impl<const D: usize, R: Rule> Point<D, R> {
    /// Returns its coordinates.
    pub fn get(self) -> [f64; D] {
        self.0
    }
}

impl<'de, const D: usize, R: Rule> Deserialize<'de> for Point<D, R> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        let numbers = match deserializer.deserialize_seq(RangeVisitor("a point: [x, y]"))? {
            Numbers::Many(numbers) => numbers,
            Numbers::One(number) => vec![number],
        };
        match numbers[..].try_into() {
            Ok(point) if numbers.iter().all(|x| R::allows(*x)) => Ok(Self(point, PhantomData)),
            _ => {
                let remedy = format!("give {}", R::point_description(D));
                Err(invalid_value(format_args!("{numbers:?}"), &remedy))
            }
        }
    }
}

/// A list of exactly `N` values. A plain array would be read from a longer list as well, without its last values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedList<T, const N: usize>([T; N]);

impl<T, const N: usize> FixedList<T, N> {
    /// Returns its values.
    pub fn get(self) -> [T; N] {
        self.0
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for FixedList<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::<T>::deserialize(deserializer)?;
        let count = values.len();
        let values = <[T; N]>::try_from(values);
        values
            .map(Self)
            .map_err(|_| invalid_value(format_args!("{count} values"), &format!("give {N} values")))
    }
}

/// One number, or a minimum and a maximum: `0.5` or `[0.4, 0.6]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberRange {
    /// The minimum; not checked, as ranges have limits of their own where they are used.
    pub low: f64,
    /// The maximum; may equal the minimum.
    pub high: f64,
}

impl<'de> Deserialize<'de> for NumberRange {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match deserializer.deserialize_any(RangeVisitor("a number, or [least, greatest]"))? {
            Numbers::One(number) => Ok(Self { low: number, high: number }),
            Numbers::Many(numbers) => match numbers[..] {
                [low, high] => Ok(Self { low, high }),
                _ => {
                    let remedy = "give one number, or the least and the greatest";
                    Err(invalid_value(format_args!("{numbers:?}"), remedy))
                }
            },
        }
    }
}

/// A number, or an array of them.
enum Numbers {
    One(f64),
    Many(Vec<f64>),
}

/// A visitor that reads numbers, one or an array of them; holds the expected form in words.
struct RangeVisitor(&'static str);

impl<'de> Visitor<'de> for RangeVisitor {
    type Value = Numbers;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
        Ok(Numbers::One(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        Ok(Numbers::One(number as f64))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
        Ok(Numbers::One(number as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut numbers = Vec::new();
        while let Some(number) = seq.next_element()? {
            numbers.push(number);
        }
        Ok(Numbers::Many(numbers))
    }
}

/// The start of the message of an invalid value. Serde's errors are one text, so value and remedy travel in it.
const INVALID_VALUE_PREFIX: &str = "wrong value `";
/// Ends the value in such a message, where it occurs first.
const REMEDY_SEPARATOR: &str = "`, ";

/// Creates the error of a type that refuses a value; `Source::parse` adds key and position.
pub fn invalid_value<E: Error>(value: impl fmt::Display, remedy: &str) -> E {
    E::custom(format_args!("{INVALID_VALUE_PREFIX}{value}{REMEDY_SEPARATOR}{remedy}"))
}

/// Splits such an error's message into value and remedy.
pub(crate) fn split_invalid_value(message: &str) -> Option<(&str, &str)> {
    message.strip_prefix(INVALID_VALUE_PREFIX)?.split_once(REMEDY_SEPARATOR)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;
    use sidestep_kernel::InputError;

    #[derive(Debug, Deserialize)]
    #[expect(dead_code, reason = "only the errors are of interest")]
    struct Section {
        a: Option<Positive>,
        b: Option<Integer<1, 9>>,
        c: Option<Vec<Point<2>>>,
        d: Option<NumberRange>,
        e: Option<Vec<Fraction>>,
        f: Option<toml::Spanned<NonNegative>>,
        g: Option<FixedList<u32, 2>>,
    }

    fn read(text: &str) -> Result<Section, InputError> {
        #[derive(Debug, Deserialize)]
        struct File {
            s: Section,
        }
        Source::new("s.toml", format!("[s]\n{text}"), "").parse::<File>().map(|file| file.s)
    }

    #[test]
    fn right_values_are_taken_whole_or_not() {
        let s = read("a = 2\nb = 9\nc = [[1, 2.5]]\nd = 3\ne = [0, 1, 0.5]\nf = 0").expect("right");
        assert_eq!(s.a.map(f64::from), Some(2.0));
        assert_eq!(s.c.expect("given")[0].get(), [1.0, 2.5]);
        assert_eq!(s.d, Some(NumberRange { low: 3.0, high: 3.0 }));
        assert_eq!(s.f.expect("given").get_ref().get(), 0.0);
        let d = read("d = [1, 2]").expect("right").d;
        assert_eq!(d, Some(NumberRange { low: 1.0, high: 2.0 }));
    }

    #[test]
    fn wrong_values_are_told_with_key_and_place() {
        for (text, column, cause, remedy) in [
            ("g = [1, 2, 3]", 5, "g = 3 values", "give 2 values"),
            ("g = [1]", 5, "g = 1 values", "give 2 values"),
            ("a = 0.0", 5, "a = 0", "above 0"),
            ("a = nan", 5, "a = NaN", "above 0"),
            ("a = inf", 5, "a = inf", "above 0"),
            ("b = 0", 5, "b = 0", "give 1 to 9"),
            ("b = -3", 5, "b = -3", "give 1 to 9"),
            ("c = [[1, 2], [nan, 1]]", 5, "c = [NaN, 1.0]", "give 2 numbers"),
            ("c = [1, 2]", 5, "c = [1.0]", "give 2 numbers"),
            ("d = [1]", 5, "d = [1.0]", "the least and the greatest"),
            ("d = [1, 2, 3]", 5, "d = [1.0, 2.0, 3.0]", "the least and the greatest"),
            ("e = [0.1, 1.5]", 11, "e = 1.5", "0 to 1"),
            ("f = -1e-9", 5, "f = -0.000000001", "at least 0"),
        ] {
            let error = read(text).expect_err(text);
            assert_eq!((error.line_and_column(), error.cause()), (Some((2, column)), cause));
            assert!(error.remedy().contains(remedy), "{error}");
        }
        let error = read("a = \"far\"").expect_err("text");
        assert!(error.cause().contains("expected a number"), "{error}");
    }
}
