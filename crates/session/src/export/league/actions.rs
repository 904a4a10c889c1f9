//! What a robot did in each tick, as the League writes it: actions with their numbers of ticks, in segments of equal
//! length.

use sidestep_kernel::Cycle;
use sidestep_kernel::view::{GridAgent, GridPlace};
use std::fmt::Write;

/// Ticks of a segment, as the League has it by default.
pub(super) const SEGMENT_TICKS: Cycle = 1000;

const FORWARD: char = 'F';
const CLOCKWISE: char = 'R';
const COUNTERCLOCKWISE: char = 'C';
const WAIT: char = 'W';

/// The moment at which a tick begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct TickState {
    pub(super) tick: Cycle,
    /// Rows of the map.
    pub(super) rows: u32,
    /// Ticks that an action takes.
    pub(super) cycles: u32,
}

/// The ticks of a robot so far.
#[derive(Debug)]
pub(super) struct RobotActions {
    pub(super) start: GridPlace,
    /// Where its present action began: for the League it is there until the action has ended.
    origin: GridPlace,
    /// The present action.
    action: char,
    actual: PathText,
    planned: PathText,
    delays: Vec<[Cycle; 2]>,
}

impl RobotActions {
    pub(super) fn new(start: GridPlace) -> Self {
        Self {
            start,
            origin: start,
            action: WAIT,
            actual: PathText::default(),
            planned: PathText::default(),
            delays: Vec::new(),
        }
    }

    /// Adds a tick.
    ///
    /// # Errors
    /// When the robot did what is no action of the League: the cause.
    pub(super) fn push(
        &mut self,
        now: TickState,
        before: &GridAgent,
        after: &GridAgent,
    ) -> Result<(), String> {
        let is_in_action = before.cycles_left > 0;
        if !is_in_action {
            self.origin = before.place;
            self.action = action_between(before.place, after.place)?;
        }
        let segment = self.segment_start(now, before);
        let is_delayed = after.delayed_cycles > before.delayed_cycles;
        let stands = is_in_action && after.cycles_left == before.cycles_left;
        let actual = if stands { WAIT } else { self.action };
        let planned = after.planned.filter(|_| !is_in_action);
        // A robot that slipped cannot do what was planned from elsewhere.
        let planned = planned
            .map_or(self.action, |place| action_between(before.place, place).unwrap_or(WAIT));
        self.actual.push(now.tick, actual, &segment);
        self.planned.push(now.tick, planned, &segment);
        if is_delayed {
            self.push_delay(now.tick);
        }
        Ok(())
    }

    /// Returns the head of the segment that begins with a tick; nothing within a segment.
    fn segment_start(&self, now: TickState, before: &GridAgent) -> String {
        if !now.tick.is_multiple_of(SEGMENT_TICKS) {
            return String::new();
        }
        let GridPlace { col, row, heading } = self.origin;
        let is_moving = before.cycles_left > 0 && self.action != WAIT;
        let counter = if is_moving { now.cycles - before.cycles_left } else { 0 };
        // The League counts rows from the north and headings clockwise.
        let row = now.rows - 1 - row;
        format!("[({},{row},{col},{},{counter}):(", now.tick, (4 - heading) % 4)
    }

    /// Adds a tick of delay. An interval ends with the tick after its last.
    fn push_delay(&mut self, tick: Cycle) {
        match self.delays.last_mut() {
            Some([_, end]) if *end == tick => *end += 1,
            _ => self.delays.push([tick, tick + 1]),
        }
    }

    /// Ends the texts after so many ticks.
    pub(super) fn finish(&mut self, ticks: Cycle) {
        self.actual.finish(ticks);
        self.planned.finish(ticks);
    }

    pub(super) fn actual(&self) -> &str {
        &self.actual.text
    }

    pub(super) fn planned(&self) -> &str {
        &self.planned.text
    }

    pub(super) fn delays(&self) -> &[[Cycle; 2]] {
        &self.delays
    }
}

