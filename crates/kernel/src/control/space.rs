//! The meaning of the numbers in observations and orders.

use crate::ports::table::split_unit;

/// One quantity of every agent of a team: its name, the shape of one agent's share of it, and its
/// allowed values.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Name; ends in the unit where the quantity has one.
    pub name: String,
    /// Shape of one agent's share; empty for a single number.
    pub shape: Vec<usize>,
    /// The allowed values.
    pub kind: SpaceKind,
    /// One sentence for the reader.
    pub meaning: String,
}

/// The values of a space.
#[derive(Debug, Clone, PartialEq)]
pub enum SpaceKind {
    /// One of these, by number from 0.
    Discrete(Vec<String>),
    /// Whole numbers from `least` to `most`, both included.
    Integer {
        /// The least value.
        low: i64,
        /// The greatest value.
        high: i64,
    },
    /// Numbers from `least` to `most`, both included; infinite where there is no bound.
    Real {
        /// The least value.
        low: f64,
        /// The greatest value.
        high: f64,
    },
}

impl Space {
    /// The greatest whole number in an order: up to it, no two of them become the same float.
    pub const MAX_INTEGER: i64 = (1 << 53) - 1;

    /// Creates a space of single numbers.
    pub fn new(name: impl Into<String>, bounds: SpaceKind, meaning: impl Into<String>) -> Self {
        Self { name: name.into(), shape: Vec::new(), kind: bounds, meaning: meaning.into() }
    }

    /// Returns the same space with another shape.
    #[must_use]
    pub fn with_shape(self, shape: impl Into<Vec<usize>>) -> Self {
        Self { shape: shape.into(), ..self }
    }

    /// Number of values of one agent.
    pub fn width(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns whether its values are whole numbers.
    pub fn is_integer(&self) -> bool {
        !matches!(self.kind, SpaceKind::Real { .. })
    }

    /// The unit of its values, where its name ends in one.
    pub fn unit(&self) -> Option<&'static str> {
        split_unit(&self.name).1
    }

    /// Returns whether a value is allowed in it.
    pub fn contains(&self, value: f64) -> bool {
        let between = |least: f64, most: f64| least <= value && value <= most;
        // By a conversion, because taking the fraction is a library call in builds for processors of any age.
        let is_whole = || value as i64 as f64 == value;
        match &self.kind {
            SpaceKind::Discrete(names) => between(0.0, names.len() as f64 - 1.0) && is_whole(),
            &SpaceKind::Integer { low: least, high: most } => {
                between(least as f64, most as f64) && is_whole()
            }
            &SpaceKind::Real { low: least, high: most } => {
                value.is_finite() && between(least, most)
            }
        }
    }

    /// Returns its values in words: `one of 0 forward, 1 left`, `a number from 0 to 1`.
    pub fn describe(&self) -> String {
        match &self.kind {
            SpaceKind::Discrete(names) => {
                let named: Vec<_> =
                    names.iter().enumerate().map(|(k, name)| format!("{k} {name}")).collect();
                format!("one of {}", named.join(", "))
            }
            SpaceKind::Integer { low: least, high: most } => {
                format!("a whole number from {least} to {most}")
            }
            SpaceKind::Real { low: least, high: most }
                if least.is_infinite() && most.is_infinite() =>
            {
                "a finite number".into()
            }
            SpaceKind::Real { low: least, high: most } if most.is_infinite() => {
                format!("a finite number of at least {least}")
            }
            SpaceKind::Real { low: least, high: most } => {
                format!("a number from {least} to {most}")
            }
        }
    }
}

/// Room for the values of all agents of a team in one space, one agent after the other.
#[derive(Debug)]
pub enum BufferMut<'a> {
    /// Room for [`SpaceKind::Discrete`] and [`SpaceKind::Integer`].
    Integer(&'a mut [i64]),
    /// Room for [`SpaceKind::Real`].
    Real(&'a mut [f64]),
}

impl BufferMut<'_> {
    /// Number of values for which there is room.
    pub fn len(&self) -> usize {
        match self {
            Self::Integer(room) => room.len(),
            Self::Real(room) => room.len(),
        }
    }

    /// Returns whether there is no room at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes a whole number; does nothing with room for real ones, because a space has one kind of values.
    #[inline]
    pub fn set_integer(&mut self, at: usize, value: i64) {
        if let Self::Integer(room) = self {
            room[at] = value;
        }
    }

    /// Writes a real number; does nothing with room for whole ones, because a space has one kind of values.
    #[inline]
    pub fn set_real(&mut self, at: usize, value: f64) {
        if let Self::Real(room) = self {
            room[at] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_space_holds_what_its_words_say() {
        let choice =
            Space::new("action", SpaceKind::Discrete(vec!["go".into(), "stay".into()]), "");
        assert_eq!(choice.describe(), "one of 0 go, 1 stay");
        assert_eq!(
            [0.0, 1.0, 2.0, -1.0, 0.5, f64::NAN].map(|v| choice.contains(v)),
            [true, true, false, false, false, false]
        );
        let whole =
            Space::new("word", SpaceKind::Integer { low: -2, high: Space::MAX_INTEGER }, "");
        assert!(whole.contains(-2.0) && whole.contains(Space::MAX_INTEGER as f64));
        assert!(!whole.contains(-3.0) && !whole.contains(1.5) && !whole.contains(f64::INFINITY));
        let real =
            Space::new("rate_rad_s", SpaceKind::Real { low: -1.0, high: 1.0 }, "").with_shape([3]);
        assert_eq!((real.width(), real.unit(), choice.width()), (3, Some("rad/s"), 1));
        assert!(real.contains(-1.0) && !real.contains(1.1) && !real.contains(f64::NAN));
        let free = SpaceKind::Real { low: f64::NEG_INFINITY, high: f64::INFINITY };
        assert!(!Space::new("x_m", free, "").contains(f64::INFINITY));
    }
}
