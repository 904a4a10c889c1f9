//! Kinds of bodies, which worlds declare: all that other code needs to show a body of a kind.

use super::color::Color;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::cell::RefCell;
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fmt;
use std::hash::{Hash, Hasher};

/// A kind of bodies. Worlds declare theirs as constants; kinds of the same name are the same kind.
#[derive(Clone, Copy)]
pub struct BodyKind(&'static KindSpec);

/// The properties of a kind of bodies.
#[derive(Debug)]
pub struct KindSpec {
    /// Its name in files, in lowercase letters.
    pub name: &'static str,
    /// The noun for what has a color and a name of its own in pictures: `chain` for the connectors of a chain.
    pub noun: &'static str,
    /// Its place in the order of kinds. Files and pictures that are sorted by kind keep their order only as long as
    /// ranks stay as they are.
    pub rank: u16,
    /// Its relation to the agents of its world.
    pub role: BodyRole,
    /// The drawing order: seen from above, higher layers cover lower ones.
    pub layer: u8,
    /// Its color.
    pub paint: Paint,
    /// The line around it.
    pub outline: Outline,
    /// Its lines in a legend.
    pub legend: LegendTexts,
    /// Whether a mark on the body shows its heading.
    pub shows_heading: bool,
}

/// The relation of a kind of bodies to the agents of its world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BodyRole {
    /// An agent, whose trajectory is recorded.
    Agent(TrailStyle),
    /// A part of a body whose parts are agents; pictures show the trails of its two ends.
    PartOfBody,
    /// Lines through the parts of the body with its number.
    LineThroughParts(BodyKind),
    /// The surroundings of the agent with its number, centered at that agent.
    AroundAgent(BodyKind),
    /// The place where the agent with its number starts.
    StartOf(BodyKind),
    /// Something that moves without being an agent; its number follows those of the agents, and it has rows in their
    /// table.
    MovesAmong(BodyKind),
    /// Something that stands still; its number follows those of the agents.
    StandsAmong(BodyKind),
    /// Something with numbers of its own.
    Thing,
}

/// The way pictures show the trails of agents.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrailStyle {
    /// At most one trail of each color: the area that an agent sweeps is wide, and trails of the same color could not be
    /// distinguished.
    OnePerColor,
    /// Thin lines, of which many can be distinguished.
    Lines,
}

/// The color of the bodies of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Paint {
    /// The color of the body's number; the color of alerts where it touches something or has failed.
    ByNumber {
        /// Opacity, from 0 (fully transparent) to 1 (opaque).
        opacity: f64,
    },
    /// The color of the body's number, so pale that all within stays visible; the color of alerts where another agent
    /// is too near.
    Veil,
    /// The same color for all bodies of the kind; the color of alerts where it touches something or has failed.
    Fixed {
        /// The color.
        color: Color,
        /// Opacity of an open body; others are opaque.
        open_opacity: f64,
    },
    /// The color of walls, or of things that move if the body does; pale in space.
    Solid,
}

/// The line around the bodies of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// None.
    None,
    /// A dark line.
    Dark,
    /// A white line.
    White,
    /// A white line from above, and a white seam in space, where the body is large enough for one.
    Seam,
    /// A line in a darker shade of the body's color; a dashed one in its color where the body is open.
    Shade,
    /// A thin line in a darker shade, pale in space.
    ThinShade,
    /// A pale line in the body's color.
    Pale,
    /// A dashed line in the body's color.
    Dashed,
}

/// The lines of a kind in a legend, by condition; empty for agents, which have names of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LegendTexts {
    /// The line of a body in plain condition.
    pub plain: &'static str,
    /// The line of a body with a velocity.
    pub moving: &'static str,
    /// The line of an open body.
    pub open: &'static str,
    /// The line of a body that touches something.
    pub touching: &'static str,
    /// The line of a body that has failed.
    pub failed: &'static str,
}

impl LegendTexts {
    /// The lines of agents.
    pub const AGENT: Self = Self::new("");

    /// Returns the lines of a kind that looks alike in all conditions but contact and failure.
    pub const fn new(plain: &'static str) -> Self {
        Self { plain, moving: plain, open: plain, touching: "in contact", failed: "failed" }
    }
}

