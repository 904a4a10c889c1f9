//! The outcome of the decisions of a chain's connectors.

use crate::agents::{ConnectorControl, ConnectorMove, ExecutedMotion};
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Chain, is_in_range, is_length_allowed};

/// Returns the new places of a chain's connectors. At most one motion is carried out, all of it: where
/// a participant's decision is missing, is another one, or would tear a rod, no connector moves.
pub(crate) fn final_positions<const D: usize>(
    chain: &Chain<D>,
    controls: &[Option<ConnectorControl<D>>],
) -> Option<Vec<Point<D>>> {
    let mut led = controls.iter().flatten().filter_map(|control| control.led);
    let (ExecutedMotion { request, first, last }, None) = (led.next()?, led.next()) else {
        return None;
    };
    let mut points = chain.points().to_vec();
    for k in first..=last {
        let control = controls.get(k as usize)?.as_ref().filter(|c| c.connector == k)?;
        let (ConnectorMove::To { request: its, to }
        | ConnectorMove::WithItsMaster { request: its, to }) = control.goes
        else {
            return None;
        };
        if its != request || !is_in_range(&to) {
            return None;
        }
        *points.get_mut(k as usize)? = to;
    }
    let rods = chain.rods().iter().zip(points.windows(2).zip(chain.points().windows(2)));
    // A rod that was out of its limits before, as in a chain that was broken, may stay so.
    let mut torn = rods.filter(|(rod, (new, old))| {
        new != old && !is_length_allowed(**rod, distance(new[0], new[1]))
    });
    torn.next().is_none().then_some(points)
}
