//! Arms from URDF files.

use super::{ChainScenarioCompiler, PositiveNumber};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_arms::kinematics::{ArmBody, SerialChain, Transform};
use sidestep_arms::motion::{MotionFilter, assumed_speeds, joint_rates, rates_cut_by};
use sidestep_arms::{Arm, RateSources};
use sidestep_import::report::Finding;
use sidestep_import::urdf::joint_limits::{self, GivenRates, JointRates};
use sidestep_import::urdf::srdf::Semantics;
use sidestep_import::urdf::{Model, Origin, Shape, Solid, Solids};
use sidestep_kernel::InputError;
use sidestep_scenario::Spanned;
use sidestep_scenario::file::read_bytes;
use std::collections::BTreeSet;
use std::ops::Range;

/// Name of a model that stands in the scenario itself; its meshes are beside the scenario.
const URDF_TEXT: &str = "urdf_text";
/// Largest size of a file of shapes, in bytes: a million points of hulls.
const MAX_SOLIDS_BYTES: u64 = 24 << 20;
/// Radius of rods where a link of an arm with shapes has none, m: a line that is seen by queries of distance.
const THIN_ROD_M: f64 = 1e-3;

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ArmSection {
    /// File of the arm (URDF).
    urdf: Option<String>,
    /// The arm itself (URDF), in place of a file.
    urdf_text: Option<String>,
    /// Link that stands still; the root by default.
    base: Option<String>,
    /// Link that is the tip.
    tip: Option<String>,
    /// File of postures (SRDF).
    srdf: Option<String>,
    /// Name of the posture at the start.
    posture: Option<String>,
    /// Values of the joints at the start, in radians or meters.
    joints: Option<Vec<f64>>,
    /// File of the highest speeds, accelerations and jerks of joints (joint_limits.yaml of MoveIt).
    joint_limits: Option<String>,
    /// Highest speed of all joints, in rad/s or m/s.
    max_velocity: Option<PositiveNumber>,
    /// Highest acceleration of all joints, in rad/s2 or m/s2.
    max_acceleration: Option<PositiveNumber>,
    /// Highest jerk of all joints, in rad/s3 or m/s3.
    max_jerk: Option<PositiveNumber>,
    /// The tool that the tip carries.
    pub(super) tool: Option<ToolSection>,
    /// What of it must not touch anything.
    body: Option<BodyWord>,
    /// File of the shapes of its links as they were read, which a recorded run keeps in place of meshes.
    solids: Option<String>,
}

/// What of an arm must not touch anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum BodyWord {
    /// Rods and connectors of the radii of its chain.
    Rods,
    /// The collision shapes of its links, and rods where a link has none.
    Shapes,
}

/// A tool on the tip of an arm, and its load.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolSection {
    /// The point that targets are for, in the frame of the tip.
    #[serde(default)]
    xyz_m: [f64; 3],
    /// Roll, pitch and yaw of the tool's frame in that of the tip, as in URDF.
    #[serde(default)]
    rpy_rad: [f64; 3],
    /// Radius of the tool, a rod from the last joint axis to its point.
    pub(super) radius_m: Option<PositiveNumber>,
    /// Radius of the load, a ball around the point.
    pub(super) load_radius_m: Option<PositiveNumber>,
}

impl ToolSection {
    /// Returns the frame of the tool in that of the tip; none if a number is out of range.
    fn transform(&self) -> Option<Transform> {
        let is_valid = |x: &f64| x.abs() <= MAX_TOOL;
        let numbers = self.xyz_m.iter().chain(&self.rpy_rad);
        let origin = Origin { xyz_m: self.xyz_m, rpy_rad: self.rpy_rad };
        numbers.clone().all(is_valid).then(|| Transform::from_urdf_origin(&origin))
    }
}

/// Largest coordinate of a tool, m and rad: more is a mistake.
const MAX_TOOL: f64 = 1e3;

impl ArmSection {
    /// Returns the rates that no joint exceeds.
    fn highest_rates(&self) -> GivenRates {
        GivenRates {
            speed: self.max_velocity.map(f64::from),
            acceleration: self.max_acceleration.map(f64::from),
            jerk: self.max_jerk.map(f64::from),
        }
    }

