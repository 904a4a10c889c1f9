//! Chains as a caller sees them: their observations, and the orders for those whose driver is outside.
//! An agent is a chain, by its number.

use super::clearance::part_clearance;
use super::driver::external::{OrderOutcome, Orders};
use super::driver::{Task, TaskKind, VetoRecord};
use super::scratch::Scratch;
use super::state::{ChainBodyState, ChainWorldState, MotionPlan};
use super::world::{ChainSpec, ChainWorld, OTHER_CHAIN};
use sidestep_kernel::control::{AgentTeam, AgentTeams, BufferMut, Order, ValueDomain, ValueSpace};
use sidestep_kernel::{Cycle, EntityId, EntitySlot};
use sidestep_rods::geometry::{Aabb as Box, Point, distance};
use sidestep_rods::{MAX_COORDINATE_M, Obstacles, VetoReason, is_length_allowed};

#[cfg(test)]
mod tests;

/// The noun for an agent that observes and takes orders.
const CHAIN: &str = "chain";
const CAUSES: [&str; 3] = ["none", "obstacle", "chain"];

impl<const D: usize> ChainSpec<D> {
    /// Returns whether some task of it takes orders.
    fn has_external_task(&self) -> bool {
        self.tasks.iter().any(takes_orders)
    }

    /// Returns the number of joints of an arm; 0 of other chains.
    fn joint_count(&self) -> usize {
        self.arm.as_ref().map_or(0, |arm| arm.serial.variables.len())
    }
}

/// Returns whether two chains observe, and may be ordered, alike.
fn is_same_team<const D: usize>(one: &ChainSpec<D>, other: &ChainSpec<D>) -> bool {
    one.name == other.name
        && one.start.points().len() == other.start.points().len()
        && one.joint_count() == other.joint_count()
        && one.has_external_task() == other.has_external_task()
}

fn takes_orders<const D: usize>(task: &Task<D>) -> bool {
    matches!(task.driver, TaskKind::External)
}

impl<const D: usize> ChainWorld<D> {
    /// Returns the teams: chains of one name and one number of connectors, that take orders or do not.
    pub(super) fn find_teams(&self) -> AgentTeams {
        let mut alike: Vec<(&ChainSpec<D>, Vec<EntityId>)> = Vec::new();
        for (id, spec) in (0..).zip(self.chains.iter()) {
            // From the last team on: chains that are alike mostly come from one section.
            match alike.iter_mut().rev().find(|(other, _)| is_same_team(other, spec)) {
                Some((_, agents)) => agents.push(id),
                None => alike.push((spec, vec![id])),
            }
        }
        let teams = alike.into_iter().map(|(spec, agents)| self.team(spec, agents));
        AgentTeams::new(teams.collect(), CHAIN)
    }

    /// Returns the team of chains like `spec`.
    fn team(&self, spec: &ChainSpec<D>, agents: Vec<EntityId>) -> AgentTeam {
        let n = spec.start.points().len();
        let mut observation_spaces = self.observation_spaces(n);
        let mut action_spaces = Vec::new();
        if spec.has_external_task() {
            observation_spaces.extend(order_result_spaces::<D>());
            action_spaces = chain_action_spaces::<D>(n);
            action_spaces.extend(joints_action_space(spec.joint_count()));
        }
        let name = if spec.name.is_empty() { CHAIN.into() } else { spec.name.clone() };
        AgentTeam { name, agents, observation_spaces, action_spaces }
    }

