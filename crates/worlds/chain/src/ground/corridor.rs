//! Corridors: straight and bent legs between two walls (slides E2, N6).

use super::GroundPose;
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin};
use sidestep_rods::Obstacle;
use sidestep_rods::geometry::Point;

/// Approximate length of a piece of wall: bends are polygons of such pieces. The walls of the measurements had it.
pub const WALL_PIECE_M: f64 = 0.16;
/// Longest corridor; longer ones are taken as a mistake.
const MAX_LENGTH_M: f64 = 1e6;
/// Largest turn of a bend, degrees: ten times around; more is taken as a mistake.
const MAX_TURN_DEG: f64 = 3600.0;

/// A part of a corridor's center line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CorridorLeg {
    /// Along the heading at its start.
    Straight {
        /// Its length, meters, above 0.
        length_m: f64,
    },
    /// Along an arc of a circle.
    Bend {
        /// Radius of the center line, meters, above 0.
        radius_m: f64,
        /// Its angle, positive to the left, degrees.
        turn_deg: f64,
    },
}

impl CorridorLeg {
    /// Returns the length of the center line, and its turn to the left.
    fn length_and_turn(self) -> (f64, f64) {
        match self {
            Self::Straight { length_m } => (length_m, 0.0),
            Self::Bend { radius_m, turn_deg } => {
                let turn_rad = turn_deg.to_radians();
                (radius_m * turn_rad.abs(), turn_rad)
            }
        }
    }

    /// Returns its fault, if it has one.
    fn fault(self) -> Option<String> {
        match self {
            Self::Straight { length_m } if !is_valid_leg_length(length_m) => {
                Some(format!("has a length of {length_m} m"))
            }
            Self::Bend { radius_m, .. } if !is_valid_leg_length(radius_m) => {
                Some(format!("has a radius of {radius_m} m"))
            }
            Self::Bend { turn_deg, .. } if !is_valid_corridor_turn(turn_deg) => {
                Some(format!("turns by {turn_deg} degrees"))
            }
            _ => None,
        }
    }
}

fn is_valid_leg_length(length_m: f64) -> bool {
    length_m > 0.0 && length_m <= MAX_LENGTH_M
}

fn is_valid_corridor_turn(turn_deg: f64) -> bool {
    turn_deg != 0.0 && turn_deg.abs() <= MAX_TURN_DEG
}

fn corridor_error(place: String, cause: String) -> InputError {
    InputError::new(place, cause, "give it in meters above 0, turns in degrees")
}

/// Legs one after the other, from the origin along the first axis, with a wall on each side.
/// Both ends are open.
#[derive(Debug, Clone, PartialEq)]
pub struct Corridor {
    legs: Vec<CorridorLeg>,
    width_m: f64,
}

impl Corridor {
    /// Returns a corridor of a width. If a bend's radius is less than half the width, its inner
    /// wall crosses itself.
    ///
    /// # Errors
    /// When there is no leg, or a length, radius, turn or width is not positive (a turn: 0) or
    /// absurd.
    pub fn new(legs: Vec<CorridorLeg>, width_m: f64) -> Result<Self, InputError> {
        if !is_valid_leg_length(width_m) {
            return Err(corridor_error("corridor".into(), format!("has a width of {width_m} m")));
        }
        if legs.is_empty() {
            return Err(corridor_error("corridor".into(), "has no leg".into()));
        }
        for (k, leg) in legs.iter().enumerate() {
            if let Some(cause) = leg.fault() {
                return Err(corridor_error(format!("corridor, leg {k}"), cause));
            }
        }
        let corridor = Self { legs, width_m };
        let length_m = corridor.length_m();
        if length_m > MAX_LENGTH_M {
            return Err(corridor_error("corridor".into(), format!("is {length_m} m long")));
        }
        Ok(corridor)
    }

