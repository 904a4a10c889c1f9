//! Lines that the program prints for its parent process.

use sidestep::kernel::terminal::escape_controls_in_json;
use sidestep_session::fleet::LinkMessage;
use std::io::Write;

/// Prints a message as a line of JSON, which the parent process can read at once.
pub(super) fn print_message(message: &LinkMessage) {
    let json = serde_json::to_string(message).expect("messages are plain data");
    let line = format!("{}\n", escape_controls_in_json(&json));
    let mut out = std::io::stdout().lock();
    // An error means that the parent process is gone, and that ends the program by standard input.
    let _ = out.write_all(line.as_bytes()).and_then(|()| out.flush());
}
