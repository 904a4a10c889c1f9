//! A script, carried out statement by statement.

use super::{
    Expression, ExpressionTerm, MAX_DEPTH, MAX_STATEMENTS, Script, ScriptAction, Statement,
};
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin};

/// Position and orientation of an initiator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Turtle {
    /// Where it is, meters; in the plane the last coordinate is not used.
    pub position_m: [f64; 3],
    /// Unit vector ahead.
    pub ahead: [f64; 3],
    /// Unit vector to the left, across `ahead`.
    pub left: [f64; 3],
}

impl Default for Turtle {
    /// Returns a turtle at the origin, facing along x, with z up.
    fn default() -> Self {
        Self { position_m: [0.0; 3], ahead: [1.0, 0.0, 0.0], left: [0.0, 1.0, 0.0] }
    }
}

impl Turtle {
    fn up(&self) -> [f64; 3] {
        let [ax, ay, az] = self.ahead;
        let [lx, ly, lz] = self.left;
        [ay * lz - az * ly, az * lx - ax * lz, ax * ly - ay * lx]
    }

    fn advance(&mut self, distance_m: f64) {
        self.position_m = linear_combination(self.position_m, 1.0, self.ahead, distance_m);
    }

    /// Turns to the left about the upward axis.
    fn turn(&mut self, angle_rad: f64) {
        let s = sin(angle_rad);
        let c = cos(angle_rad);
        let ahead = linear_combination(self.ahead, c, self.left, s);
        self.left = linear_combination(self.left, c, self.ahead, -s);
        self.ahead = ahead;
        self.orthonormalize_axes();
    }

    /// Pitches the nose up about the axis to the left.
    fn pitch_up(&mut self, angle_rad: f64) {
        self.ahead = linear_combination(self.ahead, cos(angle_rad), self.up(), sin(angle_rad));
        self.orthonormalize_axes();
    }

    /// Makes the axes orthonormal again: rounding bends them a little, and each turn multiplies
    /// earlier errors.
    fn orthonormalize_axes(&mut self) {
        self.ahead = normalize(self.ahead);
        self.left =
            normalize(linear_combination(self.left, 1.0, self.ahead, -dot(self.left, self.ahead)));
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn normalize(a: [f64; 3]) -> [f64; 3] {
    linear_combination(a, 1.0 / dot(a, a).sqrt(), [0.0; 3], 0.0)
}

fn linear_combination(a: [f64; 3], by: f64, b: [f64; 3], times: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] * by + b[i] * times)
}

/// The next motion of an initiator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScriptMotion {
    /// Move straight to this position, in m.
    MoveTo {
        /// The place, meters.
        position_m: [f64; 3],
    },
    /// Face this direction.
    Face {
        /// Unit vector.
        ahead: [f64; 3],
    },
    /// Rest.
    Wait {
        /// The duration in s, not negative.
        duration_s: f64,
    },
}

/// Motions as they are derived; none follow after an error.
#[derive(Debug, Clone)]
pub struct ScriptMotions<'a> {
    script: &'a Script,
    turtle: Turtle,
    frames: Vec<CallFrame<'a>>,
    /// Statements that may still be carried out.
    left: u64,
}

/// A body that is being carried out.
#[derive(Debug, Clone)]
struct CallFrame<'a> {
    body: &'a [Statement],
    next: usize,
    /// Number of repetitions left.
    again: u64,
    /// Values of the parameters of the procedure around.
    parameters: Vec<f64>,
}

impl<'a> ScriptMotions<'a> {
    pub(super) fn new(script: &'a Script, turtle: Turtle) -> Self {
        let main = CallFrame { body: &script.main, next: 0, again: 0, parameters: Vec::new() };
        Self { script, turtle, frames: vec![main], left: MAX_STATEMENTS }
    }

    /// Returns the turtle after the motions so far.
    pub fn turtle(&self) -> &Turtle {
        &self.turtle
    }

