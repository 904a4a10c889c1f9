//! Percepts, decisions and actions of a body.

use crate::encode::requested_body;
use crate::protocol::{BodyId, Problem};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{Inspection, Kinds};

/// Returns the percepts, decisions and actions of a body in the last cycle.
///
/// # Errors
/// If there is no such body, or it cannot be inspected.
pub(super) fn inspection(
    run: &dyn Simulation,
    of: &BodyId,
    kinds: &Kinds,
) -> Result<Inspection, Problem> {
    let inspection = requested_body(of, kinds).and_then(|body| run.inspect(body));
    inspection.ok_or_else(|| {
        let part = of.part.map(|part| format!("/{part}")).unwrap_or_default();
        let place = format!("{}/{}{part}", of.kind, of.number);
        let remedy = format!("choose a {} of this run", run.agent_noun());
        Problem::new(place, "no information about this body", remedy)
    })
}
