//! The routes of vehicles: the places that each passes by a plan, and what has to be passed by others before.
//!
//! They are the plan's action dependency graph ([`DependencyGraph`]) over moves alone: a turn enters no box, so it waits for
//! nobody, and vehicles turn by themselves.

use sidestep::kernel::view::Isometry2;
use sidestep::planners::{Action, DependencyGraph, GridPose, Instance, Plan};

/// A node of another vehicle's route.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Predecessor {
    /// The vehicle.
    pub vehicle: usize,
    /// The node of its route that it has to have reached: by going there, it left what is to be entered.
    pub node: usize,
}

/// A node of a route.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RouteNode {
    /// Column and row of the vehicle's lower-left box there.
    pub position: (u32, u32),
    /// What others have to have reached before it may be released.
    pub after: Vec<Predecessor>,
}

impl RouteNode {
    /// Returns the name of the node: vehicles at one place of the floor have the same.
    pub fn id(&self) -> String {
        let (col, row) = self.position;
        format!("{col}-{row}")
    }
}

/// The route of a vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Route {
    /// Side of the vehicle's square body in boxes.
    pub size: u32,
    /// The nodes, the start first.
    pub nodes: Vec<RouteNode>,
}

impl Route {
    /// Returns the number of its last node.
    pub fn last(&self) -> usize {
        self.nodes.len() - 1
    }

    /// Returns the boxes (column, row) that the vehicle's body covers at a node.
    pub fn boxes(&self, node: usize) -> impl Iterator<Item = (u32, u32)> + use<> {
        let (col, row) = self.nodes[node].position;
        let size = self.size;
        (0..size).flat_map(move |up| (0..size).map(move |right| (col + right, row + up)))
    }
}

/// The boxes of a floor in the frame of its map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorFrame {
    /// Side of a box in meters.
    pub box_m: f64,
    /// The lower-left corner of the floor in the frame of its map, and its turn.
    pub plane: Isometry2,
}

impl FloorFrame {
    /// Returns the center of a body in meters in the frame of the map, by its lower-left box and its side in boxes.
    pub fn center_m(&self, position: (u32, u32), size: u32) -> [f64; 2] {
        let half = 0.5 * f64::from(size);
        let x_m = (f64::from(position.0) + half) * self.box_m;
        let y_m = (f64::from(position.1) + half) * self.box_m;
        self.plane.transform_point([x_m, y_m])
    }
}

/// Why a plan has no routes: vehicles that move in a ring would have to start in the same instant.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "vehicles {vehicles:?} move in a ring, each to the place that another one leaves at the same instant"
)]
pub struct RingError {
    /// The vehicles of the first ring.
    pub vehicles: Vec<u32>,
}

/// Returns the route of each agent of a plan.
///
/// # Errors
/// Where some move in a ring.
pub fn routes(
    instance: &Instance,
    plan: &Plan,
    graph: &DependencyGraph,
) -> Result<Vec<Route>, RingError> {
    if let Some(ring) = graph.circles().first() {
        return Err(RingError { vehicles: ring.clone() });
    }
    let agents = instance.agents().len();
    let nodes_after: Vec<Vec<usize>> =
        (0..agents).map(|agent| nodes_after_actions(graph, agent)).collect();
    let mut routes = Vec::with_capacity(agents);
    for (agent, body) in instance.agents().iter().enumerate() {
        let start = plan.pose(agent, 0);
        let mut nodes = vec![RouteNode { position: start.position(), after: Vec::new() }];
        for (index, pose) in moves(graph, agent) {
            let after = graph.dependencies(agent, index).map(|dependency| {
                let vehicle = dependency.0;
                Predecessor { vehicle, node: nodes_after[vehicle][dependency.1] }
            });
            nodes.push(RouteNode { position: pose.position(), after: after.collect() });
        }
        routes.push(Route { size: body.size, nodes });
    }
    Ok(routes)
}

