//! The outcome of a body's action: the transition that is drawn, and where it is cut.

use super::Inspector;
use crate::Scratch;
use crate::act::WalkResult;
use crate::action::{Action, StepPath};
use crate::effector::ObstacleRule;
use crate::world::Role;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::view::{self, FactSection, FactTable, FactValue, MarkShape};
use std::ops::Range;

/// A transition as it would be where the body is.
struct TransitionResult {
    walk: WalkResult,
    /// Its probability here, after the obstacle rule.
    p: f64,
}

impl TransitionResult {
    fn is_free(&self) -> bool {
        self.walk.contact.is_none()
    }
}

impl<T: OccupantWord> Inspector<'_, T> {
    /// Lets the body act with its draw, and reports the outcome.
    pub(super) fn add_outcome(&mut self, word: u32, scratch: &mut Scratch) {
        let mut section = FactSection::new("Outcome");
        let start_m = self.position_m();
        if let Some(action) = self.action() {
            let drawn = self.cycle.draw_transition(action, self.slot, word);
            let all =
                self.transition_results(action, |walk| self.cycle.walk_result(walk, self.slot));
            section = self.with_drawn_transition(section, &action.walks[drawn], &all[drawn]);
            section = section.table(transition_table(action, &all, drawn));
            self.draw_paths(start_m, action, drawn, &all[drawn]);
        }
        self.cycle.act(self.slot, word, scratch);
        let section =
            section.fact("next place", self.position_m()).fact("next heading", self.facing());
        self.inspection.add_section(section);
    }

    /// Lets the body's group act at once, and reports the body's outcome. The transitions that were not drawn are
    /// those before anybody has moved.
    pub(super) fn add_outcome_at_once(&mut self, scratch: &mut Scratch) {
        let mut section = FactSection::new("Outcome");
        let start_m = self.position_m();
        let slot = self.slot;
        let tried = self.action().map(|action| {
            (action, self.transition_results(action, |walk| self.cycle.lasting_result(walk, slot)))
        });
        self.cycle.act_at_once(scratch);
        let made = scratch.group_moves.move_of(slot);
        if let (Some((action, mut all)), Some(made)) = (tried, made)
            && let Some(drawn) = made.transition
        {
            all[drawn].walk = made.result;
            section = self.with_drawn_transition(section, &action.walks[drawn], &all[drawn]);
            section = section.table(transition_table(action, &all, drawn));
            self.draw_paths(start_m, action, drawn, &all[drawn]);
        }
        let section =
            section.fact("next place", self.position_m()).fact("next heading", self.facing());
        self.inspection.add_section(section);
    }

    /// Tries all transitions of an action; `result` says how far a walk gets.
    fn transition_results(
        &self,
        action: &Action,
        result: impl Fn(&StepPath) -> WalkResult,
    ) -> Vec<TransitionResult> {
        let walks = action.walks.iter().zip(&action.probabilities);
        let mut all: Vec<TransitionResult> =
            walks.map(|(walk, &p)| TransitionResult { walk: result(walk), p }).collect();
        let sum: f64 = all.iter().filter(|one| one.is_free()).map(|one| one.p).sum();
        if self.cycle.world.obstacle_rule == ObstacleRule::Renormalise && sum > 0.0 {
            for one in &mut all {
                one.p = if one.is_free() { one.p / sum } else { 0.0 };
            }
        }
        all
    }

    /// What blocks the transition is added where something does.
    fn with_drawn_transition(
        &self,
        section: FactSection,
        walk: &StepPath,
        tried: &TransitionResult,
    ) -> FactSection {
        let (path, turn) = path_and_turn(walk);
        let section = section
            .fact("transition", path)
            .fact("turn", turn)
            .fact("probability", FactValue::Share(tried.p))
            .fact("steps wanted", FactValue::count(walk.steps.len()))
            .fact("steps made", FactValue::count(self.steps_made(tried)));
        let Some(blocker) = tried.walk.contact else { return section };
        let kind = &self.cycle.world.kinds[usize::from(blocker.kind)];
        let side = blocker.side.name();
        section
            .fact("cut by", blocker.by.map(|slot: EntitySlot| self.body_in(slot)))
            .fact("what is there", kind.as_str())
            .fact("touches it with its", side)
    }

    fn body_in(&self, slot: EntitySlot) -> view::BodyId {
        self.cycle.world.body_id(self.cycle.body(slot).id)
    }

    /// A cut keeps the steps before the obstacle; other rules, and people, make none then.
    fn steps_made(&self, tried: &TransitionResult) -> usize {
        let body = self.cycle.body(self.slot);
        let is_mover = matches!(self.cycle.type_of(body).role, Role::Mover(_));
        let is_cut = self.cycle.world.obstacle_rule == ObstacleRule::Cut && !is_mover;
        if tried.is_free() || is_cut { tried.walk.steps } else { 0 }
    }

    /// Draws the path that is intended, and those that are made and refused.
    fn draw_paths(
        &mut self,
        from_m: view::Vec3,
        action: &Action,
        drawn: usize,
        tried: &TransitionResult,
    ) {
        // The first transition of an action is the intended one.
        let intended = &action.walks[0];
        let walk = &action.walks[drawn];
        let made = self.steps_made(tried);
        let all = walk.steps.len();
        let wish = self.path_line(from_m, intended, 0..intended.steps.len());
        let done = self.path_line(from_m, walk, 0..made);
        let refused = self.path_line(from_m, walk, made..all);
        self.inspection.add_mark(view::MarkRole::Wish, "what it wants", wish);
        self.inspection.add_mark(view::MarkRole::Done, "what it does", done);
        if made < all {
            self.inspection.add_mark(view::MarkRole::Refused, "what is in its way", refused);
        }
    }

    /// The line begins where the first of these steps does, and has one point more than there are
    /// steps.
    fn path_line(&self, from_m: view::Vec3, walk: &StepPath, steps: Range<usize>) -> MarkShape {
        let mut at = [0, 0];
        let mut points_m = vec![self.offset_point(from_m, at)];
        for step in &walk.steps[..steps.end] {
            at = [at[0] + step.delta.0, at[1] + step.delta.1];
            points_m.push(self.offset_point(from_m, at));
        }
        points_m.drain(..steps.start);
        MarkShape::Line { points_m }
    }

    /// Returns the place some boxes away from another one, along the axes of the map.
    fn offset_point(&self, from_m: view::Vec3, boxes: [i32; 2]) -> view::Vec3 {
        let plane = self.cycle.world.map.plane;
        let box_m = self.cycle.world.map.box_size_m;
        let [x, y] = plane.inverse_transform_point([from_m[0], from_m[1]]);
        let [x_m, y_m] = plane
            .transform_point([x + f64::from(boxes[0]) * box_m, y + f64::from(boxes[1]) * box_m]);
        [x_m, y_m, from_m[2]]
    }
}

/// Rows are in the effector's order, in which the intended transition comes first.
fn transition_table(action: &Action, all: &[TransitionResult], drawn: usize) -> FactTable {
    let mut table =
        FactTable::new(["transition", "turn", "in free space", "here", "steps free", "drawn"]);
    for (k, (walk, tried)) in action.walks.iter().zip(all).enumerate() {
        let (path, turn) = path_and_turn(walk);
        table.push_row([
            path.into(),
            turn,
            FactValue::Share(action.probabilities[k]),
            FactValue::Share(tried.p),
            FactValue::count(tried.walk.steps),
            (k == drawn).into(),
        ]);
    }
    table
}

/// Returns the path of a transition by its letters, and its turn.
fn path_and_turn(walk: &StepPath) -> (String, FactValue) {
    let path: String = walk.steps.iter().map(|step| step.side.letter()).collect();
    let path = if path.is_empty() { "none".into() } else { path };
    // Three quarters to the left are one to the right.
    let quarters = f64::from(walk.turn) - if walk.turn == 3 { 4.0 } else { 0.0 };
    (path, FactValue::number(90.0 * quarters, "°"))
}
