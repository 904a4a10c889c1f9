//! The look of each kind of body: one table for pictures, films and recordings for viewers.

use super::body::{Body, Condition, Kind};

/// Red, green and blue, 0 to 255 each.
pub type Color = [u8; 3];

/// Colors that distinguish numbered bodies: Okabe and Ito's, without yellow and black.
pub const COLORS: [Color; 6] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
];
/// Color of walls and everything else that stands still.
pub const WALL: Color = [0x3C, 0x3C, 0x3C];
/// Color of unmapped boxes.
pub const UNKNOWN: Color = [0xED, 0xEB, 0xE6];
/// Color of things that move but do not act.
pub const MOBILE: Color = [0xA6, 0xA6, 0xA6];
/// Color of doors.
pub const DOOR: Color = [0x8B, 0x5A, 0x2B];
/// Color of conditions that should not occur.
pub const ALERT: Color = [0xD0, 0x10, 0x10];

/// The look of a body, apart from its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Its color.
    pub color: Color,
    /// Opacity, from 0 (fully transparent) to 1 (opaque).
    pub opacity: f64,
    /// The drawing order: seen from above, higher layers cover lower ones.
    pub layer: u8,
    /// Its line in a legend; empty for agents, which have names of their own.
    pub words: &'static str,
}

/// Returns the color of the body with this number.
pub fn color_of(number: u32) -> Color {
    COLORS[number as usize % COLORS.len()]
}

impl Body {
    /// Returns its look in a world with this number of dimensions.
    pub fn appearance(&self, dimensions: u8) -> Appearance {
        let (color, opacity) = self.color(dimensions);
        let layer = match self.kind {
            Kind::Door | Kind::Obstacle => 1,
            Kind::Start | Kind::Goal => 2,
            Kind::Zone => 3,
            Kind::Person | Kind::Rods => 4,
            Kind::Robot | Kind::Connector | Kind::Airplane => 5,
        };
        Appearance { color, opacity, layer, words: self.words() }
    }

    fn color(&self, dimensions: u8) -> (Color, f64) {
        let own = color_of(self.number);
        // In space an opaque obstacle would hide everything behind it.
        let opacity = if dimensions == 2 { 1.0 } else { 0.22 };
        match (self.kind, self.state) {
            (Kind::Zone, Condition::Touching) => (ALERT, 0.4),
            (Kind::Zone, _) => (own, 0.15),
            (_, Condition::Touching | Condition::Failed) => (ALERT, 1.0),
            (Kind::Door, Condition::Open) => (DOOR, 0.25),
            (Kind::Door, _) => (DOOR, 1.0),
            (Kind::Person, _) => (MOBILE, 1.0),
            (Kind::Obstacle, _) if self.moves() => (MOBILE, opacity),
            (Kind::Obstacle, _) => (WALL, opacity),
            (Kind::Start, _) => (own, 0.1),
            (Kind::Goal, _) => (own, 0.45),
            (Kind::Robot | Kind::Connector | Kind::Rods | Kind::Airplane, _) => (own, 1.0),
        }
    }

    fn words(&self) -> &'static str {
        match (self.kind, self.state) {
            (Kind::Zone, Condition::Touching) => "separation lost",
            (Kind::Zone, _) => "zone of separation",
            (_, Condition::Touching) => "in contact",
            (_, Condition::Failed) => "failed",
            (Kind::Door, Condition::Open) => "door, open",
            (Kind::Door, _) => "door, closed",
            (Kind::Person, _) => "mobile object",
            (Kind::Obstacle, _) if self.moves() => "moving obstacle (arrow: way of 1 s)",
            (Kind::Obstacle, _) => "obstacle",
            (Kind::Start, _) => "start, as wide as its zone of separation",
            (Kind::Goal, _) => "goal",
            (Kind::Robot | Kind::Connector | Kind::Rods | Kind::Airplane, _) => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Pose, Shape};
    use super::*;

    #[test]
    fn what_should_not_be_looks_alike_whoever_it_is() {
        let body = |kind| Body::new(kind, 3, Pose::at([0.0; 3]), Shape::Sphere { radius_m: 1.0 });
        for kind in [Kind::Robot, Kind::Connector, Kind::Airplane] {
            let plain = body(kind);
            assert_eq!(plain.appearance(2).color, COLORS[3]);
            let touching = plain.when(true, Condition::Touching).appearance(2);
            assert_eq!((touching.color, touching.words), (ALERT, "in contact"));
        }
    }

    #[test]
    fn an_obstacle_hides_nothing_in_space_and_is_paler_when_it_moves() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        let still = Body::new(Kind::Obstacle, 0, Pose::at([0.0; 3]), ball);
        assert_eq!(still.appearance(2).opacity, 1.0);
        assert!(still.appearance(3).opacity < 0.5);
        let moving = still.clone().moving([0.0, 1.0, 0.0]);
        assert_eq!((still.appearance(2).color, moving.appearance(2).color), (WALL, MOBILE));
    }
}
