//! CARMEN logs corrected by a SLAM program (`.log`, `.log.gz`).
//!
//! Messages read: `ODOM x y theta tv rv accel time host logger_time` and
//! `FLASER n r1 .. rn x y theta odom_x odom_y odom_theta time host logger_time`. Every other
//! message (`NEFF`, `PARAM`, ...) and `#` comments are skipped.
//!
//! The pose of a `FLASER` is the corrected one. The `ODOM` lines after it continue from that pose
//! with raw odometry, so the last one before the next `FLASER` is the robot's pose according to
//! odometry. The first `ODOM` after a `FLASER` repeats its pose, with a time that is meaningless.

use std::path::Path;

use super::table::{MAX_TEXT_BYTES, Token, data_lines, tokens};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

/// Number of beams per scan above which a count must be damaged: no scanner has as many.
const MAX_BEAMS: u32 = 100_000;
/// Maximum number of words of a message that are read: those of the longest scan, and more.
const MAX_TOKENS: usize = MAX_BEAMS as usize + 32;

/// A pose in the world: x and y in m, heading in rad.
pub type PoseXyTheta = [f64; 3];

/// A corrected log: scans, and the odometry between them.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectedLog {
    /// Odometry before the first scan.
    pub odometry_before: Vec<PoseXyTheta>,
    /// The scans with the odometry that follows each.
    pub scans: Vec<Scan>,
}

/// One `FLASER` message and the `ODOM` messages up to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Time in s from the start of the log; not always increasing.
    pub t_secs: f64,
    /// Number of beams; their ranges are checked and not kept.
    pub n_beams: u32,
    /// Corrected pose.
    pub pose: PoseXyTheta,
    /// Poses according to odometry after this scan, starting at [`Scan::pose`].
    pub odometry: Vec<PoseXyTheta>,
}

/// Reads a log.
///
/// # Errors
/// When the file cannot be read, a message is damaged, or there are fewer than two scans.
pub fn read(path: &Path) -> Result<CorrectedLog, InputError> {
    parse(&path.display().to_string(), &read_text(path, MAX_TEXT_BYTES)?)
}

/// Parses the text of a log; `place` is its name in errors.
///
/// # Errors
/// When a message is damaged or there are fewer than two scans.
pub fn parse(place: &str, text: &str) -> Result<CorrectedLog, InputError> {
    let mut log = CorrectedLog { odometry_before: Vec::new(), scans: Vec::new() };
    for (line, content) in data_lines(text) {
        let message: Vec<Token> = tokens(line, content).take(MAX_TOKENS).collect();
        match message[0].text {
            "ODOM" => {
                let pose = parse_odometry(place, &message)?;
                match log.scans.last_mut() {
                    Some(scan) => scan.odometry.push(pose),
                    None => log.odometry_before.push(pose),
                }
            }
            "FLASER" => log.scans.push(parse_scan(place, &message)?),
            _ => {}
        }
    }
    if log.scans.len() < 2 {
        return Err(InputError::new(
            place,
            format!("the log has {} FLASER messages; learning compares pairs", log.scans.len()),
            "give a corrected CARMEN log with ODOM and FLASER messages",
        ));
    }
    Ok(log)
}

fn parse_odometry(place: &str, message: &[Token]) -> Result<PoseXyTheta, InputError> {
    require_tokens(place, message, 10)?;
    parse_pose(place, &message[1..4])
}

fn parse_scan(place: &str, message: &[Token]) -> Result<Scan, InputError> {
    require_tokens(place, message, 2)?;
    let n_beams = message[1].integer(&place)?;
    if n_beams > MAX_BEAMS {
        let cause = format!("{n_beams} beams are more than {MAX_BEAMS}");
        return Err(message[1].error(&place, cause, "restore the beam count"));
    }
    let first = 2 + n_beams as usize;
    require_tokens(place, message, first + 9)?;
    // Checked, although the scan keeps only their number, so that damage is found.
    for range in &message[2..first] {
        range.number(&place)?;
    }
    Ok(Scan {
        t_secs: message[first + 6].number(&place)?,
        n_beams,
        pose: parse_pose(place, &message[first..first + 3])?,
        odometry: Vec::new(),
    })
}

fn parse_pose(place: &str, words: &[Token]) -> Result<PoseXyTheta, InputError> {
    Ok([words[0].number(&place)?, words[1].number(&place)?, words[2].number(&place)?])
}

/// Messages may be longer than documented (later programs append fields), never shorter.
fn require_tokens(place: &str, message: &[Token], n: usize) -> Result<(), InputError> {
    if message.len() >= n {
        return Ok(());
    }
    let last = message[message.len() - 1];
    let cause =
        format!("the {} message has {} words instead of {n}", message[0].text, message.len());
    Err(last.error(&place, cause, "restore the damaged line"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "# head\nPARAM a b\nODOM 0 0 0 0 0 0 0.1 h 0.1\n\
        FLASER 2 1.5 81.83 0 0 0.5 0 0 0.5 1.0 h 1.0\nNEFF 30\n\
        ODOM 0 0 0.5 0 0 0 1e-42 h 0\nODOM 1 0 0.5 0 0 0 1.9 h 1.9\n\
        FLASER 2 1.5 2 1 0.1 0.5 1 0.1 0.5 2.0 h 2.0\n";

    #[test]
    fn odometry_belongs_to_the_scan_before_it() {
        let log = parse("f.log", SMALL).unwrap();
        assert_eq!(log.odometry_before.len(), 1);
        assert_eq!(log.scans.len(), 2);
        assert_eq!(log.scans[0].odometry, [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5]]);
        assert_eq!((log.scans[1].t_secs, log.scans[1].pose), (2.0, [1.0, 0.1, 0.5]));
    }

    #[test]
    fn damaged_messages_name_line_and_column() {
        let cases = [
            ("ODOM 0 0 0\n", (1, 10)),
            ("\nODOM 0 x 0 0 0 0 0 h 0\n", (2, 8)),
            ("FLASER 3 1 2 0 0 0 0 0 0 1 h 1\n", (1, 30)),
            ("FLASER 4000000000 1\n", (1, 8)),
            ("FLASER -1 1\n", (1, 8)),
            ("FLASER\n", (1, 1)),
        ];
        for (text, position) in cases {
            assert_eq!(parse("f", text).unwrap_err().line_and_column(), Some(position), "{text}");
        }
    }

    #[test]
    fn a_log_without_scans_is_an_error() {
        assert!(parse("f", "ODOM 0 0 0 0 0 0 0 h 0\n").unwrap_err().cause().contains("FLASER"));
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_a_log_or_an_error(text in "((ODOM|FLASER|NEFF|#)?( -?[0-9.e]{0,4}){0,14}\n){0,8}") {
            let _ = parse("f", &text);
        }
    }
}
