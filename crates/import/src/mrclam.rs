//! UTIAS multi-robot cooperative localization and mapping (MRCLAM) data sets.
//!
//! A folder holds `Barcodes.dat`, `Landmark_Groundtruth.dat` and, for each robot `N`,
//! `RobotN_Groundtruth.dat`, `RobotN_Odometry.dat` and `RobotN_Measurement.dat`; each may be compressed
//! as `.gz`. `#` starts a comment line; columns are separated by blanks. Every subject of
//! `Barcodes.dat` without a surveyed position is a robot.
//!
//! A damaged row of a stream is skipped and counted, a stream of which more than half is damaged is an error; the two files
//! about subjects have to be whole. Motion capture is cut where a robot cannot have moved from one pose to the next.
//!
//! The second column of the measurement files is the **barcode number**, although their
//! header calls it a subject.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use super::report::{ImportReport, Treatment};
use super::table::{MAX_TEXT_BYTES, Token, find_file, rows};
pub use super::track::StampedPose2;
use super::track::{SpeedRule, Track, cut_and_report};
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
    /// What was found in the files.
    pub report: ImportReport,
}

/// One robot's three streams; all timestamps are of one clock, in s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RobotLog {
    /// Motion capture, sorted by time.
    pub truth: Track,
    /// Velocity commands, in the order of the file.
    pub commands: Vec<VelocityCommand>,
    /// Barcode readings, in the order of the file.
    pub measurements: Vec<Measurement>,
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

/// Reads the folder of a data set; `max_speed_mps` is the greatest speed of the robots, see [`SpeedRule`].
///
/// # Errors
/// When a file is missing or not as described in the [module](self).
pub fn read(folder: &Path, max_speed_mps: Option<f64>) -> Result<Dataset, InputError> {
    let mut reader =
        FolderReader { folder, max_speed_mps, report: ImportReport::new("MRCLAM data set") };
    let (place, text) = read_file(folder, "Barcodes.dat")?;
    let subject_of_barcode = parse_barcodes(&place, &text)?;
    let (place, text) = read_file(folder, "Landmark_Groundtruth.dat")?;
    let landmarks = parse_landmarks(&place, &text)?;
    let mut robots = BTreeMap::new();
    for &subject in subject_of_barcode.values() {
        if !landmarks.contains_key(&subject) {
            robots.insert(subject, reader.read_robot(subject)?);
        }
    }
    if robots.is_empty() {
        return Err(InputError::new(
            folder.display(),
            "no subject of Barcodes.dat is a robot: all have a surveyed position",
            "restore Barcodes.dat and Landmark_Groundtruth.dat",
        ));
    }
    let mut report = reader.report;
    add_counts(&mut report, &robots, landmarks.len());
    Ok(Dataset { subject_of_barcode, landmarks, robots, report })
}

/// Reports what is in the folder of a data set.
///
/// # Errors
/// Those of [`read`].
pub fn inspect(folder: &Path) -> Result<ImportReport, InputError> {
    Ok(read(folder, None)?.report)
}

fn add_counts(report: &mut ImportReport, robots: &BTreeMap<u32, RobotLog>, landmarks: usize) {
    let times =
        robots.values().flat_map(|robot| [robot.truth.first(), robot.truth.last()]).flatten();
    let range = times.fold([f64::INFINITY, f64::NEG_INFINITY], |[first, last], pose| {
        [first.min(pose.t_secs), last.max(pose.t_secs)]
    });
    if range[0] <= range[1] {
        let value =
            format!("from {:.3} to {:.3} s, {:.3} s", range[0], range[1], range[1] - range[0]);
        report.add_fact("motion capture", value);
    }
    report.add_kept("robots", robots.len());
    report.add_kept("landmarks", landmarks);
    report.add_kept("true poses", robots.values().map(|robot| robot.truth.len()).sum());
    report.add_kept("velocity commands", robots.values().map(|robot| robot.commands.len()).sum());
    report.add_kept("measurements", robots.values().map(|robot| robot.measurements.len()).sum());
}

/// Reads the streams of robots, and records what it finds.
struct FolderReader<'a> {
    folder: &'a Path,
    max_speed_mps: Option<f64>,
    report: ImportReport,
}

