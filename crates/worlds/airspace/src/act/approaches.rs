//! Closest approaches: how near pairs of airplanes come to each other, whoever flies them.

use super::flight::{Flight, Moment};
use crate::Scratch;
use crate::events::{Event, EventKind};
use crate::flight::distance_m;
use crate::state::{LOOKS_PER_STEP, PairRecord};
use crate::world::AirspaceWorld;

/// Pairs farther apart than this many separations are not kept in the books.
const WORTH_NOTING: f64 = 4.0;
/// Two times nearer than this part of a step are the same.
const ROUNDING: f64 = 1e-6;

/// Books the distances of all pairs during a step.
pub(super) fn book(
    world: &AirspaceWorld,
    flights: &[Flight<'_>],
    moment: Moment,
    scratch: &mut Scratch,
) {
    for (i, a) in flights.iter().enumerate().filter(|(_, f)| f.ended.is_none()) {
        for b in flights[i + 1..].iter().filter(|f| f.ended.is_none()) {
            let record = match is_worth_noting(world, a, b) {
                true => closest(world, (a, b), moment),
                false => continue,
            };
            if record.nearest_m.is_finite() {
                if record.losses > 0 {
                    let event =
                        Event::of_pair(moment.now, EventKind::LossOfSeparation, a.slot, b.slot);
                    scratch.events.push(event.with(record.nearest_m));
                }
                let pairs = scratch.pairs.entry((a.slot, b.slot));
                pairs.and_modify(|r| r.add(record)).or_insert(record);
            }
        }
    }
}

/// Whether two may come so near each other within a step that it is to be booked.
fn is_worth_noting(world: &AirspaceWorld, a: &Flight<'_>, b: &Flight<'_>) -> bool {
    let dtau_s = world.timing.dtau_s;
    let step_m = (world.top_m_s[a.slot as usize] + world.top_m_s[b.slot as usize]) * dtau_s;
    distance_m(a.pose.at, b.pose.at) <= WORTH_NOTING * gap_m(world, a, b) + step_m
        && a.levels(dtau_s).meets(&b.levels(dtau_s), world.vertical_m)
}

/// The separation of a pair.
fn gap_m(world: &AirspaceWorld, a: &Flight<'_>, b: &Flight<'_>) -> f64 {
    let own_m = |f: &Flight<'_>| world.airplanes[f.slot as usize].model.separation_m;
    own_m(a).max(own_m(b))
}

/// Returns the record of a pair in one step.
fn closest(
    world: &AirspaceWorld,
    (a, b): (&Flight<'_>, &Flight<'_>),
    moment: Moment,
) -> PairRecord {
    let (dtau_s, gap_m) = (world.timing.dtau_s, gap_m(world, a, b));
    // Only where both are in the air, and on one level.
    let apart_m = |t_s: f64| {
        let at = |f: &Flight<'_>| f.at(world.wind_m_s, moment, t_s);
        let ((place_a, height_a), (place_b, height_b)) = at(a).zip(at(b))?;
        let on_one_level = (height_a - height_b).abs() < world.vertical_m;
        on_one_level.then(|| distance_m(place_a, place_b))
    };
    // A loss goes on where the step before has ended; only when one of the two has just
    // come into the air there is none before.
    let begins = moment.step_s <= a.since_s.max(b.since_s) + ROUNDING * dtau_s;
    let mut was_lost = !begins && apart_m(0.0).is_some_and(|d| d < gap_m);
    let mut record = PairRecord { nearest_m: f64::INFINITY, lost_looks: 0, losses: 0 };
    for look in 1..=LOOKS_PER_STEP {
        let apart_m = apart_m(dtau_s * look as f64 / LOOKS_PER_STEP as f64);
        let is_lost = apart_m.is_some_and(|d| d < gap_m);
        record.nearest_m = record.nearest_m.min(apart_m.unwrap_or(f64::INFINITY));
        record.lost_looks += u64::from(is_lost);
        record.losses += u32::from(is_lost && !was_lost);
        was_lost = is_lost;
    }
    record
}
