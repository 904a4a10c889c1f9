//! Airplanes: their model, generated traffic, flight plans and recorded tracks.

use super::compile::Compiler;
use super::performance::performance_from_keys;
use crate::flight::{
    AircraftModel, AirplaneStart, ChangeAlternatives, Performance, Pose2, SpeedChanges, Surface,
    TimeDiscretization, Track,
};
use crate::flight_plan::{AirplaneSection, mixed_positions};
use crate::settings::{
    AbilityKeys, AltitudeLimit, Bank, ChangeList, Combinations, PositiveRate, PositiveTime,
    SeparationM, Speed, SpeedLimit, SurveillanceCategory, TurnCount, TurnRate, VelocityCategory,
    ability_keys,
};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_import::traffic::MAX_SPEED_M_S;
use sidestep_kernel::InputError;
use sidestep_kernel::stream::Streams;
use sidestep_scenario::{Number, Spanned};
use std::collections::BTreeMap;

/// The paper's airplane, for keys that a scenario leaves out.
const PAPER_MODEL: AircraftModel = AircraftModel {
    v_m_s: 35.0,
    omega_max_rad_s: 4f64.to_radians(),
    separation_m: 500.0,
    turns: 5,
};

#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ModelSection {
    /// Its type: one of the table of types_file, of OpenAP, or of the built-in ones.
    #[serde(rename = "type")]
    pub(super) type_name: Option<Spanned<String>>,
    /// Speed.
    v_m_s: Option<Number<Speed>>,
    /// Greatest turn rate.
    omega_max_deg_s: Option<Number<TurnRate>>,
    /// Greatest bank in turns: at any speed, turns pull no more to the side than at that bank.
    pub(super) bank_max_deg: Option<Number<Bank>>,
    /// Smallest airspeed: it stalls below.
    pub(super) v_min_m_s: Option<SpeedLimit>,
    /// Greatest airspeed.
    pub(super) v_max_m_s: Option<SpeedLimit>,
    /// Greatest rate of climb.
    pub(super) climb_max_m_s: Option<PositiveRate>,
    /// Greatest rate of descent, positive.
    pub(super) descent_max_m_s: Option<PositiveRate>,
    /// Lowest altitude.
    pub(super) floor_m: Option<AltitudeLimit>,
    /// Highest altitude.
    pub(super) ceiling_m: Option<AltitudeLimit>,
    /// Greatest change of airspeed; without it speeds change at once.
    pub(super) acceleration_m_s2: Option<PositiveRate>,
    /// Time for which its fuel, or its battery, lasts; longer flights are reported.
    pub(super) endurance_s: Option<PositiveTime>,
    /// Distance that all keep from each other.
    separation_m: Option<SeparationM>,
    turns: Option<TurnCount>,
    /// Changes of level among which method pc chooses, against the filed one.
    pub(super) level_changes_m: Option<ChangeList>,
    /// Changes of speed among which method pc chooses, against the filed one.
    pub(super) speed_changes_m_s: Option<ChangeList>,
    /// Category of accuracy of reported positions, NACp of ADS-B: a radius within which 95 % of them are.
    pub(super) nac_p: Option<SurveillanceCategory>,
    /// Category of integrity of reported positions, NIC of ADS-B: a radius for which the shield allows.
    pub(super) nic: Option<SurveillanceCategory>,
    /// Category of accuracy of reported velocities, NACv of ADS-B, for airspace.surveillance.
    pub(super) nac_v: Option<VelocityCategory>,
}

impl ModelSection {
    /// Returns the abilities that its own keys give.
    pub(super) fn abilities(&self) -> AbilityKeys {
        ability_keys!(self)
    }
}

/// The abilities of one airplane, and its separation.
#[derive(Debug, Clone)]
pub(super) struct Abilities {
    keys: AbilityKeys,
    type_name: Option<String>,
    separation_m: f64,
    turns: usize,
    pub(super) changes: ChangeAlternatives,
}

impl Abilities {
    pub(super) fn performance(&self) -> Performance {
        performance_from_keys(&self.keys, self.type_name.clone(), PAPER_MODEL.omega_max_rad_s)
    }

    /// Returns the model of an airplane with some performance and speed.
    pub(super) fn model(&self, performance: &Performance, v_m_s: f64) -> AircraftModel {
        AircraftModel {
            v_m_s,
            omega_max_rad_s: performance.turn.omega_rad_s(v_m_s),
            separation_m: self.separation_m,
            turns: self.turns,
        }
    }

    pub(super) fn v_m_s(&self) -> f64 {
        self.keys.v_m_s.unwrap_or(PAPER_MODEL.v_m_s)
    }
}

/// The time for which recorded airplanes follow their tracks.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReplayPeriod {
    pub(super) cycles: u64,
    /// End of these cycles, in seconds after the start of the run.
    until_s: f64,
    dt_s: f64,
}

