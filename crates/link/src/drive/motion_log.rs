//! The table of the motions of a drive. It has the columns of the calibration table of a run, from which
//! `sidestep learn effector --csv` learns, and how long each action took.

use sidestep::worlds::robots::drive::driver::DrivenAction;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// What stands in each row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionNames {
    /// The id of the robot.
    pub robot: u32,
    /// The name of its effector.
    pub effector: String,
    /// The names of the actions by number.
    pub actions: Vec<String>,
    /// Side of a box in meters.
    pub box_m: f64,
    /// Time in seconds of a cycle, in which delays are counted.
    pub cycle_s: f64,
}

/// A table that is written row by row, so that what was driven is there however the drive ends.
#[derive(Debug)]
pub struct MotionLog {
    file: File,
    names: MotionNames,
    cycles: CycleCount,
}

/// Counts actions in cycles, so that the sum of all delays is that of the time.
#[derive(Debug, Default)]
struct CycleCount {
    /// Time that all actions have taken, in seconds.
    elapsed_s: f64,
    /// Cycles that were counted for them.
    counted: u64,
}

/// Longest delay that `sidestep learn` knows, in cycles.
const MAX_DELAY_CYCLES: u64 = 10_000;

impl CycleCount {
    /// Returns the whole cycles that an action has taken beyond its first one. What is rounded off is left for the next.
    fn delay(&mut self, duration_s: f64, cycle_s: f64) -> u64 {
        self.elapsed_s += duration_s;
        // As a float it is saturated: neither below 0 nor above what fits.
        let due = (self.elapsed_s / cycle_s).round() as u64;
        let delay = due.saturating_sub(self.counted + 1).min(MAX_DELAY_CYCLES);
        self.counted += 1 + delay;
        delay
    }
}

impl MotionLog {
    /// Starts a table.
    ///
    /// # Errors
    /// When the file is there already and not to be replaced, or cannot be written.
    pub fn create(path: &Path, replaces: bool, names: MotionNames) -> io::Result<Self> {
        let mut options = OpenOptions::new();
        options.write(true);
        if replaces {
            options.create(true).truncate(true);
        } else {
            options.create_new(true);
        }
        let mut file = options.open(path)?;
        let columns = "cycle,robot,action,ahead_boxes,left_boxes,turn_deg,contact,effector,box_m,delay_cycles,\
                       duration_s,end_s,timeout\n";
        file.write_all(columns.as_bytes())?;
        Ok(Self { file, names, cycles: CycleCount::default() })
    }

    /// Adds an action that was over at a time of the robot's clock.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn record(&mut self, driven: &DrivenAction, end_s: f64) -> io::Result<()> {
        let MotionNames { robot, effector, actions, box_m, cycle_s } = &self.names;
        let delay = self.cycles.delay(driven.duration_s, *cycle_s);
        let unknown = String::new();
        let action = actions.get(usize::from(driven.action)).unwrap_or(&unknown);
        let yes_or_no = |is_so| if is_so { "yes" } else { "no" };
        let contact = yes_or_no(driven.contact.is_some());
        let timeout = yes_or_no(driven.is_timed_out);
        let motion = driven.motion;
        let row = format!(
            "{},{robot},{},{},{},{},{contact},{},{box_m},{delay},{:.3},{end_s:.3},{timeout}\n",
            driven.cycle,
            quoted(action),
            motion.ahead,
            motion.left,
            motion.turn_deg,
            quoted(effector),
            driven.duration_s,
        );
        self.file.write_all(row.as_bytes())
    }
}

/// Returns a text as a field of CSV: names of a scenario may have commas.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", text.replace('"', "\"\""));
    }
    text.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_add_up_to_the_time_and_are_none_where_an_action_is_short() {
        let mut cycles = CycleCount::default();
        let delays = [1.4, 1.4, 1.4, 0.2, 0.3, 9.0].map(|s| cycles.delay(s, 1.0));
        assert_eq!(delays, [0, 1, 0, 0, 0, 7]);
        assert_eq!(cycles.counted, 14, "13.7 seconds");
        assert_eq!(cycles.delay(f64::INFINITY, 1.0), MAX_DELAY_CYCLES);
    }
}