/// Returns the action that leads from one place to another.
fn action_between(from: GridPlace, to: GridPlace) -> Result<char, String> {
    let east = i64::from(to.col) - i64::from(from.col);
    let north = i64::from(to.row) - i64::from(from.row);
    let turn = (to.heading + 4 - from.heading) % 4;
    let ahead = [(1, 0), (0, 1), (-1, 0), (0, -1)][usize::from(from.heading)];
    match (turn, (east, north)) {
        (0, (0, 0)) => Ok(WAIT),
        (0, step) if step == ahead => Ok(FORWARD),
        (1, (0, 0)) => Ok(COUNTERCLOCKWISE),
        (3, (0, 0)) => Ok(CLOCKWISE),
        _ => Err(format!(
            "moves {east} boxes east and {north} north and turns by {} degrees",
            90 * u32::from(turn)
        )),
    }
}

/// A path in the words of the League.
#[derive(Debug, Default)]
struct PathText {
    text: String,
    /// The last action, and the tick at which it began.
    last: Option<(char, Cycle)>,
}

impl PathText {
    /// Adds a tick, after the head of its segment where one begins.
    fn push(&mut self, tick: Cycle, action: char, segment: &str) {
        if !segment.is_empty() {
            self.finish(tick);
            self.text.push_str(segment);
        } else if let Some((last, since)) = self.last.filter(|&(last, _)| last != action) {
            self.write_ticks(last, tick - since);
            self.text.push(',');
            self.last = None;
        }
        self.last.get_or_insert((action, tick));
    }

    /// Ends the present segment after so many ticks.
    fn finish(&mut self, ticks: Cycle) {
        if let Some((last, since)) = self.last.take() {
            self.write_ticks(last, ticks - since);
            self.text.push_str(")]");
        }
    }

    fn write_ticks(&mut self, action: char, ticks: Cycle) {
        // Text takes any number of characters.
        let _ = write!(self.text, "{action} {ticks}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agent(col: u32, heading: u8, cycles_left: u32, delayed_cycles: u64) -> GridAgent {
        let place = GridPlace { col, row: 1, heading };
        GridAgent { place, cycles_left, delayed_cycles, planned: None, task: None }
    }

    #[test]
    fn an_action_goes_on_after_a_delay_and_its_interval_ends_behind_the_last_tick() {
        let states = [
            agent(0, 0, 0, 0),
            agent(1, 0, 2, 0),
            agent(1, 0, 2, 1),
            agent(1, 0, 2, 2),
            agent(1, 0, 1, 2),
            agent(1, 0, 0, 2),
            agent(1, 0, 0, 2),
            agent(1, 3, 2, 2),
        ];
        let mut robot = RobotActions::new(states[0].place);
        for (tick, pair) in (0..).zip(states.windows(2)) {
            let now = TickState { tick, rows: 4, cycles: 3 };
            robot.push(now, &pair[0], &pair[1]).expect("actions of the League");
        }
        robot.finish(7);
        assert_eq!(robot.actual(), "[(0,2,0,0,0):(F 1,W 2,F 2,W 1,R 1)]");
        assert_eq!(robot.planned(), "[(0,2,0,0,0):(F 5,W 1,R 1)]");
        assert_eq!(robot.delays(), [[1, 3]]);
    }

    #[test]
    fn a_segment_tells_how_far_its_first_action_is() {
        let mut robot = RobotActions::new(agent(0, 1, 0, 0).place);
        let mut last = agent(0, 1, 0, 0);
        for tick in 0..SEGMENT_TICKS + 2 {
            let turned = GridPlace { heading: (last.place.heading + 1) % 4, ..last.place };
            let place = if last.cycles_left > 0 { last.place } else { turned };
            let cycles_left = [2, 1, 0][(tick % 3) as usize];
            let after = GridAgent { place, cycles_left, ..last };
            let now = TickState { tick, rows: 2, cycles: 3 };
            robot.push(now, &last, &after).expect("turns");
            last = after;
        }
        robot.finish(SEGMENT_TICKS + 2);
        let heading = (1 + SEGMENT_TICKS / 3) % 4;
        let heading = (4 - heading) % 4;
        let text = format!("[(0,0,0,3,0):(C 1000)][(1000,0,0,{heading},1):(C 2)]");
        assert_eq!(robot.actual(), text);
    }

    #[test]
    fn a_move_sideways_is_no_action_of_the_league() {
        let mut robot = RobotActions::new(agent(0, 1, 0, 0).place);
        let now = TickState { tick: 0, rows: 2, cycles: 1 };
        let error = robot.push(now, &agent(0, 1, 0, 0), &agent(1, 1, 0, 0)).expect_err("sideways");
        assert!(error.contains("1 boxes east and 0 north"), "{error}");
    }
}