    /// Returns the next statement; none at the end of the script.
    fn next_statement(&mut self) -> Option<Result<&'a Statement, InputError>> {
        loop {
            let frame = self.frames.last_mut()?;
            if let Some(statement) = frame.body.get(frame.next) {
                frame.next += 1;
                return Some(self.consume_statement_budget(statement.at).map(|()| statement));
            }
            if frame.again == 0 {
                self.frames.pop();
                continue;
            }
            frame.again -= 1;
            frame.next = 0;
            // Counted as a statement, because a body without statements would repeat unnoticed.
            let at = frame.body.first().map_or(0, |statement| statement.at);
            if let Err(error) = self.consume_statement_budget(at) {
                return Some(Err(error));
            }
        }
    }

    fn consume_statement_budget(&mut self, at: usize) -> Result<(), InputError> {
        let Some(left) = self.left.checked_sub(1) else {
            let cause = format!("more than {MAX_STATEMENTS} statements have been carried out");
            return Err(self.script.error(at, cause, "repeat less often"));
        };
        self.left = left;
        Ok(())
    }

    /// Carries out a statement; returns its motion, or none if it only opens a body.
    fn execute_statement(
        &mut self,
        statement: &'a Statement,
    ) -> Result<Option<ScriptMotion>, InputError> {
        match &statement.action {
            ScriptAction::Forward(distance) => {
                self.turtle.advance(self.evaluate_expression(distance)?);
                self.turtle_motion(statement)
            }
            ScriptAction::Goto(coordinates) => {
                for (i, coordinate) in coordinates.iter().enumerate() {
                    self.turtle.position_m[i] = self.evaluate_expression(coordinate)?;
                }
                self.turtle_motion(statement)
            }
            ScriptAction::Turn(angle) => {
                self.turtle.turn(self.evaluate_expression(angle)?.to_radians());
                Ok(Some(ScriptMotion::Face { ahead: self.turtle.ahead }))
            }
            ScriptAction::Pitch(angle) => {
                self.turtle.pitch_up(self.evaluate_expression(angle)?.to_radians());
                Ok(Some(ScriptMotion::Face { ahead: self.turtle.ahead }))
            }
            ScriptAction::Wait(duration) => self.execute_wait(duration).map(Some),
            ScriptAction::Repeat(count, body) => self.execute_repeat(count, body).map(|()| None),
            ScriptAction::Call { procedure, arguments, .. } => {
                let parameters =
                    arguments.iter().map(|argument| self.evaluate_expression(argument));
                let parameters = parameters.collect::<Result<_, _>>()?;
                let body = &self.script.procedures[*procedure].body;
                self.push_call_frame(
                    statement.at,
                    CallFrame { body, next: 0, again: 0, parameters },
                )?;
                Ok(None)
            }
        }
    }

    fn turtle_motion(&self, statement: &Statement) -> Result<Option<ScriptMotion>, InputError> {
        let position_m = self.turtle.position_m;
        if position_m.iter().all(|x| x.is_finite()) {
            return Ok(Some(ScriptMotion::MoveTo { position_m }));
        }
        Err(self.script.error(statement.at, "this goes beyond all numbers", "go less far"))
    }

    fn execute_wait(&self, duration: &Expression) -> Result<ScriptMotion, InputError> {
        let duration_s = self.evaluate_expression(duration)?;
        if duration_s < 0.0 {
            let cause = format!("a wait of {duration_s} s");
            return Err(self.script.error(duration.at, cause, "write a time from 0 on"));
        }
        Ok(ScriptMotion::Wait { duration_s })
    }

    fn execute_repeat(
        &mut self,
        count: &Expression,
        body: &'a [Statement],
    ) -> Result<(), InputError> {
        let times = self.evaluate_expression(count)?;
        if times < 0.0 || times.fract() != 0.0 || times > MAX_STATEMENTS as f64 {
            let cause = format!("nothing can be repeated {times} times");
            let remedy = format!("write a whole number from 0 to {MAX_STATEMENTS}");
            return Err(self.script.error(count.at, cause, remedy));
        }
        if times == 0.0 {
            return Ok(());
        }
        let parameters = self.parameters().to_vec();
        self.push_call_frame(
            count.at,
            CallFrame { body, next: 0, again: times as u64 - 1, parameters },
        )
    }

    fn push_call_frame(&mut self, at: usize, frame: CallFrame<'a>) -> Result<(), InputError> {
        // A finished body is removed, so the last call of a procedure takes no depth.
        while self.frames.last().is_some_and(|f| f.next == f.body.len() && f.again == 0) {
            self.frames.pop();
        }
        if self.frames.len() >= MAX_DEPTH {
            let cause = format!("more than {MAX_DEPTH} procedures in each other");
            return Err(self.script.error(at, cause, "make the procedure that calls itself end"));
        }
        self.frames.push(frame);
        Ok(())
    }

    fn parameters(&self) -> &[f64] {
        self.frames.last().map_or(&[], |frame| &frame.parameters)
    }

    fn evaluate_expression(&self, expression: &Expression) -> Result<f64, InputError> {
        let value = evaluate(&expression.terms, self.parameters());
        if value.is_finite() {
            return Ok(value);
        }
        let cause = format!("the value is {value}");
        Err(self.script.error(expression.at, cause, "divide by something that is not zero"))
    }
}

/// Evaluates a postfix expression from the parser, which has two operands wherever it takes two.
fn evaluate(terms: &[ExpressionTerm], parameters: &[f64]) -> f64 {
    let mut stack = Vec::with_capacity(terms.len());
    for term in terms {
        let value = match term {
            ExpressionTerm::Number(number) => *number,
            ExpressionTerm::Parameter(index) => parameters[*index],
            ExpressionTerm::Named(..) => unreachable!("names are resolved when a script is read"),
            ExpressionTerm::Negate => -pop(&mut stack),
            operator => {
                // The second operand was pushed last.
                let b = pop(&mut stack);
                let a = pop(&mut stack);
                match operator {
                    ExpressionTerm::Add => a + b,
                    ExpressionTerm::Subtract => a - b,
                    ExpressionTerm::Multiply => a * b,
                    _ => a / b,
                }
            }
        };
        stack.push(value);
    }
    pop(&mut stack)
}

fn pop(stack: &mut Vec<f64>) -> f64 {
    stack.pop().expect("the parser emits operands before operators")
}

impl Iterator for ScriptMotions<'_> {
    type Item = Result<ScriptMotion, InputError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let motion =
                self.next_statement()?.and_then(|statement| self.execute_statement(statement));
            match motion {
                Ok(None) => {}
                Ok(Some(motion)) => return Some(Ok(motion)),
                Err(error) => {
                    self.frames.clear();
                    return Some(Err(error));
                }
            }
        }
    }
}
