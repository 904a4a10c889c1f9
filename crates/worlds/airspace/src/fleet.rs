//! Runs whose pilots are outside of them: each cycle they receive their percepts, and return their controls.

use crate::agents::ReachedCost;
use crate::decide::possible_profiles;
use crate::events::EventKind;
use crate::method::MethodKind;
use crate::pilot::{AirplaneControl, Maneuver, Percept};
use crate::settings::Deployment;
use crate::shield::TurnProfile;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use crate::world_impl::AirspaceRun;
use sidestep_kernel::control::OrderError;
use sidestep_kernel::{Cycle, EntityId, Simulation};
use std::collections::BTreeMap;

/// A run in which airplanes may be flown by pilots outside of it.
pub trait RemotePilotRun {
    /// Returns the percepts of the airplanes that decide in the cycle to come, by rising id. No result depends on
    /// it.
    fn percepts(&self) -> Vec<Percept>;

    /// Submits the controls of airplanes for the cycle to come. An airplane without one stays on its stored fallback;
    /// unless a network is given that may lose messages, so does its whole group, because then plans are safe only if
    /// all fly them. A run that is recorded keeps the controls, so that it can be computed again.
    ///
    /// # Errors
    /// When one of them is of another airplane or cycle, or cannot be flown; none is accepted then. When the run is
    /// recorded without its controls, or one process decides for all.
    fn submit(&mut self, controls: Vec<AirplaneControl>) -> Result<(), OrderError>;

    /// Returns the controls, each serialized, that cannot be flown in the cycle to come, with the reasons.
    fn find_invalid_controls(&self, controls: &[(EntityId, Vec<u8>)]) -> Vec<(EntityId, String)>;

    /// Returns, of each airplane that decides in the cycle to come, the others of its group that its radio does
    /// not reach, both by rising id.
    fn unreachable_members(&self) -> Vec<(EntityId, Vec<EntityId>)>;
}

impl RemotePilotRun for AirspaceRun {
    fn percepts(&self) -> Vec<Percept> {
        self.world().percepts(self.state(), self.cycle())
    }

    fn submit(&mut self, controls: Vec<AirplaneControl>) -> Result<(), OrderError> {
        let mut serialized = Vec::with_capacity(controls.len());
        for control in &controls {
            let bytes = postcard::to_stdvec(control).expect("controls are plain data");
            serialized.push((control.id, bytes));
        }
        self.submit_controls(&serialized)
    }

    fn find_invalid_controls(&self, controls: &[(EntityId, Vec<u8>)]) -> Vec<(EntityId, String)> {
        let percepts = self.percepts();
        let mut invalid = Vec::new();
        for (id, bytes) in controls {
            let percept = percepts.iter().find(|percept| percept.own.id == *id);
            if let Err(reason) = self.world().read_control(*id, bytes, percept) {
                invalid.push((*id, reason));
            }
        }
        invalid
    }

    fn unreachable_members(&self) -> Vec<(EntityId, Vec<EntityId>)> {
        self.world().unreachable_members(self.state(), self.cycle())
    }
}

impl AirspaceWorld {
    /// Returns the percepts of the airplanes that decide in cycle `now`.
    pub(crate) fn percepts(&self, state: &AirspaceState, now: Cycle) -> Vec<Percept> {
        let mut all = Vec::new();
        self.for_each_group(state, now, |context, flown, traffic| {
            all.extend(flown.percepts(context, &traffic.non_cooperative));
        });
        all.sort_unstable_by_key(|percept| percept.own.id);
        all
    }

    /// Returns the others of its group that each airplane does not reach in cycle `now`.
    fn unreachable_members(
        &self,
        state: &AirspaceState,
        now: Cycle,
    ) -> Vec<(EntityId, Vec<EntityId>)> {
        let range_m = self.network.as_ref().map_or(f64::INFINITY, |network| network.range_m);
        let mut all = Vec::new();
        if range_m == f64::INFINITY {
            return all;
        }
        self.for_each_group(state, now, |context, flown, _| {
            for &own in &flown.ids {
                let unreachable = flown
                    .ids
                    .iter()
                    .copied()
                    .filter(|&id| id != own && context.state.distance_m([own, id]) > range_m)
                    .collect();
                all.push((own, unreachable));
            }
        });
        all.sort_unstable();
        all
    }

    /// Stores the controls of airplanes, if all are valid.
    pub(crate) fn store_controls(
        &self,
        state: &AirspaceState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        if self.deployment == Deployment::Direct {
            let cause = "one process decides for all (deployment = \"direct\"); set deployment to team, \
                         compact-team, replica-team, pim or hierarchical-pim";
            return Err(OrderError::NoExternalAgents { cause: cause.into() });
        }
        let percepts = self.percepts(state, now);
        let percepts: BTreeMap<_, _> =
            percepts.iter().map(|percept| (percept.own.id, percept)).collect();
        let mut read = BTreeMap::new();
        for (id, bytes) in controls {
            let refused = |cause: String| {
                let agent = format!("airplane {}", self.display_name(*id));
                OrderError::Control { agent, cause }
            };
            let control =
                self.read_control(*id, bytes, percepts.get(id).copied()).map_err(refused)?;
            if read.insert(*id, control).is_some() {
                return Err(refused("there are two of it; give one for each airplane".into()));
            }
        }
        state.set_controls(now, read.into_values().collect());
        Ok(())
    }

