//! Pool two: the bodies of a group act one after the other; the environment decides.

use super::effector::{Action, ObstacleRule, Side, Walk};
use super::perceive::all_free;
use super::state::{CLEAR, IDLE, RobotsState, contact_word};
use super::world::{BodyType, RobotsWorld, Role};
use super::{Event, EventKind, MotionSample, Scratch};
use sidestep_kernel::distr::Categorical;
use sidestep_kernel::space::{BoxWord, Floor};
use sidestep_kernel::{Column, Cycle, Slot};

/// A state with its floor, whatever the width of its words.
type On<'a, T> = (&'a Column<T>, &'a RobotsState);

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
        match &state.floor {
            Floor::Narrow(floor) => self.act_on((floor, state), now, slot, word, scratch),
            Floor::Wide(floor) => self.act_on((floor, state), now, slot, word, scratch),
        }
    }

    #[inline]
    fn act_on<T: BoxWord>(
        &self,
        (floor, state): On<'_, T>,
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
            return self.toggle((floor, state), now, slot, scratch);
        };
        let drawn = match self.obstacle_rule {
            ObstacleRule::Cut | ObstacleRule::Stay => action.distribution.sample(word),
            ObstacleRule::Renormalise => match self.rescaled(action, (floor, state), slot) {
                Ok(distribution) => distribution.sample(word),
                Err(blocked) => blocked,
            },
        };
        let walk = &action.walks[drawn];
        let base = cell.at().index(self.stride);
        if all_free(floor, base, &walk.whole.enter) {
            self.make_whole(walk, (floor, state), slot, body, base);
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
            self.blocked(walk, (floor, state), now, slot, scratch);
        }
    }

    /// Makes all of a walk that meets nothing.
    #[inline]
    fn make_whole<T: BoxWord>(
        &self,
        walk: &Walk,
        (floor, state): On<'_, T>,
        slot: Slot,
        body: &BodyType,
        base: u32,
    ) {
        let cell = &state.bodies[slot as usize];
        cell.contact.set(0);
        if walk.turn != 0 {
            cell.facing.set((cell.facing.get() + walk.turn) % 4);
        }
        if walk.steps.is_empty() {
            return;
        }
        let whole = &walk.whole;
        let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
        whole.leave.iter().for_each(|&offset| floor.set(at(offset), T::FREE));
        whole.fill.iter().for_each(|&offset| floor.set(at(offset), T::standing(slot)));
        cell.anchor.set(cell.at().offset(whole.delta.0, whole.delta.1).word());
        cell.moves.set(cell.moves.get() + walk.steps.len() as u32);
        if body.marks {
            let new = |&offset: &i32| state.visited.insert(at(offset));
            let first_visits = whole.enter.iter().filter(|offset| new(offset)).count();
            cell.first_visits.set(cell.first_visits.get() + first_visits as u32);
        }
    }

    /// A walk that may be cut short by something in the way.
    fn blocked<T: BoxWord>(
        &self,
        walk: &Walk,
        (floor, state): On<'_, T>,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let verdict = self.judge(walk, (floor, state), slot);
        let is_mover = matches!(state.type_in(self, slot).role, Role::Mover(_));
        let made = match self.obstacle_rule {
            _ if verdict.contact.is_none() => verdict.steps,
            ObstacleRule::Cut if !is_mover => verdict.steps,
            _ => 0,
        };
        self.make(walk, made, (floor, state), slot);
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
                let body = state.bodies[i].id;
                state.contacts.add(body as usize * self.kinds.len() + usize::from(kind), 1);
                if scratch.keep_events {
                    let event = EventKind::Contact { kind, side };
                    scratch.events.push(Event { cycle: now, body, event });
                }
            }
        }
    }

    /// How far a walk gets: to the first step that enters a box that is not free.
    #[inline]
    fn judge<T: BoxWord>(&self, walk: &Walk, (floor, state): On<'_, T>, slot: Slot) -> Verdict {
        let base = state.at(slot).index(self.stride);
        for (steps, step) in walk.steps.iter().enumerate() {
            for &offset in &step.enter {
                let word = floor.get(base.wrapping_add_signed(offset) as usize);
                // A path that turns back enters boxes that the body itself still covers.
                if !word.is_free() && word.slot() != slot {
                    return Verdict { steps, contact: Some((state.kind_of(word), step.side)) };
                }
            }
        }
        Verdict { steps: walk.steps.len(), contact: None }
    }

    /// Makes the first `steps` steps of a walk.
    #[inline]
    fn make<T: BoxWord>(&self, walk: &Walk, steps: usize, (floor, state): On<'_, T>, slot: Slot) {
        if steps == 0 {
            return;
        }
        let (cell, body) = (&state.bodies[slot as usize], state.type_in(self, slot));
        let base = cell.at().index(self.stride);
        let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
        let (mut moved, mut first_visits) = (cell.at(), 0);
        for step in &walk.steps[..steps] {
            step.leave.iter().for_each(|&offset| floor.set(at(offset), T::FREE));
            for &offset in &step.enter {
                floor.set(at(offset), T::standing(slot));
                first_visits += u32::from(body.marks && state.visited.insert(at(offset)));
            }
            moved = moved.offset(step.delta.0, step.delta.1);
        }
        cell.anchor.set(moved.word());
        cell.moves.set(cell.moves.get() + steps as u32);
        cell.first_visits.set(cell.first_visits.get() + first_visits);
    }

    /// The distribution over the walks that are not blocked here, or the first blocked one
    /// when none is left.
    fn rescaled<T: BoxWord>(
        &self,
        action: &Action,
        on: On<'_, T>,
        slot: Slot,
    ) -> Result<Categorical, usize> {
        let free = |walk: &Walk| self.judge(walk, on, slot).contact.is_none();
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
    fn toggle<T: BoxWord>(
        &self,
        (floor, state): On<'_, T>,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let body = state.type_in(self, slot);
        let base = state.at(slot).index(self.stride);
        let opens = state.bodies[i].facing.get() == 0;
        if !opens && !all_free(floor, base, &body.own) {
            return;
        }
        let word = if opens { T::FREE } else { T::standing(slot) };
        let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
        body.own.iter().for_each(|&offset| floor.set(at(offset), word));
        state.bodies[i].facing.set(u8::from(opens));
        if scratch.keep_events {
            let event = if opens { EventKind::Opened } else { EventKind::Closed };
            scratch.events.push(Event { cycle: now, body: state.bodies[i].id, event });
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
            robot: state.bodies[i].id,
            action: (state.bodies[i].intent.get() & !CLEAR) - 1,
            ahead,
            left,
            quarter_turns: if verdict.contact.is_none() { walk.turn } else { 0 },
            contact: verdict.contact.is_some(),
        });
    }
}
