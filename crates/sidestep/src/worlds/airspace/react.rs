//! Pool two: the airplanes of a group decide together and fly for `dt`.

use super::Scratch;
use super::airplane::{Pose, distance_m};
use super::decide::Known;
use super::shield::{Flyer, Side, Way, filter};
use super::state::{AirspaceState, PairRecord};
use super::world::{Airplane, AirspaceWorld, purpose};
use sidestep_kernel::distr::normal;
use sidestep_kernel::ports::Clock;
use sidestep_kernel::{Cycle, Slot};

/// Looks at the distance of a pair in one step of `dtau`.
pub const LOOKS_PER_STEP: usize = 10;
/// Pairs farther apart than this many separations are not kept in the books.
const WORTH_NOTING: f64 = 4.0;
/// Goals farther away than this rank alike.
const FARTHEST_M: f64 = 2e9;
/// To be refused what it wants for `dt` brings an airplane forward as if it had flown this part
/// of the way meanwhile.
const REFUSED_PART: f64 = 0.125;

/// What one airplane flies in this `dt`.
struct Flight {
    slot: Slot,
    way: Way,
    pose: Pose,
    next: usize,
    /// Steps flown until it arrived.
    arrived: Option<usize>,
}

impl AirspaceWorld {
    /// A group decides, the shield filters, all fly; `group` are flying airplanes by id.
    pub(super) fn fly(
        &self,
        state: &AirspaceState,
        now: Cycle,
        group: &[Slot],
        scratch: &mut Scratch,
    ) {
        let known: Vec<Known> = group.iter().map(|&slot| self.known(state, now, slot)).collect();
        let began_ns = scratch.clock.now_ns();
        let candidates = self.wanted(&known, now, &mut scratch.effort);
        scratch.decide_ns += scratch.clock.now_ns() - began_ns;
        let ways = if self.shield {
            self.shielded(state, group, &candidates)
        } else {
            candidates.into_iter().map(|ways| ways.into_iter().next().unwrap_or_default()).collect()
        };
        let flights = group.iter().zip(ways).map(|(&slot, way)| {
            let cell = &state.airplanes[slot as usize];
            let (pose, next) = (cell.pose(), cell.next.get() as usize);
            Flight { slot, way, pose, next, arrived: None }
        });
        self.step_all(state, now, flights.collect(), scratch);
    }

    /// What the group knows of an airplane: its position with an error.
    fn known(&self, state: &AirspaceState, now: Cycle, slot: Slot) -> Known {
        let cell = &state.airplanes[slot as usize];
        let mut pose = cell.pose();
        if self.disturbance.position_m > 0.0 {
            let mut draws = self.streams.draws(slot, now, purpose::POSITION);
            pose.at.iter_mut().for_each(|v| *v += self.disturbance.position_m * normal(&mut draws));
        }
        Known { slot, pose, next: cell.next.get() as usize }
    }

    fn shielded(&self, state: &AirspaceState, group: &[Slot], candidates: &[Vec<Way>]) -> Vec<Way> {
        let flyer = |&slot: &Slot| {
            let (cell, model) =
                (&state.airplanes[slot as usize], &self.airplanes[slot as usize].model);
            Flyer {
                pose: cell.pose(),
                v_m_s: model.v_m_s,
                omega_max_rad_s: model.omega_max_rad_s,
                separation_m: model.separation_m,
                altitude_m: self.airplanes[slot as usize].altitude_m,
                vertical_m: self.vertical_m,
                fallback: cell.side(),
                rank: self.rank(state, slot),
            }
        };
        let flyers: Vec<Flyer> = group.iter().map(flyer).collect();
        let decisions = filter(&flyers, candidates, self.timing.dtau_s);
        let mut ways = Vec::with_capacity(group.len());
        for ((decision, &slot), (flyer, wishes)) in
            decisions.iter().zip(group).zip(flyers.iter().zip(candidates))
        {
            let cell = &state.airplanes[slot as usize];
            cell.set_side(decision.fallback);
            if decision.candidate != Some(0) {
                cell.overrides.set(cell.overrides.get() + 1);
            }
            ways.push(match decision.candidate {
                Some(k) => {
                    cell.waiting.set(0);
                    wishes[k].clone()
                }
                None => {
                    cell.orbits.set(cell.orbits.get() + 1);
                    cell.waiting.set(cell.waiting.get() + 1);
                    self.orbit(flyer.fallback, flyer.omega_max_rad_s)
                }
            });
        }
        ways
    }

