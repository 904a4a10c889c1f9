//! Several postures that reach a target, and the nearest of them to the start.

use super::super::serial::Motion;
use super::answer::Posture;
use super::descent::{Descent, Effort};
use super::search::{Found, Search};
use sidestep_kernel::math::wrap_angle;
use std::f64::consts::TAU;

/// Most steps toward the start, and the first as a part of the way.
const STEPS: usize = 30;
const FIRST_PART: f64 = 0.5;
/// Parts of the way below which no further step is tried.
const LEAST_PART: f64 = 0.02;
/// Least part of the distance that a step must save.
const LEAST_GAIN: f64 = 1e-4;

impl Search<'_> {
    /// Descends from `first` and from random postures, and keeps the postures that meet the goal and
    /// are distinct from all before.
    pub(super) fn many(&mut self, first: &[f64], start: &[f64]) -> Found {
        let (wanted, nearest) = (self.by.goal.solutions, self.by.goal.nearest);
        let mut found: Vec<Vec<f64>> = Vec::new();
        let (mut steps, mut starts) = (0, 0);
        for k in 0..=self.by.goal.restarts {
            let from = if k == 0 { first.to_vec() } else { self.random(k) };
            let mut came = self.by.descend(from, Effort::BRIEF);
            (steps, starts) = (steps + came.steps, k + 1);
            if !self.by.is_met(&came.look) {
                continue;
            }
            self.turn_back(&mut came.values, start);
            if nearest {
                came = self.draw_near(came, start, &mut steps);
            }
            match found.iter().position(|other| !self.is_distinct(other, &came.values)) {
                None => found.push(came.values),
                Some(same) if self.away2(&came.values, start) < self.away2(&found[same], start) => {
                    found[same] = came.values;
                }
                Some(_) => {}
            }
            if found.len() == wanted && !nearest {
                break;
            }
        }
        found.sort_by(|a, b| self.away2(a, start).total_cmp(&self.away2(b, start)));
        found.truncate(wanted);
        let postures = found.into_iter().map(|values| self.posture(values)).collect();
        Found { postures, steps, starts }
    }

    /// Returns a posture with its errors by forward kinematics.
    pub(super) fn posture(&self, values: Vec<f64>) -> Posture {
        let tip = self.by.chain.forward(&values).tip;
        let (error_m, error_rad) = self.by.scene.errors(&tip);
        Posture { values, error_m, error_rad }
    }

    /// Moves a posture toward the start, as far as the goal allows: a part of the way, and the least
    /// way back to where the goal is met.
    fn draw_near(&mut self, mut at: Descent, start: &[f64], steps: &mut usize) -> Descent {
        let (mut part, mut away2) = (FIRST_PART, self.away2(&at.values, start));
        for _ in 0..STEPS {
            if part < LEAST_PART {
                break;
            }
            let toward = at.values.iter().zip(start).map(|(from, to)| from + part * (to - from));
            let mut came = self.by.descend(toward.collect(), Effort::BRIEF);
            *steps += came.steps;
            self.turn_back(&mut came.values, start);
            let came_away2 = self.away2(&came.values, start);
            if self.by.is_met(&came.look) && came_away2 < (1.0 - LEAST_GAIN) * away2 {
                (at, away2) = (came, came_away2);
            } else {
                part *= 0.5;
            }
        }
        at
    }

    /// Turns joints by full turns to be nearest to the start, inside their limits.
    fn turn_back(&self, values: &mut [f64], start: &[f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            let [lower, upper] = self.by.bounds.ranges[i];
            if !self.by.is_round(i) {
                continue;
            }
            let nearest = start[i] + wrap_angle(*value - start[i]);
            let choices = [nearest, nearest - TAU, nearest + TAU];
            let inside = choices.into_iter().find(|x| (lower..=upper).contains(x));
            *value = inside.unwrap_or(*value);
        }
    }

    fn is_distinct(&self, a: &[f64], b: &[f64]) -> bool {
        self.differences(a, b, wrap_angle).any(|by| by.abs() >= self.by.goal.apart)
    }

    /// Returns the square of the distance of two postures: of all joints' differences.
    fn away2(&self, a: &[f64], b: &[f64]) -> f64 {
        self.differences(a, b, |by| by).map(|by| by * by).sum()
    }

    /// Returns the differences of two postures: angles through `turned` if they are round, and
    /// slides as the angle that moves the tip as far at the arm's full reach.
    fn differences<'a>(
        &'a self,
        a: &'a [f64],
        b: &'a [f64],
        turned: impl Fn(f64) -> f64 + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let reach_m = self.skeleton.reach_m.max(f64::MIN_POSITIVE);
        let variables = self.by.chain.variables.iter().enumerate();
        variables.map(move |(i, variable)| match variable.motion {
            Motion::Turn if self.by.is_round(i) => turned(a[i] - b[i]),
            Motion::Turn => a[i] - b[i],
            Motion::Slide => (a[i] - b[i]) / reach_m,
        })
    }
}
