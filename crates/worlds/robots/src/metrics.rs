//! The metrics of a run: per robot, and in total.

use super::perceive::memory_of;
use super::state::{BodyState, RobotsState};
use super::world::{RobotsWorld, Role};
use serde::Serialize;
use sidestep_kernel::{Cycle, EntityId, Run, RunStats};
use sidestep_scenario::metrics;
use std::collections::BTreeMap;

metrics! {
    /// Counters of one robot, or their sums over all robots.
    #[derive(Debug, Clone, PartialEq, Default, Serialize)]
    pub struct Counters {
        /// Actions started, of all robots.
        pub actions: u64 => "actions",
        /// Contacts.
        pub contacts: u64 => "contacts",
        /// Contacts by the kind touched; 0 for kinds never touched.
        pub contacts_by_kind.*: BTreeMap<String, u64> => "contacts with *",
        /// Way of all robots together. In meters.
        pub distance_m: f64 => "way of all robots",
        /// Trips completed.
        pub trips: u64 => "trips completed",
        /// Mean length of a completed trip; none without trips.
        pub trip_cycles_mean: Option<f64> => "mean length of a trip" ("cycles"),
        /// Trips under way when the run ended, whose length is not in the mean. It is too low where slow ones are among them.
        pub trips_under_way: u64 => "trips under way",
        /// Estimate of the mean trip that counts those under way: time on all trips, by trips completed; none without
        /// these.
        pub trip_cycles_estimate: Option<f64> => "mean length of a trip with those under way" ("cycles"),
        /// Share of the turns of robots with a goal in which they neither moved nor turned, 0 to 1, delays included.
        pub waiting_share: Option<f64> => "share of turns waited",
        /// Boxes that no robot had covered before.
        pub first_visits: u64 => "boxes covered for the first time",
        /// Cycles in which a robot was delayed, of all robots; 0 unless an effector has delays.
        pub delayed_cycles: u64 => "delays of all robots",
        /// Times that a robot was elsewhere than its planner had planned, of all robots; 0 without `[robots.planner]`.
        pub off_plan: u64 => "times off the plan",
    }
}

metrics! {
    /// Metrics of a run so far.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct Metrics {
        /// Sums over all robots.
        #[serde(flatten)]
        pub total: Counters,
        /// Plans that planners have searched: those of `pibt` one for each team and cycle in which it acts; 0 without
        /// `[robots.planner]`.
        pub plans: u64 => "searches of planners",
        /// Searches that gave no plan, after which priority inheritance led the team for some steps; 0 without
        /// `[robots.planner]`.
        pub plan_failures: u64 => "searches without a plan",
        /// Expansions of all searches, and orders of `prioritized`; 0 of `pibt`, which searches nothing.
        pub plan_expansions: u64 => "expansions of planners",
        /// Costs of all plans above the sum of shortest paths with turns, of which 0.1 is 10 %; none without plans.
        pub plan_cost_gap: Option<f64> => "cost of plans above the lower bound",
        /// Processor time of all planners. It differs from run to run, and nothing depends on it.
        pub plan_cpu_s: f64 => "time spent planning",
        /// Tasks that robots have finished; 0 without `tasks` in a section of robots.
        pub tasks_finished: u64 => "tasks finished",
        /// Tasks that are known to a team and not finished.
        pub tasks_open: u64 => "open tasks",
        /// Share of the free boxes that a robot has covered, 0 to 1. Boxes that robots stand in at the start count.
        pub coverage: f64 => "share of the floor covered",
        /// Share of actions that ended in a contact, 0 to 1.
        pub contacts_per_action: f64 => "contacts per action",
        /// Conflict groups of 1, 2-3, 4-7, ... bodies, over all cycles.
        pub group_sizes: Vec<u64> => "conflict groups by size",
        /// Bodies of the largest conflict group; 0 where no two ever met.
        pub largest_group: u64 => "largest conflict group" ("bodies"),
        /// Gridlocks begun: robots that wait for each other in a circle, and those that wait for them.
        pub gridlocks: u64 => "gridlocks",
        /// Robots in a gridlock at the end.
        pub robots_in_gridlock: u64 => "robots in a gridlock",
        /// Cycle after which the first gridlock was found; none without one.
        pub first_gridlock_cycle: Option<u64> => "cycle of the first gridlock",
    }
}

impl RobotsWorld {
    /// Returns the counters of a robot. `cycle` counts its actions, and must be that of `state`.
    pub fn counts(&self, state: &RobotsState, cycle: Cycle, id: EntityId) -> Counters {
        let first_contact = id as usize * self.kinds.len();
        let mut contacts = 0;
        let mut contacts_by_kind = BTreeMap::new();
        for (kind, name) in self.kinds.iter().enumerate() {
            let count = u64::from(state.contacts.get(first_contact + kind));
            contacts += count;
            contacts_by_kind.insert(name.clone(), count);
        }
        let body = state.body(id);
        let trips = u64::from(body.trips.get());
        Counters {
            actions: self.actions(state, cycle, id),
            contacts,
            contacts_by_kind,
            distance_m: f64::from(body.moves.get()) * self.map.box_size_m,
            trips,
            trip_cycles_mean: ratio(body.trip_cycles.get(), trips),
            trip_cycles_estimate: ratio(self.cycles_on_trips(body, cycle), trips),
            waiting_share: ratio(state.waits_of(id), self.turns_with_goal(body, cycle)),
            trips_under_way: u64::from(self.is_on_trip(body)),
            first_visits: u64::from(body.first_visits.get()),
            delayed_cycles: u64::from(state.delays.total(id)),
            off_plan: u64::from(state.off_plan(self, id)),
        }
    }

