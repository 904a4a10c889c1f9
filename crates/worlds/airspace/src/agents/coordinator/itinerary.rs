//! The tours of coordinators: the airplane that they visit next, and the reason.

use super::hosted_aircraft::{HostAircraft, RootCoordinatorReply};
use super::state::{
    Coordinator, CoordinatorMemberData, CoordinatorTask, OptimizationProgress, RootCoordinatorData,
};
use super::{CoordinatorHostContext, CoordinatorItineraryStep, MigratingCoordinator, check};
use crate::agents::OptimizationResult;
use crate::agents::link::to_bytes;
use crate::agents::participant::InvalidMessage;

impl Coordinator {
    /// Gathers the data of the airplanes of its part, from number `k` on.
    fn gather_member_data(
        &mut self,
        k: usize,
        services: &HostAircraft,
    ) -> Option<CoordinatorItineraryStep> {
        let OptimizationProgress { round, airplanes, .. } = &mut self.data;
        for (k, airplane) in airplanes.iter_mut().enumerate().skip(k) {
            if airplane.place == services.own.me {
                airplane.update_from_ownship(&services.own, *round);
            } else if airplane.is_presumed {
                airplane.presume(&services.own);
            } else {
                self.task = CoordinatorTask::Gather(k);
                return Some(CoordinatorItineraryStep::Hop(airplane.place));
            }
        }
        self.task = CoordinatorTask::Return;
        None
    }

    /// Returns to the host that began the epoch, where the step of the algorithm is taken.
    fn return_home(
        &mut self,
        services: &mut HostAircraft,
        context: &CoordinatorHostContext<'_>,
    ) -> Option<CoordinatorItineraryStep> {
        let home = context.epochs[services.part].owner.into();
        if services.own.me != home {
            return Some(CoordinatorItineraryStep::Hop(home));
        }
        self.task = match services.root_number() {
            Some(_) => CoordinatorTask::Await,
            None => self.advance_optimization(
                services,
                context,
                CoordinatorTask::Gather(0),
                CoordinatorTask::Deliver(0),
            ),
        };
        None
    }

    /// Takes the step of the algorithm. Returns the task after it, which depends on whether the
    /// decisions are made.
    fn advance_optimization(
        &mut self,
        services: &HostAircraft,
        context: &CoordinatorHostContext<'_>,
        next: CoordinatorTask,
        last: CoordinatorTask,
    ) -> CoordinatorTask {
        self.data.advance(&services.own.common, context.tick >= services.sampling_end);
        if self.data.is_final { last } else { next }
    }

    /// Waits for the coordinator above, which takes the data and brings the results.
    fn wait_for_root(&mut self, services: &mut HostAircraft) -> Option<CoordinatorItineraryStep> {
        if let Some(RootCoordinatorReply { data, is_known }) = services.answer.take() {
            if is_known {
                self.data = data;
            }
            self.data.is_final |= !is_known;
        } else if services.is_orphan {
            self.data.is_final = true;
        } else {
            if services.report.is_none() {
                services.set_part_progress(self.data.clone());
            }
            return Some(CoordinatorItineraryStep::Stay);
        }
        services.report = None;
        self.task = if self.data.is_final {
            CoordinatorTask::Deliver(0)
        } else {
            CoordinatorTask::Gather(0)
        };
        None
    }

    /// Delivers the controls to the airplanes of its part, from number `k` on.
    fn deliver_controls(
        &mut self,
        k: usize,
        services: &mut HostAircraft,
    ) -> Option<CoordinatorItineraryStep> {
        let me = services.own.me;
        // This includes an airplane that was passed over because it could not be reached then.
        self.conclude(services);
        let mut remaining = self.data.airplanes.iter().enumerate().skip(k);
        let next = remaining.find(|(_, airplane)| !airplane.is_presumed && airplane.place != me);
        let Some((number, next)) = next else { return Some(CoordinatorItineraryStep::Done) };
        let host = next.place;
        self.task = CoordinatorTask::Deliver(number);
        Some(CoordinatorItineraryStep::Hop(host))
    }

