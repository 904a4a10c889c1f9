//! Motion scripts: a small turtle language that drives an initiator.
//!
//! ```text
//! # A square, twice as large each time.
//! to square :side
//!   repeat 4 [ forward :side turn 90 ]
//! end
//!
//! square 0.5
//! square 2 * 0.5
//! wait 1.5
//! goto 1, 2
//! ```
//!
//! | statement | effect |
//! | --- | --- |
//! | `forward D` | D meters ahead (back if D is negative) |
//! | `turn A` | A degrees to the left |
//! | `pitch A` | nose up by A degrees |
//! | `wait S` | S seconds of rest |
//! | `goto X, Y` or `goto X, Y, Z` | to that place in meters; the heading stays, and so does Z if left out |
//! | `repeat N [ ... ]` | N times; N is a whole number |
//! | `to NAME :a :b ... end` | a procedure, outside of all others; `NAME 1, 2` carries it out |
//!
//! Values are numbers, parameters, `+ - * /` and parentheses. `#` starts a comment. A procedure may
//! call itself: `repeat 0` ends that. A script starts where its [`Turtle`] is.

mod parse;
mod run;
#[cfg(test)]
mod tests;

use sidestep_kernel::InputError;

pub(crate) use run::{ScriptMotion, ScriptMotions, Turtle};

/// Longest script, in bytes: a megabyte is parsed in a moment, and no script that a person writes is as long.
pub(crate) const MAX_BYTES: usize = 1 << 20;

/// Deepest nesting of brackets: the parser recurses for each.
pub(crate) const MAX_NESTING: usize = 64;

/// Deepest nesting of procedures and repetitions while a script runs, so that one that calls itself for ever is reported.
pub(crate) const MAX_DEPTH: usize = 1000;

/// Most statements that a script may carry out. Repetitions count as one each time.
pub(crate) const MAX_STATEMENTS: u64 = 10_000_000;

/// A script whose text is right; while it runs, its values may still be wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    place: String,
    text: String,
    main: Vec<Statement>,
    procedures: Vec<Procedure>,
}

impl Script {
    /// Reads the text of a script, which errors call `place`.
    ///
    /// # Errors
    /// When the text is too long, is no script, or uses procedures or parameters that it does not
    /// have; the error names the line, the column and the token expected there.
    pub fn parse(place: &str, text: &str) -> Result<Self, InputError> {
        parse::script(place, text)
    }

    /// Returns the motions of an initiator that is at `start`, one after the other. None follow after
    /// an error.
    pub fn motions(&self, start: Turtle) -> ScriptMotions<'_> {
        ScriptMotions::new(self, start)
    }

    fn error(&self, at: usize, cause: impl Into<String>, remedy: impl Into<String>) -> InputError {
        InputError::new(&self.place, cause, remedy).with_byte_offset(&self.text, at)
    }
}

#[derive(Debug, Clone, PartialEq)]
struct Procedure {
    name: String,
    parameters: Vec<String>,
    body: Vec<Statement>,
    /// Bytes of the text before it.
    at: usize,
}

#[derive(Debug, Clone, PartialEq)]
struct Statement {
    /// Bytes of the text before it.
    at: usize,
    action: ScriptAction,
}

#[derive(Debug, Clone, PartialEq)]
enum ScriptAction {
    Forward(Expression),
    Turn(Expression),
    Pitch(Expression),
    Wait(Expression),
    /// Two or three coordinates.
    Goto(Vec<Expression>),
    Repeat(Expression, Vec<Statement>),
    Call {
        name: String,
        procedure: usize,
        arguments: Vec<Expression>,
    },
}

/// A value in postfix form: long sums nest no calls.
#[derive(Debug, Clone, PartialEq)]
struct Expression {
    /// Bytes of the text before it.
    at: usize,
    terms: Vec<ExpressionTerm>,
}

#[derive(Debug, Clone, PartialEq)]
enum ExpressionTerm {
    Number(f64),
    /// A parameter by its name, and the bytes of the text before it.
    Named(String, usize),
    /// A parameter of the procedure around.
    Parameter(usize),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
}
