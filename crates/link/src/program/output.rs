//! Lines that the program writes for its parent process.

use sidestep_session::fleet::LinkMessage;
use std::io::Write;

/// Writes a line. If the reader is gone, that has ended the program already.
pub(super) fn print_message(told: &LinkMessage) {
    let mut line = serde_json::to_string(told).expect("what is told is plain data");
    line.push('\n');
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(line.as_bytes()).and_then(|()| out.flush());
}
