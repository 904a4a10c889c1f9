//! What flies otherwise than in BlueSky although no line of the file says so.

use super::Interpreter;
use crate::bluesky::traffic::ScnAircraft;
use crate::report::Treatment;

/// Smallest true airspeed in m/s at which an aircraft flies here.
pub(super) const MIN_SPEED_MPS: f64 = 1.0;

/// The rule for speeds below it.
pub(super) const STANDING_RULE: &str =
    "speeds below 1 m/s of aircraft that fly: flown with 1 m/s, for none stands in the air";

/// The rule for levels on which the calibrated airspeed would be above the speed of sound.
pub(super) const SUPERSONIC_CLIMB_RULE: &str =
    "speeds above that of sound on the level that is given: the climb ends at Mach 1";

/// The rule for headings that a runway gives.
pub(super) const RUNWAY_HEADING_RULE: &str =
    "headings of aircraft that are created on a runway: ten times its number";

const MVP_RULE: &str =
    "RESO MVP: resolutions by heading only, as with RMETHH HDG; BlueSky changes speeds as well";
const TURN_RULE: &str =
    "turns at way-points: they begin there, as with ADDWPT FLYOVER; BlueSky begins them before it";
const VERTICAL_SPEED_RULE: &str =
    "VS without ALT: an aircraft keeps its level until it is given another one, as in BlueSky";

impl Interpreter {
    /// Names the differences that are known once the whole file is read.
    pub(super) fn note_differences(&mut self) {
        if let Some(place) = self.mvp_place.take().filter(|_| !self.has_resolution_limits) {
            let remedy = "write RMETHH BOTH for that, or RMETHH HDG";
            self.note_at(place, Treatment::Guessed, MVP_RULE, remedy);
        }
        let mut turns = Vec::new();
        let mut idle = Vec::new();
        for builder in &mut self.builders {
            let has_turn = number_of_goals(&builder.aircraft) > 1;
            turns.extend(builder.fly_by_place.take().filter(|_| has_turn));
            idle.append(&mut builder.vertical_speed_places);
        }
        for place in turns {
            self.note_at(place, Treatment::Guessed, TURN_RULE, "");
        }
        for place in idle {
            self.note_at(place, Treatment::NotUsed, VERTICAL_SPEED_RULE, "give ALT");
        }
    }

    fn note_at(&mut self, place: String, treatment: Treatment, rule: &str, remedy: &str) {
        self.place = place;
        self.note(treatment, rule, remedy);
    }
}

fn number_of_goals(aircraft: &ScnAircraft) -> usize {
    aircraft.way_points.len() + usize::from(aircraft.destination.is_some())
}
