//! The tours of coordinators: the airplane that they visit next, and the reason.

use super::hosted_aircraft::{HierarchyReply, HostedAircraft};
use super::state::{Coordinator, CoordinatorTask, HierarchyData, MemberData, RoundData};
use super::{CoordinatorStep, HostContext, MigratingCoordinator, check};
use crate::agents::OptimizationResult;
use crate::agents::link::to_bytes;
use crate::agents::participant::InvalidMessage;

impl Coordinator {
    /// Gathers the data of the airplanes of its part, from number `k` on.
    fn gather(&mut self, k: usize, ship: &HostedAircraft) -> Option<CoordinatorStep> {
        let RoundData { round, airplanes, .. } = &mut self.gathered;
        for (k, airplane) in airplanes.iter_mut().enumerate().skip(k) {
            if airplane.place == ship.own.me {
                airplane.record_model(&ship.own, *round);
            } else if airplane.is_presumed {
                airplane.presume(&ship.own);
            } else {
                self.task = CoordinatorTask::Gather(k);
                return Some(CoordinatorStep::Hop(airplane.place));
            }
        }
        self.task = CoordinatorTask::Return;
        None
    }

    /// Returns to the host that began the epoch, where the step of the algorithm is taken.
    fn return_home(
        &mut self,
        ship: &mut HostedAircraft,
        here: &HostContext<'_>,
    ) -> Option<CoordinatorStep> {
        let home = here.epochs[ship.part].owner.into();
        if ship.own.me != home {
            return Some(CoordinatorStep::Hop(home));
        }
        self.task = match ship.root_seat() {
            Some(_) => CoordinatorTask::Await,
            None => self.advance_task(
                ship,
                here,
                CoordinatorTask::Gather(0),
                CoordinatorTask::Deliver(0),
            ),
        };
        None
    }

    /// Takes the step of the algorithm. Returns the task after it, which depends on whether the
    /// decisions are made.
    fn advance_task(
        &mut self,
        ship: &HostedAircraft,
        here: &HostContext<'_>,
        next: CoordinatorTask,
        last: CoordinatorTask,
    ) -> CoordinatorTask {
        self.gathered.advance(&ship.own.briefing, here.tick >= ship.sampling_end);
        if self.gathered.is_final { last } else { next }
    }

    /// Waits for the coordinator above, which takes the data and brings the results.
    fn wait_for_root(&mut self, ship: &mut HostedAircraft) -> Option<CoordinatorStep> {
        if let Some(HierarchyReply { gathered, is_known }) = ship.answer.take() {
            if is_known {
                self.gathered = gathered;
            }
            self.gathered.is_final |= !is_known;
        } else if ship.is_orphan {
            self.gathered.is_final = true;
        } else {
            if ship.report.is_none() {
                ship.set_report(self.gathered.clone());
            }
            return Some(CoordinatorStep::Stay);
        }
        ship.report = None;
        self.task = if self.gathered.is_final {
            CoordinatorTask::Deliver(0)
        } else {
            CoordinatorTask::Gather(0)
        };
        None
    }

    /// Brings the airplanes of its part their controls, from number `k` on.
    fn deliver(&mut self, k: usize, ship: &mut HostedAircraft) -> Option<CoordinatorStep> {
        let me = ship.own.me;
        // This includes an airplane that was passed over because it could not be reached then.
        self.conclude(ship);
        let is_due = |airplane: &&MemberData| !airplane.is_presumed && airplane.place != me;
        let mut left = self.gathered.airplanes.iter().skip(k).filter(is_due);
        let Some(next) = left.next() else { return Some(CoordinatorStep::Done) };
        let number = |airplane: &MemberData| airplane.place == next.place;
        self.task =
            CoordinatorTask::Deliver(self.gathered.airplanes.iter().position(number).unwrap_or(k));
        Some(CoordinatorStep::Hop(next.place))
    }

    fn conclude(&self, ship: &mut HostedAircraft) {
        let airplanes = &self.gathered.airplanes;
        let mut beacons = vec![None; ship.own.briefing.ids.len()];
        for airplane in airplanes {
            beacons[airplane.place].clone_from(&airplane.beacon);
        }
        let own = airplanes.iter().find(|airplane| airplane.place == ship.own.me);
        let decided = own.and_then(|airplane| airplane.decided.clone());
        let presumed = airplanes.iter().filter(|a| a.is_presumed && a.place != ship.own.me);
        let unheard = presumed.map(|a| a.place).collect();
        ship.conclude(OptimizationResult { decided, beacons }, unheard);
    }
}

/// The tours of the coordinator above others: from home to home, and back.
impl Coordinator {
    /// Returns the overview, with the newest epochs of the parts that a host knows.
    fn update_hierarchy(
        &mut self,
        ship: &HostedAircraft,
        here: &HostContext<'_>,
    ) -> &mut HierarchyData {
        let parts = &here.epochs[..ship.parts.len()];
        let overview = self.overview.get_or_insert_default();
        overview.missing.resize(parts.len(), false);
        if overview.epochs.is_empty() {
            overview.epochs = parts.to_vec();
        }
        for (known, told) in overview.epochs.iter_mut().zip(parts) {
            *known = (*known).max(*told);
        }
        overview
    }

