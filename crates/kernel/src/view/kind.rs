//! Kinds of bodies, which worlds declare: all that other code needs to show a body of a kind.

use super::appearance::{Color, DOOR_COLOR, MOBILE_COLOR};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::cmp::Ordering;
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
    pub role: Role,
    /// The drawing order: seen from above, higher layers cover lower ones.
    pub layer: u8,
    /// Its color.
    pub paint: Paint,
    /// The line around it.
    pub outline: Outline,
    /// Its lines in a legend.
    pub legend: Legend,
    /// Whether a mark on the body shows its heading.
    pub shows_heading: bool,
}

/// The relation of a kind of bodies to the agents of its world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
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
pub struct Legend {
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

impl Legend {
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
    pub const fn role(self) -> Role {
        self.0.role
    }

    /// Returns whether it is an agent, whose trajectory is recorded.
    pub const fn is_agent(self) -> bool {
        matches!(self.0.role, Role::Agent(_) | Role::PartOfBody)
    }

    /// Returns whether it is an agent, or lines through the parts of one.
    pub const fn is_of_agent(self) -> bool {
        self.is_agent() || matches!(self.0.role, Role::LineThroughParts(_))
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

impl<'de> Deserialize<'de> for BodyKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::from_name(&name)
            .ok_or_else(|| de::Error::custom(format!("there is no kind `{name}`")))
    }
}

impl BodyKind {
    /// A robot.
    pub const ROBOT: Self = Self::new(&KindSpec {
        name: "robot",
        noun: "robot",
        rank: 0,
        role: Role::Agent(TrailStyle::OnePerColor),
        layer: 5,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::Dark,
        legend: Legend::AGENT,
        shows_heading: true,
    });

    /// A person, or another pedestrian.
    pub const PERSON: Self = Self::new(&KindSpec {
        name: "person",
        noun: "person",
        rank: 1,
        role: Role::MovesAmong(Self::ROBOT),
        layer: 4,
        paint: Paint::Fixed { color: MOBILE_COLOR, open_opacity: 1.0 },
        outline: Outline::Shade,
        legend: Legend::new("mobile object"),
        shows_heading: false,
    });

    /// A door.
    pub const DOOR: Self = Self::new(&KindSpec {
        name: "door",
        noun: "door",
        rank: 2,
        role: Role::StandsAmong(Self::ROBOT),
        layer: 1,
        paint: Paint::Fixed { color: DOOR_COLOR, open_opacity: 0.25 },
        outline: Outline::Shade,
        legend: Legend { open: "door, open", ..Legend::new("door, closed") },
        shows_heading: false,
    });

    /// A joint of a chain.
    pub const CONNECTOR: Self = Self::new(&KindSpec {
        name: "connector",
        noun: "chain",
        rank: 3,
        role: Role::PartOfBody,
        layer: 5,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::Seam,
        legend: Legend::AGENT,
        shows_heading: false,
    });

    /// The rods of a chain.
    pub const RODS: Self = Self::new(&KindSpec {
        name: "rods",
        noun: "rods",
        rank: 4,
        role: Role::LineThroughParts(Self::CONNECTOR),
        layer: 4,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::None,
        legend: Legend::AGENT,
        shows_heading: false,
    });

    /// An airplane.
    pub const AIRPLANE: Self = Self::new(&KindSpec {
        name: "airplane",
        noun: "airplane",
        rank: 5,
        role: Role::Agent(TrailStyle::Lines),
        layer: 5,
        paint: Paint::ByNumber { opacity: 1.0 },
        outline: Outline::White,
        legend: Legend::AGENT,
        shows_heading: false,
    });

    /// The zone around an airplane that is to be kept free.
    pub const ZONE: Self = Self::new(&KindSpec {
        name: "zone",
        noun: "zone",
        rank: 6,
        role: Role::AroundAgent(Self::AIRPLANE),
        layer: 3,
        paint: Paint::Veil,
        outline: Outline::Pale,
        legend: Legend {
            touching: "separation lost",
            failed: "zone of separation",
            ..Legend::new("zone of separation")
        },
        shows_heading: false,
    });

    /// An obstacle.
    pub const OBSTACLE: Self = Self::new(&KindSpec {
        name: "obstacle",
        noun: "obstacle",
        rank: 7,
        role: Role::Thing,
        layer: 1,
        paint: Paint::Solid,
        outline: Outline::ThinShade,
        legend: Legend { moving: "moving obstacle (arrow: way of 1 s)", ..Legend::new("obstacle") },
        shows_heading: false,
    });

    /// A destination.
    pub const GOAL: Self = Self::new(&KindSpec {
        name: "goal",
        noun: "goal",
        rank: 8,
        role: Role::Thing,
        layer: 2,
        paint: Paint::ByNumber { opacity: 0.45 },
        outline: Outline::Shade,
        legend: Legend::new("goal"),
        shows_heading: false,
    });

    /// A starting place.
    pub const START: Self = Self::new(&KindSpec {
        name: "start",
        noun: "start",
        rank: 9,
        role: Role::StartOf(Self::AIRPLANE),
        layer: 2,
        paint: Paint::ByNumber { opacity: 0.1 },
        outline: Outline::Dashed,
        legend: Legend::new("start, as wide as its zone of separation"),
        shows_heading: false,
    });

    /// All kinds.
    pub const ALL: [Self; 10] = [
        Self::ROBOT,
        Self::PERSON,
        Self::DOOR,
        Self::CONNECTOR,
        Self::RODS,
        Self::AIRPLANE,
        Self::ZONE,
        Self::OBSTACLE,
        Self::GOAL,
        Self::START,
    ];

    /// Returns the kind with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}