    /// Returns the corridor of the measurements: 14 m straight, 90 degrees left (radius 2 m), 90
    /// right (1.5), a U-turn (1.6), an S of 60, 120 and 60 degrees (1.3), a U-turn (2), 8 m
    /// straight.
    ///
    /// # Errors
    /// When the width is not positive.
    pub fn reference_corridor(width_m: f64) -> Result<Self, InputError> {
        let legs = vec![
            CorridorLeg::Straight { length_m: 14.0 },
            CorridorLeg::Bend { radius_m: 2.0, turn_deg: 90.0 },
            CorridorLeg::Bend { radius_m: 1.5, turn_deg: -90.0 },
            CorridorLeg::Bend { radius_m: 1.6, turn_deg: 180.0 },
            CorridorLeg::Bend { radius_m: 1.3, turn_deg: 60.0 },
            CorridorLeg::Bend { radius_m: 1.3, turn_deg: -120.0 },
            CorridorLeg::Bend { radius_m: 1.3, turn_deg: 60.0 },
            CorridorLeg::Bend { radius_m: 2.0, turn_deg: -180.0 },
            CorridorLeg::Straight { length_m: 8.0 },
        ];
        Self::new(legs, width_m)
    }

    /// Returns the legs, in order from the origin.
    pub fn legs(&self) -> &[CorridorLeg] {
        &self.legs
    }

    /// Returns the distance from wall to wall, meters.
    pub fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Returns the length of the center line, meters.
    pub fn length_m(&self) -> f64 {
        self.legs.iter().map(|leg| leg.length_and_turn().0).sum()
    }

    /// Returns poses along the center line, from its start to its end, at most `step_m` apart; the
    /// ends of legs are among them.
    ///
    /// # Panics
    /// If `step_m` is not positive.
    pub fn center_line(&self, step_m: f64) -> Vec<GroundPose> {
        assert!(step_m > 0.0, "poses lie apart");
        let mut line = vec![GroundPose { at: [0.0; 2], heading_rad: 0.0 }];
        for leg in &self.legs {
            let (length_m, turn_rad) = leg.length_and_turn();
            let n = (length_m / step_m).ceil();
            let ds_m = length_m / n;
            let turn_rad = turn_rad / n;
            for _ in 0..n as usize {
                let GroundPose { at: [x, y], heading_rad } = line[line.len() - 1];
                // A chord has the direction of its arc's middle, so the line does not drift off the bend.
                let middle_rad = heading_rad + 0.5 * turn_rad;
                line.push(GroundPose {
                    at: [x + ds_m * cos(middle_rad), y + ds_m * sin(middle_rad)],
                    heading_rad: heading_rad + turn_rad,
                });
            }
        }
        line
    }

    /// Returns its walls, without thickness, in pieces of about [`WALL_PIECE_M`]: first the right
    /// one, then the left one, numbered on from `first_id` in the direction of the corridor.
    pub fn walls(&self, first_id: u32) -> Vec<Obstacle<2>> {
        let line = self.center_line(WALL_PIECE_M);
        let mut walls = Vec::new();
        for side in [-1.0, 1.0] {
            for piece in line.windows(2) {
                let ends = [self.wall_point(piece[0], side), self.wall_point(piece[1], side)];
                walls.push(ends);
            }
        }
        (first_id..).zip(walls).map(|(id, ends)| Obstacle::capsule(id, ends, 0.0)).collect()
    }

    /// Returns the point of a wall beside a pose; `side` is 1 to the left, -1 to the right.
    fn wall_point(
        &self,
        GroundPose { at: [x, y], heading_rad }: GroundPose,
        side: f64,
    ) -> Point<2> {
        let half_m = 0.5 * self.width_m;
        [x - side * half_m * sin(heading_rad), y + side * half_m * cos(heading_rad)]
    }
}