    /// Who goes first: whoever is nearer to its goal, so that it is soon out of the others' way;
    /// and whoever has often been refused what it wanted, so that nobody waits for ever. Whole
    /// metres in the upper half, unique by the id in the lower one.
    fn rank(&self, state: &AirspaceState, slot: Slot) -> u64 {
        let cell = &state.airplanes[slot as usize];
        let Airplane { model, mission, .. } = &self.airplanes[slot as usize];
        let ahead = &mission[(cell.next.get() as usize).min(mission.len())..];
        let legs = ahead
            .iter()
            .scan(cell.pose().at, |from, &to| Some(distance_m(std::mem::replace(from, to), to)));
        let refused_m = f64::from(cell.overrides.get()) * model.v_m_s * self.timing.dt_s;
        // A conversion of what is out of range ends at the range.
        let first = (FARTHEST_M + REFUSED_PART * refused_m - legs.sum::<f64>()) as u32;
        u64::from(first) << 32 | u64::from(!slot)
    }

    fn orbit(&self, side: Side, omega_max_rad_s: f64) -> Way {
        let omega = side.sign() * omega_max_rad_s;
        Way { omegas_rad_s: vec![omega; self.timing.points_per_dt()] }
    }

    fn step_all(
        &self,
        state: &AirspaceState,
        now: Cycle,
        mut flights: Vec<Flight>,
        scratch: &mut Scratch,
    ) {
        let steps = self.timing.points_per_dt();
        for k in 0..steps {
            self.look(&flights, (now, k), scratch);
            for flight in flights.iter_mut().filter(|f| f.arrived.is_none()) {
                let airplane = &self.airplanes[flight.slot as usize];
                let omega = flight.way.omegas_rad_s[k];
                let pose = flight.pose.step(airplane.model.v_m_s, omega, self.timing.dtau_s);
                flight.pose = self.blown(pose);
                let pilot = self.pilot(flight.slot as usize, &airplane.mission);
                flight.next = pilot.next(flight.pose, flight.next);
                if flight.next == airplane.mission.len() {
                    flight.arrived = Some(k + 1);
                }
            }
        }
        for flight in flights {
            let cell = &state.airplanes[flight.slot as usize];
            let mut pose = flight.pose;
            if self.disturbance.heading_rad > 0.0 {
                let mut draws = self.streams.draws(flight.slot, now, purpose::HEADING);
                pose.psi_rad += self.disturbance.heading_rad * normal(&mut draws);
            }
            pose.psi_rad = sidestep_kernel::math::wrap_angle(pose.psi_rad);
            cell.set_pose(pose);
            cell.next.set(flight.next as u32);
            if let Some(k) = flight.arrived {
                cell.arrived.set(now * steps as u64 + k as u64);
            }
        }
    }

    /// Books the distances of all pairs during step `k`.
    fn look(&self, flights: &[Flight], (now, k): (Cycle, usize), scratch: &mut Scratch) {
        let dtau_s = self.timing.dtau_s;
        for (i, a) in flights.iter().enumerate().filter(|(_, f)| f.arrived.is_none()) {
            let minds = |b: &&Flight| b.arrived.is_none() && self.on_one_level(a.slot, b.slot);
            for b in flights[i + 1..].iter().filter(minds) {
                let model = |f: &Flight| &self.airplanes[f.slot as usize].model;
                let gap_m = model(a).separation_m.max(model(b).separation_m);
                let step_m = (model(a).v_m_s + model(b).v_m_s) * dtau_s;
                if distance_m(a.pose.at, b.pose.at) > WORTH_NOTING * gap_m + step_m {
                    continue;
                }
                let at = |f: &Flight, t_s: f64| {
                    f.pose.step(model(f).v_m_s, f.way.omegas_rad_s[k], t_s).at
                };
                // A loss goes on where the step before has ended; only when one of the two
                // has just appeared there is none before.
                let appeared =
                    self.appears_in(a.slot as usize).max(self.appears_in(b.slot as usize));
                let begins = now == appeared && k == 0;
                let mut was_lost = !begins && distance_m(a.pose.at, b.pose.at) < gap_m;
                let mut record = PairRecord { nearest_m: f64::INFINITY, lost_looks: 0, losses: 0 };
                for look in 1..=LOOKS_PER_STEP {
                    let t_s = dtau_s * look as f64 / LOOKS_PER_STEP as f64;
                    let apart_m = distance_m(at(a, t_s), at(b, t_s));
                    let is_lost = apart_m < gap_m;
                    record.nearest_m = record.nearest_m.min(apart_m);
                    record.lost_looks += u64::from(is_lost);
                    record.losses += u32::from(is_lost && !was_lost);
                    was_lost = is_lost;
                }
                scratch
                    .pairs
                    .entry((a.slot, b.slot))
                    .and_modify(|r| r.add(record))
                    .or_insert(record);
            }
        }
    }
}
