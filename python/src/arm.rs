//! Arms of robot models: forward and inverse kinematics of many postures and targets at once.

use crate::choice::choose;
use crate::error::{self, argument_error};
use crate::json::to_list;
use crate::pickle::{self, ArmSource, Pickle};
use crate::result::{Fields, ResultClass};
use crate::watch::run_polling;
use crate::worlds;
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyList;
use sidestep::arms::ik::IkEngine;
use sidestep::arms::kinematics::{
    ArmBody, ArmFiles, ArmGoal, ArmModel, IkResult, LinkFrames, ObstacleSphere, PoseMask,
    Transform, Vector,
};
use sidestep::experiment::sweep::scheduler::run_trials;
use sidestep::kernel::InputError;
use sidestep_session::{ArmTrajectory, Error, RecordedRun};
use std::path::PathBuf;

/// An arm of a robot model (URDF): its joints from a base link to a tip link.
///
/// Arm(urdf, *, base=None, tip=None, srdf=None, group=None): `base` is the root link and `tip` the end of the longest
/// arm if they are not named; `group` takes both from the SRDF file, which also lists the links that may touch.
/// Positions are in m in the frame of the base, angles in rad. It never changes, and threads may share it.
///
/// Raises InputError when a file, a link or the group is wrong.
///
/// Examples of its methods continue from here, in the root of a clone:
///
/// >>> import sidestep
/// >>> arm = sidestep.Arm("scenarios/chain/arm.urdf")
/// >>> len(arm.joints) == len(arm.units)
/// True
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Arm {
    model: ArmModel,
    /// Its files, for pickles.
    source: ArmSource,
}

impl Arm {
    /// Loads an arm from its files.
    pub(crate) fn load(source: ArmSource) -> PyResult<Self> {
        let files = ArmFiles {
            urdf: source.urdf.0.clone(),
            srdf: source.srdf.as_ref().map(|(path, _)| path.clone()),
            base: source.base.clone(),
            tip: source.tip.clone(),
            group: source.group.clone(),
        };
        Self::load_files(&files, source)
    }

    /// Loads an arm from copies of its files.
    pub(crate) fn load_files(files: &ArmFiles, source: ArmSource) -> PyResult<Self> {
        let model = files.load().map_err(|e| option_error(&e))?;
        Ok(Self { model, source })
    }
}

/// Returns the error of an option of the command as that of an argument.
fn option_error(e: &InputError) -> PyErr {
    match e.place().strip_prefix("--") {
        Some(name) => argument_error(&name.replace('-', "_"), e.cause(), e.remedy()),
        None => error::input_error(e),
    }
}

/// Words for the method that finds the joint values.
const ENGINES: [(&str, IkEngine); 3] =
    [("auto", IkEngine::Auto), ("chain", IkEngine::Chain), ("dls", IkEngine::Dls)];
/// Words for the parts that must not touch obstacles, as `--body` of the command has them.
const BODIES: [(&str, CollisionModel); 3] = [
    ("rods", CollisionModel::Rods),
    ("shapes", CollisionModel::Shapes),
    ("own", CollisionModel::OwnShapes),
];
/// Words for the axes of a target that may be ignored: of its position, and of its orientation.
const AXES: [(&str, Axis); 6] = [
    ("x", Axis::Along(0)),
    ("y", Axis::Along(1)),
    ("z", Axis::Along(2)),
    ("rx", Axis::About(0)),
    ("ry", Axis::About(1)),
    ("rz", Axis::About(2)),
];

/// The parts of an arm that must not touch obstacles.
#[derive(Clone, Copy, PartialEq)]
enum CollisionModel {
    /// The rods between its connectors.
    Rods,
    /// The collision shapes of its links.
    Shapes,
    /// These shapes, which must not touch each other either.
    OwnShapes,
}

/// An axis of a target, by number from 0.
#[derive(Clone, Copy)]
enum Axis {
    Along(usize),
    About(usize),
}