/// Returns the actions of an agent that lead to another place: their indices, and the poses after them.
fn moves(graph: &DependencyGraph, agent: usize) -> impl Iterator<Item = (usize, GridPose)> {
    let actions = (0..graph.actions(agent)).filter_map(move |index| {
        let action = graph.action(agent, index)?;
        is_move(action.0).then_some((index, action.1))
    });
    actions.into_iter()
}

fn is_move(action: Action) -> bool {
    matches!(action, Action::Forward | Action::Move(_))
}

/// Returns for each action of an agent the node of its route at which it is after it.
fn nodes_after_actions(graph: &DependencyGraph, agent: usize) -> Vec<usize> {
    let mut node = 0;
    let mut nodes = Vec::with_capacity(graph.actions(agent));
    for index in 0..graph.actions(agent) {
        let action = graph.action(agent, index);
        if action.is_some_and(|action| is_move(action.0)) {
            node += 1;
        }
        nodes.push(node);
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::planners::{ActionModel, Agent, FreeSpace, lacam};

    fn routes_of(free: &FreeSpace, agents: Vec<Agent>) -> Result<Vec<Route>, RingError> {
        let instance = Instance::new(free, ActionModel::Turns, agents).expect("a problem");
        let found = lacam::plan(&instance, lacam::LacamConfig::default()).expect("paths");
        let plan = found.plan.expect("a plan");
        let graph = DependencyGraph::new(&instance, &plan).expect("right");
        routes(&instance, &plan, &graph)
    }

    #[test]
    fn a_place_that_two_pass_is_released_to_the_second_when_the_first_has_reached_the_next() {
        let corridor = FreeSpace::new(4, 1, |_, _| true);
        let agent =
            |at: u32, goal: u32| Agent { size: 1, start: GridPose::new(at, 0, 0), goal: (goal, 0) };
        let routes = routes_of(&corridor, vec![agent(0, 2), agent(1, 3)]).expect("no ring");
        let positions: Vec<_> = routes[0].nodes.iter().map(|node| node.position).collect();
        assert_eq!(positions, [(0, 0), (1, 0), (2, 0)]);
        assert_eq!(routes[0].nodes[1].after, [Predecessor { vehicle: 1, node: 1 }]);
        assert_eq!(routes[0].nodes[2].after, [Predecessor { vehicle: 1, node: 2 }]);
        assert!(routes[1].nodes.iter().all(|node| node.after.is_empty()));
    }

    #[test]
    fn turns_are_no_nodes() {
        let hall = FreeSpace::new(3, 3, |_, _| true);
        let agent = Agent { size: 2, start: GridPose::new(0, 0, 2), goal: (1, 1) };
        let routes = routes_of(&hall, vec![agent]).expect("no ring");
        assert_eq!((routes[0].nodes.len(), routes[0].last()), (3, 2));
        assert_eq!(routes[0].boxes(2).collect::<Vec<_>>(), [(1, 1), (2, 1), (1, 2), (2, 2)]);
    }

    #[test]
    fn a_ring_is_refused() {
        let poses = [(0, 0, 0), (1, 0, 1), (1, 1, 2), (0, 1, 3)];
        let floor = FreeSpace::new(2, 2, |_, _| true);
        let starts = poses.map(|(col, row, heading)| GridPose::new(col, row, heading));
        let agents = (0..4).map(|k| Agent {
            size: 1,
            start: starts[k],
            goal: starts[(k + 1) % 4].position(),
        });
        assert_eq!(
            routes_of(&floor, agents.collect()),
            Err(RingError { vehicles: vec![0, 1, 2, 3] })
        );
    }

    #[test]
    fn places_are_in_the_frame_of_the_map() {
        let plane = Isometry2 { origin_m: [10.0, -5.0], yaw_rad: 0.0 };
        let frame = FloorFrame { box_m: 0.5, plane };
        assert_eq!(frame.center_m((2, 4), 1), [11.25, -2.75]);
        assert_eq!(frame.center_m((2, 4), 2), [11.5, -2.5]);
    }
}