impl FolderReader<'_> {
    fn read_robot(&mut self, subject: u32) -> Result<RobotLog, InputError> {
        let truth = self.read_stream(&format!("Robot{subject}_Groundtruth.dat"), parse_pose)?;
        let commands = self.read_stream(&format!("Robot{subject}_Odometry.dat"), parse_command)?;
        let measurements =
            self.read_stream(&format!("Robot{subject}_Measurement.dat"), parse_measurement)?;
        let truth = self.cut_truth(subject, truth);
        Ok(RobotLog { truth, commands, measurements })
    }

    fn cut_truth(&mut self, subject: u32, mut truth: Vec<StampedPose2>) -> Track {
        // Poses are looked up by time.
        truth.sort_by(|a, b| a.t_secs.total_cmp(&b.t_secs));
        let rule = SpeedRule::for_tracks(self.max_speed_mps, &[&truth]);
        cut_and_report(&format!("robot {subject}"), truth, &rule, &mut self.report)
    }

    fn read_stream<T, const N: usize>(
        &mut self,
        name: &str,
        parse_row: fn(&str, [Token<'_>; N]) -> Result<T, InputError>,
    ) -> Result<Vec<T>, InputError> {
        let (place, text) = read_file(self.folder, name)?;
        parse_stream(&place, &text, parse_row, &mut self.report)
    }
}

/// Parses the rows of a stream; damaged ones are skipped and counted.
fn parse_stream<T, const N: usize>(
    place: &str,
    text: &str,
    parse_row: fn(&str, [Token<'_>; N]) -> Result<T, InputError>,
    report: &mut ImportReport,
) -> Result<Vec<T>, InputError> {
    let mut parsed = Vec::new();
    let mut first_error = None;
    let mut damaged = 0;
    for row in rows(&place, text) {
        match row.and_then(|row| parse_row(place, row)) {
            Ok(row) => parsed.push(row),
            Err(error) => {
                damaged += 1;
                let line = error.line_and_column().map_or(0, |(line, _)| line);
                let found = format!("{place}, line {line}: {}", error.cause());
                report.record(
                    Treatment::Dropped,
                    "rows that are damaged",
                    found,
                    "restore the rows",
                );
                first_error = first_error.or(Some(error));
            }
        }
    }
    match first_error {
        Some(error) if damaged > parsed.len() => Err(error),
        _ => Ok(parsed),
    }
}

fn read_file(folder: &Path, name: &str) -> Result<(String, String), InputError> {
    let path = find_file(folder, name)?;
    Ok((path.display().to_string(), read_text(&path, MAX_TEXT_BYTES)?))
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

fn parse_pose(place: &str, [t, x, y, heading]: [Token<'_>; 4]) -> Result<StampedPose2, InputError> {
    Ok(StampedPose2 {
        t_secs: t.number(&place)?,
        position_m: [x.number(&place)?, y.number(&place)?],
        heading_rad: heading.number(&place)?,
    })
}

fn parse_command(
    place: &str,
    [t, forward, turn]: [Token<'_>; 3],
) -> Result<VelocityCommand, InputError> {
    Ok(VelocityCommand {
        t_secs: t.number(&place)?,
        forward_mps: forward.number(&place)?,
        turn_radps: turn.number(&place)?,
    })
}

fn parse_measurement(
    place: &str,
    [t, barcode, range, bearing]: [Token<'_>; 4],
) -> Result<Measurement, InputError> {
    Ok(Measurement {
        t_secs: t.number(&place)?,
        barcode: barcode.integer(&place)?,
        range_m: range.number(&place)?,
        bearing_rad: bearing.number(&place)?,
    })
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
        let data = read(small().path(), None).unwrap();
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
        let error = read(folder.path(), None).unwrap_err();
        assert!(error.place().ends_with("Robot1_Odometry.dat"), "{error}");
    }

    #[test]
    fn a_damaged_row_is_skipped_and_a_robot_that_jumps_is_cut() {
        let folder = small();
        let mut truth = String::new();
        for k in 0..40 {
            let x_m = if (20..25).contains(&k) { 0.0 } else { 3.0 + 0.01 * f64::from(k) };
            truth += &format!("{:.2} {x_m} 0 0\n", 10.0 + 0.1 * f64::from(k));
        }
        truth += "10.05 1 x 0\n";
        std::fs::write(folder.path().join("Robot1_Groundtruth.dat"), truth).unwrap();
        let data = read(folder.path(), None).unwrap();
        assert_eq!((data.robots[&1].truth.len(), data.robots[&1].truth.cuts()), (35, 1));
        let lines: Vec<String> = data.report.findings.iter().map(ToString::to_string).collect();
        assert!(lines[0].contains("line 41: `x` is not a finite number"), "{lines:?}");
        assert!(
            lines[1].starts_with("repaired: jumps of robot 1, at which its track is cut (2 times)")
        );
        assert_eq!(data.report.dropped(), 6);
    }

    #[test]
    fn a_bad_number_names_file_line_and_column() {
        let folder = small();
        let path = folder.path().join("Robot1_Measurement.dat");
        std::fs::write(&path, "# head\n10.05 14 far 0.1\n").unwrap();
        let error = read(folder.path(), None).unwrap_err();
        assert!(error.place().ends_with("Robot1_Measurement.dat"));
        assert_eq!(error.line_and_column(), Some((2, 10)));
    }

    #[test]
    fn a_barcode_listed_twice_and_a_set_without_robots_are_errors() {
        assert!(parse_barcodes("f", "1 5\n2 5\n").unwrap_err().cause().contains("twice"));
        let folder = small();
        std::fs::write(folder.path().join("Barcodes.dat"), "6 14\n").unwrap();
        assert!(read(folder.path(), None).unwrap_err().cause().contains("robot"));
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_a_stream_or_an_error(text in "(( |\t)?-?[0-9.e#]{0,5}){0,5}\n?(\\PC{0,20}\n){0,4}") {
            let _ = (parse_barcodes("f", &text), parse_landmarks("f", &text));
            let mut report = ImportReport::default();
            let _ = parse_stream("f", &text, parse_pose, &mut report);
            let _ = parse_stream("f", &text, parse_command, &mut report);
            let _ = parse_stream("f", &text, parse_measurement, &mut report);
        }
    }
}
