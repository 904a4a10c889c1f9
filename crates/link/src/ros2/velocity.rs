//! Velocities from outside, as orders to robots whose behavior is `external`.
//!
//! Robots move from box to box, so a velocity becomes the nearest of the actions that they have in a cycle. An order is part
//! of the run: it is recorded, and the run replays.

use sidestep::import::bag::cdr::decode;
use sidestep::kernel::control::{AgentTeam, ValueDomain};
use sidestep::kernel::{EntityId, Simulation};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::time::{Duration, Instant};

/// The name of the order that is an action.
pub const ACTION_ORDER: &str = "action";

/// Time for which a velocity counts, if no other one comes: as long as drivers of robots wait by default before they
/// stop.
const COMMAND_TIMEOUT: Duration = Duration::from_millis(500);

/// A velocity that a robot is asked for, in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    /// Ahead; backwards where it is negative.
    pub ahead_m_s: f64,
    /// The rate of turning to the left.
    pub turn_rad_s: f64,
}

impl Velocity {
    /// Reads a message `geometry_msgs/msg/Twist`: three velocities along x, y, z, and three rates about them. Robots move
    /// ahead and turn; `None` where the bytes are no such message, or a number is not finite.
    pub fn from_twist(bytes: &[u8]) -> Option<Self> {
        let numbers: [f64; 6] = decode(bytes).ok()?;
        let is_finite = numbers.iter().all(|number| number.is_finite());
        is_finite.then_some(Self { ahead_m_s: numbers[0], turn_rad_s: numbers[5] })
    }

    /// Returns the name of the nearest action, by the parts of a box and of a quarter turn that it would make in a cycle. What
    /// is less than half of either is nearer to no motion, and so is a way back, which is no action.
    pub fn nearest_action(&self, box_m: f64, cycle_s: f64) -> &'static str {
        const HALF: f64 = 0.5;
        let boxes = self.ahead_m_s * cycle_s / box_m;
        let quarters = self.turn_rad_s * cycle_s / FRAC_PI_2;
        match () {
            () if quarters.abs() >= HALF && quarters.abs() > boxes => {
                if quarters > 0.0 {
                    "left"
                } else {
                    "right"
                }
            }
            () if boxes >= HALF => "forward",
            () => "stay",
        }
    }
}

/// A robot that obeys velocities.
#[derive(Debug)]
struct ObedientRobot {
    /// The number of each action, by its name.
    actions: BTreeMap<String, f64>,
    /// The last velocity, the time at which it came, and whether no cycle has used it yet.
    last: Option<(Velocity, Instant, bool)>,
}

/// Orders of actions: one for each of some robots.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ActionOrders {
    /// The robots, in ascending order.
    pub robots: Vec<EntityId>,
    /// The numbers of their actions.
    pub actions: Vec<f64>,
}

/// The robots of a run that obey velocities.
#[derive(Debug)]
pub struct VelocityOrders {
    box_m: f64,
    cycle_s: f64,
    robots: BTreeMap<EntityId, ObedientRobot>,
}

impl VelocityOrders {
    /// Returns those of a run: none in other worlds than that of robots.
    pub fn new(run: &dyn Simulation) -> Self {
        let scenery = run.scenery();
        let mut robots = BTreeMap::new();
        // In a world without a floor there are no boxes from which an action would follow.
        let Some(floor) = &scenery.floor else {
            return Self { box_m: 1.0, cycle_s: scenery.cycle_s, robots };
        };
        for team in run.agent_teams() {
            let Some(actions) = actions_of(team) else { continue };
            for &robot in &team.agents {
                robots.insert(robot, ObedientRobot { actions: actions.clone(), last: None });
            }
        }
        Self { box_m: floor.box_m, cycle_s: scenery.cycle_s, robots }
    }

    /// Returns the robots, in ascending order.
    pub fn robots(&self) -> impl Iterator<Item = EntityId> {
        self.robots.keys().copied()
    }

    /// Receives a velocity for a robot.
    pub fn receive(&mut self, robot: EntityId, velocity: Velocity, now: Instant) {
        if let Some(robot) = self.robots.get_mut(&robot) {
            robot.last = Some((velocity, now, true));
        }
    }

