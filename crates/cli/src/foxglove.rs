//! The address at which viewers watch runs live.

use crate::console::Console;
use sidestep_session::ViewerAddress;

/// Prints the address for viewers, and warns of one that others can reach.
pub(crate) fn print_address(at: &ViewerAddress, console: Console) {
    console.note(format!("Foxglove and Lichtblick: open a connection to {}", at.url()));
    if at.is_public() {
        console.warn(
            "others can reach these viewers' address, which asks for no token: anyone who has it can\n  \
             watch, pause and steer the run; what is sent is not encrypted",
        );
    }
}
