//! Lines that the program tells whoever started it.

use sidestep_session::fleet::Told;
use std::io::Write;

/// Tells something. A reader that is gone has ended the program by that already.
pub(super) fn tell(told: &Told) {
    let mut line = serde_json::to_string(told).expect("what is told is plain data");
    line.push('\n');
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(line.as_bytes()).and_then(|()| out.flush());
}
