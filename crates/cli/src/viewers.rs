//! The words about viewers that watch runs live.

use crate::console::Console;
use sidestep_session::ViewersAt;

/// Says where viewers are served, and warns of an address that others can reach.
pub(crate) fn tell(at: &ViewersAt, console: Console) {
    console.note(format!("Foxglove and Lichtblick: open a connection to {}", at.url()));
    if at.is_open_to_others() {
        console.warn(
            "others can reach these viewers' address, which asks for no token: whoever has it can\n  \
             watch, pause and steer the run; what is sent is not encrypted",
        );
    }
}
