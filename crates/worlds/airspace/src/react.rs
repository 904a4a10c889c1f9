//! Pool two: the airplanes of a group decide together and fly for `dt`.

use super::Scratch;
use super::airplane::{Point, Pose, distance_m};
use super::decide::Known;
use super::deploy::Seen;
use super::deploy::contact::Contacts;
use super::events::{Event, EventKind};
use super::levels::Levels;
use super::orders::Stage;
use super::shield::{Flyer, Side, Way};
use super::state::{AirspaceState, Cell, LEFT};
use super::track::Track;
use super::world::{AirspaceWorld, purpose};
use sidestep_kernel::distr::normal;
use sidestep_kernel::{Cycle, Slot, Turn};

/// Goals farther away than this rank alike.
const FARTHEST_M: f64 = 2e9;
/// To be refused what it wants for `dt` brings an airplane forward as if it had flown this part
/// of the way meanwhile.
const REFUSED_PART: f64 = 0.125;

/// One airplane in this `dt`.
pub(super) struct Flight<'a> {
    pub(super) slot: Slot,
    pub(super) course: Course<'a>,
    pub(super) pose: Pose,
    pub(super) altitude_m: f64,
    /// When it came into the air, seconds after the start.
    pub(super) since_s: f64,
    next: usize,
    /// How it ended, as [`super::state::Cell::arrived`] says it.
    pub(super) ended: Option<u64>,
}

/// What it follows.
pub(super) enum Course<'a> {
    /// What has been decided.
    Way(Way, Stage<'a>),
    /// Its recorded way.
    Track(&'a Track),
}

impl Flight<'_> {
    /// Its altitude some seconds after `altitude_m`, on a decided way.
    fn altitude_after_m(&self, stage: &Stage<'_>, seconds: f64) -> f64 {
        let most_m = stage.climb_m_s * seconds;
        self.altitude_m + (stage.altitude_m - self.altitude_m).clamp(-most_m, most_m)
    }

    /// Where and how high it is `t_s` after the begin of step `k` at `step_s`; `None` where it
    /// is not in the air.
    pub(super) fn at(
        &self,
        world: &AirspaceWorld,
        (step_s, k): (f64, usize),
        t_s: f64,
    ) -> Option<(Point, f64)> {
        match &self.course {
            Course::Way(way, stage) => {
                let omega = way.omegas_rad_s[k];
                let [x, y] = self.pose.step(stage.model.v_m_s, omega, t_s).at;
                let [wx, wy] = world.wind_m_s;
                Some(([x + wx * t_s, y + wy * t_s], self.altitude_after_m(stage, t_s)))
            }
            Course::Track(track) => {
                let now_s = step_s + t_s;
                let at = || (track.pose_at(now_s).at, track.altitude_at_m(now_s));
                track.covers(now_s).then(at)
            }
        }
    }

    /// All levels that it is on during one step.
    pub(super) fn levels(&self, dtau_s: f64) -> Levels {
        match &self.course {
            Course::Way(_, stage) => {
                Levels::between(self.altitude_m, self.altitude_after_m(stage, dtau_s))
            }
            Course::Track(_) => Levels::ALL,
        }
    }
}

impl AirspaceWorld {
    /// A group decides, the shield filters, all fly, those on recorded ways beside them; `group`
    /// are the airplanes in the air, by id.
    pub(super) fn fly(&self, turn: &mut Turn<'_, Self>, group: &[Slot]) {
        let &mut Turn { state, now, clock, ref mut scratch, .. } = turn;
        let flown: Vec<Slot> =
            group.iter().copied().filter(|&slot| !self.is_replayed(slot, now)).collect();
        if self.shield {
            self.admit(state, now, &flown, scratch);
        }
        self.carry_out(state, now, &flown);
        let known: Vec<Known> = flown.iter().map(|&slot| self.known(state, now, slot)).collect();
        let began_ns = clock.thread_cpu_ns();
        let mut contacts = state.take_contacts(&flown);
        let candidates = self.wanted(&known, now, &mut contacts, scratch);
        scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
        let ways = if self.shield {
            self.shielded(state, (now, &flown), &candidates, &mut contacts, scratch)
        } else {
            candidates.into_iter().map(|ways| ways.into_iter().next().unwrap_or_default()).collect()
        };
        state.put_contacts(&flown, contacts);
        let mut ways = ways.into_iter();
        let flights = group.iter().map(|&slot| {
            let course = match &self.airplanes[slot as usize].track {
                Some(track) if self.is_replayed(slot, now) => Course::Track(track),
                _ => Course::Way(ways.next().unwrap_or_default(), self.stage_now(state, slot)),
            };
            self.flight(state, slot, course)
        });
        self.step_all(state, now, flights.collect(), scratch);
    }