/// Returns the rows of an array, which must have this width.
fn matrix_rows(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
    width: usize,
) -> PyResult<Vec<Vec<f64>>> {
    let array = array.as_array();
    if array.ncols() != width {
        let cause = format!("has rows of {} numbers", array.ncols());
        return Err(argument_error(
            name,
            cause,
            format!("give an array of the shape (n, {width})"),
        ));
    }
    let rows: Vec<Vec<f64>> = array.rows().into_iter().map(|row| row.to_vec()).collect();
    if let Some(k) = rows.iter().position(|row| !row.iter().all(|x| x.is_finite())) {
        let cause = format!("row {k} is {:?}", rows[k]);
        return Err(argument_error(name, cause, "give finite numbers"));
    }
    Ok(rows)
}

fn row_vector(row: &[f64]) -> Vector {
    std::array::from_fn(|k| row[k])
}

fn to_array<'py>(
    py: Python<'py>,
    flat: Vec<f64>,
    shape: Vec<usize>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    PyArray1::from_vec(py, flat).reshape(shape)
}

/// Returns the motions of the arms of a recorded run: the native part of `sidestep.trajectories`.
#[pyfunction]
pub(crate) fn arm_trajectories(
    py: Python<'_>,
    folder: PathBuf,
    every: u64,
) -> PyResult<Vec<Bound<'_, PyAny>>> {
    let read = py.detach(|| {
        let recorded = RecordedRun::open(worlds::list(), &folder)?;
        sidestep_session::arm_trajectories(&recorded, 0..=recorded.cycles_done, every)
    });
    let arms = read.map_err(|e: Error| error::session_error(&e))?;
    arms.into_iter().map(|arm| trajectory_result(py, arm)).collect()
}

