//! The appearance of each kind of body: one table for pictures, animations and recordings for viewers.

use super::body::{Body, BodyCondition};
use super::color::{ALERT_COLOR, Color, MOBILE_COLOR, WALL_COLOR, body_color};
use super::kind::Paint;

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

impl Body {
    /// Returns its appearance: in three dimensions, obstacles let what is behind them show through.
    pub fn appearance(&self, dimensions: u8) -> Appearance {
        let (color, opacity) = self.color(dimensions);
        Appearance { color, opacity, layer: self.kind.spec().layer, legend: self.legend_text() }
    }

    fn color(&self, dimensions: u8) -> (Color, f64) {
        let own = body_color(self.number);
        let is_alert = matches!(self.state, BodyCondition::Touching | BodyCondition::Failed);
        match self.kind.spec().paint {
            Paint::Veil if self.state == BodyCondition::Touching => (ALERT_COLOR, 0.4),
            Paint::Veil => (own, 0.15),
            _ if is_alert => (ALERT_COLOR, 1.0),
            Paint::ByNumber { opacity } => (own, opacity),
            Paint::Fixed { color, open_opacity } if self.state == BodyCondition::Open => {
                (color, open_opacity)
            }
            Paint::Fixed { color, .. } => (color, 1.0),
            Paint::Solid => {
                let color = if self.is_moving() { MOBILE_COLOR } else { WALL_COLOR };
                // In space an opaque obstacle would hide everything behind it.
                let opacity = if dimensions == 2 { 1.0 } else { 0.22 };
                (color, opacity)
            }
        }
    }

    fn legend_text(&self) -> &'static str {
        let legend = &self.kind.spec().legend;
        match self.state {
            BodyCondition::Touching => legend.touching,
            BodyCondition::Failed => legend.failed,
            _ if self.is_moving() => legend.moving,
            BodyCondition::Open => legend.open,
            BodyCondition::Plain | BodyCondition::Leading => legend.plain,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kind::samples::{AIRPLANE, CONNECTOR, ROBOT};
    use super::super::{BODY_COLORS, BodyKind, Pose, Shape};
    use super::*;

    #[test]
    fn what_should_not_be_looks_alike_whoever_it_is() {
        let body = |kind| {
            Body::new(kind, 3, Pose::from_position([0.0; 3]), Shape::Sphere { radius_m: 1.0 })
        };
        for kind in [ROBOT, CONNECTOR, AIRPLANE] {
            let plain = body(kind);
            assert_eq!(plain.appearance(2).color, BODY_COLORS[3]);
            let touching = plain.with_condition_if(true, BodyCondition::Touching).appearance(2);
            assert_eq!((touching.color, touching.legend), (ALERT_COLOR, "in contact"));
        }
    }

    #[test]
    fn an_obstacle_hides_nothing_in_space_and_is_paler_when_it_moves() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        let still = Body::new(BodyKind::OBSTACLE, 0, Pose::from_position([0.0; 3]), ball);
        assert_eq!(still.appearance(2).opacity, 1.0);
        assert!(still.appearance(3).opacity < 0.5);
        let moving = still.clone().with_velocity([0.0, 1.0, 0.0]);
        assert_eq!(
            (still.appearance(2).color, moving.appearance(2).color),
            (WALL_COLOR, MOBILE_COLOR)
        );
    }
}
