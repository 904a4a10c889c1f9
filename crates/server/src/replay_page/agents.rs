//! Which agents are inspected for a replay, and in which cycles.

use sidestep_kernel::view::{AgentNumber, Body, Frame, Scenery};
use sidestep_kernel::{Cycle, InputError};
use sidestep_session::export::CycleWindow;

/// The inspections that a replay holds: of some agents or of all, in all cycles or in some; of none without either.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InspectionRequest {
    /// The agents; none given means all where there is a window.
    pub agents: Vec<AgentNumber>,
    /// The cycles; none given means all where there are agents.
    pub cycles: Option<CycleWindow>,
}

impl InspectionRequest {
    /// Returns the agents of a frame that are inspected in its cycle.
    pub(super) fn agents_of<'a>(&self, frame: &'a Frame) -> Vec<&'a Body> {
        let is_in_window = |window: CycleWindow| window.contains(frame.cycle);
        let is_due = self.cycles.map_or(!self.agents.is_empty(), is_in_window);
        if !is_due {
            return Vec::new();
        }
        let agents = frame.bodies.iter().filter(|body| body.kind.is_agent());
        agents.filter(|body| self.includes(body)).collect()
    }

    fn includes(&self, body: &Body) -> bool {
        self.agents.is_empty() || self.agents.iter().any(|agent| agent.matches(body.id()))
    }

    /// Refuses agents and cycles that the part of the run does not have; `first` is its first frame.
    ///
    /// # Errors
    /// When an agent is not there, or the window has none of the cycles.
    pub(super) fn check(
        &self,
        scenery: &Scenery,
        first: &Frame,
        (from, until): (Cycle, Cycle),
    ) -> Result<(), InputError> {
        if let Some(window) = self.cycles
            && (window.from > until || window.until < from)
        {
            let place = format!("--cycles {window}");
            let cause = format!("the file has cycles {from} to {until}");
            return Err(InputError::new(place, cause, format!("give {from}:{until} or less")));
        }
        AgentNumber::check_all(&self.agents, scenery, &first.bodies)
    }

    /// Refuses a request of which no run of a sweep has anything.
    ///
    /// # Errors
    /// When something was requested.
    pub(crate) fn refuse_without_any(&self) -> Result<(), InputError> {
        let numbers: Vec<String> = self.agents.iter().map(ToString::to_string).collect();
        let place = match (self.cycles, numbers.is_empty()) {
            (None, true) => return Ok(()),
            (None, false) => format!("--agents {}", numbers.join(",")),
            (Some(window), _) => format!("--cycles {}:{}", window.from, window.until),
        };
        let cause = "no run with a replay has such agents in such cycles";
        Err(InputError::new(place, cause, "give others, or leave it out"))
    }

    /// Returns what can be inspected, in words; `noun` is that for an agent.
    pub(super) fn describe(&self, noun: &str) -> String {
        let numbers: Vec<String> = self.agents.iter().map(ToString::to_string).collect();
        let who = match numbers.as_slice() {
            [] => format!("every {noun}"),
            [one] => format!("{noun} {one}"),
            _ => format!("{noun}s {}", numbers.join(", ")),
        };
        match self.cycles {
            None if numbers.is_empty() => String::new(),
            None => format!("{who} in all cycles"),
            Some(CycleWindow { from, until }) => format!("{who} in cycles {from} to {until}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::robots::kinds::ROBOT;
    use sidestep_kernel::view::{Pose, Shape};

    fn frame(cycle: Cycle) -> Frame {
        let robot = |number| {
            let shape = Shape::Sphere { radius_m: 0.1 };
            Body::new(ROBOT, number, Pose::from_position([0.0; 3]), shape)
        };
        Frame { cycle, bodies: (0..4).map(robot).collect(), ..Frame::default() }
    }

    fn scenery() -> Scenery {
        let bodies = Vec::new();
        Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies,
            names: Vec::new(),
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        }
    }

    fn request(agents: &[&str], cycles: Option<&str>) -> InspectionRequest {
        InspectionRequest {
            agents: agents.iter().map(|text| text.parse().expect("a number")).collect(),
            cycles: cycles.map(|text| text.parse().expect("a window")),
        }
    }

    #[test]
    fn agents_and_cycles_are_those_that_were_named() {
        let numbers = |request: &InspectionRequest, cycle| -> Vec<u32> {
            request.agents_of(&frame(cycle)).iter().map(|body| body.number).collect()
        };
        assert_eq!(numbers(&request(&[], None), 5), [0; 0]);
        assert_eq!(numbers(&request(&["3", "1"], None), 5), [1, 3]);
        assert_eq!(numbers(&request(&[], Some("4:6")), 6), [0, 1, 2, 3]);
        assert_eq!(numbers(&request(&["2", "0/7"], Some("4:6")), 4), [2]);
        assert_eq!(numbers(&request(&["2"], Some("4:6")), 7), [0; 0]);
        assert_eq!(
            request(&["2", "0/7"], Some("4:6")).describe("robot"),
            "robots 2, 0/7 in cycles 4 to 6"
        );
        assert_eq!(request(&[], None).describe("robot"), "");
    }

    #[test]
    fn what_is_not_there_is_refused_in_words() {
        let check = |request: InspectionRequest| request.check(&scenery(), &frame(0), (0, 100));
        let told = |request| check(request).expect_err("refused").to_string();
        assert!(told(request(&["4"], None)).contains("their numbers are 0 to 3"));
        assert!(told(request(&["3/5"], None)).contains("has no such part"));
        assert!(told(request(&[], Some("101:200"))).contains("cycles 0 to 100"));
        assert!(check(request(&["3"], Some("100:200"))).is_ok());
    }
}