    /// Returns the spaces of the perception of a chain of `n` connectors, in the order of [`Self::write_observations`].
    fn observation_spaces(&self, n: usize) -> Vec<ValueSpace> {
        let look_m = self.look_m;
        let up_to_look = ValueDomain::Real { low: f64::NEG_INFINITY, high: look_m };
        let part = ValueDomain::Integer { low: -1, high: n as i64 - 1 };
        let reasons = std::iter::once("none").chain(VetoReason::ALL.iter().map(|r| r.name()));
        let gap = format!(
            "gap between each connector and the nearest obstacle or other chain, below 0 inside it; {look_m} \
             where nothing is as near"
        );
        vec![
            ValueSpace::new("joints_m", unbounded_real_space(), "places of its connectors")
                .with_shape([n, D]),
            ValueSpace::new("gap_m", up_to_look.clone(), gap).with_shape([n]),
            ValueSpace::new(
                "nearest_m",
                unbounded_real_space(),
                "way from each connector's middle to the surface of that; 0 where nothing is near",
            )
            .with_shape([n, D]),
            ValueSpace::new("rod_gap_m", up_to_look, "the same gap of each rod")
                .with_shape([n - 1]),
            ValueSpace::new("leads", part.clone(), "connector that leads; -1 where none does"),
            ValueSpace::new(
                "is_broken",
                choice_space(["no", "yes"]),
                "whether its parts are scattered",
            ),
            ValueSpace::new(
                "veto",
                choice_space(reasons),
                "reason of the last objection to what it wanted",
            ),
            ValueSpace::new("veto_part", part, "connector that objected; -1 where none did"),
        ]
    }

    /// Returns an error, with the remedy, if no rod and no joint of a chain can ever be as an order wants it.
    pub(super) fn check_possible(&self, order: &Order<'_>) -> Result<(), String> {
        match self.order_name(order) {
            Orders::ROD_TO => self.check_rod_possible(order),
            Orders::JOINTS => self.check_joints_possible(order),
            _ => Ok(()),
        }
    }

    fn check_joints_possible(&self, order: &Order<'_>) -> Result<(), String> {
        let Some(arm) = &self.chains[order.agent as usize].arm else { return Ok(()) };
        let checked = arm.serial.check_limits(Orders::JOINTS, order.values);
        checked.map_err(|error| format!("{}; {}", error.cause(), error.remedy()))
    }

    fn check_rod_possible(&self, order: &Order<'_>) -> Result<(), String> {
        let (first, second) = order.values.split_at(D);
        let first: Point<D> = std::array::from_fn(|i| first[i]);
        let second: Point<D> = std::array::from_fn(|i| second[i]);
        let long_m = distance(first, second);
        let rods = self.chains[order.agent as usize].start.rods();
        if rods.iter().any(|rod| is_length_allowed(*rod, long_m)) {
            return Ok(());
        }
        let least_m = rods.iter().map(|rod| rod.min_m).fold(f64::INFINITY, f64::min);
        let most_m = rods.iter().map(|rod| rod.max_m).fold(0.0, f64::max);
        Err(format!(
            "its places are {long_m} m apart, and no rod of the chain is as long; give places {least_m} m to \
             {most_m} m apart"
        ))
    }

    fn order_name(&self, order: &Order<'_>) -> &str {
        &self.teams.as_slice()[order.team].action_spaces[order.space].name
    }

    /// Records an order in the state of its chain.
    pub(super) fn record_order(&self, state: &ChainWorldState<D>, order: &Order<'_>) {
        let name = self.order_name(order);
        let mut body = state.body_mut(order.agent as usize);
        body.external.orders.record(name, order.values);
        // A task that takes no orders has plans of its own, which are to be left alone.
        let takes_orders = self.current_task(order.agent, &body).is_some_and(takes_orders);
        if name == Orders::JOINTS && takes_orders {
            body.plan = Some(MotionPlan::Joints([order.values.to_vec()].into()));
        }
    }

