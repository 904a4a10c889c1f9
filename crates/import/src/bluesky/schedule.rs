//! The commands that are due, in the order of their times.

use super::lines::CommandText;
use std::collections::BTreeMap;

/// The maximum number of commands of a scenario and all files that it calls: some 20 times the most known.
pub(super) const MAX_COMMANDS: u64 = 1_000_000;

/// The order of commands: by time, then by the file that they were read from, the last one first, then as in the file.
type CommandOrder = (u64, i64, u64);

/// Commands that wait for their time.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    pending: BTreeMap<CommandOrder, CommandText>,
    /// Number of commands added so far.
    added: u64,
    /// Number of batches added so far.
    batches: i64,
}

impl Schedule {
    /// Adds the commands of a file, whose times are in seconds after `start_s`. At one time they precede those that
    /// wait, except behind the last of all, as in the simulator. Returns the number of those that are too many.
    pub(super) fn add(
        &mut self,
        commands: impl IntoIterator<Item = CommandText>,
        start_s: f64,
        now_s: f64,
    ) -> u64 {
        self.batches += 1;
        let last = self.pending.last_key_value().map(|(order, _)| (order.0, order.1));
        let mut left_out = 0;
        for command in commands {
            let at_s = (command.time_s + start_s).max(now_s);
            let group = match last {
                Some((time, group)) if time == order_of(at_s) && at_s > now_s => group,
                _ => -self.batches,
            };
            left_out += u64::from(!self.insert(at_s, group, command));
        }
        left_out
    }

    /// Adds a command behind all others of its time. Returns whether there was room.
    pub(super) fn add_last(&mut self, at_s: f64, command: CommandText) -> bool {
        self.insert(at_s, i64::MAX, command)
    }

    fn insert(&mut self, at_s: f64, group: i64, mut command: CommandText) -> bool {
        self.added += 1;
        if self.added > MAX_COMMANDS {
            return false;
        }
        command.time_s = at_s;
        self.pending.insert((order_of(at_s), group, self.added), command);
        true
    }

    /// Takes the next command, whose time is now that since the start of the scenario.
    pub(super) fn next(&mut self) -> Option<CommandText> {
        self.pending.pop_first().map(|(_, command)| command)
    }

    /// Takes all commands that are due after a time.
    pub(super) fn take_after(&mut self, now_s: f64) -> impl Iterator<Item = CommandText> {
        self.pending.split_off(&(order_of(now_s) + 1, i64::MIN, 0)).into_values()
    }
}

/// Returns a number that rises with the time, which is not negative: the order of its bits is that of the numbers.
fn order_of(at_s: f64) -> u64 {
    // Negative zero has other bits.
    (at_s + 0.0).to_bits()
}
