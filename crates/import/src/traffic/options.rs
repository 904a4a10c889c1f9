//! Choices of a reader of recorded traffic that a file does not tell.

use sidestep_kernel::InputError;
use sidestep_scenario::ImportOptions;
use std::path::Path;

/// How rows become flights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrafficOptions {
    /// The longest time in s between two rows of one flight: after a longer gap another flight begins, because nobody
    /// knows where the aircraft was.
    pub max_gap_s: f64,
    /// Speed over the ground in kt below which an aircraft is on the ground, where its row has no flag for it.
    pub ground_speed_kt: f64,
    /// Whether rows with a frozen position, or one that the reported speed does not lead to, are left out.
    pub leaves_out_suspicious: bool,
}

impl Default for TrafficOptions {
    fn default() -> Self {
        Self { max_gap_s: 600.0, ground_speed_kt: 30.0, leaves_out_suspicious: false }
    }
}

impl TrafficOptions {
    /// The keys of [`set`](Self::set).
    pub const KEYS: [&str; 3] = ["max_gap_s", "ground_speed_kt", "leave_out_suspicious"];

    /// Returns the options that are given for the import of a file.
    ///
    /// # Errors
    /// Those of [`set`](Self::set).
    pub fn from_import(file: &Path, options: &ImportOptions) -> Result<Self, InputError> {
        let mut chosen = Self::default();
        for (key, value) in options.iter() {
            let place = format!("{} with --set import.{key}={value}", file.display());
            chosen.set(&place, key, value)?;
        }
        Ok(chosen)
    }

    /// Sets an option by its key.
    ///
    /// # Errors
    /// When there is no such option, or the value does not fit; `place` is where it was given.
    pub fn set(&mut self, place: &str, key: &str, value: &str) -> Result<(), InputError> {
        let error = |remedy: &str| {
            Err(InputError::new(place, format!("`{key}` is {value}"), remedy).with_key(key))
        };
        let number = value.parse::<f64>().ok();
        match (key, number, value) {
            ("max_gap_s", Some(gap_s), _) if gap_s > 0.0 => self.max_gap_s = gap_s,
            ("max_gap_s", ..) => return error("give seconds above 0, such as 600, or inf"),
            ("ground_speed_kt", Some(limit_kt), _) if (0.0..=1000.0).contains(&limit_kt) => {
                self.ground_speed_kt = limit_kt;
            }
            ("ground_speed_kt", ..) => return error("give knots from 0 to 1000"),
            ("leave_out_suspicious", _, "true") => self.leaves_out_suspicious = true,
            ("leave_out_suspicious", _, "false") => self.leaves_out_suspicious = false,
            ("leave_out_suspicious", ..) => return error("give true or false"),
            _ => {
                let cause = format!("recorded traffic has no option `{key}`");
                let remedy = format!("its options are {}", Self::KEYS.join(", "));
                return Err(InputError::new(place, cause, remedy).with_key(key));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_set_by_their_keys_and_wrong_ones_say_what_is_right() {
        let mut options = TrafficOptions::default();
        options.set("", "max_gap_s", "inf").unwrap();
        options.set("", "ground_speed_kt", "0").unwrap();
        options.set("", "leave_out_suspicious", "true").unwrap();
        let expected = TrafficOptions {
            max_gap_s: f64::INFINITY,
            ground_speed_kt: 0.0,
            leaves_out_suspicious: true,
        };
        assert_eq!(options, expected);
        for (key, value) in [
            ("max_gap_s", "0"),
            ("max_gap_s", "nan"),
            ("ground_speed_kt", "-1"),
            ("leave_out_suspicious", "1"),
            ("gap", "1"),
        ] {
            assert!(options.set("", key, value).is_err(), "{key} = {value}");
        }
        assert_eq!(options, expected);
    }
}