    fn conclude(&self, services: &mut HostAircraft) {
        let airplanes = &self.data.airplanes;
        let mut beacons = vec![None; services.own.common.ids.len()];
        for airplane in airplanes {
            beacons[airplane.place].clone_from(&airplane.beacon);
        }
        let own = airplanes.iter().find(|airplane| airplane.place == services.own.me);
        let decided = own.and_then(|airplane| airplane.decided.clone());
        let presumed = airplanes.iter().filter(|a| a.is_presumed && a.place != services.own.me);
        let unheard = presumed.map(|a| a.place).collect();
        services.conclude(OptimizationResult { decided, beacons }, unheard);
    }
}

/// The tours of the coordinator above others: from home to home, and back.
impl Coordinator {
    /// Returns the data about the parts, with the newest epochs that a host knows.
    fn update_hierarchy(
        &mut self,
        services: &HostAircraft,
        context: &CoordinatorHostContext<'_>,
    ) -> &mut RootCoordinatorData {
        let parts = &context.epochs[..services.parts.len()];
        let hierarchy = self.hierarchy.get_or_insert_default();
        hierarchy.missing.resize(parts.len(), false);
        if hierarchy.epochs.is_empty() {
            hierarchy.epochs = parts.to_vec();
        }
        for (known, other) in hierarchy.epochs.iter_mut().zip(parts) {
            *known = (*known).max(*other);
        }
        hierarchy
    }

    /// Collects the data of the parts from number `k` on.
    fn collect_part_reports(
        &mut self,
        first: usize,
        services: &mut HostAircraft,
        context: &CoordinatorHostContext<'_>,
    ) -> Option<CoordinatorItineraryStep> {
        let mut has_timed_out = context.has_timed_out;
        for k in first..services.parts.len() {
            self.task = CoordinatorTask::Collect(k);
            let hierarchy = self.update_hierarchy(services, context);
            let home = usize::from(hierarchy.epochs[k].owner);
            let is_here = home == services.own.me;
            let is_lost = hierarchy.unreachable.contains(&home);
            let report = services.report.clone().filter(|_| is_here && context.is_here[k]);
            if let Some(report) = report {
                hierarchy.missing[k] = false;
                self.merge_part_progress(report);
            } else if hierarchy.missing[k] || std::mem::take(&mut has_timed_out) {
                hierarchy.missing[k] = true;
                self.presume(k, services);
            } else if is_here || is_lost {
                // The part's coordinator is not home yet, or it is brought back elsewhere.
                return Some(CoordinatorItineraryStep::Stay);
            } else {
                return Some(CoordinatorItineraryStep::Hop(home));
            }
        }
        // Whether the decisions are made or not, every part waits for an answer.
        let parts = CoordinatorTask::HandBack(services.parts.len());
        self.task = self.advance_optimization(services, context, parts, parts);
        None
    }

    fn merge_part_progress(&mut self, report: OptimizationProgress) {
        self.data.round = report.round;
        self.data.calm = report.calm;
        self.data.airplanes.extend(report.airplanes);
    }

    /// Presumes the airplanes of a part whose coordinator cannot be found.
    fn presume(&mut self, part: usize, services: &HostAircraft) {
        let presumed = services.parts[part].iter().map(|&place| {
            let mut airplane = CoordinatorMemberData::new(place);
            airplane.presume(&services.own);
            airplane
        });
        self.data.airplanes.extend(presumed);
    }

    /// Brings the results to the parts before number `k`, the last one first, because there the collection has ended.
    fn return_results(
        &mut self,
        k: usize,
        services: &mut HostAircraft,
        context: &CoordinatorHostContext<'_>,
    ) -> Option<CoordinatorItineraryStep> {
        for k in (0..k).rev() {
            self.task = CoordinatorTask::HandBack(k + 1);
            let hierarchy = self.update_hierarchy(services, context);
            let home = usize::from(hierarchy.epochs[k].owner);
            if hierarchy.missing[k] || hierarchy.unreachable.contains(&home) {
                continue;
            }
            if home != services.own.me {
                return Some(CoordinatorItineraryStep::Hop(home));
            }
            if context.is_here[k] && services.report.is_some() {
                services.set_reply(self.reply_for(&services.parts[k]));
            }
        }
        if self.data.is_final {
            self.release_waiting(services, context);
            return Some(CoordinatorItineraryStep::Done);
        }
        self.data.airplanes.clear();
        self.task = CoordinatorTask::Collect(0);
        None
    }

