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
    pub bounds: Bounds,
    /// One sentence for the reader.
    pub meaning: String,
}

/// The values of a space.
#[derive(Debug, Clone, PartialEq)]
pub enum Bounds {
    /// One of these, by number from 0.
    Choice(Vec<String>),
    /// Whole numbers from `least` to `most`, both included.
    Whole {
        /// The least value.
        least: i64,
        /// The greatest value.
        most: i64,
    },
    /// Numbers from `least` to `most`, both included; infinite where there is no bound.
    Real {
        /// The least value.
        least: f64,
        /// The greatest value.
        most: f64,
    },
}

impl Space {
    /// The greatest whole number in an order: up to it, no two of them become the same float.
    pub const MOST_WHOLE: i64 = (1 << 53) - 1;

    /// Creates a space of single numbers.
    pub fn new(name: impl Into<String>, bounds: Bounds, meaning: impl Into<String>) -> Self {
        Self { name: name.into(), shape: Vec::new(), bounds, meaning: meaning.into() }
    }

    /// Returns the same space with another shape.
    #[must_use]
    pub fn shaped(self, shape: impl Into<Vec<usize>>) -> Self {
        Self { shape: shape.into(), ..self }
    }

    /// Number of values of one agent.
    pub fn width(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns whether its values are whole numbers.
    pub fn is_whole(&self) -> bool {
        !matches!(self.bounds, Bounds::Real { .. })
    }

    /// The unit of its values, where its name ends in one.
    pub fn unit(&self) -> Option<&'static str> {
        split_unit(&self.name).1
    }

    /// Returns whether a value is allowed in it.
    pub fn holds(&self, value: f64) -> bool {
        let between = |least: f64, most: f64| least <= value && value <= most;
        // By a conversion, because taking the fraction is a library call in builds for processors of any age.
        let is_whole = || value as i64 as f64 == value;
        match &self.bounds {
            Bounds::Choice(names) => between(0.0, names.len() as f64 - 1.0) && is_whole(),
            &Bounds::Whole { least, most } => between(least as f64, most as f64) && is_whole(),
            &Bounds::Real { least, most } => value.is_finite() && between(least, most),
        }
    }

    /// Returns its values in words: `one of 0 forward, 1 left`, `a number from 0 to 1`.
    pub fn words(&self) -> String {
        match &self.bounds {
            Bounds::Choice(names) => {
                let named: Vec<_> =
                    names.iter().enumerate().map(|(k, name)| format!("{k} {name}")).collect();
                format!("one of {}", named.join(", "))
            }
            Bounds::Whole { least, most } => format!("a whole number from {least} to {most}"),
            Bounds::Real { least, most } if least.is_infinite() && most.is_infinite() => {
                "a finite number".into()
            }
            Bounds::Real { least, most } if most.is_infinite() => {
                format!("a finite number of at least {least}")
            }
            Bounds::Real { least, most } => format!("a number from {least} to {most}"),
        }
    }
}

/// Room for the values of all agents of a team in one space, one agent after the other.
#[derive(Debug)]
pub enum CellsMut<'a> {
    /// Room for [`Bounds::Choice`] and [`Bounds::Whole`].
    Whole(&'a mut [i64]),
    /// Room for [`Bounds::Real`].
    Real(&'a mut [f64]),
}

impl CellsMut<'_> {
    /// Number of values for which there is room.
    pub fn len(&self) -> usize {
        match self {
            Self::Whole(room) => room.len(),
            Self::Real(room) => room.len(),
        }
    }

    /// Returns whether there is no room at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes a whole number; does nothing with room for real ones, because a space has one kind of values.
    #[inline]
    pub fn whole(&mut self, at: usize, value: i64) {
        if let Self::Whole(room) = self {
            room[at] = value;
        }
    }

    /// Writes a real number; does nothing with room for whole ones, because a space has one kind of values.
    #[inline]
    pub fn real(&mut self, at: usize, value: f64) {
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
        let choice = Space::new("action", Bounds::Choice(vec!["go".into(), "stay".into()]), "");
        assert_eq!(choice.words(), "one of 0 go, 1 stay");
        assert_eq!(
            [0.0, 1.0, 2.0, -1.0, 0.5, f64::NAN].map(|v| choice.holds(v)),
            [true, true, false, false, false, false]
        );
        let whole = Space::new("word", Bounds::Whole { least: -2, most: Space::MOST_WHOLE }, "");
        assert!(whole.holds(-2.0) && whole.holds(Space::MOST_WHOLE as f64));
        assert!(!whole.holds(-3.0) && !whole.holds(1.5) && !whole.holds(f64::INFINITY));
        let real =
            Space::new("rate_rad_s", Bounds::Real { least: -1.0, most: 1.0 }, "").shaped([3]);
        assert_eq!((real.width(), real.unit(), choice.width()), (3, Some("rad/s"), 1));
        assert!(real.holds(-1.0) && !real.holds(1.1) && !real.holds(f64::NAN));
        let free = Bounds::Real { least: f64::NEG_INFINITY, most: f64::INFINITY };
        assert!(!Space::new("x_m", free, "").holds(f64::INFINITY));
    }
}