    /// Returns the actions of a robot before a cycle, without turns that a delay or an action that went on took from it.
    fn actions(&self, state: &RobotsState, cycle: Cycle, id: EntityId) -> u64 {
        let due = self.bodies[id as usize].actions_before(cycle);
        due - u64::from(state.delays.missed(id)) - u64::from(state.action_progress.busy(id))
    }

    /// Returns whether a robot is on a trip. Of one whose actions are ordered, the orders tell: its last trip ended when the
    /// next one began.
    fn is_on_trip(&self, body: &BodyState) -> bool {
        let Role::Robot(model) = &self.type_of(body.id).role else { return false };
        let has_ordered_trips = body.trips.get() > 0 || body.trip_begun.get() > 0;
        let is_by_order = model.behaviour.is_external() && has_ordered_trips;
        model.behaviour.is_on_trip(&memory_of(body)) || is_by_order
    }

    /// Returns the cycles that a robot spent on trips, the one under way included.
    fn cycles_on_trips(&self, body: &BodyState, cycle: Cycle) -> u64 {
        let since = if self.is_on_trip(body) { body.trip_begun.get() } else { cycle };
        body.trip_cycles.get() + cycle.saturating_sub(since)
    }

    /// Returns the turns of a robot in which it had a goal. One that has no goal left stopped at the end of its last
    /// trip.
    fn turns_with_goal(&self, body: &BodyState, cycle: Cycle) -> u64 {
        if self.goal_robots.binary_search(&body.id).is_err() {
            return 0;
        }
        let end = if self.has_goal(body) { cycle } else { body.trip_begun.get() };
        self.bodies[body.id as usize].actions_before(end)
    }

    /// Returns the counters of all robots together after `cycle` cycles. Names of kinds are looked up once, and not for
    /// every robot: a recorded run does this a thousand times.
    pub fn totals(&self, state: &RobotsState, cycle: Cycle) -> Counters {
        let mut total = Counters::default();
        let [mut trip_cycles, mut cycles_on_trips] = [0; 2];
        let [mut waits, mut turns] = [0; 2];
        let mut contacts = vec![0; self.kinds.len()];
        for &id in &self.robots {
            let body = state.body(id);
            trip_cycles += body.trip_cycles.get();
            cycles_on_trips += self.cycles_on_trips(body, cycle);
            waits += state.waits_of(id);
            turns += self.turns_with_goal(body, cycle);
            total.distance_m += f64::from(body.moves.get()) * self.map.box_size_m;
            total.actions += self.actions(state, cycle, id);
            total.trips += u64::from(body.trips.get());
            total.trips_under_way += u64::from(self.is_on_trip(body));
            total.first_visits += u64::from(body.first_visits.get());
            total.delayed_cycles += u64::from(state.delays.total(id));
            total.off_plan += u64::from(state.off_plan(self, id));
            let first_contact = id as usize * self.kinds.len();
            for (kind, sum) in contacts.iter_mut().enumerate() {
                *sum += u64::from(state.contacts.get(first_contact + kind));
            }
        }
        total.contacts = contacts.iter().sum();
        total.contacts_by_kind = self.kinds.iter().cloned().zip(contacts).collect();
        // Over all trips, and not over the robots' means, which would count a slow robot's trips more.
        total.trip_cycles_mean = ratio(trip_cycles, total.trips);
        total.trip_cycles_estimate = ratio(cycles_on_trips, total.trips);
        total.waiting_share = ratio(waits, turns);
        total
    }

    /// Returns the metrics of a run, with what the kernel measured of it.
    pub fn metrics(&self, state: &RobotsState, cycle: Cycle, stats: &RunStats) -> Metrics {
        let groups = &stats.groups;
        let total = self.totals(state, cycle);
        let plans = state.plan_counts();
        let free = self.free_boxes.max(1);
        let tasks = state.task_counts();
        // Empty bins at the end are left out.
        let used = groups.counts.iter().rposition(|&n| n > 0).map_or(0, |k| k + 1);
        let progress = &state.progress;
        Metrics {
            gridlocks: progress.gridlocks_begun(),
            robots_in_gridlock: progress.gridlocks().iter().map(|g| g.robots.len() as u64).sum(),
            first_gridlock_cycle: progress.first_gridlock_cycle(),
            coverage: (self.boxes_covered_at_start() + total.first_visits) as f64 / free as f64,
            plans: plans.plans,
            plan_failures: plans.failures,
            plan_expansions: plans.expansions,
            plan_cost_gap: (plans.bounds > 0)
                .then(|| plans.costs as f64 / plans.bounds as f64 - 1.0),
            plan_cpu_s: stats.plan_ns as f64 / 1e9,
            tasks_finished: tasks.finished,
            tasks_open: tasks.open,
            contacts_per_action: total.contacts as f64 / total.actions.max(1) as f64,
            group_sizes: groups.counts[..used].to_vec(),
            largest_group: groups.largest,
            total,
        }
    }

