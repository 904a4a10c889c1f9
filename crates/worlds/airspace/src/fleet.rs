//! Runs whose pilots are elsewhere: each cycle they receive their perceptions, and return their controls.

use crate::decide::possible_profiles;
use crate::events::EventKind;
use crate::pilot::{Control, Maneuver, Percept};
use crate::settings::{Deployment, Method};
use crate::shield::TurnProfile;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use crate::world_impl::AirspaceRun;
use sidestep_kernel::control::OrderError;
use sidestep_kernel::{Cycle, EntityId, Simulation};
use std::collections::BTreeMap;

/// A run in which airplanes may be flown by pilots outside of it.
pub trait Fleet {
    /// Returns the perceptions of each airplane that decides in the cycle to come, by rising id. No result depends on
    /// it.
    fn percepts(&self) -> Vec<Percept>;

    /// Hands over the controls of airplanes for the cycle to come. An airplane without one stays on its stored orbit;
    /// unless a network is given that may lose messages, so does its whole group, because then plans are safe only if
    /// all fly them. A run that is recorded keeps the controls, so that it can be computed again.
    ///
    /// # Errors
    /// When one of them is of another airplane or cycle, or cannot be flown; none is taken then. When the run is
    /// recorded without its controls, or one process decides for all.
    fn submit(&mut self, controls: Vec<Control>) -> Result<(), OrderError>;

    /// Returns the controls, each serialized, that cannot be flown in the cycle to come, with the reasons.
    fn invalid_controls(&self, controls: &[(EntityId, Vec<u8>)]) -> Vec<(EntityId, String)>;

    /// Returns, of each airplane that decides in the cycle to come, the others of its group that its radio does
    /// not reach, both by rising id.
    fn out_of_range(&self) -> Vec<(EntityId, Vec<EntityId>)>;
}

impl Fleet for AirspaceRun {
    fn percepts(&self) -> Vec<Percept> {
        self.world().percepts(self.state(), self.cycle())
    }

    fn submit(&mut self, controls: Vec<Control>) -> Result<(), OrderError> {
        let bytes =
            |control: &Control| postcard::to_stdvec(control).expect("controls are plain data");
        let controls: Vec<_> = controls.iter().map(|one| (one.id, bytes(one))).collect();
        self.submit_controls(&controls)
    }

    fn invalid_controls(&self, controls: &[(EntityId, Vec<u8>)]) -> Vec<(EntityId, String)> {
        let sights = self.percepts();
        let sight = |id| sights.iter().find(|sight| sight.own.id == id);
        let why = |(id, bytes): &(EntityId, Vec<u8>)| {
            Some((*id, self.world().read_control(*id, bytes, sight(*id)).err()?))
        };
        controls.iter().filter_map(why).collect()
    }

    fn out_of_range(&self) -> Vec<(EntityId, Vec<EntityId>)> {
        self.world().out_of_range(self.state(), self.cycle())
    }
}

impl AirspaceWorld {
    /// Returns the perceptions of each airplane that decides in cycle `now`.
    pub(crate) fn percepts(&self, state: &AirspaceState, now: Cycle) -> Vec<Percept> {
        let mut all = Vec::new();
        self.for_each_group(state, now, |turn, flown, intruders| {
            all.extend(flown.percepts(turn, intruders));
        });
        all.sort_unstable_by_key(|sight| sight.own.id);
        all
    }

    /// Returns the others of its group that each airplane does not reach in cycle `now`.
    fn out_of_range(&self, state: &AirspaceState, now: Cycle) -> Vec<(EntityId, Vec<EntityId>)> {
        let range_m = self.network.as_ref().map_or(f64::INFINITY, |network| network.range_m);
        let mut all = Vec::new();
        if range_m == f64::INFINITY {
            return all;
        }
        self.for_each_group(state, now, |turn, flown, _| {
            for &own in &flown.ids {
                let is_beyond = |other: &EntityId| turn.state.distance_m([own, *other]) > range_m;
                let others = flown.ids.iter().copied().filter(|&id| id != own);
                all.push((own, others.filter(is_beyond).collect()));
            }
        });
        all.sort_unstable();
        all
    }