impl BodyKind {
    /// Creates a kind.
    pub const fn new(spec: &'static KindSpec) -> Self {
        Self(spec)
    }

    /// Its name in files.
    pub const fn name(self) -> &'static str {
        self.0.name
    }

    /// Its properties.
    pub const fn spec(self) -> &'static KindSpec {
        self.0
    }

    /// Its relation to the agents of its world.
    pub const fn role(self) -> BodyRole {
        self.0.role
    }

    /// Returns whether it is an agent, whose trajectory is recorded.
    pub const fn is_agent(self) -> bool {
        matches!(self.0.role, BodyRole::Agent(_) | BodyRole::PartOfBody)
    }

    /// Returns whether it is an agent, or lines through the parts of one.
    pub const fn is_of_agent(self) -> bool {
        self.is_agent() || matches!(self.0.role, BodyRole::LineThroughParts(_))
    }
}

impl fmt::Debug for BodyKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for BodyKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl PartialEq for BodyKind {
    fn eq(&self, other: &Self) -> bool {
        // Two worlds may declare the same kind, and a constant may have several addresses.
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for BodyKind {}

impl PartialOrd for BodyKind {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for BodyKind {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_rank = self.0.rank.cmp(&other.0.rank);
        by_rank.then_with(|| self.name().cmp(other.name()))
    }
}

impl Hash for BodyKind {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name().hash(state);
    }
}

impl Serialize for BodyKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

thread_local! {
    /// The kinds that the names in a text stand for while [`Kinds::resolve_names_during`] reads it: Serde hands no
    /// context to the code that it derives.
    static READABLE: RefCell<Kinds> = const { RefCell::new(Kinds(Vec::new())) };
}

/// Reads a name; it stands for one of the kinds of [`Kinds::resolve_names_during`].
impl<'de> Deserialize<'de> for BodyKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let kind = READABLE.with_borrow(|kinds| kinds.find(&name));
        kind.ok_or_else(|| de::Error::custom(format!("there is no kind `{name}`")))
    }
}

/// Kinds that several worlds show.
impl BodyKind {
    /// An obstacle.
    pub const OBSTACLE: Self = Self::new(&KindSpec {
        name: "obstacle",
        noun: "obstacle",
        rank: 7,
        role: BodyRole::Thing,
        layer: 1,
        paint: Paint::Solid,
        outline: Outline::ThinShade,
        legend: LegendTexts {
            moving: "moving obstacle (arrow: way of 1 s)",
            ..LegendTexts::new("obstacle")
        },
        shows_heading: false,
    });

    /// A destination.
    pub const GOAL: Self = Self::new(&KindSpec {
        name: "goal",
        noun: "goal",
        rank: 8,
        role: BodyRole::Thing,
        layer: 2,
        paint: Paint::ByNumber { opacity: 0.45 },
        outline: Outline::Shade,
        legend: LegendTexts::new("goal"),
        shows_heading: false,
    });
}

/// The kinds of bodies that the worlds of a program show, by rank: names in files stand for these.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kinds(Vec<BodyKind>);

impl Kinds {
    /// Returns the list of these kinds, in which each occurs once.
    pub fn new(kinds: impl IntoIterator<Item = BodyKind>) -> Self {
        let distinct: BTreeSet<BodyKind> = kinds.into_iter().collect();
        Self(distinct.into_iter().collect())
    }

    /// Returns the kind with a name.
    pub fn find(&self, name: &str) -> Option<BodyKind> {
        self.iter().find(|kind| kind.name() == name)
    }

    /// Returns the kinds, by rank.
    pub fn iter(&self) -> impl Iterator<Item = BodyKind> + '_ {
        self.0.iter().copied()
    }

    /// Returns the kinds, by rank.
    pub fn as_slice(&self) -> &[BodyKind] {
        &self.0
    }

    /// Returns the names of the kinds.
    pub fn names(&self) -> Vec<&'static str> {
        self.iter().map(BodyKind::name).collect()
    }

    /// Reads a text with bodies, whose names of kinds stand for these: without this, the text of a body cannot be read.
    pub fn resolve_names_during<T>(&self, read: impl FnOnce() -> T) -> T {
        let _restorer = KindsRestorer { before: READABLE.replace(self.clone()) };
        read()
    }
}

