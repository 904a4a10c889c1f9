//! Pool two: the bodies of a group act one after the other; the environment decides.

use super::effector::{Action, ObstacleRule, Side, Walk};
use super::state::{FREE, IDLE, KIND_BITS, RobotsState, VISITED, contact_word};
use super::world::{Door, RobotsWorld, Role, purpose};
use super::{Event, EventKind, MotionSample, Scratch};
use sidestep_kernel::distr::Categorical;
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
    /// One body acts on the state as left by those before it.
    #[inline]
    pub(super) fn act(&self, state: &RobotsState, now: Cycle, slot: Slot, scratch: &mut Scratch) {
        let i = slot as usize;
        let intent = state.bodies[i].intent.get();
        if intent == IDLE {
            return;
        }
        let heading = usize::from(state.bodies[i].facing.get());
        match &self.body_type(slot).role {
            Role::Robot(model) => {
                let action = &model.body.actions[heading][usize::from(intent - 1)];
                self.robot_acts(action, state, now, slot, scratch);
            }
            Role::Mover(mover) => {
                let walk = &mover.steps[heading].walks[0];
                if self.judge(walk, state, slot).contact.is_none() {
                    self.make(walk, 1, state, slot);
                }
            }
            Role::Door(door) => self.toggle(door, state, now, slot, scratch),
        }
    }

    #[inline]
    fn robot_acts(
        &self,
        action: &Action,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let word = self.streams.block(self.bodies[i].id, now, purpose::EFFECT, 0)[0];
        let drawn = match self.obstacle_rule {
            ObstacleRule::Cut | ObstacleRule::Stay => action.distribution.sample(word),
            ObstacleRule::Renormalise => match self.rescaled(action, state, slot) {
                Ok(distribution) => distribution.sample(word),
                Err(blocked) => blocked,
            },
        };
        let walk = &action.walks[drawn];
        let verdict = self.judge(walk, state, slot);
        let made = if self.obstacle_rule == ObstacleRule::Cut || verdict.contact.is_none() {
            verdict.steps
        } else {
            0
        };
        self.make(walk, made, state, slot);
        if scratch.keep_samples {
            self.sample_motion(walk, verdict, now, slot, state, scratch);
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
        let i = slot as usize;
        let body = self.body_type(slot);
        let at = state.at(slot);
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
        let tag = state.claims.tag(moved);
        let index = moved.index(self.stride);
        for &offset in &body.own {
            state.claims.claim(index.wrapping_add_signed(offset), tag);
        }
        state.bodies[i].anchor.set(moved.word());
        let cell = &state.bodies[i];
        cell.moves.set(cell.moves.get() + steps as u32);
        if body.marks != 0 && first_visits > 0 {
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
    fn toggle(&self, _: &Door, state: &RobotsState, now: Cycle, slot: Slot, scratch: &mut Scratch) {
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

    /// Notes what an action came to, for a log to learn from: displacement in boxes in the
    /// frame of the heading before, turn in degrees.
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
            action: state.bodies[i].intent.get() - 1,
            ahead,
            left,
            quarter_turns: walk.turn,
            contact: verdict.contact.is_some(),
        });
    }
}
