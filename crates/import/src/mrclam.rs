//! UTIAS multi-robot cooperative localization and mapping (MRCLAM) data sets.
//!
//! A folder holds `Barcodes.dat`, `Landmark_Groundtruth.dat` and, for each robot `N`,
//! `RobotN_Groundtruth.dat`, `RobotN_Odometry.dat` and `RobotN_Measurement.dat`; each may be compressed
//! as `.gz`. `#` starts a comment line; columns are separated by blanks. Every subject of
//! `Barcodes.dat` without a surveyed position is a robot.
//!
//! The second column of the measurement files is the **barcode number**, although their
//! header calls it a subject.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use super::table::{MAX_TEXT_BYTES, Token, find_file, rows};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

/// A data set: all files of one folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// Subject number by barcode number: measurements have only the latter.
    pub subject_of_barcode: BTreeMap<u32, u32>,
    /// Position in the world by subject number, in meters.
    pub landmarks: BTreeMap<u32, [f64; 2]>,
    /// Log of each robot by subject number; subjects without a surveyed position are robots.
    pub robots: BTreeMap<u32, RobotLog>,
}

/// One robot's three streams; all timestamps are of one clock, in s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RobotLog {
    /// Motion capture, sorted by time.
    pub truth: Vec<StampedPose2>,
    /// Velocity commands, in the order of the file.
    pub commands: Vec<VelocityCommand>,
    /// Barcode readings, in the order of the file.
    pub measurements: Vec<Measurement>,
}

/// A pose from motion capture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedPose2 {
    /// Time in s.
    pub t_secs: f64,
    /// Position in the world, in meters.
    pub position_m: [f64; 2],
    /// Heading in rad, counterclockwise from the x axis.
    pub heading_rad: f64,
}

/// A velocity command, in force until the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityCommand {
    /// Time in s.
    pub t_secs: f64,
    /// Forward velocity, in m/s.
    pub forward_mps: f64,
    /// Angular velocity in rad/s, positive to the left.
    pub turn_radps: f64,
}

/// One reading of a barcode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Time in s.
    pub t_secs: f64,
    /// Barcode number as decoded, which may be a misreading.
    pub barcode: u32,
    /// Range, in meters.
    pub range_m: f64,
    /// Bearing in rad relative to the heading, positive to the left.
    pub bearing_rad: f64,
}

/// Reads the folder of a data set.
///
/// # Errors
/// When a file is missing or not as described in the [module](self).
pub fn read(folder: &Path) -> Result<Dataset, InputError> {
    let (place, text) = read_file(folder, "Barcodes.dat")?;
    let subject_of_barcode = parse_barcodes(&place, &text)?;
    let (place, text) = read_file(folder, "Landmark_Groundtruth.dat")?;
    let landmarks = parse_landmarks(&place, &text)?;
    let mut robots = BTreeMap::new();
    for &subject in subject_of_barcode.values() {
        if !landmarks.contains_key(&subject) {
            robots.insert(subject, read_robot(folder, subject)?);
        }
    }
    if robots.is_empty() {
        return Err(InputError::new(
            folder.display(),
            "no subject of Barcodes.dat is a robot: all have a surveyed position",
            "restore Barcodes.dat and Landmark_Groundtruth.dat",
        ));
    }
    Ok(Dataset { subject_of_barcode, landmarks, robots })
}

fn read_file(folder: &Path, name: &str) -> Result<(String, String), InputError> {
    let path = find_file(folder, name)?;
    Ok((path.display().to_string(), read_text(&path, MAX_TEXT_BYTES)?))
}

fn read_robot(folder: &Path, subject: u32) -> Result<RobotLog, InputError> {
    let (place, text) = read_file(folder, &format!("Robot{subject}_Groundtruth.dat"))?;
    let truth = parse_truth(&place, &text)?;
    let (place, text) = read_file(folder, &format!("Robot{subject}_Odometry.dat"))?;
    let commands = parse_commands(&place, &text)?;
    let (place, text) = read_file(folder, &format!("Robot{subject}_Measurement.dat"))?;
    let measurements = parse_measurements(&place, &text)?;
    Ok(RobotLog { truth, commands, measurements })
}

fn parse_barcodes(place: &str, text: &str) -> Result<BTreeMap<u32, u32>, InputError> {
    let mut barcodes = BTreeMap::new();
    for row in rows(&place, text) {
        let [subject, barcode] = row?;
        let earlier = barcodes.insert(barcode.integer(&place)?, subject.integer(&place)?);
        check_unique(&place, earlier.is_some(), &barcode)?;
    }
    Ok(barcodes)
}

