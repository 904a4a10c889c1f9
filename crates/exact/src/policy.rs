//! The policies that have a name.

use sidestep_error_models::RandomPolicy;
use sidestep_error_models::effector::FORWARD;
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

/// The names that [`policy`] accepts, for messages.
pub const POLICIES: [&str; 3] = ["uniform", "forward", "bounce"];

/// Returns the policy of a name: `uniform` (each standard action alike), `forward` (always ahead),
/// or `bounce` (ahead, and a turn to either side after a contact).
///
/// # Errors
/// When there is no such policy.
pub fn policy(name: &str) -> Result<RandomPolicy, InputError> {
    match name {
        "uniform" => Ok(RandomPolicy::uniform()),
        "forward" => Ok(RandomPolicy::always(FORWARD)),
        "bounce" => Ok(RandomPolicy::bounce()),
        _ => {
            let remedy = suggestion(name, &POLICIES);
            Err(InputError::new("--policy", format!("unknown policy `{name}`"), remedy))
        }
    }
}
