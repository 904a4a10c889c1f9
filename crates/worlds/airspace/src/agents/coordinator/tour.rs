//! The tours of coordinators: the airplane that they visit next, and the reason.

use super::aboard::{Aboard, Answer};
use super::state::{Coordinator, Gathered, Overview, Task, Visited};
use super::{Here, Passenger, Step, check};
use crate::agents::Conclusion;
use crate::agents::link::bytes_of;
use crate::agents::party::Unsound;

impl Coordinator {
    /// Gathers the data of the airplanes of its part, from number `k` on.
    fn gather(&mut self, k: usize, ship: &Aboard) -> Option<Step> {
        let Gathered { round, airplanes, .. } = &mut self.gathered;
        for (k, airplane) in airplanes.iter_mut().enumerate().skip(k) {
            if airplane.place == ship.own.me {
                airplane.see(&ship.own, *round);
            } else if airplane.is_presumed {
                airplane.presume(&ship.own);
            } else {
                self.task = Task::Gather(k);
                return Some(Step::Hop(airplane.place));
            }
        }
        self.task = Task::Return;
        None
    }

    /// Returns to the host that began the epoch, where the step of the algorithm is taken.
    fn go_home(&mut self, ship: &mut Aboard, here: &Here<'_>) -> Option<Step> {
        let home = here.epochs[ship.part].owner.into();
        if ship.own.me != home {
            return Some(Step::Hop(home));
        }
        self.task = match ship.above() {
            Some(_) => Task::Await,
            None => self.settle(ship, here, Task::Gather(0), Task::Deliver(0)),
        };
        None
    }

    /// Takes the step of the algorithm. Returns the task after it, which depends on whether the
    /// decisions are made.
    fn settle(&mut self, ship: &Aboard, here: &Here<'_>, next: Task, last: Task) -> Task {
        self.gathered.settle(&ship.own.briefing, here.tick >= ship.enough_at);
        if self.gathered.is_final { last } else { next }
    }

    /// Waits for the coordinator above, which takes the data and brings the results.
    fn wait(&mut self, ship: &mut Aboard) -> Option<Step> {
        if let Some(Answer { gathered, is_known }) = ship.answer.take() {
            if is_known {
                self.gathered = gathered;
            }
            self.gathered.is_final |= !is_known;
        } else if ship.is_orphan {
            self.gathered.is_final = true;
        } else {
            if ship.report.is_none() {
                ship.tell(self.gathered.clone());
            }
            return Some(Step::Stay);
        }
        ship.report = None;
        self.task = if self.gathered.is_final { Task::Deliver(0) } else { Task::Gather(0) };
        None
    }

    /// Brings the airplanes of its part their controls, from number `k` on.
    fn deliver(&mut self, k: usize, ship: &mut Aboard) -> Option<Step> {
        let me = ship.own.me;
        // This includes an airplane that was passed over because it could not be reached then.
        self.tell(ship);
        let is_due = |airplane: &&Visited| !airplane.is_presumed && airplane.place != me;
        let mut left = self.gathered.airplanes.iter().skip(k).filter(is_due);
        let Some(next) = left.next() else { return Some(Step::Over) };
        let number = |airplane: &Visited| airplane.place == next.place;
        self.task = Task::Deliver(self.gathered.airplanes.iter().position(number).unwrap_or(k));
        Some(Step::Hop(next.place))
    }

    fn tell(&self, ship: &mut Aboard) {
        let airplanes = &self.gathered.airplanes;
        let mut beacons = vec![None; ship.own.briefing.ids.len()];
        for airplane in airplanes {
            beacons[airplane.place].clone_from(&airplane.beacon);
        }
        let own = airplanes.iter().find(|airplane| airplane.place == ship.own.me);
        let decided = own.and_then(|airplane| airplane.decided.clone());
        let presumed = airplanes.iter().filter(|a| a.is_presumed && a.place != ship.own.me);
        let unheard = presumed.map(|a| a.place).collect();
        ship.conclude(Conclusion { decided, beacons }, unheard);
    }
}

