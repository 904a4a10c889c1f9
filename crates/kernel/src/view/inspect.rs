//! Percepts and decisions of a body, and their outcome: facts for a panel, and marks for the scene.

use super::body::BodyId;
use super::kind::BodyKind;
use super::pose::Vec3;
use crate::units::Cycle;
use serde::{Serialize, Serializer};

/// Percepts and decisions of a body in a cycle, and their outcome, in a form that is the same for all worlds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// The inspected body; serialized with the names of its fields.
    #[serde(serialize_with = "serialize_body_fields")]
    pub body: BodyId,
    /// The cycle that is about to run.
    pub cycle: Cycle,
    /// The body in words, as the heading of a panel.
    pub title: String,
    /// Facts about it, in the order of the panel.
    pub sections: Vec<FactSection>,
    /// Marks to draw over the scene, the first ones lowest.
    pub marks: Vec<Mark>,
}

/// Facts about one topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FactSection {
    /// The topic, by which [`Inspection::section`] finds it.
    pub title: String,
    /// Facts with a value each, in the order of the panel.
    pub facts: Vec<Fact>,
    /// A table after the single facts; `None` where it would have no rows.
    pub table: Option<FactTable>,
}

/// An answer to one question about the body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fact {
    /// The question that it answers.
    pub label: String,
    /// The answer; [`FactValue::None`] shows that there is none.
    pub value: FactValue,
}

/// The value of a fact by its type, because viewers lay out each type in its own form.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FactValue {
    /// A number with its unit.
    Number {
        /// The number, in the unit.
        value: f64,
        /// Its unit; empty for plain numbers.
        unit: &'static str,
    },
    /// A share or probability, from 0 to 1.
    Share(f64),
    /// Words, shown as they are.
    Text(String),
    /// A body by its identity, so that viewers can select it.
    #[serde(serialize_with = "serialize_body_fields")]
    Body(BodyId),
    /// A position in meters.
    Place(Vec3),
    /// Yes or no.
    Flag(bool),
    /// Nothing, or not known.
    None,
}

/// A table of facts of one kind, e.g. one row per neighbor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FactTable {
    /// Headings of the columns, which fix the length of each row.
    pub columns: Vec<String>,
    /// Rows of a value per column.
    pub rows: Vec<Vec<FactValue>>,
}

/// A figure over the scene that shows one percept, decision or outcome.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mark {
    /// Its role, by which viewers choose a style.
    pub role: MarkRole,
    /// What it shows, in words.
    pub label: String,
    /// Likelihood or strength, from 0 to 1; 1 where that has no meaning.
    pub weight: f64,
    /// Its shape, at its place in the world.
    pub shape: MarkShape,
}

/// What a mark shows; viewers draw each role in a style of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MarkRole {
    /// The ground truth.
    True,
    /// The sensor's report of it.
    Reported,
    /// The action that the body has chosen.
    Wish,
    /// The action that results.
    Done,
    /// An action that is not carried out, or the obstacle to it.
    Refused,
    /// The space that it claims for its action.
    Claim,
    /// The other bodies of its conflict group.
    Group,
    /// A predicted path.
    Predicted,
    /// The predicted path that was chosen.
    Chosen,
    /// Its knowledge of other bodies.
    Known,
    /// The orbit that it can always fall back to.
    Orbit,
    /// Its destination.
    Target,
    /// The path that it is to follow.
    Plan,
    /// From a body to one that it waits for.
    Wait,
}

/// The shape of a mark in the frame of the world, in meters.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum MarkShape {
    /// An open polyline.
    Line {
        /// Its points, from one end to the other.
        points_m: Vec<Vec3>,
    },
    /// A closed polygon.
    Area {
        /// Its corners, counterclockwise.
        corners_m: Vec<Vec3>,
    },
    /// A position without extent.
    Point {
        /// Its position.
        at_m: Vec3,
    },
    /// A horizontal circle.
    Circle {
        /// Its center, at its height.
        at_m: Vec3,
        /// Its radius.
        radius_m: f64,
    },
}

/// Serializes an identity with the names of its fields; files have it as a tuple, which is shorter in long tables.
fn serialize_body_fields<S: Serializer>(
    &BodyId { kind, number, part }: &BodyId,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct BodyIdFields {
        kind: BodyKind,
        number: u32,
        part: Option<u32>,
    }
    BodyIdFields { kind, number, part }.serialize(serializer)
}

impl MarkRole {
    /// Every role once, in the order of declaration.
    pub const ALL: [Self; 14] = [
        Self::True,
        Self::Reported,
        Self::Wish,
        Self::Done,
        Self::Refused,
        Self::Claim,
        Self::Group,
        Self::Predicted,
        Self::Chosen,
        Self::Known,
        Self::Orbit,
        Self::Target,
        Self::Plan,
        Self::Wait,
    ];
}

impl Inspection {
    /// Creates an inspection without facts and marks; `cycle` is the one about to run.
    pub fn new(body: BodyId, cycle: Cycle, title: impl Into<String>) -> Self {
        Self { body, cycle, title: title.into(), sections: Vec::new(), marks: Vec::new() }
    }

    /// Adds a section, unless it is empty.
    pub fn add_section(&mut self, section: FactSection) {
        if !section.facts.is_empty() || section.table.is_some() {
            self.sections.push(section);
        }
    }

    /// Adds a mark with full weight.
    pub fn add_mark(&mut self, role: MarkRole, label: impl Into<String>, shape: MarkShape) {
        self.add_weighted_mark(role, label, 1.0, shape);
    }

