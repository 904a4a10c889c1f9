//! The meaning of the numbers in observations and orders.

use crate::ports::table::split_unit;

/// One quantity of every agent of a team: its name, the shape of one agent's share of it, and its
/// allowed values.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueSpace {
    /// Name; ends in the unit where the quantity has one.
    pub name: String,
    /// Shape of one agent's share; empty for a single number.
    pub shape: Vec<usize>,
    /// The allowed values, the same for every number of the shape.
    pub kind: ValueDomain,
    /// Its meaning, in one sentence.
    pub meaning: String,
}

/// Type and bounds of the values of a space, the same for every number of an array.
#[derive(Debug, Clone, PartialEq)]
pub enum ValueDomain {
    /// Named choices; a value is the index of a name.
    Discrete(Vec<String>),
    /// Whole numbers from `low` to `high`, both included.
    Integer {
        /// The lowest value.
        low: i64,
        /// The highest value.
        high: i64,
    },
    /// Numbers from `low` to `high`, both included; infinite where there is no bound.
    Real {
        /// The lowest value, in the unit of the space's name.
        low: f64,
        /// The highest value, in the unit of the space's name.
        high: f64,
    },
}

impl ValueSpace {
    /// The greatest whole number in an order: orders are floats, and up to it no two whole numbers become the same
    /// float.
    pub const MAX_INTEGER: i64 = (1 << 53) - 1;

    /// Creates a space with one number per agent.
    pub fn new(name: impl Into<String>, kind: ValueDomain, meaning: impl Into<String>) -> Self {
        Self { name: name.into(), shape: Vec::new(), kind, meaning: meaning.into() }
    }

    /// Returns the same space with another shape.
    #[must_use]
    pub fn with_shape(self, shape: impl Into<Vec<usize>>) -> Self {
        Self { shape: shape.into(), ..self }
    }

    /// Number of values of one agent: the product of the shape, 1 for a single number.
    pub fn value_count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns whether its values are whole numbers.
    pub fn is_integer(&self) -> bool {
        !matches!(self.kind, ValueDomain::Real { .. })
    }

    /// The unit of its values, where its name ends in one.
    pub fn unit(&self) -> Option<&'static str> {
        split_unit(&self.name).1
    }

    /// Returns whether a value is allowed in it.
    pub fn contains(&self, value: f64) -> bool {
        match &self.kind {
            ValueDomain::Discrete(names) => {
                (0.0..=names.len() as f64 - 1.0).contains(&value) && is_whole(value)
            }
            &ValueDomain::Integer { low, high } => {
                (low as f64..=high as f64).contains(&value) && is_whole(value)
            }
            &ValueDomain::Real { low, high } => value.is_finite() && (low..=high).contains(&value),
        }
    }

    /// Returns its values in words: `one of 0 forward, 1 left`, `a number from 0 to 1`.
    pub fn describe(&self) -> String {
        match &self.kind {
            ValueDomain::Discrete(names) => {
                let choices: Vec<_> =
                    names.iter().enumerate().map(|(k, name)| format!("{k} {name}")).collect();
                format!("one of {}", choices.join(", "))
            }
            ValueDomain::Integer { low, high } => format!("a whole number from {low} to {high}"),
            ValueDomain::Real { low, high } if low.is_infinite() && high.is_infinite() => {
                "a finite number".into()
            }
            ValueDomain::Real { low, high } if high.is_infinite() => {
                format!("a finite number of at least {low}")
            }
            ValueDomain::Real { low, high } => format!("a number from {low} to {high}"),
        }
    }
}

/// Returns whether a value has no fraction. By a conversion, because taking the fraction is a library call in builds
/// for processors of any age.
fn is_whole(value: f64) -> bool {
    value as i64 as f64 == value
}

/// A caller's buffer for the values of all agents of a team in one space, one agent after the other.
#[derive(Debug)]
pub enum BufferMut<'a> {
    /// For [`ValueDomain::Discrete`] and [`ValueDomain::Integer`].
    Integer(&'a mut [i64]),
    /// For [`ValueDomain::Real`].
    Real(&'a mut [f64]),
}

impl BufferMut<'_> {
    /// Number of values that it holds.
    pub fn len(&self) -> usize {
        match self {
            Self::Integer(values) => values.len(),
            Self::Real(values) => values.len(),
        }
    }

    /// Returns whether it holds no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes a whole number; does nothing with a buffer of real ones, because a space has one kind of values.
    #[inline]
    pub fn set_integer(&mut self, index: usize, value: i64) {
        if let Self::Integer(values) = self {
            values[index] = value;
        }
    }

    /// Writes a real number; does nothing with a buffer of whole ones, because a space has one kind of values.
    #[inline]
    pub fn set_real(&mut self, index: usize, value: f64) {
        if let Self::Real(values) = self {
            values[index] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_space_holds_what_its_words_say() {
        let choice =
            ValueSpace::new("action", ValueDomain::Discrete(vec!["go".into(), "stay".into()]), "");
        assert_eq!(choice.describe(), "one of 0 go, 1 stay");
        assert_eq!(
            [0.0, 1.0, 2.0, -1.0, 0.5, f64::NAN].map(|v| choice.contains(v)),
            [true, true, false, false, false, false]
        );
        let whole = ValueSpace::new(
            "word",
            ValueDomain::Integer { low: -2, high: ValueSpace::MAX_INTEGER },
            "",
        );
        assert!(whole.contains(-2.0) && whole.contains(ValueSpace::MAX_INTEGER as f64));
        assert!(!whole.contains(-3.0) && !whole.contains(1.5) && !whole.contains(f64::INFINITY));
        let real = ValueSpace::new("rate_rad_s", ValueDomain::Real { low: -1.0, high: 1.0 }, "")
            .with_shape([3]);
        assert_eq!((real.value_count(), real.unit(), choice.value_count()), (3, Some("rad/s"), 1));
        assert!(real.contains(-1.0) && !real.contains(1.1) && !real.contains(f64::NAN));
        let free = ValueDomain::Real { low: f64::NEG_INFINITY, high: f64::INFINITY };
        assert!(!ValueSpace::new("x_m", free, "").contains(f64::INFINITY));
    }
}
