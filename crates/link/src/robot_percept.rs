//! Percepts of robots, as the server sends them.

use sidestep::kernel::Cycle;
use sidestep::worlds::robots::agents::RobotPercept;

/// Reads the percept of a robot for a cycle.
///
/// # Errors
/// When it is none, or of another cycle, with the reason.
pub(crate) fn read_percept(cycle: Cycle, bytes: &[u8]) -> Result<RobotPercept, String> {
    let percept: RobotPercept = postcard::from_bytes(bytes).map_err(|e| e.to_string())?;
    if percept.cycle != cycle {
        return Err("it is of another cycle".into());
    }
    Ok(percept)
}
