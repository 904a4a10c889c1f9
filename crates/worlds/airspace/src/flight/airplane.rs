//! Airplanes as a scenario gives them, and as their group knows them.

use super::change::ChangeAlternatives;
use super::command::{CommandKinds, CommandLimits, LevelCommand, MethodCommand};
use super::levels::FlightLevelRange;
use super::motion::{AircraftModel, Point, Pose2};
use super::order::{FlightOrder, FlightTask};
use super::performance::Performance;
use super::track::Track;
use sidestep_kernel::EntitySlot;

/// One airplane at its start.
#[derive(Debug, Clone, PartialEq)]
pub struct AirplaneStart {
    /// Its call sign; `None` where only its id identifies it.
    pub callsign: Option<String>,
    /// Its abilities, with the speed that it has until an order changes it.
    pub model: AircraftModel,
    /// What it can fly.
    pub performance: Performance,
    /// The pose in which it appears.
    pub start: Pose2,
    /// Way-points in the order in which it has to reach them.
    pub mission: Vec<Point>,
    /// Those of its way-points, under any orders, that only lead around areas.
    pub detours: Vec<Point>,
    /// Altitude in meters of the level on which the method takes it over.
    pub altitude_m: f64,
    /// Time of its appearance, in seconds after the start of the run.
    pub appears_s: f64,
    /// Time at which it vanishes, in seconds after the start of the run; infinite for never.
    pub leaves_s: f64,
    /// Orders in flight, by rising time.
    pub orders: Vec<FlightOrder>,
    /// Its recorded track, which it follows until the method takes it over.
    pub track: Option<Track>,
    /// Whether it avoids nobody: it flies its recorded track to the end, or straight from way-point to way-point.
    pub is_non_cooperative: bool,
    /// Its priority: it has right of way over airplanes with a smaller one.
    pub priority: u8,
    /// The changes of level and speed among which method `pc` chooses for it.
    pub changes: ChangeAlternatives,
    /// The smallest and the largest airspeed that a method may command of it, in meters per second; none if none does.
    pub commanded_speeds_m_s: Option<[f64; 2]>,
}

impl AirplaneStart {
    /// Returns whether it keeps a heading, and flies to no way-point, after its first `done` orders.
    pub(crate) fn has_fixed_heading(&self, done: usize) -> bool {
        let last_direction = self.orders.iter().take(done).rev().find(|order| {
            matches!(
                order.task,
                FlightTask::Heading(_) | FlightTask::Proceed | FlightTask::WayPoints(_)
            )
        });
        last_direction.is_some_and(|order| matches!(order.task, FlightTask::Heading(_)))
    }

    /// Returns the order after the first `done` ones, if its time has come. Of an airplane that accelerates only the
    /// first change of speed of a cycle is due: after orders that had to wait, one would follow the other at once.
    pub(crate) fn due_order(&self, done: DoneOrders, now_s: f64) -> Option<&FlightOrder> {
        let DoneOrders { count, has_changed_speed } = done;
        let must_wait = |task: &FlightTask| {
            has_changed_speed && self.performance.accelerates() && task.speed_m_s().is_some()
        };
        self.orders.get(count).filter(|order| order.at_s <= now_s && !must_wait(&order.task))
    }

    /// Returns the number of orders among the first `count`, without the speeds on the way to one.
    pub(crate) fn whole_orders(&self, count: u16) -> u16 {
        if !self.performance.accelerates() {
            return count;
        }
        let done = self.orders.iter().take(count.into());
        done.filter(|order| !matches!(order.task, FlightTask::Acceleration(_))).count() as u16
    }

    /// Returns the speeds with which it is planned to fly, in meters per second: that at its start and those of its
    /// orders.
    pub(crate) fn planned_speeds_m_s(&self) -> impl Iterator<Item = f64> {
        self.filed_speeds_m_s().chain(self.commanded_speeds_m_s.into_iter().flatten())
    }

    /// Returns the speed at its start and those of its orders, in meters per second.
    pub(crate) fn filed_speeds_m_s(&self) -> impl Iterator<Item = f64> {
        let ordered = self.orders.iter().filter_map(|order| order.task.speed_m_s());
        ordered.chain([self.model.v_m_s])
    }