fn trajectory_result(py: Python<'_>, arm: ArmTrajectory) -> PyResult<Bound<'_, PyAny>> {
    let shape = || vec![arm.times_s.len(), arm.joints.len()];
    Fields::new(py)
        .with("chain", arm.chain)?
        .with("name", &arm.name)?
        .with("joints", PyList::new(py, &arm.joints)?)?
        .with("times_s", arm.times_s.to_pyarray(py))?
        .with("positions", to_array(py, arm.positions.concat(), shape())?)?
        .with("velocities", to_array(py, arm.velocities.concat(), shape())?)?
        .with("accelerations", to_array(py, arm.accelerations.concat(), shape())?)?
        .build(ResultClass("sidestep._arm", "ArmTrajectory"))
}

#[pymethods]
impl Arm {
    #[new]
    #[pyo3(signature = (urdf, *, base=None, tip=None, srdf=None, group=None))]
    fn new(
        urdf: PathBuf,
        base: Option<String>,
        tip: Option<String>,
        srdf: Option<PathBuf>,
        group: Option<String>,
    ) -> PyResult<Self> {
        if group.is_some() && srdf.is_none() {
            return Err(argument_error("group", "groups are in SRDF files", "give srdf as well"));
        }
        if group.is_some() && (base.is_some() || tip.is_some()) {
            return Err(argument_error("group", "it names base and tip", "leave base and tip out"));
        }
        let files = ArmFiles { urdf, base, tip, srdf, group };
        let model = files.load().map_err(|e| option_error(&e))?;
        let with_text = |path: &PathBuf| -> PyResult<(PathBuf, String)> {
            let text = std::fs::read_to_string(path);
            let failed = |e| error::RecordError::new_err(format!("{}: {e}", path.display()));
            Ok((std::path::absolute(path).unwrap_or_else(|_| path.clone()), text.map_err(failed)?))
        };
        let source = ArmSource {
            urdf: with_text(&files.urdf)?,
            srdf: files.srdf.as_ref().map(with_text).transpose()?,
            base: files.base,
            tip: files.tip,
            group: files.group,
        };
        Ok(Self { model, source })
    }

    /// Name of the robot.
    #[getter]
    fn robot(&self) -> &str {
        &self.model.model.name
    }

    /// Name of the base link.
    #[getter]
    fn base(&self) -> &str {
        &self.model.chain.base
    }

    /// Name of the tip link.
    #[getter]
    fn tip(&self) -> &str {
        &self.model.chain.tip
    }

    /// Names of the joints that have a value, outward from the base.
    #[getter]
    fn joints(&self) -> Vec<&str> {
        self.model.chain.variables.iter().map(|v| v.name.as_str()).collect()
    }

    /// Units of their values: rad or m.
    #[getter]
    fn units(&self) -> Vec<&'static str> {
        self.model.chain.variables.iter().map(|v| v.motion.unit()).collect()
    }

    /// Lowest and highest values, of the shape (joints, 2); infinite where a joint has no limits.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let variables = &self.model.chain.variables;
        let mut flat = Vec::with_capacity(2 * variables.len());
        for variable in variables {
            match &variable.limits {
                Some(limits) => flat.extend([limits.lower, limits.upper]),
                None => flat.extend([f64::NEG_INFINITY, f64::INFINITY]),
            }
        }
        to_array(py, flat, vec![variables.len(), 2])
    }

    /// The joint values of a named posture of the SRDF file; without a name, each value is as near to zero as its
    /// limits allow.
    ///
    /// Raises InputError when there is no such posture.
    ///
    /// >>> arm.posture().shape == (len(arm.joints),)
    /// True
    #[pyo3(signature = (name=None))]
    fn posture<'py>(
        &self,
        py: Python<'py>,
        name: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.model.named_posture(name).map_err(|e| option_error(&e))?))
    }

    /// What was not taken as it stood in its files, as `Finding` objects, like `sidestep.inspect` names it.
    ///
    /// >>> [finding.treatment for finding in arm.findings]
    /// []
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let findings = self.model.findings().into_iter().map(|finding| {
            let fields = serde_json::to_value(finding).expect("a finding is plain data");
            Fields::from_json(py, &fields)?.build(ResultClass("sidestep._inspect", "Finding"))
        });
        PyList::new(py, findings.collect::<PyResult<Vec<_>>>()?)
    }

    /// Pickles the arm with the texts of its files; meshes that these name are taken from their places.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickle<'py, (ArmSource,)>> {
        Ok((pickle::maker(py, "unpack_arm")?, (self.source.clone(),)))
    }

    fn __repr__(&self) -> String {
        let robot = &self.model.model.name;
        let chain = &self.model.chain;
        format!("Arm({robot}, {} to {}, {} joints)", chain.base, chain.tip, chain.variables.len())
    }

    /// Forward kinematics: the native part of `sidestep.fk`. Joint values of the shape (n, joints).
    fn forward<'py>(
        &self,
        py: Python<'py>,
        joints: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let chain = &self.model.chain;
        let rows = matrix_rows("joints", &joints, chain.variables.len())?;
        let skeleton = chain.skeleton();
        let frames: Vec<LinkFrames> =
            py.detach(|| rows.iter().map(|row| chain.forward_kinematics(row)).collect());
        let n = rows.len();
        let tip = frames.iter().flat_map(|f| f.tip.origin_m).collect();
        let rotation = frames.iter().flat_map(|f| f.tip.rotation.concat()).collect();
        let quaternion = frames.iter().flat_map(|f| f.tip.quaternion()).collect();
        let connectors =
            frames.iter().flat_map(|f| chain.connector_positions(&skeleton, f).concat()).collect();
        // Counted in a posture that always exists, because there may be no rows.
        let count = chain
            .connector_positions(&skeleton, &chain.forward_kinematics(&chain.rest_values()))
            .len();
        let inside_limits: Vec<bool> =
            rows.iter().map(|row| chain.outside_limits(row).is_empty()).collect();
        Fields::new(py)
            .with("tip", to_array(py, tip, vec![n, 3])?)?
            .with("rotation", to_array(py, rotation, vec![n, 3, 3])?)?
            .with("quaternion", to_array(py, quaternion, vec![n, 4])?)?
            .with("connectors", to_array(py, connectors, vec![n, count, 3])?)?
            .with("inside_limits", inside_limits.to_pyarray(py))?
            .build(ResultClass("sidestep._arm", "FkResult"))
    }

    /// Inverse kinematics: the native part of `sidestep.ik`. Targets of the shape (n, 3), (n, 6) with roll, pitch and
    /// yaw, or (n, 7) with a quaternion x, y, z, w.
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        targets: PyReadonlyArray2<'py, f64>,
        start: PyReadonlyArray2<'py, f64>,
        options: IkOptions,
    ) -> PyResult<Bound<'py, PyAny>> {
        let chain = &self.model.chain;
        let targets = matrix_rows("targets", &targets, targets.as_array().ncols())?;
        let start = matrix_rows("start", &start, chain.variables.len())?;
        let (goal, remarks) = options.common_goal(&self.model)?;
        if start.len() != 1 && start.len() != targets.len() {
            let cause = format!("{} postures for {} targets", start.len(), targets.len());
            return Err(argument_error("start", cause, "give one for all, or one for each"));
        }
        let goals = targets.iter().map(|target| options.target_goal(&goal, target));
        let goals = goals.collect::<PyResult<Vec<ArmGoal>>>()?;
        let numbers: Vec<usize> = (0..goals.len()).collect();
        let solved = run_polling(py, |watcher| {
            let mut solved: Vec<(usize, IkResult)> = Vec::with_capacity(goals.len());
            run_trials(
                &numbers,
                options.workers.max(1),
                |&k| {
                    let start = &start[if start.len() == 1 { 0 } else { k }];
                    let solve = || chain.solve(&goals[k], start).map(|result| (k, result));
                    watcher.should_continue().then(solve)
                },
                &mut |result| {
                    solved.push(result);
                    Ok::<_, InputError>(())
                },
            )?;
            // Results arrive in the order of their completion, which depends on the workers.
            solved.sort_by_key(|(k, _)| *k);
            Ok(solved.into_iter().map(|(_, result)| result).collect::<Vec<_>>())
        })?;
        result_arrays(
            py,
            solved.map_err(|e: InputError| option_error(&e))?,
            chain.variables.len(),
            remarks,
        )
    }
}

