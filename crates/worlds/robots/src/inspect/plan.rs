//! Where a robot goes: its goal, the plan that leads it there, and the bodies for which it waits.

use super::Inspector;
use crate::plan::place_in_team;
use crate::team::TeamState;
use sidestep_kernel::EntityId;
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::view::{self, FactSection, FactTable, FactValue, MarkRole, MarkShape};

/// Most places of a path that are drawn: beyond, it leads off the screen.
const MAX_PATH_PLACES: usize = 1_000;

/// What the planner of a team has in mind for one of its robots.
#[derive(Default)]
struct TeamPlan {
    goal: Option<(u32, u32)>,
    /// Places of the plan from the present one on; of a planner that plans no further, that after the next action.
    path: Vec<(u32, u32)>,
    /// Robots that pass before it by the order of the plan.
    before: Vec<EntityId>,
    off_plan: u32,
    /// Whether it is to wait in this cycle.
    is_waiting: bool,
    /// The place where the planner believes it, if that depends on reports.
    believed: Option<(u32, u32)>,
}

impl<T: OccupantWord> Inspector<'_, T> {
    /// Adds where a robot with a goal goes, and draws it; nothing for others.
    pub(super) fn add_plan(&mut self) {
        let plan = self.team_plan();
        let own_path = self.path_to_own_goal();
        let goal = plan.as_ref().and_then(|plan| plan.goal).or(own_path.last().copied());
        let Some(goal) = goal else { return };
        let mut section = FactSection::new("Plan").fact("goal", self.center_m(goal));
        let mut waits_for = Vec::new();
        match &plan {
            Some(plan) => {
                let next = plan.path.get(1).copied();
                section = section
                    .fact("planned next place", next.map(|place| self.center_m(place)))
                    .fact("times off its plan", FactValue::count(plan.off_plan))
                    .fact_if("believed place", plan.believed.map(|place| self.center_m(place)));
                if let Some(place) = plan.believed {
                    let shape = MarkShape::Point { at_m: self.center_m(place) };
                    self.inspection.add_mark(MarkRole::Known, "where it is believed", shape);
                }
                self.draw_path("what it is to do", &plan.path);
                waits_for.clone_from(&plan.before);
            }
            // Where it would go if nobody were in its way.
            None => self.draw_path("way to its goal", &own_path),
        }
        let may_wait = plan.as_ref().is_none_or(|plan| plan.is_waiting);
        if !may_wait {
            waits_for.clear();
        } else if waits_for.is_empty() {
            waits_for = self.cycle.world.bodies_in_way(self.present, self.id);
        }
        let mut table = FactTable::new(["waits for"]);
        for &other in &waits_for {
            table.push_row([self.cycle.world.body_id(other).into()]);
        }
        self.draw_waits(self.id, &waits_for);
        section = section.fact("gridlock", self.gridlock());
        self.draw_gridlock();
        self.inspection.add_section(section.table(table));
        let at_m = self.center_m(goal);
        self.inspection.add_mark(MarkRole::Target, "goal", MarkShape::Point { at_m });
    }

    /// Returns what the planner of its team has in mind; none for a robot that decides alone.
    fn team_plan(&self) -> Option<TeamPlan> {
        let world = self.cycle.world;
        let (team, robot) = place_in_team(world, self.id)?;
        let robots = &world.planner_teams[team].robots;
        let team_state: &TeamState = &self.cycle.state.planner_teams[team];
        let errand = team_state.goal_of_task(robot);
        // Before the locks are taken, which it takes, too.
        let now = self.cycle.now;
        let known = world.situation_known(
            self.present,
            &world.planner_teams[team],
            &self.present.planner_teams[team],
            now,
        );
        let is_free =
            known.busy_agent(robot).is_none() && world.bodies[self.id as usize].is_due(now);
        let (planner, memory) = team_state.locked();
        let mut path: Vec<(u32, u32)> = planner
            .path_ahead(&memory.planner, robot)
            .into_iter()
            .map(|pose| pose.position())
            .collect();
        let pose = known.poses[robot];
        let has_reports = world.planner_teams[team].leader.reports.is_some();
        let believed = has_reports.then(|| pose.position());
        if path.is_empty() {
            path.push(pose.position());
            path.extend(memory.planned[robot].map(|pose| pose.position()));
        }
        let before = planner.agents_before(&memory.planner, robot);
        Some(TeamPlan {
            goal: errand.or(memory.planner.pibt.goals[robot]),
            path,
            before: before.into_iter().map(|other| robots.start + other as EntityId).collect(),
            off_plan: memory.off_plan[robot],
            is_waiting: is_free && memory.planned[robot].is_none_or(|planned| planned == pose),
            believed,
        })
    }

    /// Returns the places of the cheapest path to the goal that a robot has by its own behavior, from its place on.
    fn path_to_own_goal(&self) -> Vec<(u32, u32)> {
        let world = self.cycle.world;
        let body = self.cycle.body(self.slot);
        let Some((_, field)) = world.goal_of(body) else { return Vec::new() };
        let mut place = world.map_position(body.position());
        let mut path = vec![place];
        while let Some(direction) = field.direction(place.0, place.1) {
            place = match direction {
                0 => (place.0 + 1, place.1),
                1 => (place.0, place.1 + 1),
                2 => (place.0 - 1, place.1),
                _ => (place.0, place.1 - 1),
            };
            path.push(place);
        }
        path
    }

    /// Returns the gridlock that it is in, in words.
    fn gridlock(&self) -> FactValue {
        let gridlocks = self.present.progress.gridlocks();
        let own = gridlocks.iter().find(|gridlock| gridlock.robots.contains(&self.id));
        own.map_or(FactValue::None, |gridlock| gridlock.to_string().into())
    }

    /// Draws who waits for whom in the gridlock that it is in.
    fn draw_gridlock(&mut self) {
        let present = self.present;
        let gridlocks = present.progress.gridlocks();
        let Some(own) = gridlocks.iter().find(|gridlock| gridlock.robots.contains(&self.id)) else {
            return;
        };
        let id = self.id;
        for &robot in own.robots.iter().filter(|&&robot| robot != id) {
            let others = self.cycle.world.bodies_in_way(present, robot);
            self.draw_waits(robot, &others);
        }
    }

    fn draw_waits(&mut self, robot: EntityId, others: &[EntityId]) {
        let from_m = self.body_center_m(robot);
        for &other in others {
            let points_m = vec![from_m, self.body_center_m(other)];
            let label =
                format!("{} waits for {}", self.name_of_body(robot), self.name_of_body(other));
            self.inspection.add_mark(MarkRole::Wait, label, MarkShape::Line { points_m });
        }
    }

    fn draw_path(&mut self, label: &str, path: &[(u32, u32)]) {
        let mut points_m: Vec<view::Vec3> = Vec::new();
        for &place in path.iter().take(MAX_PATH_PLACES) {
            let at_m = self.center_m(place);
            // While it turns or waits, it is at one place.
            if points_m.last() != Some(&at_m) {
                points_m.push(at_m);
            }
        }
        if points_m.len() > 1 {
            self.inspection.add_mark(MarkRole::Plan, label, MarkShape::Line { points_m });
        }
    }

    fn name_of_body(&self, id: EntityId) -> String {
        let world = self.cycle.world;
        format!("{} {id}", world.kinds[usize::from(world.type_of(id).kind)])
    }

    fn body_center_m(&self, id: EntityId) -> view::Vec3 {
        self.cycle.world.visible_body(id, self.present.body(id)).pose.at_m
    }

    /// Returns the center of this body if its lower left box were at a place of the map.
    fn center_m(&self, at: (u32, u32)) -> view::Vec3 {
        let [x_m, y_m] = self.cycle.world.middle_m(self.id, at);
        [x_m, y_m, self.position_m()[2]]
    }
}
