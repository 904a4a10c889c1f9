//! Joint trajectories from outside, for arms whose task is `external`: where all joints have to be at the end of each cycle is
//! an order. So the orders are part of the run, and it replays without the trajectories.

use sidestep::import::bag::cdr::decode;
use sidestep::import::bag::messages::JointTrajectory;
use sidestep::kernel::control::MultiAgentOrder;
use sidestep::kernel::view::JointValues;
use sidestep::kernel::{EntityId, Simulation};
use sidestep_session::ros::RunTopics;
use std::collections::{BTreeMap, BTreeSet};

/// The order that is where joints have to go.
pub const JOINTS_ORDER: &str = "joints";

/// Largest number of values in a trajectory: whoever reaches the network can send more.
const MAX_VALUES: usize = 1 << 20;

/// Difference from the last point up to which joints are there, in rad or m: rounding.
const THERE: f64 = 1e-9;

/// Reads a message `trajectory_msgs/msg/JointTrajectory`; `None` where the bytes are no such message, a number is not finite,
/// or there are too many.
pub fn read_trajectory(bytes: &[u8]) -> Option<JointTrajectory> {
    let message: JointTrajectory = decode(bytes).ok()?;
    let count: usize = message.points.iter().map(|point| point.positions.len()).sum();
    let mut positions = message.points.iter().flat_map(|point| &point.positions);
    (count <= MAX_VALUES && positions.all(|value| value.is_finite())).then_some(message)
}

/// A trajectory of all joints of an arm, from where it was when the trajectory came.
#[derive(Debug, Clone, PartialEq)]
struct Trajectory {
    /// Times in seconds of the run, rising.
    times_s: Vec<f64>,
    /// Values at these times.
    points: Vec<Vec<f64>>,
}

impl Trajectory {
    /// Returns the values at a time, in between along straight lines; the last ones from the last time on.
    fn at(&self, time_s: f64) -> Option<Vec<f64>> {
        let next = self.times_s.partition_point(|&point_s| point_s <= time_s);
        let Some(to) = self.points.get(next) else { return self.points.last().cloned() };
        let Some(before) = next.checked_sub(1) else { return self.points.first().cloned() };
        let from = &self.points[before];
        let span_s = self.times_s[next] - self.times_s[before];
        let share = (time_s - self.times_s[before]) / span_s;
        Some(from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect())
    }

    fn is_over(&self, time_s: f64, joints: &[f64]) -> bool {
        let is_late = self.times_s.last().is_none_or(|&last_s| time_s >= last_s);
        let last = self.points.last();
        let is_there = last.is_none_or(|last| {
            last.iter().zip(joints).all(|(wanted, value)| (wanted - value).abs() <= THERE)
        });
        is_late && is_there
    }
}

/// The arms of a run that obey trajectories.
#[derive(Debug, Default)]
pub struct TrajectoryOrders {
    arms: BTreeMap<EntityId, Option<Trajectory>>,
    accepted: u64,
    refused: u64,
    /// The last reason that was told.
    told: String,
}

impl TrajectoryOrders {
    /// Returns those of a run: none in other worlds than that of chains.
    pub fn new(run: &dyn Simulation) -> Self {
        let takes_joints =
            |space: &sidestep::kernel::control::ValueSpace| space.name == JOINTS_ORDER;
        let teams = run.agent_teams().iter();
        let teams = teams.filter(|team| team.action_spaces.iter().any(takes_joints));
        let arms = teams.flat_map(|team| &team.agents).map(|&arm| (arm, None)).collect();
        Self { arms, ..Self::default() }
    }

    /// Returns the arms, by the numbers of their chains, in ascending order.
    pub fn arms(&self) -> impl Iterator<Item = EntityId> {
        self.arms.keys().copied()
    }

    /// Returns the number of trajectories that were taken.
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Returns the number of trajectories that were refused.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Takes a trajectory for an arm in place of its last one. One that cannot be is refused, counted and told; the one before
    /// stays then.
    pub fn receive(
        &mut self,
        (run, topics): (&dyn Simulation, &RunTopics),
        arm: EntityId,
        message: &JointTrajectory,
    ) {
        let reason = match made(run, topics.arm_joints(arm), (arm, message)) {
            Ok(trajectory) => {
                self.accepted += 1;
                self.arms.insert(arm, Some(trajectory));
                return;
            }
            Err(reason) => format!("a trajectory of chain {arm} is refused: {reason}"),
        };
        self.refused += 1;
        // A sender that repeats itself is told once.
        if reason != self.told {
            tracing::warn!("{reason} ({} refused so far)", self.refused);
            self.told = reason;
        }
    }

    /// Forgets all trajectories.
    pub fn clear(&mut self) {
        self.arms.values_mut().for_each(|trajectory| *trajectory = None);
    }

    /// Returns the orders for the next cycle: where the joints of each arm with a trajectory have to be at its end.
    pub fn orders(
        &mut self,
        run: &dyn Simulation,
        topics: &RunTopics,
    ) -> Vec<(EntityId, Vec<f64>)> {
        let cycle_s = run.scenery().cycle_s;
        let now_s = run.cycle() as f64 * cycle_s;
        let mut orders = Vec::new();
        for (&arm, slot) in &mut self.arms {
            let Some(trajectory) = slot else { continue };
            let joints = topics.arm_joints(arm).map_or(&[][..], |joints| &joints.values);
            if trajectory.is_over(now_s, joints) {
                *slot = None;
                continue;
            }
            // Before its first time it rests where it is.
            let has_begun = trajectory.times_s.first().is_some_and(|&start_s| now_s >= start_s);
            let wanted = trajectory.at(now_s + cycle_s).filter(|_| has_begun);
            orders.extend(wanted.map(|wanted| (arm, wanted)));
        }
        orders
    }
}