    /// Forgets the velocity of a robot.
    pub fn forget(&mut self, robot: EntityId) {
        if let Some(robot) = self.robots.get_mut(&robot) {
            robot.last = None;
        }
    }

    /// Forgets all velocities.
    pub fn clear(&mut self) {
        self.robots.values_mut().for_each(|robot| robot.last = None);
    }

    /// Returns the orders for the next cycle. A velocity counts in at least one cycle; robots without one stay where they are.
    pub fn orders(&mut self, now: Instant) -> ActionOrders {
        let mut orders = ActionOrders::default();
        for (&id, robot) in &mut self.robots {
            let Some((velocity, came, is_new)) = &mut robot.last else { continue };
            if !*is_new && now.saturating_duration_since(*came) > COMMAND_TIMEOUT {
                robot.last = None;
                continue;
            }
            *is_new = false;
            let action = velocity.nearest_action(self.box_m, self.cycle_s);
            if let Some(number) = robot.actions.get(action) {
                orders.robots.push(id);
                orders.actions.push(*number);
            }
        }
        orders
    }
}

/// Returns the numbers of the actions of a team that takes actions as orders; `None` of another team.
fn actions_of(team: &AgentTeam) -> Option<BTreeMap<String, f64>> {
    let space = team.action_spaces.iter().find(|space| space.name == ACTION_ORDER)?;
    let ValueDomain::Discrete(names) = &space.kind else { return None };
    let numbers = (0_u32..).map(f64::from);
    Some(names.iter().cloned().zip(numbers).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::cdr::encode;

    #[test]
    fn a_velocity_becomes_the_nearest_action() {
        let action =
            |ahead_m_s, turn_rad_s| Velocity { ahead_m_s, turn_rad_s }.nearest_action(0.5, 2.0);
        assert_eq!(action(0.25, 0.0), "forward");
        assert_eq!(action(0.1, 0.0), "stay");
        assert_eq!(action(-1.0, 0.0), "stay");
        assert_eq!(action(0.0, 0.5), "left");
        assert_eq!(action(0.0, -0.5), "right");
        assert_eq!(action(0.0, 0.3), "stay");
        assert_eq!(action(0.25, 0.5), "forward", "a whole box is more than a part of a turn");
        assert_eq!(action(-0.25, 0.5), "left");
    }

    #[test]
    fn only_a_message_of_finite_numbers_is_a_velocity() {
        let twist = encode(&[0.5, 0.0, 0.0, 0.0, 0.0, -1.0]);
        let velocity = Velocity { ahead_m_s: 0.5, turn_rad_s: -1.0 };
        assert_eq!(Velocity::from_twist(&twist), Some(velocity));
        for end in 0..twist.len() {
            assert_eq!(Velocity::from_twist(&twist[..end]), None);
        }
        assert_eq!(Velocity::from_twist(&encode(&[0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0])), None);
    }

    #[test]
    fn a_velocity_counts_once_at_least_and_for_half_a_second() {
        let actions = BTreeMap::from([("forward".to_string(), 0.0), ("stay".to_string(), 3.0)]);
        let robots = BTreeMap::from([(4, ObedientRobot { actions, last: None })]);
        let mut orders = VelocityOrders { box_m: 0.5, cycle_s: 1.0, robots };
        let start = Instant::now();
        let none = ActionOrders::default();
        let one = |action| ActionOrders { robots: vec![4], actions: vec![action] };
        assert_eq!(orders.orders(start), none);
        orders.receive(4, Velocity { ahead_m_s: 0.5, turn_rad_s: 0.0 }, start);
        orders.receive(5, Velocity { ahead_m_s: 0.5, turn_rad_s: 0.0 }, start);
        let late = start + Duration::from_secs(9);
        assert_eq!(orders.orders(late), one(0.0), "no cycle has used it");
        assert_eq!(orders.orders(late), none);
        orders.receive(4, Velocity { ahead_m_s: 0.0, turn_rad_s: 0.0 }, start);
        assert_eq!(orders.orders(start), one(3.0));
        assert_eq!(orders.orders(start + COMMAND_TIMEOUT), one(3.0));
    }
}
