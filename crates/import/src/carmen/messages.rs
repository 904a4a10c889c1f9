//! The messages of a log, line by line.

use sidestep_kernel::InputError;

use super::PoseXyTheta;
use crate::table::{Token, tokens};

/// Number of beams per scan above which a count must be damaged: no scanner has as many.
const MAX_BEAMS: u32 = 100_000;
/// Maximum number of words of a message that are read: those of the longest scan, and more.
const MAX_TOKENS: usize = 2 * MAX_BEAMS as usize + 64;

/// A message that is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CarmenMessage<'a> {
    /// `ODOM`.
    Odometry(TimedPose),
    /// `FLASER` or `ROBOTLASER1`.
    Scan(ScanMessage),
    /// `TRUEPOS`: the true pose, and that of odometry.
    TruePose(TimedPose, PoseXyTheta),
    /// Another message, by its name.
    Other(&'a str),
}

/// A pose at a time in s from the start of the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimedPose {
    pub(super) t_secs: f64,
    pub(super) pose: PoseXyTheta,
}

/// A scan without its ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ScanMessage {
    pub(super) kind: ScanKind,
    pub(super) n_beams: u32,
    /// The pose of the robot.
    pub(super) at: TimedPose,
    /// The pose by odometry that `FLASER` gives beside it.
    pub(super) odometry: Option<PoseXyTheta>,
}

/// The messages of scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ScanKind {
    Flaser,
    Robotlaser,
}

impl ScanKind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Flaser => "FLASER",
            Self::Robotlaser => "ROBOTLASER1",
        }
    }
}

/// Parses a line with data.
///
/// # Errors
/// When the message is damaged, with its line and column.
pub(super) fn parse<'a>(
    place: &str,
    line: usize,
    content: &'a str,
) -> Result<CarmenMessage<'a>, InputError> {
    let message: Vec<Token<'a>> = tokens(line, content).take(MAX_TOKENS).collect();
    match message[0].text {
        "ODOM" => {
            require_tokens(place, &message, 10)?;
            Ok(CarmenMessage::Odometry(timed_pose(place, &message, 1, 7)?))
        }
        "FLASER" => parse_flaser(place, &message).map(CarmenMessage::Scan),
        "ROBOTLASER1" => parse_robotlaser(place, &message).map(CarmenMessage::Scan),
        "TRUEPOS" => {
            require_tokens(place, &message, 10)?;
            let truth = timed_pose(place, &message, 1, 7)?;
            Ok(CarmenMessage::TruePose(truth, parse_pose(place, &message[4..7])?))
        }
        other => Ok(CarmenMessage::Other(other)),
    }
}

fn parse_flaser(place: &str, message: &[Token<'_>]) -> Result<ScanMessage, InputError> {
    require_tokens(place, message, 2)?;
    let n_beams = count(place, &message[1], "restore the beam count")?;
    let first = 2 + n_beams as usize;
    require_tokens(place, message, first + 9)?;
    check_numbers(place, &message[2..first])?;
    Ok(ScanMessage {
        kind: ScanKind::Flaser,
        n_beams,
        at: timed_pose(place, message, first, first + 6)?,
        odometry: Some(parse_pose(place, &message[first + 3..first + 6])?),
    })
}

/// Parses `ROBOTLASER1 type start fov resolution max accuracy mode n r1 .. rn m i1 .. im`, the pose of the laser, that of
/// the robot, `tv rv forward side axis time host logger_time`.
fn parse_robotlaser(place: &str, message: &[Token<'_>]) -> Result<ScanMessage, InputError> {
    require_tokens(place, message, 9)?;
    let n_beams = count(place, &message[8], "restore the beam count")?;
    let strengths = 9 + n_beams as usize;
    require_tokens(place, message, strengths + 1)?;
    check_numbers(place, &message[9..strengths])?;
    let n_strengths = count(place, &message[strengths], "restore the count of remissions")?;
    let first = strengths + 1 + n_strengths as usize;
    require_tokens(place, message, first + 14)?;
    check_numbers(place, &message[strengths + 1..first])?;
    Ok(ScanMessage {
        kind: ScanKind::Robotlaser,
        n_beams,
        at: timed_pose(place, message, first + 3, first + 11)?,
        odometry: None,
    })
}

fn count(place: &str, word: &Token<'_>, remedy: &str) -> Result<u32, InputError> {
    let n = word.integer(&place)?;
    if n <= MAX_BEAMS {
        return Ok(n);
    }
    Err(word.error(&place, format!("{n} beams are more than {MAX_BEAMS}"), remedy))
}

/// Checks ranges, although a scan keeps only their number, so that damage is found.
fn check_numbers(place: &str, words: &[Token<'_>]) -> Result<(), InputError> {
    words.iter().try_for_each(|word| word.number(&place).map(drop))
}

fn timed_pose(
    place: &str,
    message: &[Token<'_>],
    first: usize,
    time: usize,
) -> Result<TimedPose, InputError> {
    let t_secs = message[time].number(&place)?;
    Ok(TimedPose { t_secs, pose: parse_pose(place, &message[first..first + 3])? })
}

fn parse_pose(place: &str, words: &[Token<'_>]) -> Result<PoseXyTheta, InputError> {
    Ok([words[0].number(&place)?, words[1].number(&place)?, words[2].number(&place)?])
}

/// Messages may be longer than documented (later programs append fields), never shorter.
fn require_tokens(place: &str, message: &[Token<'_>], n: usize) -> Result<(), InputError> {
    if message.len() >= n {
        return Ok(());
    }
    let last = message[message.len() - 1];
    let cause =
        format!("the {} message has {} words instead of {n}", message[0].text, message.len());
    Err(last.error(&place, cause, "restore the damaged line"))
}