    /// Returns the results for a part.
    fn reply_for(&self, part: &[usize]) -> RootCoordinatorReply {
        let of_part = self.data.airplanes.iter().filter(|a| part.contains(&a.place));
        let airplanes = of_part.cloned().collect();
        RootCoordinatorReply {
            data: OptimizationProgress { airplanes, ..self.data },
            is_known: true,
        }
    }

    /// Releases a part that was left out while its coordinator waited here.
    fn release_waiting(&self, services: &mut HostAircraft, context: &CoordinatorHostContext<'_>) {
        if context.is_here[services.part] && services.report.is_some() {
            services.set_reply(RootCoordinatorReply {
                data: OptimizationProgress::default(),
                is_known: false,
            });
        }
    }
}

impl MigratingCoordinator for Coordinator {
    type Services = HostAircraft;

    fn new(services: &HostAircraft, number: usize) -> Self {
        let is_above = services.root_number() == Some(number);
        let part = services.parts.get(number).filter(|_| !is_above);
        let airplanes =
            part.into_iter().flatten().map(|&place| CoordinatorMemberData::new(place)).collect();
        Self {
            task: if is_above { CoordinatorTask::Collect(0) } else { CoordinatorTask::Gather(0) },
            data: OptimizationProgress { airplanes, ..OptimizationProgress::default() },
            hierarchy: is_above.then(RootCoordinatorData::default),
            has_changes: services.own.common.has_changes(),
        }
    }

    fn encode(&self) -> Vec<u8> {
        let mut bytes = to_bytes(self);
        if self.has_changes {
            let airplanes = self.data.airplanes.iter();
            bytes.extend(to_bytes(&airplanes.map(|one| one.orders).collect::<Vec<u32>>()));
        }
        bytes
    }

    fn decode(
        bytes: &[u8],
        services: &HostAircraft,
        number: usize,
    ) -> Result<Self, InvalidMessage> {
        let read = postcard::take_from_bytes::<Self>(bytes);
        let (mut state, mut rest) = read.map_err(|_| InvalidMessage::Form)?;
        state.has_changes = services.own.common.has_changes();
        if state.has_changes {
            let read = postcard::take_from_bytes::<Vec<u32>>(rest);
            let list = read.map_err(|_| InvalidMessage::Form)?;
            let orders = list.0;
            rest = list.1;
            let airplanes = &mut state.data.airplanes;
            InvalidMessage::Length.ensure(orders.len() == airplanes.len())?;
            airplanes.iter_mut().zip(orders).for_each(|(one, orders)| one.orders = orders);
        }
        InvalidMessage::Form.ensure(rest.is_empty())?;
        check::check_state(&state, services, number)?;
        Ok(state)
    }

    fn advance(
        &mut self,
        services: &mut HostAircraft,
        context: &CoordinatorHostContext<'_>,
    ) -> CoordinatorItineraryStep {
        loop {
            let step = match self.task {
                CoordinatorTask::Gather(k) => self.gather_member_data(k, services),
                CoordinatorTask::Return => self.return_home(services, context),
                CoordinatorTask::Await => self.wait_for_root(services),
                CoordinatorTask::Deliver(k) => self.deliver_controls(k, services),
                CoordinatorTask::Collect(k) => self.collect_part_reports(k, services, context),
                CoordinatorTask::HandBack(k) => self.return_results(k, services, context),
            };
            if let Some(step) = step {
                return step;
            }
        }
    }

    fn on_unreachable(&mut self, place: usize) {
        match &mut self.hierarchy {
            Some(hierarchy) if hierarchy.unreachable.contains(&place) => {}
            Some(hierarchy) => hierarchy.unreachable.push(place),
            None => {
                let airplane = self.data.airplanes.iter_mut().find(|a| a.place == place);
                airplane.into_iter().for_each(|airplane| airplane.is_presumed = true);
            }
        }
    }

    fn is_done_without(&self, place: usize) -> bool {
        let CoordinatorTask::Deliver(k) = self.task else { return false };
        let mut left = self.data.airplanes.iter().skip(k);
        left.all(|airplane| airplane.is_presumed || airplane.place == place)
    }
}
