//! The planner of arms and its collision checks as a Python module. `beside_ompl.py` builds it, asks it for plans, and
//! lets OMPL ask the same checks.

use cpu_time::ThreadTime;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sidestep_arms::Arm;
use sidestep_arms::kinematics::ArmFiles;
use sidestep_arms::motion::{JointRates, MotionFilter};
use sidestep_arms::plan::{ConfigurationSpace, JointGoal, JointPosture, JointSpace, plan_to_goal};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{InputError, Seed};
use sidestep_rods::geometry::{ConvexCore, Cuboid};
use sidestep_rods::{Chain, Obstacle, Obstacles};
use std::path::PathBuf;

/// Radii of the connectors and rods of the guide chain, m. Of an arm with shapes they decide the step between two
/// postures that are checked, here 5 mm, and nothing else.
const GUIDE_RADIUS_M: f64 = 0.02;
/// Rates of all joints; no plan depends on them.
const RATES: JointRates = JointRates { speed: 1.0, acceleration: 5.0, jerk: 50.0 };
const CYCLE_S: f64 = 0.02;

/// A ball: center and radius in m.
type BallSpec = ([f64; 3], f64);
/// An upright box: center and half extents in m, and its turn about the vertical as cosine and sine.
type BoxSpec = ([f64; 3], [f64; 3], [f64; 2]);
/// A plan, if there is one, and the CPU seconds of its search.
type TimedPlan = (Option<Vec<Vec<f64>>>, f64);

/// An arm among obstacles.
#[pyclass]
struct Scene {
    arm: Arm,
    chain: Chain<3>,
    obstacles: Obstacles<3>,
    /// CPU seconds of all checks that were asked from outside.
    #[pyo3(get)]
    checks_s: f64,
}

#[pymethods]
impl Scene {
    /// Reads an arm. Links that overlap at `start` may touch.
    #[new]
    #[pyo3(signature = (urdf, srdf, tip, start, balls, boxes))]
    fn new(
        urdf: PathBuf,
        srdf: Option<PathBuf>,
        tip: Option<String>,
        start: Vec<f64>,
        balls: Vec<BallSpec>,
        boxes: Vec<BoxSpec>,
    ) -> PyResult<Self> {
        let files = ArmFiles { urdf, srdf, tip, base: None, group: None };
        let model = files.load().map_err(value_error)?;
        let (body, _) = model.body();
        // Without values the posture at rest.
        let start = if start.is_empty() { model.chain.rest_values() } else { start };
        let rates = vec![RATES; model.chain.variables.len()];
        let filter = MotionFilter::new(rates, CYCLE_S).map_err(value_error)?;
        let arm = Arm::new(model.chain, [0.0; 3], start, filter).with_body(body);
        let chain = arm.chain(GUIDE_RADIUS_M, GUIDE_RADIUS_M).map_err(value_error)?;
        let mut all = Vec::new();
        for (center, radius_m) in balls {
            all.push(Obstacle::ball(all.len() as u32, center, radius_m));
        }
        for (center, half_m, [cos, sin]) in boxes {
            let axes = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
            let core = ConvexCore::Cuboid(Cuboid { center, axes, half_m });
            all.push(Obstacle::new_static(all.len() as u32, core, 0.0));
        }
        let obstacles = Obstacles::new(all, 1.0).map_err(value_error)?;
        Ok(Self { arm, chain, obstacles, checks_s: 0.0 })
    }

    /// Lowest and highest value of each joint; infinite where one has no limit.
    fn limits(&self) -> Vec<[f64; 2]> {
        self.arm.follower.limits().to_vec()
    }

    /// Names of the joints.
    fn joints(&self) -> Vec<String> {
        self.arm.serial.variables.iter().map(|variable| variable.name.clone()).collect()
    }

    /// Number of the body's parts that are convex hulls of meshes, and of pairs of links that must not touch.
    fn shapes(&self) -> (usize, usize) {
        self.arm.body.as_ref().map_or((0, 0), |body| (body.hulls(), body.pairs().len()))
    }

    /// Returns whether it touches something at its start, which checks then allow to stay.
    fn starts_inside(&self) -> bool {
        let start = self.arm.posture(&self.arm.values);
        let own = !self.arm.exempt_overlaps.is_empty();
        let body = self.arm.body.as_ref();
        own || body.is_some_and(|b| b.deepest_contact(start, &self.obstacles, true).is_some())
    }

    /// Returns whether a posture touches nothing.
    fn is_free(&mut self, joints: Vec<f64>) -> bool {
        let started = ThreadTime::now();
        let is_free = self.space().is_free(&joints);
        self.checks_s += started.elapsed().as_secs_f64();
        is_free
    }

    /// Returns whether the straight path of the joints from a posture to another touches nothing.
    fn is_path_free(&mut self, from: Vec<f64>, to: Vec<f64>) -> bool {
        let started = ThreadTime::now();
        let is_free = self.space().is_path_free(&from, &to);
        self.checks_s += started.elapsed().as_secs_f64();
        is_free
    }

    /// Plans a path from the start to joint values.
    fn plan(&self, goal: Vec<f64>, seed: u64) -> PyResult<TimedPlan> {
        let started = ThreadTime::now();
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(1));
        let path = plan_to_goal(&self.space(), &JointGoal::Values(goal), &mut draws);
        let path = path.map_err(value_error)?;
        Ok((path, started.elapsed().as_secs_f64()))
    }
}

impl Scene {
    fn space(&self) -> JointSpace<'_, 3> {
        let start = JointPosture { arm: &self.arm, joints: &self.arm.values };
        let tool = self.arm.skeleton.rods.len();
        JointSpace::new(start, &self.chain, &self.obstacles, true, tool)
    }
}

fn value_error(error: InputError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The planner of arms, and its collision checks.
#[pymodule]
fn sidestep_bench_planning(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Scene>()
}