    /// Notes the controls of airplanes, once all are found to be right.
    pub(crate) fn store_controls(
        &self,
        state: &AirspaceState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        if self.deployment == Deployment::Direct {
            let cause = "one process decides for all (deployment = \"direct\"); set deployment to team, \
                         compact-team, pim or hierarchical-pim";
            return Err(OrderError::NoExternalAgents { cause: cause.into() });
        }
        let sights = self.percepts(state, now);
        let sights: BTreeMap<_, _> = sights.iter().map(|sight| (sight.own.id, sight)).collect();
        let mut read = BTreeMap::new();
        for (id, bytes) in controls {
            let refused = |cause: String| {
                let who = format!("airplane {}", self.display_name_or_id(*id));
                OrderError::Control { who, cause }
            };
            let control =
                self.read_control(*id, bytes, sights.get(id).copied()).map_err(refused)?;
            if read.insert(*id, control).is_some() {
                return Err(refused("there are two of it; give one for each airplane".into()));
            }
        }
        state.set_controls(now, read.into_values().collect());
        Ok(())
    }

    /// Returns the name that people use for an airplane, or else the id.
    fn display_name_or_id(&self, id: EntityId) -> String {
        self.callsign(id).unwrap_or_else(|| id.to_string())
    }

    /// Reads a control, and checks that its airplane can fly it.
    fn read_control(
        &self,
        id: EntityId,
        bytes: &[u8],
        sight: Option<&Percept>,
    ) -> Result<Control, String> {
        let Some(sight) = sight else {
            let cause =
                "it does not decide in this cycle; give controls for those of `sights` only";
            return Err(cause.into());
        };
        let read = postcard::take_from_bytes::<Control>(bytes);
        let Some((control, _)) = read.ok().filter(|(_, rest)| rest.is_empty()) else {
            return Err("its bytes are none of a control of this build".into());
        };
        if (control.id, control.cycle) != (id, sight.cycle) {
            return Err(format!(
                "it is of airplane {} and cycle {}; give that of airplane {id} and cycle {}",
                control.id, control.cycle, sight.cycle
            ));
        }
        self.check_maneuver(sight, &control.course)?;
        self.check_control(&control)?;
        Ok(control)
    }

    /// Checks that an airplane can fly a course.
    fn check_maneuver(&self, sight: &Percept, course: &Maneuver) -> Result<(), String> {
        let Maneuver::Way { wish, way: TurnProfile { omegas_rad_s }, .. } = course else {
            return Ok(());
        };
        let (own, steps) = (&sight.own, self.timing.points_per_dt());
        if omegas_rad_s.len() != steps {
            let found = omegas_rad_s.len();
            return Err(format!("its way has {found} turn rates; give {steps}, one for each step"));
        }
        let most_rad_s = self.segment(own.id, own.orders).model.omega_max_rad_s;
        // Comparisons with NaN are false.
        let is_within = |omega: &&f64| omega.abs() <= most_rad_s;
        if let Some(omega) = omegas_rad_s.iter().find(|omega| !is_within(omega)) {
            return Err(format!(
                "a turn rate of {omega} rad/s; give {} to {most_rad_s}",
                -most_rad_s
            ));
        }
        let ways = match self.method {
            // Any heading may be ordered, or come of a method that looks at others.
            Method::Mvp | Method::Orca | Method::External => return Ok(()),
            Method::Pc | Method::None => possible_profiles(self, own.known_aircraft()),
        };
        match ways.iter().any(|way| way.omegas_rad_s == *omegas_rad_s) {
            true if (*wish as usize) < ways.len() => Ok(()),
            _ => Err("its way is none of those that its actions lead; give one of them".into()),
        }
    }

    /// Checks the parts of a control beside the course.
    fn check_control(&self, control: &Control) -> Result<(), String> {
        let is_told = |kind: EventKind| {
            use EventKind::{Deadline, GroupTooLarge, HeldBack, Unheard};
            matches!(kind, Deadline | GroupTooLarge | HeldBack | Unheard)
        };
        let (id, n) = (control.id, self.airplanes.len());
        let is_own = control.events.iter().all(|event| {
            let about = (event.airplane, event.cycle) == (id, control.cycle);
            about && is_told(event.kind) && (event.other as usize) < n && event.at_m.is_none()
        });
        let are_known = control.memory.contacts.keys().all(|&other| (other as usize) < n);
        let has_contacts = self.network.is_some() || control.memory.contacts.is_empty();
        match is_own && are_known && has_contacts && control.memory.resolving.check(n).is_ok() {
            true => Ok(()),
            false => Err("its events or its memory are none that a pilot can have".into()),
        }
    }
}
