//! Pool two: the bodies of a group act one after the other; the environment decides.

use super::effector::{Action, ObstacleRule, Side, Walk};
use super::state::{BodyCell, CLEAR, FREE, IDLE, KIND_BITS, RobotsState, VISITED, contact_word};
use super::world::{BodyType, RobotsWorld, Role};
use super::{Event, EventKind, MotionSample, Scratch};
use sidestep_kernel::distr::Categorical;
use sidestep_kernel::space::{Position, Tags};
use sidestep_kernel::{Cycle, Slot};

/// What a walk comes to in the present state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Verdict {
    /// Steps that are made.
    pub(super) steps: usize,
    /// Kind and side of what stopped it.
    pub(super) contact: Option<(u8, Side)>,
}

impl RobotsWorld {
    /// One body acts with the draw of its own stream.
    #[inline]
    pub(super) fn act_drawn(
        &self,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let [word, _] = self.act_words(state.bodies[slot as usize].id, now);
        self.act(state, now, slot, word, scratch);
    }

    /// One body acts on the state as left by those before it; `word` is its draw.
    #[inline]
    pub(super) fn act(
        &self,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        word: u32,
        scratch: &mut Scratch,
    ) {
        let cell = &state.bodies[slot as usize];
        if cell.intent.get() == IDLE {
            return;
        }
        let body = &self.types[usize::from(cell.ty)];
        let Some(action) = body.actions.get(usize::from(cell.action.get())) else {
            return self.toggle(state, now, slot, scratch);
        };
        let drawn = match self.obstacle_rule {
            ObstacleRule::Cut | ObstacleRule::Stay => action.distribution.sample(word),
            ObstacleRule::Renormalise => match self.rescaled(action, state, slot) {
                Ok(distribution) => distribution.sample(word),
                Err(blocked) => blocked,
            },
        };
        let walk = &action.walks[drawn];
        let base = cell.at().index(self.stride);
        if self.is_clear(walk, state, base) {
            self.make_whole(walk, state, cell, body, base);
            if scratch.keep_samples {
                let steps = walk.steps.len();
                self.sample_motion(
                    walk,
                    Verdict { steps, contact: None },
                    now,
                    slot,
                    state,
                    scratch,
                );
            }
        } else {
            self.blocked(walk, state, now, slot, scratch);
        }
    }

    /// Whether a walk meets nothing.
    #[inline]
    fn is_clear(&self, walk: &Walk, state: &RobotsState, base: u32) -> bool {
        let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
        let met = walk.whole.enter.iter().fold(0, |met, &o| met | state.grid.get(at(o)));
        met & KIND_BITS == FREE
    }

    /// Makes all of a walk that meets nothing.
    #[inline]
    fn make_whole(
        &self,
        walk: &Walk,
        state: &RobotsState,
        cell: &BodyCell,
        body: &BodyType,
        base: u32,
    ) {
        cell.contact.set(0);
        if walk.turn != 0 {
            cell.facing.set((cell.facing.get() + walk.turn) % 4);
        }
        let whole = &walk.whole;
        if walk.steps.is_empty() {
            return;
        }
        let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
        for &offset in &whole.leave {
            state.grid.set(at(offset), state.grid.get(at(offset)) & !KIND_BITS);
        }
        let mut first_visits = 0;
        let mut enter = |offset: i32, kind: u8| {
            let before = state.grid.get(at(offset));
            first_visits += u32::from(!before & body.marks != 0);
            state.grid.set(at(offset), before & VISITED | kind);
        };
        whole.pass.iter().for_each(|&offset| enter(offset, body.marks));
        whole.fill.iter().for_each(|&offset| enter(offset, body.kind | body.marks));
        let moved = cell.at().offset(whole.delta.0, whole.delta.1);
        self.settle(state, cell, body, moved);
        cell.moves.set(cell.moves.get() + walk.steps.len() as u32);
        if first_visits > 0 {
            cell.first_visits.set(cell.first_visits.get() + first_visits);
        }
    }

    /// Sets a body's anchor and writes its new tag into the boxes it covers.
    #[inline]
    fn settle(&self, state: &RobotsState, cell: &BodyCell, body: &BodyType, moved: Position) {
        let (tag, index) = (state.claims.tag(moved), moved.index(self.stride));
        cell.anchor.set(moved.word());
        let at = |offset: i32| index.wrapping_add_signed(offset) as usize;
        match state.claims.tags() {
            Tags::Narrow(tags) => body.own.iter().for_each(|&o| tags.set(at(o), tag as u8)),
            Tags::Wide(tags) => body.own.iter().for_each(|&o| tags.set(at(o), tag)),
        }
    }

    /// A walk that may be cut short by something in the way.
    fn blocked(
        &self,
        walk: &Walk,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let verdict = self.judge(walk, state, slot);
        let is_mover = matches!(self.body_type(slot).role, Role::Mover(_));
        let made = match self.obstacle_rule {
            _ if verdict.contact.is_none() => verdict.steps,
            ObstacleRule::Cut if !is_mover => verdict.steps,
            _ => 0,
        };
        self.make(walk, made, state, slot);
        if is_mover {
            return;
        }
        if scratch.keep_samples {
            let made = Verdict { steps: made, ..verdict };
            self.sample_motion(walk, made, now, slot, state, scratch);
        }
        match verdict.contact {
            None => {
                state.bodies[i].contact.set(0);
                if walk.turn != 0 {
                    state.bodies[i].facing.set((state.bodies[i].facing.get() + walk.turn) % 4);
                }
            }
            Some((kind, side)) => {
                state.bodies[i].contact.set(contact_word(kind, side as u8));
                state.contacts.add(i * self.kinds.len() + usize::from(kind), 1);
                if scratch.keep_events {
                    let body = self.bodies[i].id;
                    let event = EventKind::Contact { kind, side };
                    scratch.events.push(Event { cycle: now, body, event });
                }
            }
        }
    }