    fn flight<'a>(&self, state: &AirspaceState, slot: Slot, course: Course<'a>) -> Flight<'a> {
        let cell = &state.airplanes[slot as usize];
        let recorded_s = self.airplanes[slot as usize].track.as_ref().map_or(0.0, Track::begins_s);
        let since_s = self.starts_s(self.appears_in(slot as usize)).max(recorded_s);
        let (pose, altitude_m) = (cell.pose(), cell.altitude_m.get());
        let next = cell.next.get() as usize;
        Flight { slot, course, pose, altitude_m, since_s, next, ended: None }
    }

    /// What the group knows of an airplane: its position with an error.
    pub(super) fn known(&self, state: &AirspaceState, now: Cycle, slot: Slot) -> Known {
        let cell = &state.airplanes[slot as usize];
        let mut pose = cell.pose();
        if self.disturbance.position_m > 0.0 {
            let mut draws = self.streams.draws(slot, now, purpose::POSITION);
            pose.at.iter_mut().for_each(|v| *v += self.disturbance.position_m * normal(&mut draws));
        }
        let (orders, altitude_m) = (u32::from(cell.orders.get()), cell.altitude_m.get());
        Known { slot, pose, next: cell.next.get() as usize, orders, altitude_m }
    }

    /// What the shield knows of an airplane.
    pub(super) fn flyer(&self, state: &AirspaceState, slot: Slot) -> Flyer {
        let (cell, stage) = (&state.airplanes[slot as usize], self.stage_now(state, slot));
        Flyer {
            id: slot,
            pose: cell.pose(),
            v_m_s: stage.model.v_m_s,
            omega_max_rad_s: stage.model.omega_max_rad_s,
            separation_m: stage.model.separation_m,
            levels: Levels::between(cell.altitude_m.get(), stage.altitude_m),
            vertical_m: self.vertical_m,
            fallback: cell.side(),
            came_too_close: cell.came_too_close(),
            rank: self.rank(cell, &stage, slot),
        }
    }

    /// Who goes first: whoever is nearer to its goal, so that it is soon out of the others' way;
    /// and whoever has often been refused what it wanted, so that nobody waits for ever. Whole
    /// metres in the upper half, unique by the id in the lower one.
    fn rank(&self, cell: &Cell, stage: &Stage<'_>, slot: Slot) -> u64 {
        let ahead = &stage.mission[(cell.next.get() as usize).min(stage.mission.len())..];
        let legs = ahead
            .iter()
            .scan(cell.pose().at, |from, &to| Some(distance_m(std::mem::replace(from, to), to)));
        let refused_m = f64::from(cell.overrides.get()) * stage.model.v_m_s * self.timing.dt_s;
        // A conversion of what is out of range ends at the range.
        let first = (FARTHEST_M + REFUSED_PART * refused_m - legs.sum::<f64>()) as u32;
        u64::from(first) << 32 | u64::from(!slot)
    }

    fn shielded(
        &self,
        state: &AirspaceState,
        (now, group): (Cycle, &[Slot]),
        candidates: &[Vec<Way>],
        contacts: &mut [Contacts],
        scratch: &mut Scratch,
    ) -> Vec<Way> {
        let seen = |&slot: &Slot| Seen {
            flyer: self.flyer(state, slot),
            orbits: state.airplanes[slot as usize].orbiting.get() > 0,
        };
        let seen: Vec<Seen> = group.iter().map(seen).collect();
        let (decisions, traffic) =
            self.exchanged(&seen, candidates, now, contacts, &mut scratch.events);
        scratch.exchanged.add(traffic);
        let mut ways = Vec::with_capacity(group.len());
        for ((decision, &slot), (Seen { flyer, .. }, wishes)) in
            decisions.iter().zip(group).zip(seen.iter().zip(candidates))
        {
            let cell = &state.airplanes[slot as usize];
            cell.set_side(decision.fallback);
            if decision.candidate != Some(0) {
                cell.overrides.set(cell.overrides.get() + 1);
            }
            ways.push(match decision.candidate {
                Some(k) => {
                    cell.orbiting.set(0);
                    if k > 0 {
                        let event = Event::of(now, EventKind::Override, slot);
                        scratch.events.push(event.with(k as f64));
                    }
                    wishes[k].clone()
                }
                None => {
                    cell.orbits.set(cell.orbits.get() + 1);
                    cell.orbiting.set(cell.orbiting.get() + 1);
                    scratch.events.push(Event::of(now, EventKind::Orbit, slot));
                    self.orbit(flyer.fallback, flyer.omega_max_rad_s)
                }
            });
        }
        ways
    }

    fn orbit(&self, side: Side, omega_max_rad_s: f64) -> Way {
        let omega = side.sign() * omega_max_rad_s;
        Way { omegas_rad_s: vec![omega; self.timing.points_per_dt()] }
    }

    fn step_all(
        &self,
        state: &AirspaceState,
        now: Cycle,
        mut flights: Vec<Flight<'_>>,
        scratch: &mut Scratch,
    ) {
        let steps = self.timing.points_per_dt();
        for k in 0..steps {
            let step = now * steps as u64 + k as u64;
            let step_s = step as f64 * self.timing.dtau_s;
            for flight in flights.iter_mut().filter(|f| f.ended.is_none()) {
                let leaves_s = self.airplanes[flight.slot as usize].leaves_s;
                flight.ended = (leaves_s <= step_s).then_some(LEFT | step);
            }
            self.look(&flights, (step_s, k), scratch);
            for flight in flights.iter_mut().filter(|f| f.ended.is_none()) {
                self.step(flight, step, k);
            }
        }
        for flight in flights {
            self.store(state, now, flight, scratch);
        }
    }

    /// Flies step `k` of this `dt`, which is step `step` of the run.
    fn step(&self, flight: &mut Flight<'_>, step: u64, k: usize) {
        let dtau_s = self.timing.dtau_s;
        let is_at_end = match &flight.course {
            Course::Way(way, stage) => {
                let omega = way.omegas_rad_s[k];
                let altitude_m = flight.altitude_after_m(stage, dtau_s);
                flight.altitude_m = altitude_m;
                flight.pose = self.blown(flight.pose.step(stage.model.v_m_s, omega, dtau_s));
                let pilot = self.pilot(stage.model, stage.mission);
                flight.next = pilot.next(flight.pose, flight.next);
                flight.next == stage.mission.len()
            }
            Course::Track(track) => {
                let after_s = (step + 1) as f64 * dtau_s;
                flight.pose = track.pose_at(after_s);
                flight.altitude_m = track.altitude_at_m(after_s);
                track.ends_s() <= after_s
            }
        };
        flight.ended = is_at_end.then_some(step + 1);
    }

    fn store(&self, state: &AirspaceState, now: Cycle, flight: Flight<'_>, scratch: &mut Scratch) {
        let cell = &state.airplanes[flight.slot as usize];
        let mut pose = flight.pose;
        let is_disturbed = matches!(flight.course, Course::Way(..));
        if is_disturbed && self.disturbance.heading_rad > 0.0 {
            let mut draws = self.streams.draws(flight.slot, now, purpose::HEADING);
            pose.psi_rad += self.disturbance.heading_rad * normal(&mut draws);
        }
        pose.psi_rad = sidestep_kernel::math::wrap_angle(pose.psi_rad);
        cell.set_pose(pose);
        cell.altitude_m.set(flight.altitude_m);
        cell.next.set(flight.next as u32);
        if let Some(ended) = flight.ended {
            cell.arrived.set(ended);
            if let Some(delay_s) = self.airplane_metrics(state, flight.slot).delay_s() {
                let event = Event::of(now, EventKind::Arrival, flight.slot);
                scratch.events.push(event.with(delay_s));
            }
        }
    }
}