/// Returns the trajectory of all joints that a message describes.
fn made(
    run: &dyn Simulation,
    joints: Option<&JointValues>,
    (arm, message): (EntityId, &JointTrajectory),
) -> Result<Trajectory, String> {
    let joints = joints.ok_or("where its joints are is not known yet")?;
    let places = joint_places(joints, &message.joint_names)?;
    let cycle_s = run.scenery().cycle_s;
    let now_s = run.cycle() as f64 * cycle_s;
    let stamp_s = message.header.stamp.secs();
    let end_s = run.config().cycles as f64 * cycle_s;
    if stamp_s > end_s {
        return Err(format!(
            "it begins at {stamp_s} s, and the run ends at {end_s} s; give a time of /clock, or 0 for now"
        ));
    }
    let start_s = now_s.max(stamp_s);
    let mut trajectory = Trajectory { times_s: vec![start_s], points: vec![joints.values.clone()] };
    if message.points.is_empty() {
        return Err("it has no points".into());
    }
    for (k, point) in message.points.iter().enumerate() {
        if point.positions.len() != places.len() {
            return Err(format!(
                "point {k} has {} positions; give {}, one for each of its joints",
                point.positions.len(),
                places.len()
            ));
        }
        let mut values = joints.values.clone();
        for (&place, &value) in places.iter().zip(&point.positions) {
            values[place] = value;
        }
        let order = MultiAgentOrder { order: JOINTS_ORDER, agents: &[arm], values: &values };
        run.check(&order).map_err(|error| format!("point {k}: {error}"))?;
        trajectory
            .add(start_s + point.time_from_start.secs(), values)
            .map_err(|cause| format!("point {k}: {cause}"))?;
    }
    Ok(trajectory)
}

impl Trajectory {
    /// Adds a point after the others; one at the very start takes the place of where the joints are.
    fn add(&mut self, time_s: f64, values: Vec<f64>) -> Result<(), &'static str> {
        let last_s = self.times_s.last().copied().unwrap_or(f64::NEG_INFINITY);
        let is_first = self.times_s.len() == 1;
        if is_first && time_s == last_s {
            self.points = vec![values];
            return Ok(());
        }
        if time_s <= last_s {
            return Err("its time is not after the one before; give rising times from the start");
        }
        self.times_s.push(time_s);
        self.points.push(values);
        Ok(())
    }
}

/// Returns the places of named joints among those of an arm.
fn joint_places(joints: &JointValues, names: &[String]) -> Result<Vec<usize>, String> {
    let mut places = Vec::new();
    let mut known = BTreeSet::new();
    for name in names {
        let place = joints.names.iter().position(|own| own == name);
        let Some(place) = place.filter(|place| known.insert(*place)) else {
            let name = name.escape_debug();
            return Err(format!(
                "`{name}` is no joint of it, or there twice; give some of {}",
                joints.names.join(", ")
            ));
        };
        places.push(place);
    }
    if places.is_empty() {
        return Err(format!("it names no joints; give some of {}", joints.names.join(", ")));
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::cdr::encode;
    use sidestep::import::bag::messages::{Header, JointTrajectoryPoint, Time};

    fn message(positions: &[f64]) -> JointTrajectory {
        let point = JointTrajectoryPoint {
            positions: positions.to_vec(),
            velocities: Vec::new(),
            accelerations: Vec::new(),
            effort: Vec::new(),
            time_from_start: Time::from_secs(2.0),
        };
        let header = Header { stamp: Time::from_secs(0.0), frame_id: String::new() };
        JointTrajectory { header, joint_names: vec!["a".into()], points: vec![point] }
    }

    #[test]
    fn values_between_two_points_are_on_a_line_and_stay_at_the_last() {
        let mut trajectory = Trajectory { times_s: vec![1.0], points: vec![vec![0.0, 4.0]] };
        assert!(trajectory.add(3.0, vec![1.0, 2.0]).is_ok());
        assert!(trajectory.add(3.0, vec![1.0, 2.0]).is_err(), "times rise");
        assert_eq!(trajectory.at(0.0), Some(vec![0.0, 4.0]));
        assert_eq!(trajectory.at(2.0), Some(vec![0.5, 3.0]));
        assert_eq!(trajectory.at(9.0), Some(vec![1.0, 2.0]));
        assert!(!trajectory.is_over(2.0, &[1.0, 2.0]));
        assert!(!trajectory.is_over(3.0, &[1.0, 1.9]), "joints that lag are still led");
        assert!(trajectory.is_over(3.0, &[1.0, 2.0]));
    }

    #[test]
    fn joints_are_known_by_their_names() {
        let names = ["a", "b", "c"].map(String::from).to_vec();
        let joints = JointValues { number: 0, names, values: vec![0.0; 3] };
        let places = |names: &[&str]| {
            joint_places(&joints, &names.iter().map(|&name| name.into()).collect::<Vec<String>>())
        };
        assert_eq!(places(&["c", "a"]), Ok(vec![2, 0]));
        assert!(places(&["d"]).is_err_and(|reason| reason.contains("a, b, c")));
        assert!(places(&["a", "a"]).is_err());
        assert!(places(&[]).is_err());
    }

    #[test]
    fn only_finite_numbers_are_a_trajectory() {
        assert_eq!(read_trajectory(&encode(&message(&[1.0]))), Some(message(&[1.0])));
        assert_eq!(read_trajectory(&encode(&message(&[f64::NAN]))), None);
        assert_eq!(read_trajectory(&[0, 1, 0, 0, 7]), None);
    }
}