    /// Lets a method command of it what it commands at all, within what it can fly.
    pub(crate) fn allow_commands(&mut self, kinds: CommandKinds) {
        let Performance { v_min_m_s, v_max_m_s, .. } = self.performance;
        let speeds_m_s = kinds
            .speeds
            .and_then(|factors| factors.speeds_m_s(self.filed_speeds_m_s(), v_min_m_s..=v_max_m_s));
        self.commanded_speeds_m_s = speeds_m_s.map(|range| [*range.start(), *range.end()]);
    }

    /// Lets a method choose among its changes of speed, too.
    pub(crate) fn allow_changes(&mut self) {
        let Performance { v_min_m_s, v_max_m_s, .. } = self.performance;
        for filed_m_s in self.filed_speeds_m_s().collect::<Vec<f64>>() {
            for change_m_s in &self.changes.speeds_m_s {
                let v_m_s = (filed_m_s + change_m_s).max(v_min_m_s).min(v_max_m_s);
                let [from, to] = self.commanded_speeds_m_s.unwrap_or([filed_m_s; 2]);
                self.commanded_speeds_m_s = Some([from.min(v_m_s), to.max(v_m_s)]);
            }
        }
    }

    /// Returns a command within what it can fly, and what a method may command of it.
    pub(crate) fn limited_command(&self, command: MethodCommand) -> MethodCommand {
        let Performance { floor_m, ceiling_m, .. } = self.performance;
        let level = command.level.map(|level| LevelCommand {
            altitude_m: level.altitude_m.max(floor_m).min(ceiling_m),
            ..level
        });
        let limits_m_s = self.commanded_speeds_m_s;
        let v_m_s = command.v_m_s.zip(limits_m_s);
        MethodCommand { level, v_m_s: v_m_s.map(|(v_m_s, [from, to])| v_m_s.clamp(from, to)) }
    }

    /// Returns the commands of some kinds that may be in force for it.
    pub(crate) fn command_limits(&self, kinds: CommandKinds) -> CommandLimits {
        let Performance { floor_m, ceiling_m, .. } = self.performance;
        let ordered = self.orders.iter().filter_map(|order| match order.task {
            FlightTask::Altitude { altitude_m, .. } => Some(altitude_m),
            _ => None,
        });
        let flyable = FlightLevelRange { low_m: floor_m, high_m: ceiling_m };
        // A filed level may be beyond its limits, and it goes back to it.
        let filed = ordered.chain([self.altitude_m]);
        let levels = filed.fold(flyable, FlightLevelRange::extended_by_level);
        let speeds_m_s = self
            .planned_speeds_m_s()
            .fold([f64::INFINITY, 0.0], |[low, high], v_m_s| [low.min(v_m_s), high.max(v_m_s)]);
        CommandLimits { kinds, levels, speeds_m_s }
    }

    /// Returns its model with the turn rate that it can fly at any of its planned speeds.
    pub(crate) fn least_turning_model(&self) -> AircraftModel {
        let turn = &self.performance.turn;
        let rates = self.planned_speeds_m_s().map(|v_m_s| turn.omega_rad_s(v_m_s));
        let omega_max_rad_s = rates.fold(self.model.omega_max_rad_s, f64::min);
        AircraftModel { omega_max_rad_s, ..self.model.clone() }
    }
}

/// The orders that an airplane has carried out when it looks for the next one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DoneOrders {
    /// Their number.
    pub(crate) count: usize,
    /// Whether one of this cycle has changed its speed.
    pub(crate) has_changed_speed: bool,
}

impl DoneOrders {
    /// Returns those at the start of a cycle.
    pub(crate) fn at_cycle_start(count: usize) -> Self {
        Self { count, has_changed_speed: false }
    }

    /// Returns those after one more.
    #[must_use]
    pub(crate) fn and(self, order: &FlightOrder) -> Self {
        let changes_speed = order.task.speed_m_s().is_some();
        Self { count: self.count + 1, has_changed_speed: self.has_changed_speed || changes_speed }
    }
}

/// An airplane of a group, as the group knows it.
#[derive(Debug, Clone, Copy)]
pub struct KnownAircraft {
    /// Slot of the airplane, which is its id.
    pub slot: EntitySlot,
    /// Its pose as all see it, with the error of the cycle.
    pub pose: Pose2,
    /// Number of way-points done with.
    pub next: usize,
    /// Number of orders carried out.
    pub orders: u32,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// The command of its method that is in force.
    pub command: MethodCommand,
}