    /// How far a walk gets: to the first step that enters a box that is not free.
    #[inline]
    pub(super) fn judge(&self, walk: &Walk, state: &RobotsState, slot: Slot) -> Verdict {
        let base = state.at(slot).index(self.stride);
        for (steps, step) in walk.steps.iter().enumerate() {
            for &offset in &step.enter {
                let kind = state.kind_at(base.wrapping_add_signed(offset));
                if kind != FREE && !self.is_own(walk, steps, offset) {
                    return Verdict { steps, contact: Some((kind, step.side)) };
                }
            }
        }
        Verdict { steps: walk.steps.len(), contact: None }
    }

    /// A path that turns back enters boxes that the body itself still covers in the state.
    #[inline]
    fn is_own(&self, walk: &Walk, steps: usize, offset: i32) -> bool {
        walk.steps[..steps].iter().any(|earlier| earlier.leave.contains(&offset))
    }

    /// Makes the first `steps` steps of a walk.
    #[inline]
    fn make(&self, walk: &Walk, steps: usize, state: &RobotsState, slot: Slot) {
        if steps == 0 {
            return;
        }
        let (cell, body) = (&state.bodies[slot as usize], self.body_type(slot));
        let at = cell.at();
        let base = at.index(self.stride);
        let (mut moved, mut first_visits) = (at, 0);
        for step in &walk.steps[..steps] {
            for &offset in &step.leave {
                let index = base.wrapping_add_signed(offset) as usize;
                state.grid.set(index, state.grid.get(index) & !KIND_BITS);
            }
            for &offset in &step.enter {
                let index = base.wrapping_add_signed(offset) as usize;
                let before = state.grid.get(index);
                first_visits += u32::from(before & VISITED == 0);
                state.grid.set(index, before & VISITED | body.kind | body.marks);
            }
            moved = moved.offset(step.delta.0, step.delta.1);
        }
        self.settle(state, cell, body, moved);
        cell.moves.set(cell.moves.get() + steps as u32);
        if body.marks != 0 {
            cell.first_visits.set(cell.first_visits.get() + first_visits);
        }
    }

    /// The distribution over the walks that are not blocked here, or the first blocked one
    /// when none is left.
    fn rescaled(
        &self,
        action: &Action,
        state: &RobotsState,
        slot: Slot,
    ) -> Result<Categorical, usize> {
        let free = |walk: &Walk| self.judge(walk, state, slot).contact.is_none();
        let mut row: Vec<f64> = action
            .probabilities
            .iter()
            .zip(&action.walks)
            .map(|(&p, walk)| if p > 0.0 && free(walk) { p } else { 0.0 })
            .collect();
        let sum: f64 = row.iter().sum();
        if sum <= 0.0 {
            return Err(action.probabilities.iter().position(|&p| p > 0.0).unwrap_or(0));
        }
        row.iter_mut().for_each(|p| *p /= sum);
        Ok(Categorical::new(&row).expect("a rescaled row is a distribution"))
    }

    /// Opens, or closes when nobody stands in the way; otherwise the closing waits.
    fn toggle(&self, state: &RobotsState, now: Cycle, slot: Slot, scratch: &mut Scratch) {
        let i = slot as usize;
        let body = self.body_type(slot);
        let base = state.at(slot).index(self.stride);
        let boxes = || body.own.iter().map(|&o| base.wrapping_add_signed(o));
        let opens = state.bodies[i].facing.get() == 0;
        if !opens && boxes().any(|b| state.kind_at(b) != FREE) {
            return;
        }
        if opens {
            for b in boxes() {
                let index = b as usize;
                state.grid.set(index, state.grid.get(index) & !KIND_BITS);
            }
        } else {
            state.occupy(self, slot);
        }
        state.bodies[i].facing.set(u8::from(opens));
        if scratch.keep_events {
            let event = if opens { EventKind::Opened } else { EventKind::Closed };
            scratch.events.push(Event { cycle: now, body: self.bodies[i].id, event });
        }
    }

    /// Notes what an action came to, for a log to learn from: the steps and the turn that were
    /// made, not those that the drawn transition would have made in a free place.
    fn sample_motion(
        &self,
        walk: &Walk,
        verdict: Verdict,
        now: Cycle,
        slot: Slot,
        state: &RobotsState,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let (mut ahead, mut left) = (0, 0);
        for step in &walk.steps[..verdict.steps] {
            match step.side {
                Side::Front => ahead += 1,
                Side::Back => ahead -= 1,
                Side::Left => left += 1,
                Side::Right => left -= 1,
            }
        }
        scratch.motion_samples.push(MotionSample {
            cycle: now,
            robot: self.bodies[i].id,
            action: (state.bodies[i].intent.get() & !CLEAR) - 1,
            ahead,
            left,
            quarter_turns: if verdict.contact.is_none() { walk.turn } else { 0 },
            contact: verdict.contact.is_some(),
        });
    }
}
