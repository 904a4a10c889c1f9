//! Targets of an arm's tool with an orientation, straight lines of it, and targets of joint values.

use super::super::driver::{TargetPath, Targets};
use super::ChainScenarioCompiler;
use super::tasks::TaskSection;
use super::tool_keys::{FreeAxis, PathWord, ToolContext};
use sidestep_arms::Arm;
use sidestep_arms::kinematics::{ArmGoal, PoseMask, Transform};
use sidestep_arms::plan::JointGoal;
use sidestep_import::urdf::Origin;
use sidestep_kernel::InputError;
use std::ops::Range;

/// Angle at which an orientation counts as reached, unless it is given, rad: that of 1 mm at the end of a tool of 1 m.
const DEFAULT_TOLERANCE_RAD: f64 = 1e-3;

impl<const D: usize> TaskSection<D> {
    /// Returns the keys that an arm's tool alone may have, and whether they are given.
    fn tool_keys(&self) -> [(&'static str, bool); 7] {
        [
            ("rpy_rad", self.rpy_rad.is_some()),
            ("quaternions", self.quaternions.is_some()),
            ("free", self.free.is_some()),
            ("tolerance_rad", self.tolerance_rad.is_some()),
            ("joints", self.joints.is_some()),
            // Any path is that of every chain.
            ("path", self.path == Some(PathWord::Line)),
            ("blend_m", self.blend_m.is_some()),
        ]
    }

    /// Returns whether targets are more than places, so that they are always planned.
    pub(super) fn needs_plan(&self) -> bool {
        self.rpy_rad.is_some()
            || self.quaternions.is_some()
            || self.joints.is_some()
            || self.path == Some(PathWord::Line)
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Returns targets with what is asked of an arm's tool at each of them.
    pub(super) fn add_joint_goals(
        &self,
        s: &TaskSection<D>,
        tool: ToolContext<'_>,
        targets: Targets<D>,
        at: Range<usize>,
    ) -> Result<Targets<D>, InputError> {
        let given = s.tool_keys().into_iter().find(|(_, is_given)| *is_given);
        let Some((key, _)) = given else { return Ok(targets) };
        let Some(arm) = tool.arm.filter(|arm| tool.connector == arm.skeleton.rods.len()) else {
            let at = self.source.key_span(at, &[key]);
            let cause = "only the tool of an arm has orientations, lines and joint values as targets, and passes some";
            let remedy = match tool.arm {
                Some(arm) => format!("give connector = {}, the tool", arm.skeleton.rods.len()),
                None => "give the chain arm = { urdf = \"FILE\" }, or leave this out".into(),
            };
            return Err(self.source.error(at, cause, remedy));
        };
        if s.blend_m.is_some() && s.path == Some(PathWord::Line) {
            let at = self.source.key_span(at, &["blend_m"]);
            let cause = "a tool comes to rest at each end of a straight line";
            return Err(self.source.error(at, cause, "leave blend_m or path out"));
        }
        let count = s.joints.as_ref().map_or(targets.places.len(), Vec::len);
        if s.blend_m.is_some() && count == 1 {
            let at = self.source.key_span(at, &["blend_m"]);
            let cause = "a tool comes to rest at its last target, and there is no other one";
            return Err(self.source.error(at, cause, "give another target, or leave blend_m out"));
        }
        if let Some(values) = &s.joints {
            return self.joint_values(s, arm, values, at);
        }
        let only_blends =
            s.tool_keys().iter().all(|(key, is_given)| !is_given || *key == "blend_m");
        if only_blends {
            return Ok(targets);
        }
        let path = match s.path {
            Some(PathWord::Line) => TargetPath::Line,
            _ => TargetPath::Any,
        };
        let goals = self.poses(s, arm, &targets, at)?;
        Ok(Targets { goals, path, ..targets })
    }

    /// Returns targets of joint values.
    fn joint_values(
        &self,
        s: &TaskSection<D>,
        arm: &Arm,
        values: &[Vec<f64>],
        at: Range<usize>,
    ) -> Result<Targets<D>, InputError> {
        let others = ["rpy_rad", "quaternions", "free", "tolerance_rad", "path"];
        let mut given = s.tool_keys().into_iter().filter(|(_, is_given)| *is_given);
        let other = given.find(|(key, _)| others.contains(key)).map(|(key, _)| key);
        let other = other.or(s.targets_m.is_some().then_some("targets_m"));
        // Values of joints are reached exactly.
        let other = other.or(s.tolerance_m.is_some().then_some("tolerance_m"));
        if let Some(key) = other {
            let at = self.source.key_span(at, &[key]);
            let cause = format!("`{key}` beside `joints`, which are whole targets");
            return Err(self.source.error(at, cause, "leave one of them out"));
        }
        if values.is_empty() {
            let at = self.source.key_span(at, &["joints"]);
            let remedy = "give a list of a value for each joint, for each target";
            return Err(self.source.error(at, "no target", remedy));
        }
        let mut places = Vec::new();
        for (i, values) in values.iter().enumerate() {
            let place = format!("joints of target {i}");
            let checked = arm.serial.check_joint_values(&place, values);
            let checked = checked.and_then(|()| arm.serial.check_limits(&place, values));
            checked.map_err(|error| {
                let at = self.source.key_span(at.clone(), &["joints"]);
                self.source.error_from(at, &error)
            })?;
            let connectors = arm.connector_positions(values);
            places.extend(connectors.last().copied());
        }
        let goals = values.iter().cloned().map(JointGoal::Values).collect();
        Ok(Targets { places, goals, ..self.plain_targets(s, Vec::new()) })
    }

    /// Returns the poses at the targets; none where these are places alone, reached on any way.
    fn poses(
        &self,
        s: &TaskSection<D>,
        arm: &Arm,
        targets: &Targets<D>,
        at: Range<usize>,
    ) -> Result<Vec<JointGoal>, InputError> {
        let is_turned = s.rpy_rad.is_some() || s.quaternions.is_some();
        let free = s.free.as_deref().unwrap_or_default();
        let is_free = |axes: [FreeAxis; 3]| axes.map(|axis| free.contains(&axis));
        let along = is_free([FreeAxis::X, FreeAxis::Y, FreeAxis::Z]);
        let about = is_free([FreeAxis::Rx, FreeAxis::Ry, FreeAxis::Rz]);
        let is_line = s.path == Some(PathWord::Line);
        // A free coordinate is refused as one of the line.
        let frees_turn = s.free.is_some() && (!is_line || about.contains(&true));
        let of_turns = [("free", frees_turn), ("tolerance_rad", s.tolerance_rad.is_some())];
        let unused = of_turns.into_iter().find(|(_, is_given)| *is_given);
        if !is_turned && let Some((key, _)) = unused {
            let at = self.source.key_span(at, &[key]);
            let remedy = "add rpy_rad or quaternions, or leave this out";
            return Err(self.source.error(at, "no orientation is asked for", remedy));
        }
        let mask = PoseMask::with_free(is_turned, along, about).map_err(|error| {
            let at = self.source.key_span(at.clone(), &["free"]);
            self.source.error(at, error.cause(), error.remedy())
        })?;
        if is_line && !mask.has_whole_position() {
            let at = self.source.key_span(at, &["free"]);
            let cause = "a line whose position is free";
            return Err(self.source.error(at, cause, "free turns alone, or leave path out"));
        }
        let orientations = self.orientations(s, targets.places.len(), at)?;
        let tolerance_rad = s.tolerance_rad.map_or(DEFAULT_TOLERANCE_RAD, f64::from);
        let goals = targets.places.iter().zip(orientations).map(|(place, orientation)| {
            let target = Transform { origin_m: arm.to_base(*place), ..orientation };
            let pose = ArmGoal::from_pose(target);
            JointGoal::Pose(ArmGoal {
                asked: mask,
                tolerance_m: targets.tolerance_m,
                tolerance_rad,
                ..pose
            })
        });
        Ok(goals.collect())
    }

    /// Returns the orientation at each target; all alike where a single one is given, and none where none counts.
    fn orientations(
        &self,
        s: &TaskSection<D>,
        targets: usize,
        at: Range<usize>,
    ) -> Result<Vec<Transform>, InputError> {
        let (key, given) = match (&s.rpy_rad, &s.quaternions) {
            (Some(angles), None) => {
                let turned = |rpy_rad: &[f64; 3]| {
                    Transform::from_urdf_origin(&Origin { xyz_m: [0.0; 3], rpy_rad: *rpy_rad })
                };
                ("rpy_rad", angles.iter().map(turned).collect::<Vec<_>>())
            }
            (None, Some(quaternions)) => {
                let turned =
                    |xyzw: &[f64; 4]| Transform::from_quaternion("quaternions", [0.0; 3], *xyzw);
                let turned = quaternions.iter().map(turned).collect::<Result<Vec<_>, _>>();
                let turned = turned.map_err(|error| {
                    let at = self.source.key_span(at.clone(), &["quaternions"]);
                    self.source.error_from(at, &error)
                });
                ("quaternions", turned?)
            }
            (None, None) => return Ok(vec![Transform::IDENTITY; targets]),
            (Some(_), Some(_)) => {
                let at = self.source.key_span(at, &["quaternions"]);
                let cause = "orientations given twice";
                return Err(self.source.error(at, cause, "give rpy_rad or quaternions"));
            }
        };
        if given.iter().any(|turn| turn.rotation.iter().flatten().any(|x| !x.is_finite())) {
            let at = self.source.key_span(at, &[key]);
            return Err(self.source.error(
                at,
                "an orientation is not finite",
                "give finite numbers",
            ));
        }
        if given.len() == 1 {
            return Ok(vec![given[0]; targets]);
        }
        if given.len() != targets {
            let at = self.source.key_span(at, &[key]);
            let cause = format!("{} orientations for {targets} targets", given.len());
            return Err(self.source.error(at, cause, "give one for each target, or one for all"));
        }
        Ok(given)
    }

    /// Returns targets that are places.
    pub(super) fn plain_targets(
        &self,
        s: &TaskSection<D>,
        places: Vec<sidestep_rods::geometry::Point<D>>,
    ) -> Targets<D> {
        let tolerance_m = s.tolerance_m.map_or(super::tasks::DEFAULT_TOLERANCE_M, f64::from);
        let blend_m = s.blend_m.map(f64::from);
        Targets { places, tolerance_m, goals: Vec::new(), path: TargetPath::Any, blend_m }
    }
}