impl Compiler<'_> {
    /// Returns the abilities of an airplane of the file, or of the generated ones: by its own keys, then its own type,
    /// then the keys and the type of all. Of two types only one counts: a mixture of both is none that flies.
    pub(super) fn abilities(&self, own: Option<&Spanned<AirplaneSection>>) -> Abilities {
        let usual = ModelSection::default();
        let common = self.file.airplane.as_ref().unwrap_or(&usual);
        let own = own.map(Spanned::get_ref);
        let own_type = own.and_then(|own| own.type_name.as_ref());
        let types = &self.recipe.types;
        let mut keys = own.map(AirplaneSection::abilities).unwrap_or_default();
        if let Some(name) = own_type {
            keys = keys.or(types.abilities(name.get_ref()));
        }
        keys = keys.or(common.abilities());
        let common_type = common.type_name.as_ref();
        if let Some(name) = common_type.filter(|_| own_type.is_none()) {
            keys = keys.or(types.abilities(name.get_ref()));
        }
        let separation_m = own.and_then(|own| own.separation_m).or(common.separation_m);
        let turns = own.and_then(|own| own.turns).or(common.turns);
        let levels = own.and_then(|own| own.level_changes_m.as_ref());
        let speeds = own.and_then(|own| own.speed_changes_m_s.as_ref());
        let list = |own: Option<&ChangeList>, common: Option<&ChangeList>| {
            own.or(common).map(|list| list.0.clone()).unwrap_or_default()
        };
        let changes = ChangeAlternatives {
            levels_m: list(levels, common.level_changes_m.as_ref()),
            speeds_m_s: list(speeds, common.speed_changes_m_s.as_ref()),
            is_product: self.file.airspace.combinations == Combinations::All,
        };
        Abilities {
            keys,
            type_name: own_type.or(common_type).map(|name| name.get_ref().clone()),
            separation_m: separation_m.map_or(PAPER_MODEL.separation_m, f64::from),
            turns: turns.map_or(PAPER_MODEL.turns, |turns| turns.0),
            changes,
        }
    }

    pub(super) fn airplanes(
        &self,
        streams: &Streams,
        replay: ReplayPeriod,
    ) -> Result<Vec<AirplaneStart>, InputError> {
        self.check_generator_surface()?;
        let mut all = match &self.file.airspace.generator {
            Some(generator) => self.generate_airplanes(generator, streams)?,
            None => Vec::new(),
        };
        let mut named: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (id, airplane) in all.iter().enumerate() {
            if let Some(callsign) = &airplane.callsign {
                named.entry(callsign.clone()).or_default().push(id);
            }
        }
        for section in &self.file.airplanes.0 {
            let own = self.abilities(Some(section));
            let airplane = match section.get_ref().track(self.source)? {
                Some(track) => self.recorded_airplane(section, &own, track, replay)?,
                None => self.planned_airplane(section, &own, replay.dt_s)?,
            };
            self.check_performance(&airplane, Some(section))?;
            if let Some(callsign) = &airplane.callsign {
                let namesakes = named.entry(callsign.clone()).or_default();
                if namesakes.iter().any(|other| are_confusable(&all[*other], &airplane)) {
                    let error = section.get_ref().repeated_callsign_error(self.source);
                    return Err(error.expect("it has a call sign"));
                }
                namesakes.push(all.len());
            }
            all.push(airplane);
        }
        if self.file.airspace.replay_until_s.is_some() && all.iter().all(|a| a.track.is_none()) {
            return Err(self
                .source
                .unused_key("airspace.replay_until_s", "without a recorded track"));
        }
        if all.is_empty() {
            let remedy = "add [airspace.generator] with kind and n, or [[airplanes]]";
            return Err(self.source.error(None, "the scenario has no airplanes", remedy));
        }
        Ok(all)
    }

    /// Returns the surface on which the airplanes have their positions.
    pub(super) fn surface(&self) -> Result<Surface, InputError> {
        let mut surface = None;
        for section in &self.file.airplanes.0 {
            let own = section.get_ref().surface(self.source, section.span())?;
            match (surface, own) {
                (Some(before), Some(own)) if before != own => {
                    return Err(mixed_positions(self.source, section.span()));
                }
                _ => surface = surface.or(own),
            }
        }
        Ok(surface.unwrap_or_default())
    }

    /// Returns an airplane with a flight plan of its own.
    fn planned_airplane(
        &self,
        section: &Spanned<AirplaneSection>,
        abilities: &Abilities,
        dt_s: f64,
    ) -> Result<AirplaneStart, InputError> {
        let s = section.get_ref();
        let error =
            |cause: &str, remedy: &str| Err(self.source.error(section.span(), cause, remedy));
        let (Some(at), Some(heading_deg)) = (s.start_at(self.source)?, s.heading_deg) else {
            let remedy = "add at_m = [x, y] and heading_deg, or a track";
            return error("an airplane that begins nowhere", remedy);
        };
        let mission = s.way_points(self.source)?;
        if mission.is_empty() {
            let remedy = match self.surface()? {
                Surface::Plane => "add way_points_m = [[x, y], ...]",
                Surface::Earth => "add way_points_deg = [[latitude, longitude], ...]",
            };
            return error("an airplane without way-points", remedy);
        }
        let heading_rad = sidestep_kernel::math::wrap_angle(heading_deg.get().to_radians());
        let performance = abilities.performance();
        let model = abilities.model(&performance, abilities.v_m_s());
        let altitude_m = s.altitude_m.map_or(0.0, f64::from);
        let appears_s = s.appears_s.map_or(0.0, f64::from);
        let (mut orders, leaves_s) = s.orders(self.source, &performance, altitude_m)?;
        if performance.accelerates() {
            let changes = SpeedChanges {
                v_m_s: model.v_m_s,
                acceleration_m_s2: performance.acceleration_m_s2,
                first_cycle: (appears_s / dt_s).ceil() as u64,
                dt_s,
            };
            let Some(steps) = changes.steps(&orders) else {
                let cause = "orders to speeds that take more than 60000 cycles to reach";
                return error(cause, "give a larger acceleration_m_s2, or a longer dt_s");
            };
            orders = steps;
        }
        Ok(AirplaneStart {
            callsign: s.callsign(self.source)?,
            model,
            performance,
            start: Pose2 { at, heading_rad },
            mission,
            detours: Vec::new(),
            altitude_m,
            appears_s,
            leaves_s,
            orders,
            track: None,
            is_non_cooperative: s.is_non_cooperative(self.source)?,
            priority: s.priority.map_or(0, |priority| priority.get() as u8),
            changes: abilities.changes.clone(),
            commanded_speeds_m_s: None,
        })
    }

    /// Returns an airplane that follows its track, and then flies along the rest of it, with the recorded speed unless
    /// another one is given.
    fn recorded_airplane(
        &self,
        section: &Spanned<AirplaneSection>,
        abilities: &Abilities,
        track: Track,
        replay: ReplayPeriod,
    ) -> Result<AirplaneStart, InputError> {
        let top_m_s = track.max_speed_m_s();
        if top_m_s >= MAX_SPEED_M_S {
            let cause = format!("a track with {top_m_s:e} m/s between two of its points");
            let remedy = format!(
                "leave out points that nothing reaches: nothing is faster than {MAX_SPEED_M_S:e} m/s"
            );
            return Err(self.source.error(section.span(), cause, remedy));
        }
        let performance = abilities.performance();
        let v_m_s = match section.get_ref().v_m_s {
            Some(v_m_s) => v_m_s.get(),
            // One that hardly moves in its record must be able to fly as well.
            None => track.mean_speed_m_s(replay.until_s).max(1.0),
        };
        let model = abilities.model(&performance, v_m_s);
        let callsign = section.get_ref().callsign(self.source)?;
        let is_non_cooperative = section.get_ref().is_non_cooperative(self.source)?;
        let airplane = replayed_airplane(track, (model, performance), replay, is_non_cooperative);
        let priority = section.get_ref().priority.map_or(0, |priority| priority.get() as u8);
        let changes = abilities.changes.clone();
        Ok(AirplaneStart { callsign, priority, changes, ..airplane })
    }

    /// Returns the time for which recorded airplanes follow their tracks.
    pub(super) fn replay_period(&self, timing: &TimeDiscretization) -> ReplayPeriod {
        let until_s = self.file.airspace.replay_until_s.map_or(f64::INFINITY, f64::from);
        // The conversion saturates at the largest number of cycles.
        let cycles = (until_s / timing.dt_s).ceil() as u64;
        ReplayPeriod { cycles, until_s: cycles as f64 * timing.dt_s, dt_s: timing.dt_s }
    }
}

