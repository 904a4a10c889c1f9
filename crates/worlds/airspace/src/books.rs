//! The books: how near pairs of airplanes come to each other, whoever flies them.

use super::Scratch;
use super::airplane::distance_m;
use super::events::{Event, EventKind};
use super::react::Flight;
use super::state::PairRecord;
use super::world::AirspaceWorld;
use sidestep_kernel::Cycle;

/// Looks at the distance of a pair in one step of `dtau`.
pub const LOOKS_PER_STEP: usize = 10;
/// Pairs farther apart than this many separations are not kept in the books.
const WORTH_NOTING: f64 = 4.0;
/// Two times nearer than this part of a step are the same.
const ROUNDING: f64 = 1e-6;

impl AirspaceWorld {
    /// Books the distances of all pairs during step `k`, which begins at `step_s`.
    pub(super) fn look(
        &self,
        flights: &[Flight<'_>],
        (step_s, k): (f64, usize),
        scratch: &mut Scratch,
    ) {
        let dtau_s = self.timing.dtau_s;
        for (i, a) in flights.iter().enumerate().filter(|(_, f)| f.ended.is_none()) {
            for b in flights[i + 1..].iter().filter(|f| f.ended.is_none()) {
                let step_m =
                    (self.top_m_s[a.slot as usize] + self.top_m_s[b.slot as usize]) * dtau_s;
                let apart_m = distance_m(a.pose.at, b.pose.at);
                if apart_m > WORTH_NOTING * self.gap_m(a, b) + step_m
                    || !a.levels(dtau_s).meets(&b.levels(dtau_s), self.vertical_m)
                {
                    continue;
                }
                let record = self.look_at((a, b), (step_s, k));
                if record.nearest_m.is_finite() {
                    if record.losses > 0 {
                        let now = (step_s / self.timing.dt_s + ROUNDING) as Cycle;
                        let kind = EventKind::LossOfSeparation;
                        let event = Event::of_pair(now, kind, a.slot, b.slot);
                        scratch.events.push(event.with(record.nearest_m));
                    }
                    let pairs = scratch.pairs.entry((a.slot, b.slot));
                    pairs.and_modify(|r| r.add(record)).or_insert(record);
                }
            }
        }
    }

    /// The separation of a pair.
    fn gap_m(&self, a: &Flight<'_>, b: &Flight<'_>) -> f64 {
        let own_m = |f: &Flight<'_>| self.airplanes[f.slot as usize].model.separation_m;
        own_m(a).max(own_m(b))
    }

    /// What comes of a pair in one step.
    fn look_at(&self, (a, b): (&Flight<'_>, &Flight<'_>), (step_s, k): (f64, usize)) -> PairRecord {
        let (dtau_s, gap_m) = (self.timing.dtau_s, self.gap_m(a, b));
        // Only where both are in the air, and on one level.
        let apart_m = |t_s: f64| {
            let at = |f: &Flight<'_>| f.at(self, (step_s, k), t_s);
            let ((place_a, height_a), (place_b, height_b)) = at(a).zip(at(b))?;
            let on_one_level = (height_a - height_b).abs() < self.vertical_m;
            on_one_level.then(|| distance_m(place_a, place_b))
        };
        // A loss goes on where the step before has ended; only when one of the two has just
        // come into the air there is none before.
        let begins = step_s <= a.since_s.max(b.since_s) + ROUNDING * dtau_s;
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
}
