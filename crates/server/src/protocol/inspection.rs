//! Percepts, decisions and deeds of a body, for a panel and for marks on the canvas. Names no world.

use super::BodyId;
use serde::Serialize;

/// Facts and marks of a body: its percepts, decisions and deeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Inspection {
    /// The body.
    pub body: BodyId,
    /// Cycles done.
    pub cycle: f64,
    /// The body's name.
    pub title: String,
    /// Facts, by subject.
    pub sections: Vec<Section>,
    /// Marks to draw of it.
    pub marks: Vec<Mark>,
}

/// Facts on one subject.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Section {
    /// The subject.
    pub title: String,
    /// The facts.
    pub facts: Vec<Fact>,
    /// A table, where facts are many of a kind.
    pub table: Option<Table>,
}

/// A fact.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Fact {
    /// Its name, in words.
    pub label: String,
    /// Its value.
    pub value: Value,
}

/// The value of a fact.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Value {
    /// A number.
    Number {
        /// The number.
        value: f64,
        /// Its unit; may be empty.
        unit: String,
    },
    /// A share or a probability, from 0 to 1.
    Share(f64),
    /// Words.
    Text(String),
    /// A body.
    Body(BodyId),
    /// A place, in meters.
    Place([f64; 3]),
    /// Yes or no.
    Flag(bool),
    /// Nothing.
    None,
}

/// Facts in rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Table {
    /// The heads of the columns.
    pub columns: Vec<String>,
    /// The rows, each with a value for each column.
    pub rows: Vec<Vec<Value>>,
}

/// Something to draw over the scene while the body is selected.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Mark {
    /// Its meaning.
    pub role: Role,
    /// The same in words.
    pub label: String,
    /// Likelihood or strength, from 0 to 1; 1 where that has no meaning.
    pub weight: f64,
    /// Its shape.
    pub shape: MarkShape,
}

/// The meaning of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The world as it is.
    True,
    /// A sensor's report.
    Reported,
    /// The agent's wish.
    Wish,
    /// The action carried out.
    Done,
    /// A thing that was refused.
    Refused,
    /// Room that is claimed.
    Claim,
    /// The bodies in conflict.
    Group,
    /// A prediction.
    Predicted,
    /// The choice.
    Chosen,
    /// Knowledge of others.
    Known,
    /// The orbit that it can always fall back to.
    Orbit,
    /// A destination.
    Target,
}

/// The shape of a mark.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum MarkShape {
    /// A polyline.
    Line {
        /// Its points, in meters.
        points_m: Vec<[f64; 3]>,
    },
    /// A polygon.
    Area {
        /// Its corners, in meters.
        corners_m: Vec<[f64; 3]>,
    },
    /// A point.
    Point {
        /// Its place, in meters.
        at_m: [f64; 3],
    },
    /// A circle, parallel to the ground.
    Circle {
        /// Its center, in meters.
        at_m: [f64; 3],
        /// Its radius, in meters.
        radius_m: f64,
    },
}