/// Returns whether two airplanes of one call sign are in the air at the same time. Recordings have such airplanes, and
/// their aircraft are known by their addresses.
fn are_confusable(one: &AirplaneStart, other: &AirplaneStart) -> bool {
    let are_recorded = one.track.is_some() && other.track.is_some();
    let overlap = one.appears_s < other.leaves_s && other.appears_s < one.leaves_s;
    !are_recorded && overlap
}

fn replayed_airplane(
    track: Track,
    (model, performance): (AircraftModel, Performance),
    replay: ReplayPeriod,
    is_non_cooperative: bool,
) -> AirplaneStart {
    let begins_s = track.start_s();
    let is_replayed_at_start = (begins_s / replay.dt_s).floor() < replay.cycles as f64;
    let appears_s = if is_non_cooperative || is_replayed_at_start {
        begins_s
    } else {
        // The method flies whole cycles only, and so the airplane enters at the start of one.
        (begins_s / replay.dt_s).ceil() * replay.dt_s
    };
    let joins_s = replay.until_s.max(appears_s);
    AirplaneStart {
        callsign: None,
        model,
        performance,
        start: track.pose_at(appears_s),
        mission: track.remaining_way_points(joins_s),
        detours: Vec::new(),
        altitude_m: track.altitude_at_m(joins_s),
        appears_s,
        leaves_s: f64::INFINITY,
        orders: Vec::new(),
        track: Some(track),
        is_non_cooperative,
        priority: 0,
        changes: ChangeAlternatives::default(),
        commanded_speeds_m_s: None,
    }
}