#[cfg(test)]
mod pull_tests;
#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::Obstacles;
    use sidestep_rods::geometry::{ConvexCore, distance};

    fn leg() -> impl Strategy<Value = CorridorLeg> {
        prop_oneof![
            (0.1..5.0f64).prop_map(|length_m| CorridorLeg::Straight { length_m }),
            (1.0..3.0f64, prop_oneof![-180.0..-10.0f64, 10.0..180.0f64])
                .prop_map(|(radius_m, turn_deg)| CorridorLeg::Bend { radius_m, turn_deg }),
        ]
    }

    proptest! {
        #[test]
        fn the_line_is_as_long_as_its_legs_and_turns_as_they_do(
            legs in prop::collection::vec(leg(), 1..8), step_m in 0.02..0.3f64,
        ) {
            let corridor = Corridor::new(legs.clone(), 1.0).unwrap();
            let line = corridor.center_line(step_m);
            let way_m: f64 = line.windows(2).map(|w| distance(w[0].at, w[1].at)).sum();
            prop_assert!((way_m - corridor.length_m()).abs() < 1e-9);
            prop_assert!(line.windows(2).all(|w| distance(w[0].at, w[1].at) <= step_m + 1e-12));
            let turns = legs.iter().map(|leg| match leg {
                CorridorLeg::Straight { .. } => 0.0,
                CorridorLeg::Bend { turn_deg, .. } => turn_deg.to_radians(),
            });
            prop_assert!((line[line.len() - 1].heading_rad - turns.sum::<f64>()).abs() < 1e-9);
        }

        #[test]
        fn a_bend_ends_where_its_circle_says(radius_m in 0.5..5.0f64, turn_deg in 5.0..180.0f64) {
            let corridor = Corridor::new(vec![CorridorLeg::Bend { radius_m, turn_deg }], 1.0).unwrap();
            let line = corridor.center_line(0.01 * radius_m);
            let turn_rad = turn_deg.to_radians();
            let end = [radius_m * sin(turn_rad), radius_m * (1.0 - cos(turn_rad))];
            prop_assert!(distance(line[line.len() - 1].at, end) < 1e-4 * radius_m);
        }
    }

    #[test]
    fn walls_are_half_a_width_beside_the_line_and_closed() {
        let corridor = Corridor::reference_corridor(2.0).unwrap();
        let walls = corridor.walls(7);
        assert_eq!(walls.len(), 2 * (corridor.center_line(WALL_PIECE_M).len() - 1));
        assert!((7..).zip(&walls).all(|(id, wall)| wall.id == id));
        let ends: Vec<_> = walls
            .iter()
            .map(|wall| match wall.core {
                ConvexCore::Segment(ends) => ends,
                other => panic!("{other:?} is no wall"),
            })
            .collect();
        let breaks = ends.windows(2).filter(|w| w[0][1] != w[1][0]).count();
        assert_eq!(breaks, 1, "between the right wall and the left one");
        let all = Obstacles::new(walls, 1.0).unwrap();
        for pose in corridor.center_line(0.05) {
            let clearance_m = all.clearance_m([pose.at; 2], 0.0, 2.0);
            assert!((clearance_m - 1.0).abs() < 0.01, "{clearance_m} at {:?}", pose.at);
        }
    }

    #[test]
    fn impossible_corridors_are_refused() {
        let straight = |length_m| vec![CorridorLeg::Straight { length_m }];
        let bend = |radius_m, turn_deg| vec![CorridorLeg::Bend { radius_m, turn_deg }];
        assert!(Corridor::new(Vec::new(), 1.0).is_err());
        for width_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Corridor::new(straight(1.0), width_m).is_err());
            assert!(Corridor::new(straight(width_m), 1.0).is_err());
            assert!(Corridor::new(bend(width_m, 90.0), 1.0).is_err());
        }
        for turn_deg in [0.0, f64::NAN, f64::INFINITY, 1e9] {
            assert!(Corridor::new(bend(1.0, turn_deg), 1.0).is_err());
        }
        assert!(Corridor::new(straight(9e5).repeat(2), 1.0).is_err());
    }
}
