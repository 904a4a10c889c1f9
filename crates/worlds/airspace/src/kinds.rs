//! The kinds of bodies in an airspace.

use sidestep_kernel::view::{
    BodyKind, BodyRole, KindSpec, LegendTexts, Outline, Paint, TrailStyle,
};

/// All kinds of bodies in this world.
pub(crate) const ALL: &[BodyKind] = &[AIRPLANE, ZONE, START, BodyKind::GOAL];

/// An airplane.
pub const AIRPLANE: BodyKind = BodyKind::new(&KindSpec {
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

/// The zone around an airplane that is to be kept free.
pub const ZONE: BodyKind = BodyKind::new(&KindSpec {
    name: "zone",
    noun: "zone",
    rank: 6,
    role: BodyRole::AroundAgent(AIRPLANE),
    layer: 3,
    paint: Paint::Veil,
    outline: Outline::Pale,
    legend: LegendTexts {
        touching: "separation lost",
        failed: "zone of separation",
        ..LegendTexts::new("zone of separation")
    },
    shows_heading: false,
});

/// A starting place.
pub const START: BodyKind = BodyKind::new(&KindSpec {
    name: "start",
    noun: "start",
    rank: 9,
    role: BodyRole::StartOf(AIRPLANE),
    layer: 2,
    paint: Paint::ByNumber { opacity: 0.1 },
    outline: Outline::Dashed,
    legend: LegendTexts::new("start, as wide as its zone of separation"),
    shows_heading: false,
});
