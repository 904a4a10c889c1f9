//! The kinds of bodies in an airspace.

use sidestep_kernel::view::{
    BodyKind, BodyRole, KindSpec, LegendTexts, Outline, Paint, TrailStyle, WALL_COLOR,
};

/// All kinds of bodies in this world.
pub(crate) const ALL: &[BodyKind] = &[AIRPLANE, ZONE, START, AREA, BodyKind::GOAL];

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

/// The border of an area; that of an area to stay inside of is open.
pub const AREA: BodyKind = BodyKind::new(&KindSpec {
    name: "area",
    noun: "area",
    rank: 10,
    role: BodyRole::Thing,
    layer: 1,
    paint: Paint::Fixed { color: WALL_COLOR, open_opacity: 1.0 },
    outline: Outline::None,
    legend: LegendTexts {
        open: "area to stay inside of",
        ..LegendTexts::new("area to stay out of")
    },
    shows_heading: false,
});