    /// Returns the number of boxes under robots at the start, which do not count as first visits.
    fn boxes_covered_at_start(&self) -> u64 {
        self.robots.iter().map(|&id| self.type_of(id).own.len() as u64).sum()
    }
}

/// Returns a ratio, where it has a value.
fn ratio(sum: u64, count: u64) -> Option<f64> {
    (count > 0).then(|| sum as f64 / count as f64)
}

/// Returns the bytes on the heap that grow with the boxes, and with the bodies.
pub fn heap_bytes(run: &Run<RobotsWorld>) -> (usize, usize) {
    let (boxes, bodies) = run.state().heap_bytes();
    let world = run.world();
    let per_body = std::mem::size_of_val(&*world.bodies) + std::mem::size_of_val(&*world.robots);
    (boxes, bodies + run.engine_heap_bytes() + per_body)
}

#[cfg(test)]
mod tests {
    use crate::robots_run;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    /// The way there and back takes 8 cycles, or no time at all is enough.
    #[test]
    fn the_mean_length_of_trips_says_how_many_it_leaves_out() {
        let text = "format = 1\nworld = \"robots\"\n[map]\nascii = \".....\"\n[robots]\nat = [[0, 0, 0]]\n\
                    behaviour = { kind = \"shuttle\", a = [0, 0, 1, 1], b = [4, 0, 1, 1] }\n";
        let mut run = robots_run(&Source::new("s", text, ""), 1).expect("fits");
        assert_eq!(run.metrics().total.trips_under_way, 0);
        run.advance(6);
        let total = run.metrics().total;
        assert_eq!((total.trips, total.trip_cycles_mean, total.trips_under_way), (0, None, 1));
        run.advance(100);
        let total = run.metrics().total;
        assert!(total.trips > 0 && total.trips_under_way == 1, "{total:?}");
    }

    #[test]
    fn the_estimate_of_the_mean_trip_counts_the_time_of_those_under_way() {
        let text = "format = 1\nworld = \"robots\"\nregime = \"reliable\"\n[map]\nascii = \"..........\"\n\
                    [robots]\nat = [[0, 0, 0], [9, 0, 2]]\n\
                    behaviour = { kind = \"goto\", goals = [[4, 0], [9, 0]] }\n";
        let mut run = robots_run(&Source::new("s", text, ""), 1).expect("fits");
        run.advance(100);
        let each: Vec<_> = (0..2).map(|id| run.world().counts(run.state(), 100, id)).collect();
        let total = run.metrics().total;
        assert!(total.trips > 0 && total.trips_under_way > 0, "{total:?}");
        let estimate = total.trip_cycles_estimate.expect("some trips");
        assert!(estimate > total.trip_cycles_mean.expect("some trips"), "{total:?}");
        // Each robot was on trips from the start to the end.
        let whole = 100.0 * f64::from(u8::try_from(total.trips_under_way).expect("few"));
        let done: f64 = each
            .iter()
            .filter(|counts| counts.trips_under_way == 0)
            .map(|counts| counts.trip_cycles_mean.unwrap_or(0.0) * counts.trips as f64)
            .sum();
        assert!((estimate * total.trips as f64 - whole - done).abs() < 1e-9, "{total:?}");
    }

    /// Its first turn is a turn to the left, then it stands: its effector never moves it.
    #[test]
    fn a_turn_counts_as_waiting_where_a_robot_neither_moves_nor_turns() {
        let text = "format = 1\nworld = \"robots\"\nregime = \"effectors\"\n[map]\nascii = \".....\"\n\
                    [robots]\nat = [[0, 0, 1]]\neffector = \"stuck\"\n\
                    behaviour = { kind = \"goto\", goals = [[4, 0]], avoidance = \"touch\" }\n\
                    [effectors.stuck]\nforward = [{ p = 1.0 }]\nleft = [{ p = 1.0, turn = 90 }]\n\
                    right = [{ p = 1.0, turn = -90 }]\n";
        let mut run = robots_run(&Source::new("s", text, ""), 1).expect("fits");
        run.advance(10);
        assert_eq!(run.metrics().total.waiting_share, Some(0.9));
    }

    #[test]
    fn a_robot_covers_the_boxes_it_stands_in_and_those_it_comes_to() {
        let text = "format = 1\nworld = \"robots\"\n[map]\nascii = \"...#.\"\n[robots]\nat = [[0, 0, 0]]\n\
                    behaviour = { kind = \"replay\", actions = [\"forward\"], repeat = true }\n";
        let mut run = robots_run(&Source::new("s", text, ""), 1).expect("fits");
        assert_eq!(run.metrics().coverage, 0.25);
        run.advance(5);
        assert_eq!(run.metrics().coverage, 0.75);
    }
}