/// The tours of the coordinator above others: from home to home, and back.
impl Coordinator {
    /// Returns the overview, with the newest epochs of the parts that a host knows.
    fn overview(&mut self, ship: &Aboard, here: &Here<'_>) -> &mut Overview {
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
    fn collect(&mut self, first: usize, ship: &mut Aboard, here: &Here<'_>) -> Option<Step> {
        let mut is_impatient = here.is_impatient;
        for k in first..ship.parts.len() {
            self.task = Task::Collect(k);
            let overview = self.overview(ship, here);
            let home = usize::from(overview.epochs[k].owner);
            let (is_here, is_lost) = (home == ship.own.me, overview.unreachable.contains(&home));
            let report = ship.report.clone().filter(|_| is_here && here.aboard[k]);
            if let Some(report) = report {
                overview.missing[k] = false;
                self.take(report);
            } else if overview.missing[k] || std::mem::take(&mut is_impatient) {
                overview.missing[k] = true;
                self.presume(k, ship);
            } else if is_here || is_lost {
                // The part's coordinator is not home yet, or it is brought back elsewhere.
                return Some(Step::Stay);
            } else {
                return Some(Step::Hop(home));
            }
        }
        let parts = Task::HandBack(ship.parts.len());
        self.task = self.settle(ship, here, parts, parts);
        None
    }

    fn take(&mut self, report: Gathered) {
        (self.gathered.round, self.gathered.calm) = (report.round, report.calm);
        self.gathered.airplanes.extend(report.airplanes);
    }

    /// Presumes the airplanes of a part whose coordinator cannot be found.
    fn presume(&mut self, part: usize, ship: &Aboard) {
        let presumed = ship.parts[part].iter().map(|&place| {
            let mut airplane = Visited::new(place);
            airplane.presume(&ship.own);
            airplane
        });
        self.gathered.airplanes.extend(presumed);
    }

    /// Brings the results to the parts before number `k`, the last one first.
    fn hand_back(&mut self, k: usize, ship: &mut Aboard, here: &Here<'_>) -> Option<Step> {
        for k in (0..k).rev() {
            self.task = Task::HandBack(k + 1);
            let overview = self.overview(ship, here);
            let home = usize::from(overview.epochs[k].owner);
            if overview.missing[k] || overview.unreachable.contains(&home) {
                continue;
            }
            if home != ship.own.me {
                return Some(Step::Hop(home));
            }
            if here.aboard[k] && ship.report.is_some() {
                ship.answer(self.answer(&ship.parts[k]));
            }
        }
        if self.gathered.is_final {
            self.leave_nobody_waiting(ship, here);
            return Some(Step::Over);
        }
        self.gathered.airplanes.clear();
        self.task = Task::Collect(0);
        None
    }

    /// Returns the results for a part.
    fn answer(&self, part: &[usize]) -> Answer {
        let of_part = self.gathered.airplanes.iter().filter(|a| part.contains(&a.place));
        let airplanes = of_part.cloned().collect();
        Answer { gathered: Gathered { airplanes, ..self.gathered }, is_known: true }
    }

    /// Releases a part that was left out while its coordinator waited here.
    fn leave_nobody_waiting(&self, ship: &mut Aboard, here: &Here<'_>) {
        if here.aboard[ship.part] && ship.report.is_some() {
            ship.answer(Answer { gathered: Gathered::default(), is_known: false });
        }
    }
}

impl Passenger for Coordinator {
    type Ship = Aboard;

    fn new(ship: &Aboard, seat: usize) -> Self {
        let is_above = ship.above() == Some(seat);
        let part = ship.parts.get(seat).filter(|_| !is_above);
        let airplanes = part.into_iter().flatten().map(|&place| Visited::new(place)).collect();
        Self {
            task: if is_above { Task::Collect(0) } else { Task::Gather(0) },
            gathered: Gathered { airplanes, ..Gathered::default() },
            overview: is_above.then(Overview::default),
        }
    }

    fn written(&self) -> Vec<u8> {
        bytes_of(self)
    }

    fn read(bytes: &[u8], ship: &Aboard, seat: usize) -> Result<Self, Unsound> {
        let read = postcard::take_from_bytes::<Self>(bytes);
        let (state, rest) = read.map_err(|_| Unsound::Form)?;
        Unsound::Form.unless(rest.is_empty())?;
        check::state(&state, ship, seat)?;
        Ok(state)
    }

    fn go_on(&mut self, ship: &mut Aboard, here: &Here<'_>) -> Step {
        loop {
            let step = match self.task {
                Task::Gather(k) => self.gather(k, ship),
                Task::Return => self.go_home(ship, here),
                Task::Await => self.wait(ship),
                Task::Deliver(k) => self.deliver(k, ship),
                Task::Collect(k) => self.collect(k, ship, here),
                Task::HandBack(k) => self.hand_back(k, ship, here),
            };
            if let Some(step) = step {
                return step;
            }
        }
    }

    fn cannot_reach(&mut self, place: usize) {
        match &mut self.overview {
            Some(overview) if overview.unreachable.contains(&place) => {}
            Some(overview) => overview.unreachable.push(place),
            None => {
                let airplane = self.gathered.airplanes.iter_mut().find(|a| a.place == place);
                airplane.into_iter().for_each(|airplane| airplane.is_presumed = true);
            }
        }
    }

    fn is_over_without(&self, place: usize) -> bool {
        let Task::Deliver(k) = self.task else { return false };
        let mut left = self.gathered.airplanes.iter().skip(k);
        left.all(|airplane| airplane.is_presumed || airplane.place == place)
    }
}
