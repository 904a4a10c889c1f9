//! The kinds of bodies in a building.

use sidestep_kernel::view::{
    BodyKind, BodyRole, DOOR_COLOR, KindSpec, LegendTexts, MOBILE_COLOR, Outline, Paint, TrailStyle,
};

/// All kinds of bodies in this world.
pub(crate) const ALL: &[BodyKind] = &[ROBOT, PERSON, DOOR];

/// A robot.
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

/// A person, or another pedestrian.
pub const PERSON: BodyKind = BodyKind::new(&KindSpec {
    name: "person",
    noun: "person",
    rank: 1,
    role: BodyRole::MovesAmong(ROBOT),
    layer: 4,
    paint: Paint::Fixed { color: MOBILE_COLOR, open_opacity: 1.0 },
    outline: Outline::Shade,
    legend: LegendTexts::new("person"),
    shows_heading: false,
});

/// A door.
pub const DOOR: BodyKind = BodyKind::new(&KindSpec {
    name: "door",
    noun: "door",
    rank: 2,
    role: BodyRole::StandsAmong(ROBOT),
    layer: 1,
    paint: Paint::Fixed { color: DOOR_COLOR, open_opacity: 0.25 },
    outline: Outline::Shade,
    legend: LegendTexts { open: "door, open", ..LegendTexts::new("door, closed") },
    shows_heading: false,
});