/// Puts back the kinds that could be read before, also where the reader panics and a test or a server goes on.
struct KindsRestorer {
    before: Kinds,
}

impl Drop for KindsRestorer {
    fn drop(&mut self) {
        READABLE.set(Kinds(std::mem::take(&mut self.before.0)));
    }
}

/// Kinds for tests.
#[cfg(test)]
pub(super) mod samples {
    use super::{BodyKind, BodyRole, KindSpec, LegendTexts, Outline, Paint, TrailStyle};

    /// A robot.
    pub(crate) const ROBOT: BodyKind = BodyKind::new(&KindSpec {
        name: "robot",
        noun: "robot",
        rank: 0,
        role: BodyRole::Agent(TrailStyle::OnePerColor),
        layer: 5,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::Dark,
        legend: LegendTexts::AGENT,
        shows_heading: true,
    });

    /// A joint of a chain.
    pub(crate) const CONNECTOR: BodyKind = BodyKind::new(&KindSpec {
        name: "connector",
        noun: "chain",
        rank: 3,
        role: BodyRole::PartOfBody,
        layer: 5,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::Seam,
        legend: LegendTexts::AGENT,
        shows_heading: false,
    });

    /// The start of an airplane.
    pub(crate) const AIRPLANE_START: BodyKind = BodyKind::new(&KindSpec {
        name: "airplane-start",
        noun: "start",
        rank: 1,
        role: BodyRole::StartOf(AIRPLANE),
        layer: 1,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::White,
        legend: LegendTexts::AGENT,
        shows_heading: false,
    });

    /// An airplane.
    pub(crate) const AIRPLANE: BodyKind = BodyKind::new(&KindSpec {
        name: "airplane",
        noun: "airplane",
        rank: 5,
        role: BodyRole::Agent(TrailStyle::Lines),
        layer: 5,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::White,
        legend: LegendTexts::AGENT,
        shows_heading: false,
    });
}

#[cfg(test)]
mod tests {
    use super::super::BodyId;
    use super::samples::{AIRPLANE, CONNECTOR, ROBOT};
    use super::*;

    #[test]
    fn kinds_come_by_rank_and_are_found_by_name() {
        let kinds = Kinds::new([BodyKind::GOAL, CONNECTOR, ROBOT, BodyKind::GOAL]);
        assert_eq!(kinds.names(), ["robot", "connector", "goal"]);
        assert_eq!(kinds.find("connector"), Some(CONNECTOR));
        assert_eq!(kinds.parse_body_id("connector/0/7"), Some(BodyId::new(CONNECTOR, 0, Some(7))));
        assert_eq!(kinds.parse_body_id("robot/3"), Some(BodyId::new(ROBOT, 3, None)));
        for name in ["scenery", "robot", "robot/x", "robot/1/2/3", "cow/1", "airplane/0"] {
            assert_eq!(kinds.parse_body_id(name), None, "{name}");
        }
    }

    #[test]
    fn names_in_texts_stand_for_the_kinds_with_which_they_are_read() {
        let id = BodyId::new(AIRPLANE, 7, None);
        let text = serde_json::to_string(&id).expect("JSON");
        assert_eq!(text, r#"["airplane",7,null]"#);
        let read = || serde_json::from_str::<BodyId>(&text).ok();
        assert_eq!(Kinds::new([ROBOT, AIRPLANE]).resolve_names_during(read), Some(id));
        assert_eq!(Kinds::new([ROBOT]).resolve_names_during(read), None);
        assert_eq!(read(), None);
    }

    #[test]
    fn kinds_are_forgotten_after_a_reader_that_panics() {
        let read = || serde_json::from_str::<BodyId>(r#"["airplane",7,null]"#).ok();
        let result = std::panic::catch_unwind(|| {
            Kinds::new([AIRPLANE]).resolve_names_during(|| panic!("a reader that fails"));
        });
        assert!(result.is_err());
        assert_eq!(read(), None);
    }
}