    /// Reads a control, and checks that its airplane can fly it.
    fn read_control(
        &self,
        id: EntityId,
        bytes: &[u8],
        percept: Option<&Percept>,
    ) -> Result<AirplaneControl, String> {
        let Some(percept) = percept else {
            let cause =
                "it does not decide in this cycle; give controls for those of `percepts` only";
            return Err(cause.into());
        };
        let read = postcard::take_from_bytes::<AirplaneControl>(bytes);
        let Some((control, _)) = read.ok().filter(|(_, rest)| rest.is_empty()) else {
            return Err("its bytes are no control of this build".into());
        };
        if (control.id, control.cycle) != (id, percept.cycle) {
            return Err(format!(
                "it is of airplane {} and cycle {}; give that of airplane {id} and cycle {}",
                control.id, control.cycle, percept.cycle
            ));
        }
        self.check_maneuver(percept, &control.maneuver)?;
        self.check_control(&control)?;
        Ok(control)
    }

    /// Checks that an airplane can fly a maneuver.
    fn check_maneuver(&self, percept: &Percept, maneuver: &Maneuver) -> Result<(), String> {
        let Maneuver::Profile {
            candidate, profile: TurnProfile { omegas_rad_s }, fallback, ..
        } = maneuver
        else {
            return Ok(());
        };
        let own = &percept.own;
        let cycles = fallback.cycles_until_orbit();
        let choices = self.fallbacks[own.id as usize].iter();
        let max_cycles = choices.map(|choice| choice.cycles_until_orbit()).max().unwrap_or(0);
        if cycles > max_cycles {
            return Err(format!(
                "a fallback that orbits after {cycles} cycles; give one that does after at most {max_cycles}"
            ));
        }
        let steps = self.timing.points_per_dt();
        if omegas_rad_s.len() != steps {
            let found = omegas_rad_s.len();
            return Err(format!("it has {found} turn rates; give {steps}, one for each step"));
        }
        let max_rad_s = self.flown_segment(own.id, own.orders, &own.command).model.omega_max_rad_s;
        // NaN is in no range.
        let range = -max_rad_s..=max_rad_s;
        if let Some(omega) = omegas_rad_s.iter().find(|omega| !range.contains(omega)) {
            return Err(format!(
                "a turn rate of {omega} rad/s; give {} to {max_rad_s}",
                -max_rad_s
            ));
        }
        let profiles = match self.method {
            // A caller may order any heading, and a reactive method may choose any.
            MethodKind::Mvp
            | MethodKind::Orca
            | MethodKind::Bands
            | MethodKind::External
            | MethodKind::Own(_) => {
                return Ok(());
            }
            MethodKind::Pc | MethodKind::None => possible_profiles(self, own.as_known_aircraft()),
        };
        let is_known = profiles.iter().any(|profile| profile.omegas_rad_s == *omegas_rad_s);
        if is_known && (*candidate as usize) < profiles.len() {
            return Ok(());
        }
        Err("its turn rates are those of none of its actions; give those of one of them".into())
    }

    /// Checks the parts of a control beside the maneuver.
    fn check_control(&self, control: &AirplaneControl) -> Result<(), String> {
        let n = self.airplanes.len();
        let are_events_valid = control.events.iter().all(|event| {
            let is_own = (event.airplane, event.cycle) == (control.id, control.cycle);
            is_own
                && is_pilot_event(event.kind)
                && (event.other as usize) < n
                && event.at_m.is_none()
        });
        let are_known = control.memory.contacts.keys().all(|&other| (other as usize) < n);
        // Where the network is reliable, no airplane keeps any.
        let are_contacts_valid = self.network.is_some() || control.memory.contacts.is_empty();
        let are_resolutions_valid = control.memory.resolving.check(n).is_ok();
        let is_status_valid = control.optimized.is_none_or(|status| {
            let is_action = (status.chosen as usize) < self.actions(control.id).len();
            let has_costs =
                |reached: ReachedCost| reached.cost.is_finite() && reached.bound.is_finite();
            is_action && status.reached.is_none_or(has_costs)
        });
        // The airspace brings it within the limits of the airplane.
        let is_command_valid = self.command_kinds().allows(&control.memory.command);
        let is_memory_valid =
            are_known && are_contacts_valid && are_resolutions_valid && is_command_valid;
        if are_events_valid && is_memory_valid && is_status_valid {
            return Ok(());
        }
        Err("its events, its memory or its optimization are impossible for a pilot".into())
    }
}

/// Returns whether pilots report events of this kind; the run itself reports all others.
fn is_pilot_event(kind: EventKind) -> bool {
    use EventKind::{Deadline, GroupTooLarge, HeldBack, SearchLimit, Unheard};
    matches!(kind, Deadline | GroupTooLarge | HeldBack | SearchLimit | Unheard)
}
