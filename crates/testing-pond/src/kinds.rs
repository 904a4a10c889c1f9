//! The kinds of bodies in a pond.

use sidestep_kernel::view::{
    BodyKind, BodyRole, KindSpec, LegendTexts, Outline, Paint, TrailStyle,
};

/// All kinds of bodies in this world.
pub(crate) const ALL: &[BodyKind] = &[FROG, BodyKind::OBSTACLE];

/// A frog.
pub const FROG: BodyKind = BodyKind::new(&KindSpec {
    name: "frog",
    noun: "frog",
    rank: 100,
    role: BodyRole::Agent(TrailStyle::OnePerColor),
    layer: 5,
    paint: Paint::ByNumber { opacity: 1.0 },
    outline: Outline::Dark,
    legend: LegendTexts::AGENT,
    shows_heading: false,
});