/// The options of all targets.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct IkOptions {
    free: Vec<String>,
    engine: String,
    tolerance_m: f64,
    tolerance_rad: f64,
    solutions: usize,
    apart: f64,
    nearest: bool,
    restarts: usize,
    seed: u64,
    obstacles: Vec<[f64; 4]>,
    body: String,
    ignore_limits: bool,
    workers: usize,
}

impl IkOptions {
    /// Returns the part of the goal that all targets share, and remarks on the arm's body.
    fn common_goal(&self, arm: &ArmModel) -> PyResult<(ArmGoal, Vec<String>)> {
        let engine = choose("engine", &self.engine, &ENGINES)?;
        let model = choose("body", &self.body, &BODIES)?;
        let is_own = model == CollisionModel::OwnShapes;
        // Without obstacles and without the arm's own links, no shape can be touched: none is read.
        let has_shapes = is_own || model == CollisionModel::Shapes && !self.obstacles.is_empty();
        let (body, remarks) = match has_shapes.then(|| arm.body()) {
            Some((body, remarks)) => (Some(body), remarks),
            None => (None, Vec::new()),
        };
        if is_own && body.as_ref().is_none_or(ArmBody::is_empty) {
            let cause = [&["no link has a collision shape that can be read".into()], &remarks[..]];
            let remedy = "give the links boxes, cylinders, spheres or meshes (STL, OBJ, DAE)";
            return Err(argument_error("body", cause.concat().join("; "), remedy));
        }
        let goal = ArmGoal {
            engine,
            tolerance_m: self.tolerance_m,
            tolerance_rad: self.tolerance_rad,
            restarts: self.restarts,
            seed: self.seed,
            solutions: self.solutions,
            nearest: self.nearest,
            apart: self.apart,
            ignore_limits: self.ignore_limits,
            spheres: self.obstacles.iter().map(sphere).collect(),
            body,
            own_body: is_own,
            ..ArmGoal::new([0.0; 3])
        };
        Ok((goal, remarks))
    }