    /// Collects the data of the parts from number `k` on.
    fn collect(
        &mut self,
        first: usize,
        ship: &mut HostedAircraft,
        here: &HostContext<'_>,
    ) -> Option<CoordinatorStep> {
        let mut is_impatient = here.has_timed_out;
        for k in first..ship.parts.len() {
            self.task = CoordinatorTask::Collect(k);
            let overview = self.update_hierarchy(ship, here);
            let home = usize::from(overview.epochs[k].owner);
            let (is_here, is_lost) = (home == ship.own.me, overview.unreachable.contains(&home));
            let report = ship.report.clone().filter(|_| is_here && here.is_here[k]);
            if let Some(report) = report {
                overview.missing[k] = false;
                self.add_report(report);
            } else if overview.missing[k] || std::mem::take(&mut is_impatient) {
                overview.missing[k] = true;
                self.presume(k, ship);
            } else if is_here || is_lost {
                // The part's coordinator is not home yet, or it is brought back elsewhere.
                return Some(CoordinatorStep::Stay);
            } else {
                return Some(CoordinatorStep::Hop(home));
            }
        }
        let parts = CoordinatorTask::HandBack(ship.parts.len());
        self.task = self.advance_task(ship, here, parts, parts);
        None
    }

    fn add_report(&mut self, report: RoundData) {
        (self.gathered.round, self.gathered.calm) = (report.round, report.calm);
        self.gathered.airplanes.extend(report.airplanes);
    }

    /// Presumes the airplanes of a part whose coordinator cannot be found.
    fn presume(&mut self, part: usize, ship: &HostedAircraft) {
        let presumed = ship.parts[part].iter().map(|&place| {
            let mut airplane = MemberData::new(place);
            airplane.presume(&ship.own);
            airplane
        });
        self.gathered.airplanes.extend(presumed);
    }

    /// Brings the results to the parts before number `k`, the last one first.
    fn return_results(
        &mut self,
        k: usize,
        ship: &mut HostedAircraft,
        here: &HostContext<'_>,
    ) -> Option<CoordinatorStep> {
        for k in (0..k).rev() {
            self.task = CoordinatorTask::HandBack(k + 1);
            let overview = self.update_hierarchy(ship, here);
            let home = usize::from(overview.epochs[k].owner);
            if overview.missing[k] || overview.unreachable.contains(&home) {
                continue;
            }
            if home != ship.own.me {
                return Some(CoordinatorStep::Hop(home));
            }
            if here.is_here[k] && ship.report.is_some() {
                ship.set_reply(self.reply_for(&ship.parts[k]));
            }
        }
        if self.gathered.is_final {
            self.release_waiting(ship, here);
            return Some(CoordinatorStep::Done);
        }
        self.gathered.airplanes.clear();
        self.task = CoordinatorTask::Collect(0);
        None
    }

    /// Returns the results for a part.
    fn reply_for(&self, part: &[usize]) -> HierarchyReply {
        let of_part = self.gathered.airplanes.iter().filter(|a| part.contains(&a.place));
        let airplanes = of_part.cloned().collect();
        HierarchyReply { gathered: RoundData { airplanes, ..self.gathered }, is_known: true }
    }

    /// Releases a part that was left out while its coordinator waited here.
    fn release_waiting(&self, ship: &mut HostedAircraft, here: &HostContext<'_>) {
        if here.is_here[ship.part] && ship.report.is_some() {
            ship.set_reply(HierarchyReply { gathered: RoundData::default(), is_known: false });
        }
    }
}

impl MigratingCoordinator for Coordinator {
    type Services = HostedAircraft;

    fn new(ship: &HostedAircraft, seat: usize) -> Self {
        let is_above = ship.root_seat() == Some(seat);
        let part = ship.parts.get(seat).filter(|_| !is_above);
        let airplanes = part.into_iter().flatten().map(|&place| MemberData::new(place)).collect();
        Self {
            task: if is_above { CoordinatorTask::Collect(0) } else { CoordinatorTask::Gather(0) },
            gathered: RoundData { airplanes, ..RoundData::default() },
            overview: is_above.then(HierarchyData::default),
        }
    }

    fn encode(&self) -> Vec<u8> {
        to_bytes(self)
    }

    fn decode(bytes: &[u8], ship: &HostedAircraft, seat: usize) -> Result<Self, InvalidMessage> {
        let read = postcard::take_from_bytes::<Self>(bytes);
        let (state, rest) = read.map_err(|_| InvalidMessage::Form)?;
        InvalidMessage::Form.unless(rest.is_empty())?;
        check::check_state(&state, ship, seat)?;
        Ok(state)
    }

    fn advance(&mut self, ship: &mut HostedAircraft, here: &HostContext<'_>) -> CoordinatorStep {
        loop {
            let step = match self.task {
                CoordinatorTask::Gather(k) => self.gather(k, ship),
                CoordinatorTask::Return => self.return_home(ship, here),
                CoordinatorTask::Await => self.wait_for_root(ship),
                CoordinatorTask::Deliver(k) => self.deliver(k, ship),
                CoordinatorTask::Collect(k) => self.collect(k, ship, here),
                CoordinatorTask::HandBack(k) => self.return_results(k, ship, here),
            };
            if let Some(step) = step {
                return step;
            }
        }
    }

    fn on_unreachable(&mut self, place: usize) {
        match &mut self.overview {
            Some(overview) if overview.unreachable.contains(&place) => {}
            Some(overview) => overview.unreachable.push(place),
            None => {
                let airplane = self.gathered.airplanes.iter_mut().find(|a| a.place == place);
                airplane.into_iter().for_each(|airplane| airplane.is_presumed = true);
            }
        }
    }

    fn is_done_without(&self, place: usize) -> bool {
        let CoordinatorTask::Deliver(k) = self.task else { return false };
        let mut left = self.gathered.airplanes.iter().skip(k);
        left.all(|airplane| airplane.is_presumed || airplane.place == place)
    }
}
