//! The appearance of each kind of body: one table for pictures, animations and recordings for viewers.

use super::body::{Body, BodyKind, Condition};

/// Red, green and blue, 0 to 255 each.
pub type Color = [u8; 3];

/// Colors that distinguish numbered bodies: Okabe and Ito's palette for all kinds of color vision, without yellow,
/// which is faint on white, and black, which is the color of text.
pub const BODY_COLORS: [Color; 6] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
];
/// Dark gray, for walls and everything else that stands still.
pub const WALL_COLOR: Color = [0x3C, 0x3C, 0x3C];
/// Nearly white, because a map may consist mostly of unmapped boxes.
pub const UNKNOWN_COLOR: Color = [0xED, 0xEB, 0xE6];
/// Light gray, for things that move but do not act.
pub const MOBILE_COLOR: Color = [0xA6, 0xA6, 0xA6];
/// Brown, like wood; an open door has a low opacity.
pub const DOOR_COLOR: Color = [0x8B, 0x5A, 0x2B];
/// Color of conditions that should not occur.
pub const ALERT_COLOR: Color = [0xD0, 0x10, 0x10];

/// The appearance of a body, apart from its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Its color, before the opacity is applied.
    pub color: Color,
    /// Opacity, from 0 (fully transparent) to 1 (opaque).
    pub opacity: f64,
    /// The drawing order: seen from above, higher layers cover lower ones.
    pub layer: u8,
    /// Its line in a legend; empty for agents, which have names of their own.
    pub legend: &'static str,
}

/// Returns the color of a number; numbers that differ by a multiple of six share one.
pub fn body_color(number: u32) -> Color {
    BODY_COLORS[number as usize % BODY_COLORS.len()]
}

impl Body {
    /// Returns its appearance: in three dimensions, obstacles let what is behind them show through.
    pub fn appearance(&self, dimensions: u8) -> Appearance {
        let (color, opacity) = self.color(dimensions);
        // Agents are on top, and what stands still at the bottom, because viewers follow what moves.
        let layer = match self.kind {
            BodyKind::Door | BodyKind::Obstacle => 1,
            BodyKind::Start | BodyKind::Goal => 2,
            BodyKind::Zone => 3,
            BodyKind::Person | BodyKind::Rods => 4,
            BodyKind::Robot | BodyKind::Connector | BodyKind::Airplane => 5,
        };
        Appearance { color, opacity, layer, legend: self.legend() }
    }

    fn color(&self, dimensions: u8) -> (Color, f64) {
        let own = body_color(self.number);
        // In space an opaque obstacle would hide everything behind it.
        let opacity = if dimensions == 2 { 1.0 } else { 0.22 };
        match (self.kind, self.state) {
            // Zones, starts and goals let the bodies within them show through.
            (BodyKind::Zone, Condition::Touching) => (ALERT_COLOR, 0.4),
            (BodyKind::Zone, _) => (own, 0.15),
            (_, Condition::Touching | Condition::Failed) => (ALERT_COLOR, 1.0),
            (BodyKind::Door, Condition::Open) => (DOOR_COLOR, 0.25),
            (BodyKind::Door, _) => (DOOR_COLOR, 1.0),
            (BodyKind::Person, _) => (MOBILE_COLOR, 1.0),
            (BodyKind::Obstacle, _) if self.is_moving() => (MOBILE_COLOR, opacity),
            (BodyKind::Obstacle, _) => (WALL_COLOR, opacity),
            (BodyKind::Start, _) => (own, 0.1),
            (BodyKind::Goal, _) => (own, 0.45),
            (BodyKind::Robot | BodyKind::Connector | BodyKind::Rods | BodyKind::Airplane, _) => {
                (own, 1.0)
            }
        }
    }

    fn legend(&self) -> &'static str {
        match (self.kind, self.state) {
            (BodyKind::Zone, Condition::Touching) => "separation lost",
            (BodyKind::Zone, _) => "zone of separation",
            (_, Condition::Touching) => "in contact",
            (_, Condition::Failed) => "failed",
            (BodyKind::Door, Condition::Open) => "door, open",
            (BodyKind::Door, _) => "door, closed",
            (BodyKind::Person, _) => "mobile object",
            (BodyKind::Obstacle, _) if self.is_moving() => "moving obstacle (arrow: way of 1 s)",
            (BodyKind::Obstacle, _) => "obstacle",
            (BodyKind::Start, _) => "start, as wide as its zone of separation",
            (BodyKind::Goal, _) => "goal",
            (BodyKind::Robot | BodyKind::Connector | BodyKind::Rods | BodyKind::Airplane, _) => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Pose, Shape};
    use super::*;

    #[test]
    fn what_should_not_be_looks_alike_whoever_it_is() {
        let body = |kind| {
            Body::new(kind, 3, Pose::from_position([0.0; 3]), Shape::Sphere { radius_m: 1.0 })
        };
        for kind in [BodyKind::Robot, BodyKind::Connector, BodyKind::Airplane] {
            let plain = body(kind);
            assert_eq!(plain.appearance(2).color, BODY_COLORS[3]);
            let touching = plain.with_state_if(true, Condition::Touching).appearance(2);
            assert_eq!((touching.color, touching.legend), (ALERT_COLOR, "in contact"));
        }
    }

    #[test]
    fn an_obstacle_hides_nothing_in_space_and_is_paler_when_it_moves() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        let still = Body::new(BodyKind::Obstacle, 0, Pose::from_position([0.0; 3]), ball);
        assert_eq!(still.appearance(2).opacity, 1.0);
        assert!(still.appearance(3).opacity < 0.5);
        let moving = still.clone().with_velocity([0.0, 1.0, 0.0]);
        assert_eq!(
            (still.appearance(2).color, moving.appearance(2).color),
            (WALL_COLOR, MOBILE_COLOR)
        );
    }
}
