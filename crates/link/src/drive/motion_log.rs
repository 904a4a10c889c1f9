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
}

/// A table that is written row by row, so that what was driven is there however the drive ends.
#[derive(Debug)]
pub struct MotionLog {
    file: File,
    names: MotionNames,
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
        let columns = "cycle,robot,action,ahead_boxes,left_boxes,turn_deg,contact,effector,box_m,duration_s,timeout\n";
        file.write_all(columns.as_bytes())?;
        Ok(Self { file, names })
    }

    /// Adds an action.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn record(&mut self, driven: &DrivenAction) -> io::Result<()> {
        let MotionNames { robot, effector, actions, box_m } = &self.names;
        let unknown = String::new();
        let action = actions.get(usize::from(driven.action)).unwrap_or(&unknown);
        let yes_or_no = |is_so| if is_so { "yes" } else { "no" };
        let contact = yes_or_no(driven.contact.is_some());
        let timeout = yes_or_no(driven.is_timed_out);
        let motion = driven.motion;
        let row = format!(
            "{},{robot},{},{},{},{},{contact},{},{box_m},{:.3},{timeout}\n",
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