    /// Writes a row for each agent of a team, in the order of its spaces.
    pub(super) fn write_observations(
        &self,
        state: &ChainWorldState<D>,
        now: Cycle,
        team: usize,
        room: &mut [BufferMut<'_>],
    ) {
        let AgentTeam { agents, action_spaces: ordered, .. } = &self.teams.as_slice()[team];
        let scratch = &mut Scratch::new(self);
        let boxes: Vec<Box<D>> =
            (0..state.len()).map(|slot| self.bounding_box(&state.body(slot))).collect();
        for (row, &id) in agents.iter().enumerate() {
            let look = boxes[id as usize].grown(self.look_m);
            let others = (0..state.len() as EntitySlot).filter(|slot| *slot != id);
            let near = others.filter(|slot| boxes[*slot as usize].intersects(&look));
            scratch.nearby.gather(self, state, now, near);
            let body = &state.body(id as usize);
            let mut row = ObservationRow { row, rooms: room.iter_mut() };
            self.write_chain_observation(id, body, &scratch.nearby.all, &mut row);
            if !ordered.is_empty() {
                self.observe_order_result(id, body, &mut row);
            }
        }
    }

    /// Returns the box around a chain.
    fn bounding_box(&self, body: &ChainBodyState<D>) -> Box<D> {
        let radii_m = body.chain.connectors().iter().map(|connector| connector.radius_m);
        Box::from_points(body.chain.points()).grown(radii_m.fold(0.0, f64::max))
    }

    fn current_task(&self, id: EntityId, body: &ChainBodyState<D>) -> Option<&Task<D>> {
        self.chains[id as usize].tasks.get(body.driving.task as usize)
    }

    fn write_chain_observation(
        &self,
        id: EntityId,
        body: &ChainBodyState<D>,
        obstacles: &Obstacles<D>,
        row: &mut ObservationRow<'_, '_>,
    ) {
        let chain = &body.chain;
        let n = chain.points().len();
        let is_whole = body.scattered.is_none();
        let all: Vec<_> =
            (0..n).map(|k| part_clearance(chain, obstacles, k, self.look_m, is_whole)).collect();
        row.push_reals(chain.points().as_flattened().iter().copied());
        row.push_reals(all.iter().map(|near| near.gap_m));
        row.push_reals(all.iter().flat_map(|near| near.to_surface));
        row.push_reals(all[..n - 1].iter().map(|near| near.rod_gap_m));
        let leads =
            self.current_task(id, body).filter(|task| !matches!(task.driver, TaskKind::Rest));
        row.push_integer(leads.map_or(-1, |task| task.agent as i64));
        row.push_integer(i64::from(!is_whole));
        let veto = if self.chains[id as usize].has_external_task() {
            body.external.answer.veto
        } else {
            body.driving.objection
        };
        row.push_integer(veto.map_or(0, |VetoRecord { reason, .. }| reason.number() as i64 + 1));
        row.push_integer(veto.map_or(-1, |VetoRecord { by, .. }| i64::from(by)));
    }

    fn observe_order_result(
        &self,
        id: EntityId,
        body: &ChainBodyState<D>,
        row: &mut ObservationRow<'_, '_>,
    ) {
        let answer = &body.external.answer;
        let (cause, number) = match answer.obstacle {
            None => (0, -1),
            Some(obstacle) if obstacle < OTHER_CHAIN => (1, i64::from(obstacle)),
            Some(part) => (2, i64::from(part - OTHER_CHAIN)),
        };
        let heeds =
            body.scattered.is_none() && self.current_task(id, body).is_some_and(takes_orders);
        row.push_integer(cause);
        row.push_integer(number);
        row.push_integer(i64::from(heeds));
        row.push_integer(answer.outcome as i64);
        row.push_reals(answer.target_m[0][..D].iter().chain(&answer.target_m[1][..D]).copied());
        row.push_reals(answer.reached_m[..D].iter().copied());
        row.push_reals([answer.done_share]);
    }
}

/// Returns the spaces of the answers to a chain that takes orders.
fn order_result_spaces<const D: usize>() -> Vec<ValueSpace> {
    let number = ValueDomain::Integer { low: -1, high: i64::from(u32::MAX) };
    let share = ValueDomain::Real { low: 0.0, high: 1.0 };
    vec![
        ValueSpace::new("veto_cause", choice_space(CAUSES), "sort of thing because of which it objected"),
        ValueSpace::new("veto_cause_id", number, "number of that obstacle or chain; -1 for none"),
        ValueSpace::new("heeds", choice_space(["no", "yes"]), "whether it takes orders in this cycle"),
        ValueSpace::new("answer", choice_space(OrderOutcome::NAMES), "what came of the orders in the last cycle"),
        ValueSpace::new(
            "wish_m",
            unbounded_real_space(),
            "places that both ends of the rod, or twice that the connector, should have reached in the \
             last cycle; 0 where there was no errand",
        )
        .with_shape([2, D]),
        ValueSpace::new(
            "reached_m",
            unbounded_real_space(),
            "place that the first of them has reached or, vetoed, could have reached; 0 where there was \
             no errand",
        )
        .with_shape([D]),
        ValueSpace::new("done_share", share, "part of the last cycle's way that was done"),
    ]
}

/// Returns the spaces of the orders for a chain of `n` connectors.
fn chain_action_spaces<const D: usize>(n: usize) -> Vec<ValueSpace> {
    let place = ValueDomain::Real { low: -MAX_COORDINATE_M, high: MAX_COORDINATE_M };
    let mut spaces = vec![
        ValueSpace::new(
            Orders::TO,
            place.clone(),
            "place toward which a connector goes, at its task's speed; without `to_m` and `rod_to_m` nothing \
             moves, and the last of them counts",
        )
        .with_shape([D]),
        ValueSpace::new(
            Orders::CONNECTOR,
            ValueDomain::Integer { low: 0, high: n as i64 - 1 },
            "that connector, from 0; the one that leads where this is not ordered",
        ),
        ValueSpace::new(
            Orders::REACH,
            choice_space(["exact", "as-far-as-it-goes"]),
            "what comes of a cycle's way that cannot all be gone: nothing, or as much as goes; exact where \
             this is not ordered",
        ),
    ];
    if n > 1 {
        spaces.push(
            ValueSpace::new(
                Orders::ROD_TO,
                place,
                "places toward which the ends of a rod go, none faster than its task's speed",
            )
            .with_shape([2, D]),
        );
        spaces.push(ValueSpace::new(
            Orders::ROD,
            ValueDomain::Integer { low: 0, high: n as i64 - 2 },
            "that rod, from 0; the one behind the leading connector where this is not ordered",
        ));
    }
    spaces
}

/// Returns the space of the order to the joints of an arm with so many; none where there are none.
fn joints_action_space(joints: usize) -> Option<ValueSpace> {
    let value = ValueDomain::Real { low: -MAX_COORDINATE_M, high: MAX_COORDINATE_M };
    let meaning = "values of the joints of the arm, in rad or m, toward which all of them go, none faster than it may be and the \
                   leading connector no faster than its task's speed; what is in the way stops them; like `to_m`, the last target counts";
    (joints > 0).then(|| ValueSpace::new(Orders::JOINTS, value, meaning).with_shape([joints]))
}

fn unbounded_real_space() -> ValueDomain {
    ValueDomain::Real { low: f64::NEG_INFINITY, high: f64::INFINITY }
}

fn choice_space<'a>(names: impl IntoIterator<Item = &'a str>) -> ValueDomain {
    ValueDomain::Discrete(names.into_iter().map(String::from).collect())
}

/// One agent's row in the rooms of its team, filled room by room.
struct ObservationRow<'a, 'b> {
    row: usize,
    rooms: std::slice::IterMut<'a, BufferMut<'b>>,
}

impl ObservationRow<'_, '_> {
    fn push_integer(&mut self, value: i64) {
        if let Some(room) = self.rooms.next() {
            room.set_integer(self.row, value);
        }
    }

    fn push_reals(&mut self, values: impl IntoIterator<Item = f64>) {
        let Some(room) = self.rooms.next() else { return };
        let values: Vec<f64> = values.into_iter().collect();
        for (k, value) in values.iter().enumerate() {
            room.set_real(self.row * values.len() + k, *value);
        }
    }
}
