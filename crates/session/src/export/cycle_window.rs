//! Cycles from one to another, as options give them.

use sidestep_kernel::Cycle;
use std::fmt;
use std::str::FromStr;

/// Cycles from one to another, both included: `200:400`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleWindow {
    /// The first cycle.
    pub from: Cycle,
    /// The last cycle.
    pub until: Cycle,
}

impl CycleWindow {
    /// Returns whether a cycle is in the window.
    pub fn contains(self, cycle: Cycle) -> bool {
        (self.from..=self.until).contains(&cycle)
    }
}

impl FromStr for CycleWindow {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no window of cycles, like 200:400");
        let (from, until) = text.split_once(':').ok_or_else(wrong)?;
        let from = from.parse().map_err(|_| wrong())?;
        let until = until.parse().map_err(|_| wrong())?;
        if until < from {
            return Err(format!("the window ends at {until}, before it begins at {from}"));
        }
        Ok(Self { from, until })
    }
}

impl fmt::Display for CycleWindow {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}:{}", self.from, self.until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_read_as_it_is_written() {
        let window: CycleWindow = "200:400".parse().expect("a window");
        assert_eq!(window.to_string(), "200:400");
        assert!(window.contains(200) && window.contains(400) && !window.contains(401));
        for text in ["1:x", "9:2", "7", ""] {
            assert!(text.parse::<CycleWindow>().is_err(), "{text}");
        }
    }
}