    /// Returns where the rates of joints are from; `given` are those of a file.
    fn rate_sources(&self, serial: &SerialChain, given: &JointRates) -> RateSources {
        let at_most = self.highest_rates();
        let assumed_speeds = assumed_speeds(serial, given, at_most);
        RateSources { assumed_speeds, cut: rates_cut_by(serial, given, at_most) }
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Returns an arm with its base at `at_m`.
    pub(super) fn compile_arm(
        &self,
        section: &Spanned<ArmSection>,
        at_m: [f64; 3],
    ) -> Result<Arm, InputError> {
        let s = section.get_ref();
        let at = section.span();
        let model = self.model(s, at.clone())?;
        let base = match &s.base {
            Some(name) => self.link(&model, "base", name, at.clone())?,
            None => model.root,
        };
        let tip = match &s.tip {
            Some(name) => self.link(&model, "tip", name, at.clone())?,
            None => model.default_tip(),
        };
        let place = s.urdf.as_deref().unwrap_or("urdf_text");
        let serial = SerialChain::new(&model, base, tip, place)
            .map_err(|error| self.source.error_from(at.clone(), &error))?;
        let serial = match &s.tool {
            Some(tool) => {
                let tool = tool.transform().ok_or_else(|| {
                    let at = self.source.key_span(at.clone(), &["tool"]);
                    let remedy = format!("give finite numbers up to {MAX_TOOL:e}");
                    self.source.error(at, "a tool out of range", remedy)
                })?;
                serial.with_tool(&tool)
            }
            None => serial,
        };
        if serial.variables.is_empty() {
            let at = self.source.key_span(at, &["tip", "base", "urdf", "urdf_text"]);
            let cause = format!("nothing moves between {} and {}", serial.base, serial.tip);
            return Err(self.source.error(at, cause, "give another base or another tip"));
        }
        let mut findings: Vec<Finding> = match &s.tip {
            Some(_) => model.findings_with_tip().cloned().collect(),
            None => model.report.findings.clone(),
        };
        let semantics = self.semantics(s, &model, at.clone())?;
        findings.extend(semantics.iter().flat_map(|semantics| semantics.report.findings.clone()));
        let values = self.values(s, (&model, &serial), semantics.as_ref(), at.clone())?;
        serial
            .check_limits("joints", &values)
            .map_err(|error| self.invalid_posture_error(at.clone(), &error))?;
        let given = self.joint_limits(s, &serial, at.clone())?;
        let rates = joint_rates(&serial, &given, s.highest_rates());
        let rate_sources = s.rate_sources(&serial, &given);
        let motion = MotionFilter::new(rates, self.dt_s())
            .map_err(|error| self.source.error_from(at, &error))?;
        let arm = Arm { rate_sources, ..Arm::new(serial, at_m, values, motion) };
        let may_touch = |links: &BTreeSet<usize>| match &semantics {
            Some(semantics) => semantics.may_touch(links),
            None => Vec::new(),
        };
        let arm = self.with_body(section, &model, arm, may_touch)?;
        findings.extend(arm.findings.iter().cloned());
        Ok(Arm { findings, ..arm })
    }

    /// Returns an arm with the shapes of its links, if some of those that move have any and they are not left out. Its
    /// findings are what was said of shapes.
    fn with_body(
        &self,
        section: &Spanned<ArmSection>,
        model: &Model,
        arm: Arm,
        may_touch: impl Fn(&BTreeSet<usize>) -> Vec<(usize, usize)>,
    ) -> Result<Arm, InputError> {
        let s = section.get_ref();
        let at = section.span();
        if s.body == Some(BodyWord::Rods) {
            let unused = [("solids", s.solids.is_some(), false)];
            self.source.refuse_unused_keys(at, &unused, "with body = \"rods\"")?;
            return Ok(arm);
        }
        let read = match &s.solids {
            Some(file) => {
                Solids { solids: self.solids_file(file, model, at.clone())?, ..Solids::default() }
            }
            None => {
                model.solids(&self.source.path(s.urdf.as_deref().unwrap_or(URDF_TEXT).as_ref()))
            }
        };
        let links: BTreeSet<usize> = read.solids.iter().map(|solid| solid.link).collect();
        let body = ArmBody::new(model, &arm.serial, &read.solids, &may_touch(&links));
        if !body.has_moving_shape() {
            if s.body == Some(BodyWord::Shapes) {
                let at = self.source.key_span(at, &["body"]);
                let cause = "no link of the arm that moves has a collision shape";
                return Err(self.source.error(at, cause, "leave body out: its rods count"));
            }
            return Ok(arm);
        }
        let tool = s.tool.as_ref();
        let radii_m = [tool.and_then(|t| t.radius_m), tool.and_then(|t| t.load_radius_m)];
        let body = body.with_rods(&arm.serial, &arm.skeleton, THIN_ROD_M).with_tool(
            &arm.serial,
            &arm.skeleton,
            radii_m.map(|radius| radius.map(f64::from)),
        );
        let has_meshes = read.solids.iter().any(|solid| matches!(solid.shape, Shape::Hull { .. }));
        // A recorded run has the model's text, but not its meshes.
        let solids = if has_meshes { read.solids } else { Vec::new() };
        let findings = read.report.findings;
        Ok(Arm { findings, solids, ..arm.with_body(body) })
    }

    /// Returns the shapes that a recorded run has kept.
    fn solids_file(
        &self,
        file: &str,
        model: &Model,
        at: Range<usize>,
    ) -> Result<Vec<Solid>, InputError> {
        let path = self.source.path(file.as_ref());
        let bytes = read_bytes(&path, MAX_SOLIDS_BYTES);
        let bytes = self.source.with_file_key(at.clone(), "solids", bytes)?;
        let solids: Option<Vec<Solid>> = postcard::from_bytes(&bytes).ok();
        let fits = |solid: &Solid| solid.link < model.links.len() && solid.is_finite();
        solids.filter(|solids| solids.iter().all(fits)).ok_or_else(|| {
            let cause = format!("{} holds no shapes of this model", path.display());
            let remedy = "leave solids out: the shapes are then read from the model";
            let at = self.source.key_span(at, &["solids"]);
            self.source.error(at, cause, remedy)
        })
    }

    /// Returns the link that a key names; errors point at that key.
    fn link(
        &self,
        model: &Model,
        key: &str,
        name: &str,
        at: Range<usize>,
    ) -> Result<usize, InputError> {
        model.link(key, name).map_err(|error| {
            let at = self.source.key_span(at, &[key]);
            self.source.error_from(at, &error)
        })
    }

    /// Returns an error about the joint values at the start, at the key that gives them.
    fn invalid_posture_error(&self, at: Range<usize>, error: &InputError) -> InputError {
        let at = self.source.key_span(at, &["joints", "posture"]);
        self.source.error_from(at, error)
    }

    /// Returns the model of an arm: from a file, or from the scenario itself.
    fn model(&self, s: &ArmSection, at: Range<usize>) -> Result<Model, InputError> {
        match (&s.urdf, &s.urdf_text) {
            (Some(file), None) => {
                let model = Model::load(&self.source.path(file.as_ref()));
                self.source.with_file_key(at, "urdf", model)
            }
            (None, Some(text)) => {
                let model = Model::parse("urdf_text", text);
                self.source.with_file_key(at, "urdf_text", model)
            }
            _ => {
                let remedy = "give urdf = \"FILE\", or urdf_text = the text of such a file";
                let at = self.source.key_span(at, &["urdf_text", "urdf"]);
                Err(self.source.error(at, "an arm needs one model", remedy))
            }
        }
    }

    /// Returns the postures of an arm, if it names a file of them.
    fn semantics(
        &self,
        s: &ArmSection,
        model: &Model,
        at: Range<usize>,
    ) -> Result<Option<Semantics>, InputError> {
        let Some(file) = &s.srdf else { return Ok(None) };
        let semantics = Semantics::load(&self.source.path(file.as_ref()), model);
        self.source.with_file_key(at, "srdf", semantics).map(Some)
    }

    /// Returns the rates of joints in a file of them, if one is named.
    fn joint_limits(
        &self,
        s: &ArmSection,
        serial: &SerialChain,
        at: Range<usize>,
    ) -> Result<JointRates, InputError> {
        let Some(file) = &s.joint_limits else { return Ok(JointRates::new()) };
        let rates = joint_limits::load(&self.source.path(file.as_ref()));
        let rates = self.source.with_file_key(at.clone(), "joint_limits", rates)?;
        // Files have the joints of grippers too; one with none of the arm's is that of another robot.
        if !serial.variables.iter().any(|variable| rates.contains_key(&variable.name)) {
            let names: Vec<&str> = serial.variables.iter().map(|v| v.name.as_str()).collect();
            let at = self.source.key_span(at, &["joint_limits"]);
            let cause = "the file has no joint of this arm";
            let remedy = format!("give limits of some of: {}", names.join(", "));
            return Err(self.source.error(at, cause, remedy));
        }
        Ok(rates)
    }

    /// Returns the joint values at the start: given, of a named posture, or at rest.
    fn values(
        &self,
        s: &ArmSection,
        (model, serial): (&Model, &SerialChain),
        semantics: Option<&Semantics>,
        at: Range<usize>,
    ) -> Result<Vec<f64>, InputError> {
        match (&s.joints, &s.posture, semantics) {
            (Some(values), None, None) => {
                serial
                    .check_joint_values("joints", values)
                    .map_err(|error| self.invalid_posture_error(at, &error))?;
                Ok(values.clone())
            }
            (None, Some(name), Some(semantics)) => {
                let posture = semantics
                    .posture("posture", name)
                    .map_err(|error| self.invalid_posture_error(at, &error))?;
                Ok(serial.posture_values(model, &posture))
            }
            (None, None, None) => Ok(serial.rest_values()),
            _ => {
                let remedy = "give joints = [...], or srdf and posture, or none of them";
                let at = self.source.key_span(at, &["posture", "srdf", "joints"]);
                Err(self.source.error(at, "a posture given twice, or by half", remedy))
            }
        }
    }
}