fn parse_landmarks(place: &str, text: &str) -> Result<BTreeMap<u32, [f64; 2]>, InputError> {
    let mut landmarks = BTreeMap::new();
    for row in rows(&place, text) {
        let [subject, x, y, _, _] = row?;
        let position_m = [x.number(&place)?, y.number(&place)?];
        let earlier = landmarks.insert(subject.integer(&place)?, position_m);
        check_unique(&place, earlier.is_some(), &subject)?;
    }
    Ok(landmarks)
}

fn check_unique(
    place: &dyn fmt::Display,
    is_repeated: bool,
    word: &Token,
) -> Result<(), InputError> {
    if !is_repeated {
        return Ok(());
    }
    Err(word.error(place, format!("{} is listed twice", word.text), "list it once"))
}

/// Parses motion capture; sorted here, because poses are looked up by time.
fn parse_truth(place: &str, text: &str) -> Result<Vec<StampedPose2>, InputError> {
    let mut truth = Vec::new();
    for row in rows(&place, text) {
        let [t, x, y, heading] = row?;
        truth.push(StampedPose2 {
            t_secs: t.number(&place)?,
            position_m: [x.number(&place)?, y.number(&place)?],
            heading_rad: heading.number(&place)?,
        });
    }
    truth.sort_by(|a: &StampedPose2, b: &StampedPose2| a.t_secs.total_cmp(&b.t_secs));
    Ok(truth)
}

fn parse_commands(place: &str, text: &str) -> Result<Vec<VelocityCommand>, InputError> {
    let mut commands = Vec::new();
    for row in rows(&place, text) {
        let [t, forward, turn] = row?;
        commands.push(VelocityCommand {
            t_secs: t.number(&place)?,
            forward_mps: forward.number(&place)?,
            turn_radps: turn.number(&place)?,
        });
    }
    Ok(commands)
}

fn parse_measurements(place: &str, text: &str) -> Result<Vec<Measurement>, InputError> {
    let mut measurements = Vec::new();
    for row in rows(&place, text) {
        let [t, barcode, range, bearing] = row?;
        measurements.push(Measurement {
            t_secs: t.number(&place)?,
            barcode: barcode.integer(&place)?,
            range_m: range.number(&place)?,
            bearing_rad: bearing.number(&place)?,
        });
    }
    Ok(measurements)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with one robot (1) and one landmark (6).
    fn small() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let files = [
            ("Barcodes.dat", "# head\n 1 \t 5\n 6 \t 14\n"),
            ("Landmark_Groundtruth.dat", "6 2.0 0.5 0.1 0.1\n"),
            ("Robot1_Groundtruth.dat", "10.1 1 0 0\n10.0 0 0 0\n"),
            ("Robot1_Odometry.dat", "10.0 0.08 -0.1\n"),
            ("Robot1_Measurement.dat", "10.05 14 2.0 0.1\n"),
        ];
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    #[test]
    fn a_folder_reads_into_robots_and_landmarks_with_truth_sorted() {
        let data = read(small().path()).unwrap();
        assert_eq!(data.subject_of_barcode, BTreeMap::from([(5, 1), (14, 6)]));
        assert_eq!(data.landmarks[&6], [2.0, 0.5]);
        let robot = &data.robots[&1];
        assert_eq!(robot.truth[0].t_secs, 10.0);
        assert_eq!(robot.commands[0].turn_radps, -0.1);
        assert_eq!(robot.measurements[0].barcode, 14);
    }

    #[test]
    fn a_missing_file_is_named() {
        let folder = small();
        std::fs::remove_file(folder.path().join("Robot1_Odometry.dat")).unwrap();
        let error = read(folder.path()).unwrap_err();
        assert!(error.place().ends_with("Robot1_Odometry.dat"), "{error}");
    }

    #[test]
    fn a_bad_number_names_file_line_and_column() {
        let folder = small();
        let path = folder.path().join("Robot1_Measurement.dat");
        std::fs::write(&path, "# head\n10.05 14 far 0.1\n").unwrap();
        let error = read(folder.path()).unwrap_err();
        assert!(error.place().ends_with("Robot1_Measurement.dat"));
        assert_eq!(error.line_and_column(), Some((2, 10)));
    }

    #[test]
    fn a_barcode_listed_twice_and_a_set_without_robots_are_errors() {
        assert!(parse_barcodes("f", "1 5\n2 5\n").unwrap_err().cause().contains("twice"));
        let folder = small();
        std::fs::write(folder.path().join("Barcodes.dat"), "6 14\n").unwrap();
        assert!(read(folder.path()).unwrap_err().cause().contains("robot"));
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_a_stream_or_an_error(text in "(( |\t)?-?[0-9.e#]{0,5}){0,5}\n?(\\PC{0,20}\n){0,4}") {
            let _ = (parse_barcodes("f", &text), parse_landmarks("f", &text));
            let _ = (parse_truth("f", &text), parse_commands("f", &text));
            let _ = parse_measurements("f", &text);
        }
    }
}
