//! Commands until they are acknowledged.

use super::channel::Channel;
use super::counts::MavlinkCounts;
use super::messages::{CommandAck, CommandInt, result_name};
use ::mavlink::dialects::common::COMMAND_LONG_DATA;
use std::collections::BTreeMap;
use std::fmt;
use std::time::{Duration, Instant};

/// Time without an acknowledgment after which a command is sent again.
const REPEAT_INTERVAL: Duration = Duration::from_millis(400);

/// How often a command is sent at most.
const MAX_ATTEMPTS: u8 = 3;

/// Time that a command which is in progress may take before it counts as unanswered.
const PROGRESS_INTERVAL: Duration = Duration::from_secs(3);

/// Time after which a command that was sent has a result.
pub(super) const ANSWER_TIME: Duration = Duration::from_millis(1300);

/// `MAV_RESULT_ACCEPTED`.
const ACCEPTED: u8 = 0;
/// `MAV_RESULT_UNSUPPORTED`.
pub(super) const UNSUPPORTED: u8 = 3;
/// `MAV_RESULT_IN_PROGRESS`.
const IN_PROGRESS: u8 = 5;

/// A command.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum CommandMessage {
    /// One without a place: older autopilots know most of them in this form alone.
    Long(COMMAND_LONG_DATA),
    /// One with a place, or of another dialect.
    Int(CommandInt),
}

/// What has become of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CommandOutcome {
    /// The autopilot obeys.
    Accepted,
    /// It does not, with the number of its `MAV_RESULT`.
    Refused(u8),
    /// It does not answer.
    Unanswered,
}

impl fmt::Display for CommandOutcome {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Accepted => out.write_str("accepted"),
            Self::Refused(result) => write!(out, "refused with {}", result_name(*result)),
            Self::Unanswered => write!(out, "not acknowledged, though sent {MAX_ATTEMPTS} times"),
        }
    }
}

impl CommandMessage {
    /// Returns the number of the command.
    pub(super) fn number(&self) -> u16 {
        match self {
            // All of the common dialect are below 65536.
            Self::Long(content) => content.command as u16,
            Self::Int(content) => content.command,
        }
    }

    fn send(&self, channel: &mut Channel, confirmation: u8) {
        match self {
            Self::Long(content) => {
                channel.send(&COMMAND_LONG_DATA { confirmation, ..content.clone() });
            }
            Self::Int(content) => channel.send(content),
        }
    }
}

/// A command that waits for its acknowledgment.
#[derive(Debug)]
struct Pending {
    message: CommandMessage,
    attempts: u8,
    due: Instant,
}

/// The commands of a vehicle.
#[derive(Debug, Default)]
pub(super) struct Commands {
    /// One of each number: an acknowledgment has no more than that.
    pending: BTreeMap<u16, Pending>,
    outcomes: BTreeMap<u16, CommandOutcome>,
}

impl Commands {
    /// Sends a command, and again until it is acknowledged or was sent often enough. One of the same number that waits is
    /// given up.
    pub(super) fn submit(&mut self, message: CommandMessage, channel: &mut Channel) {
        message.send(channel, 0);
        let number = message.number();
        self.outcomes.remove(&number);
        let pending = Pending { message, attempts: 1, due: Instant::now() + REPEAT_INTERVAL };
        self.pending.insert(number, pending);
    }

    /// Sends a command once: the next one of its number replaces it soon.
    pub(super) fn send_once(&mut self, message: &CommandMessage, channel: &mut Channel) {
        message.send(channel, 0);
    }

    /// Returns what has become of the last command of a number; none while it waits, or when there was none.
    pub(super) fn outcome(&self, number: u16) -> Option<CommandOutcome> {
        self.outcomes.get(&number).copied()
    }

    /// Returns whether a command of a number waits.
    pub(super) fn is_pending(&self, number: u16) -> bool {
        self.pending.contains_key(&number)
    }

    /// Takes note of an acknowledgment to this system.
    pub(super) fn on_ack(&mut self, ack: CommandAck, counts: &mut MavlinkCounts) {
        if ack.result == IN_PROGRESS {
            if let Some(pending) = self.pending.get_mut(&ack.command) {
                pending.due = Instant::now() + PROGRESS_INTERVAL;
            }
            return;
        }
        self.pending.remove(&ack.command);
        let outcome = match ack.result {
            ACCEPTED => CommandOutcome::Accepted,
            result => CommandOutcome::Refused(result),
        };
        if outcome != CommandOutcome::Accepted {
            counts.refused_commands += 1;
        }
        self.outcomes.insert(ack.command, outcome);
    }

    /// Sends again what has waited long enough, and gives up what was sent often enough.
    pub(super) fn repeat(&mut self, channel: &mut Channel) {
        let now = Instant::now();
        let mut given_up = Vec::new();
        for (number, pending) in &mut self.pending {
            if now < pending.due {
                continue;
            }
            if pending.attempts == MAX_ATTEMPTS {
                given_up.push(*number);
                continue;
            }
            pending.message.send(channel, pending.attempts);
            pending.attempts += 1;
            pending.due = now + REPEAT_INTERVAL;
        }
        for number in given_up {
            self.pending.remove(&number);
            self.outcomes.insert(number, CommandOutcome::Unanswered);
            channel.counts.unanswered_commands += 1;
        }
    }
}
