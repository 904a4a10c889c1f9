//! The kinds of bodies of chains.

use sidestep_kernel::view::{
    BodyKind, BodyRole, KindSpec, LegendTexts, Outline, Paint, TrailStyle,
};

/// All kinds of bodies in this world.
pub(crate) const ALL: &[BodyKind] = &[ROBOT, CONNECTOR, RODS, BodyKind::OBSTACLE, BodyKind::GOAL];

/// A robot on wheels that carries a joint of a chain: the same kind as in buildings.
pub const ROBOT: BodyKind = BodyKind::new(&KindSpec {
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
pub const CONNECTOR: BodyKind = BodyKind::new(&KindSpec {
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

/// The rods of a chain.
pub const RODS: BodyKind = BodyKind::new(&KindSpec {
    name: "rods",
    noun: "rods",
    rank: 4,
    role: BodyRole::LineThroughParts(CONNECTOR),
    layer: 4,
    paint: Paint::ByNumber { opacity: 1.0 },
    outline: Outline::None,
    legend: LegendTexts::AGENT,
    shows_heading: false,
});
