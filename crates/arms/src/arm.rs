//! An arm of joints as a chain of rods (slides K1 to K4).

use super::kinematics::{
    ArmBody, ArmGoal, BodyPosture, BodyTravel, ConnectorTargetSolver, SerialChain, Skeleton, Vector,
};
use super::motion::{AssumedSpeed, CutRates, MotionFilter};
use sidestep_import::report::Finding;
use sidestep_import::urdf::Solid;
use sidestep_kernel::InputError;
use sidestep_rods::geometry::{Point, convert_dimensions, sub};
use sidestep_rods::{Chain, Connector, Mobility, Obstacle, Rod};
use std::f64::consts::PI;

/// Least length of rods with a joint that can bring their ends together: a rod of no length has no direction.
const MIN_ROD_M: f64 = 1e-6;
/// Greatest length of rods with a joint without limits: the greatest that a chain allows.
const MAX_ROD_M: f64 = 1e6;
/// Least bend limit of a connector, rad: a joint whose limits meet would give 0, which a chain refuses.
const MIN_BEND_RAD: f64 = 1e-9;

/// Where the highest rates of an arm's joints are from, beside its model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RateSources {
    /// The joints whose highest speed is assumed, because nothing gives it.
    pub assumed_speeds: Vec<AssumedSpeed>,
    /// Of each variable, which rates are those that no joint exceeds, whatever it may by itself.
    pub cut: Vec<CutRates>,
}

/// An arm: its joints, its connectors, and the place of its base.
#[derive(Debug)]
pub struct Arm {
    /// Joints from base to tip.
    pub serial: SerialChain,
    /// What the joints' axes make of it, the same at every posture.
    pub skeleton: Skeleton,
    /// Position of the base's frame; its axes are those of the world.
    pub at_m: Vector,
    /// Joint values at the start, rad or m.
    pub values: Vec<f64>,
    /// Finds joint values that follow its connectors.
    pub follower: ConnectorTargetSolver,
    /// Keeps the joints to their rates.
    pub motion: MotionFilter,
    /// Where the rates of its motion are from.
    pub rate_sources: RateSources,
    /// The shapes of its links, which then must not touch anything, in place of its rods; none where its rods count.
    pub body: Option<ArmBody>,
    /// Bounds on the travel of its body's parts; of no part where its rods count.
    pub travel: BodyTravel,
    /// Parts of its body that overlap at the start, by name with their depth in m: they may.
    pub exempt_overlaps: Vec<(String, String, f64)>,
    /// The shapes of its links as they were read, where some are meshes; none otherwise.
    pub solids: Vec<Solid>,
    /// What was not taken as it stood in its files; none where it is of no file.
    pub findings: Vec<Finding>,
}

impl Arm {
    /// Returns an arm at a posture, whose joints move as the filter lets them. Values that are outside their limits by
    /// rounding are put inside.
    pub fn new(serial: SerialChain, at_m: Vector, values: Vec<f64>, motion: MotionFilter) -> Self {
        let skeleton = serial.skeleton();
        let follower = ConnectorTargetSolver::new(&serial, &skeleton);
        let values = follower.clamp(values);
        Self {
            values,
            skeleton,
            serial,
            at_m,
            follower,
            motion,
            rate_sources: RateSources::default(),
            body: None,
            travel: BodyTravel::default(),
            exempt_overlaps: Vec::new(),
            solids: Vec::new(),
            findings: Vec::new(),
        }
    }

    /// Returns the arm with a body of shapes. Parts that overlap at its start may touch.
    #[must_use]
    pub fn with_body(self, mut body: ArmBody) -> Self {
        let exempt_overlaps = body.exempt_overlaps(self.posture(&self.values));
        let travel = BodyTravel::new(&self.serial, &body);
        Self { body: Some(body), travel, exempt_overlaps, ..self }
    }

    /// Returns a posture in the world.
    pub fn posture<'a>(&'a self, values: &'a [f64]) -> BodyPosture<'a> {
        BodyPosture { chain: &self.serial, at_m: self.at_m, values }
    }

    /// Returns obstacles that enclose the links of an arm with a body at a posture; none where its rods count.
    pub fn enclosures<const D: usize>(&self, values: &[f64], id: u32) -> Option<Vec<Obstacle<D>>> {
        Some(self.body.as_ref()?.enclosures(self.posture(values), id))
    }

    /// Returns the connector that stands for a link, the base being link 0.
    pub fn connector_of_link(&self, link: usize) -> usize {
        self.skeleton.connector_of_link(link)
    }

    /// Returns the arm as a chain with a fixed base: the guide of its joints. Joint limits become bend limits if
    /// those are equivalent; the joints themselves keep to all of them.
    ///
    /// # Errors
    /// When its connectors make no chain, e.g. because a rod has length 0.
    pub fn chain(&self, radius_m: f64, rod_radius_m: f64) -> Result<Chain<3>, InputError> {
        let points: Vec<Vector> = self.connector_positions(&self.values);
        let mut connectors = vec![Connector::free(radius_m); points.len()];
        connectors[0].mobility = Mobility::Fixed;
        // The bend at the first connector is measured from the base's axis, which is no rod of the chain.
        let limits = self.serial.bend_limits(&self.skeleton);
        for (connector, limit) in connectors.iter_mut().zip(limits).skip(1) {
            let exact = limit.filter(|limit| limit.is_exact);
            connector.max_bend_rad = exact.map_or(PI, |limit| limit.max_bend_rad.max(MIN_BEND_RAD));
        }
        let rods = self.skeleton.rods.iter().map(|rod| Rod {
            min_m: rod.min_m.max(MIN_ROD_M),
            max_m: rod.max_m.clamp(MIN_ROD_M, MAX_ROD_M),
            radius_m: rod_radius_m,
        });
        Chain::new(points, connectors, rods.collect())
    }

    /// Returns the places of the connectors in the world at these joint values.
    pub fn connector_positions<const D: usize>(&self, values: &[f64]) -> Vec<Point<D>> {
        let in_base = self.follower.connector_positions(values);
        in_base.into_iter().map(|p| convert_dimensions(self.to_world(p))).collect()
    }

    /// Returns a place of the world in the frame of the base.
    pub fn to_base<const D: usize>(&self, p: Point<D>) -> Vector {
        sub(convert_dimensions(p), self.at_m)
    }

    /// Returns a goal for connector `k` at a place of the world, and the arm up to it.
    pub fn goal<const D: usize>(
        &self,
        k: usize,
        at: Point<D>,
        tolerance_m: f64,
    ) -> (SerialChain, ArmGoal) {
        let goal = ArmGoal { tolerance_m, ..ArmGoal::new(self.to_base(at)) };
        (self.serial.up_to_connector(&self.skeleton, k), goal)
    }

    fn to_world(&self, p: Vector) -> Vector {
        [0, 1, 2].map(|i| p[i] + self.at_m[i])
    }
}