    /// Adds a mark with a weight, which is kept between 0 and 1.
    pub fn add_weighted_mark(
        &mut self,
        role: MarkRole,
        label: impl Into<String>,
        weight: f64,
        shape: MarkShape,
    ) {
        self.marks.push(Mark { role, label: label.into(), weight: weight.clamp(0.0, 1.0), shape });
    }

    /// Returns the section with a title; `None` where the body has no facts on that topic.
    pub fn section(&self, title: &str) -> Option<&FactSection> {
        self.sections.iter().find(|section| section.title == title)
    }

    /// Returns the value of a fact, by the titles of its section and itself.
    pub fn fact_value(&self, section: &str, label: &str) -> Option<&FactValue> {
        let fact = self.section(section)?.facts.iter().find(|fact| fact.label == label)?;
        Some(&fact.value)
    }

    /// Returns the marks in a role, in the order in which they were added.
    pub fn marks_with_role(&self, role: MarkRole) -> impl Iterator<Item = &Mark> {
        self.marks.iter().filter(move |mark| mark.role == role)
    }
}

impl FactSection {
    /// Creates a section without facts, which [`Inspection::add_section`] leaves out if it stays empty.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), facts: Vec::new(), table: None }
    }

    /// Adds a fact after the others.
    #[must_use]
    pub fn fact(mut self, label: impl Into<String>, value: impl Into<FactValue>) -> Self {
        self.facts.push(Fact { label: label.into(), value: value.into() });
        self
    }

    /// Adds a fact, or nothing without a value, where [`Self::fact`] would show that there is none.
    #[must_use]
    pub fn fact_if(self, label: &str, value: Option<impl Into<FactValue>>) -> Self {
        match value {
            Some(value) => self.fact(label, value),
            None => self,
        }
    }

    /// Adds a table, unless it has no rows.
    #[must_use]
    pub fn table(self, table: FactTable) -> Self {
        Self { table: (!table.rows.is_empty()).then_some(table), ..self }
    }
}

impl FactTable {
    /// Creates a table without rows.
    pub fn new<const N: usize>(columns: [&str; N]) -> Self {
        Self { columns: columns.map(String::from).to_vec(), rows: Vec::new() }
    }

    /// Adds a row, which must have a value for each column.
    pub fn push_row<const N: usize>(&mut self, values: [FactValue; N]) {
        assert_eq!(N, self.columns.len(), "a value for each column");
        self.rows.push(values.into());
    }

    /// Returns the values of the column with a heading from the first row on; `None` if there is no such column.
    pub fn column(&self, heading: &str) -> Option<impl Iterator<Item = &FactValue>> {
        let k = self.columns.iter().position(|column| column == heading)?;
        Some(self.rows.iter().map(move |row| &row[k]))
    }
}

impl FactValue {
    /// Creates a number; `unit` follows it on the screen, and is empty for plain numbers.
    pub fn number(value: f64, unit: &'static str) -> Self {
        Self::Number { value, unit }
    }

    /// Creates a number of meters; infinity becomes [`FactValue::None`].
    pub fn meters(value: f64) -> Self {
        if value.is_finite() { Self::number(value, "m") } else { Self::None }
    }

    /// Creates a number of degrees from radians.
    pub fn degrees(value_rad: f64) -> Self {
        Self::number(value_rad.to_degrees(), "°")
    }

    /// Creates a number without a unit; larger ones than `u32` holds become its maximum.
    pub fn count(value: impl TryInto<u32>) -> Self {
        Self::number(f64::from(value.try_into().unwrap_or(u32::MAX)), "")
    }

    /// Creates words, which are shown as they are.
    pub fn text(words: impl Into<String>) -> Self {
        Self::Text(words.into())
    }
}

impl From<&str> for FactValue {
    fn from(words: &str) -> Self {
        Self::Text(words.into())
    }
}

impl From<String> for FactValue {
    fn from(words: String) -> Self {
        Self::Text(words)
    }
}

impl From<BodyId> for FactValue {
    fn from(body: BodyId) -> Self {
        Self::Body(body)
    }
}

impl From<Vec3> for FactValue {
    fn from(at_m: Vec3) -> Self {
        Self::Place(at_m)
    }
}

impl From<bool> for FactValue {
    fn from(value: bool) -> Self {
        Self::Flag(value)
    }
}

impl<T: Into<Self>> From<Option<T>> for FactValue {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, Into::into)
    }
}

#[cfg(test)]
mod tests {
    use super::super::kind::samples::ROBOT;
    use super::*;

    #[test]
    fn what_was_told_is_found_again_and_empty_sections_are_left_out() {
        let who = BodyId::new(ROBOT, 3, None);
        let mut told = Inspection::new(who, 7, "robot 3");
        told.add_section(FactSection::new("nothing").table(FactTable::new(["a"])));
        let mut table = FactTable::new(["other", "apart"]);
        table.push_row([who.into(), FactValue::meters(f64::INFINITY)]);
        told.add_section(
            FactSection::new("sees").fact("heading", FactValue::degrees(0.0)).table(table),
        );
        told.add_weighted_mark(MarkRole::Wish, "on", 1.5, MarkShape::Point { at_m: [0.0; 3] });
        assert_eq!(told.sections.len(), 1);
        assert_eq!(told.fact_value("sees", "heading"), Some(&FactValue::number(0.0, "°")));
        let table = told.section("sees").and_then(|s| s.table.as_ref()).unwrap();
        assert_eq!(table.column("apart").unwrap().collect::<Vec<_>>(), [&FactValue::None]);
        assert_eq!(
            told.marks_with_role(MarkRole::Wish).map(|m| m.weight).collect::<Vec<_>>(),
            [1.0]
        );
    }
}
