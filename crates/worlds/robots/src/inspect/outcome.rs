//! The outcome of a body's action: the transition that is drawn, and where it is cut.

use super::Looking;
use crate::Scratch;
use crate::act::Verdict;
use crate::effector::{Action, ObstacleRule, Walk};
use crate::world::Role;
use sidestep_kernel::Slot;
use sidestep_kernel::space::BoxWord;
use sidestep_kernel::view::{self, MarkShape, Section, Table, Value};

/// A transition as it would be where the body is.
struct Tried {
    verdict: Verdict,
    /// Its probability here, after the obstacle rule.
    p: f64,
}

impl<T: BoxWord> Looking<'_, T> {
    /// Lets the body act with its draw, and reports the outcome.
    pub(super) fn acts(&mut self, word: u32, scratch: &mut Scratch) {
        let mut section = Section::new("Outcome");
        let start_m = self.place();
        if let Some(action) = self.action() {
            let drawn = self.scene.drawn(action, self.slot, word);
            let all = self.tried(action);
            section = self.drawn(section, &action.walks[drawn], &all[drawn]);
            section = section.table(transitions(action, &all, drawn));
            self.draw_ways(start_m, action, drawn, &all[drawn]);
        }
        self.scene.act(self.slot, word, scratch);
        let section = section.fact("next place", self.place()).fact("next heading", self.facing());
        self.told.tell(section);
    }

    /// Tries all transitions of an action where the body is.
    fn tried(&self, action: &Action) -> Vec<Tried> {
        let verdicts = action.walks.iter().map(|walk| self.scene.judge(walk, self.slot));
        let mut all: Vec<Tried> =
            verdicts.zip(&action.probabilities).map(|(verdict, &p)| Tried { verdict, p }).collect();
        let free = |one: &Tried| one.verdict.contact.is_none();
        let sum: f64 = all.iter().filter(|one| free(one)).map(|one| one.p).sum();
        if self.scene.world.obstacle_rule == ObstacleRule::Renormalise && sum > 0.0 {
            all.iter_mut().for_each(|one| one.p = if free(one) { one.p / sum } else { 0.0 });
        }
        all
    }

    /// Tells the transition that is drawn.
    fn drawn(&self, section: Section, walk: &Walk, tried: &Tried) -> Section {
        let (path, turn) = said(walk);
        let section = section
            .fact("transition", path)
            .fact("turn", turn)
            .fact("probability", Value::Share(tried.p))
            .fact("steps wanted", Value::count(walk.steps.len()))
            .fact("steps made", Value::count(self.made(tried)));
        let Some(touch) = tried.verdict.contact else { return section };
        let kind = &self.scene.world.kinds[usize::from(touch.kind)];
        let side = touch.side.name();
        section
            .fact("cut by", touch.by.map(|slot: Slot| self.who_in(slot)))
            .fact("what is there", kind.as_str())
            .fact("touches it with its", side)
    }

    fn who_in(&self, slot: Slot) -> view::Who {
        self.scene.world.who(self.scene.cell(slot).id)
    }

    /// Returns the number of steps that are made of a transition.
    fn made(&self, tried: &Tried) -> usize {
        let cell = self.scene.cell(self.slot);
        let is_mover = matches!(self.scene.type_of(cell).role, Role::Mover(_));
        let is_cut = self.scene.world.obstacle_rule == ObstacleRule::Cut && !is_mover;
        let is_free = tried.verdict.contact.is_none();
        if is_free || is_cut { tried.verdict.steps } else { 0 }
    }

    /// Draws the way that is intended, and those that are made and refused.
    fn draw_ways(&mut self, from_m: view::Place, action: &Action, drawn: usize, tried: &Tried) {
        let way = |walk: &Walk, steps: std::ops::Range<usize>| {
            let mut at = [0, 0];
            let mut points_m = vec![self.moved(from_m, at)];
            for step in &walk.steps[..steps.end] {
                at = [at[0] + step.delta.0, at[1] + step.delta.1];
                points_m.push(self.moved(from_m, at));
            }
            points_m.drain(..steps.start);
            MarkShape::Line { points_m }
        };
        let (meant, walk, made) = (&action.walks[0], &action.walks[drawn], self.made(tried));
        let all = walk.steps.len();
        let [wish, done, refused] =
            [way(meant, 0..meant.steps.len()), way(walk, 0..made), way(walk, made..all)];
        self.told.mark(view::Role::Wish, "what it wants", wish);
        self.told.mark(view::Role::Done, "what it does", done);
        if made < all {
            self.told.mark(view::Role::Refused, "what is in its way", refused);
        }
    }

    /// Returns the place some boxes away from another one.
    fn moved(&self, from_m: view::Place, boxes: [i32; 2]) -> view::Place {
        let (plane, box_m) = (self.scene.world.map.plane, self.scene.world.map.box_size_m);
        let [x, y] = plane.point([from_m[0], from_m[1]]);
        let [x_m, y_m] =
            plane.place([x + f64::from(boxes[0]) * box_m, y + f64::from(boxes[1]) * box_m]);
        [x_m, y_m, from_m[2]]
    }
}

/// Returns all transitions of an action, the drawn one marked.
fn transitions(action: &Action, all: &[Tried], drawn: usize) -> Table {
    let mut table =
        Table::new(["transition", "turn", "in free space", "here", "steps free", "drawn"]);
    for (k, (walk, tried)) in action.walks.iter().zip(all).enumerate() {
        let (path, turn) = said(walk);
        let (free, here) = (Value::Share(action.probabilities[k]), Value::Share(tried.p));
        let steps = Value::count(tried.verdict.steps);
        table.row([path.into(), turn, free, here, steps, (k == drawn).into()]);
    }
    table
}

/// Returns the path of a transition by its letters, and its turn.
fn said(walk: &Walk) -> (String, Value) {
    let path: String = walk.steps.iter().map(|step| step.side.letter()).collect();
    let path = if path.is_empty() { "none".into() } else { path };
    let quarters = f64::from(walk.turn) - if walk.turn == 3 { 4.0 } else { 0.0 };
    (path, Value::number(90.0 * quarters, "°"))
}