    /// Returns the goal of one target; the number of its values decides how its orientation is given.
    fn target_goal(&self, goal: &ArmGoal, target: &[f64]) -> PyResult<ArmGoal> {
        let position = row_vector(target);
        let target_pose = match target.len() {
            3 => Transform { origin_m: position, ..Transform::IDENTITY },
            6 => Transform::from_urdf_origin(&sidestep::import::urdf::Origin {
                xyz_m: position,
                rpy_rad: row_vector(&target[3..]),
            }),
            width if width != 7 => {
                let cause = format!("a target of {width} numbers");
                let remedy = "give 3 (a place), 6 (with roll, pitch, yaw) or 7 (with a quaternion)";
                return Err(argument_error("targets", cause, remedy));
            }
            _ => {
                let xyzw = std::array::from_fn(|k| target[3 + k]);
                Transform::from_quaternion("targets", position, xyzw)
                    .map_err(|e| option_error(&e))?
            }
        };
        let mut along = [false; 3];
        let mut about = [false; 3];
        for name in &self.free {
            match choose("free", name, &AXES)? {
                Axis::Along(axis) => along[axis] = true,
                Axis::About(axis) => about[axis] = true,
            }
        }
        let asked =
            PoseMask::with_free(target.len() > 3, along, about).map_err(|e| option_error(&e))?;
        Ok(ArmGoal { target: target_pose, asked, ..goal.clone() })
    }
}

fn sphere(&[x, y, z, radius_m]: &[f64; 4]) -> ObstacleSphere {
    ObstacleSphere { center_m: [x, y, z], radius_m }
}

/// Returns results as arrays, one row for each target.
fn result_arrays<'py>(
    py: Python<'py>,
    results: Vec<IkResult>,
    width: usize,
    remarks: Vec<String>,
) -> PyResult<Bound<'py, PyAny>> {
    let joints = results.iter().flat_map(|result| result.values.clone()).collect();
    let reached: Vec<bool> = results.iter().map(|result| result.reached).collect();
    let reasons = results.iter().map(|result| result.reason.as_ref().map(ToString::to_string));
    Fields::new(py)
        .with("joints", to_array(py, joints, vec![results.len(), width])?)?
        .with("reached", reached.to_pyarray(py))?
        .with("error_m", PyArray1::from_iter(py, results.iter().map(|result| result.error_m)))?
        .with("error_rad", PyArray1::from_iter(py, results.iter().map(|result| result.error_rad)))?
        .with(
            "iterations",
            PyArray1::from_iter(py, results.iter().map(|result| result.iterations as i64)),
        )?
        .with("starts", PyArray1::from_iter(py, results.iter().map(|result| result.starts as i64)))?
        .with("reasons", to_list(py, reasons)?)?
        .with("others", other_postures(py, &results, width)?)?
        .with("remarks", remarks)?
        .build(ResultClass("sidestep._arm", "IkResult"))
}

/// Returns the further postures of each target, one per row; targets have different numbers of them.
fn other_postures<'py>(
    py: Python<'py>,
    results: &[IkResult],
    width: usize,
) -> PyResult<Bound<'py, PyList>> {
    let others = PyList::empty(py);
    for result in results {
        let flat: Vec<f64> = result.others.iter().flat_map(|other| other.values.clone()).collect();
        let rows: Bound<'_, PyArray2<f64>> =
            PyArray1::from_vec(py, flat).reshape([result.others.len(), width])?;
        others.append(rows)?;
    }
    Ok(others)
}

/// Makes an arm again: from its files, where they still hold the same texts, as they do on the same machine; else from
/// these texts alone, without the meshes that the files name.
///
/// Raises InputError when a text is wrong.
#[pyfunction]
pub(crate) fn unpack_arm(source: ArmSource) -> PyResult<Arm> {
    let is_there = |(path, text): &(PathBuf, String)| {
        std::fs::read_to_string(path).is_ok_and(|found| found == *text)
    };
    if is_there(&source.urdf) && source.srdf.as_ref().is_none_or(is_there) {
        return Arm::load(source);
    }
    let folder = tempfile::tempdir().map_err(|e| error::RecordError::new_err(e.to_string()))?;
    let copy = |name: &str, text: &str| -> PyResult<PathBuf> {
        let copy = folder.path().join(name);
        let written = std::fs::write(&copy, text);
        written.map_err(|e| error::RecordError::new_err(format!("{}: {e}", copy.display())))?;
        Ok(copy)
    };
    let files = ArmFiles {
        urdf: copy("arm.urdf", &source.urdf.1)?,
        srdf: source.srdf.as_ref().map(|(_, text)| copy("arm.srdf", text)).transpose()?,
        base: source.base.clone(),
        tip: source.tip.clone(),
        group: source.group.clone(),
    };
    Arm::load_files(&files, source)
}
