//! An arm of a robot model: the files, and the links or the group that choose it.

use super::body::ArmBody;
use super::serial::SerialChain;
use sidestep_import::report::Finding;
use sidestep_import::urdf::srdf::Semantics;
use sidestep_import::urdf::{Model, Shape, Solids};
use sidestep_kernel::InputError;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The files of a robot model, and the part of it that is the arm. Errors name it by the options of the
/// command: `--base`, `--tip`, `--group`, `--posture`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ArmFiles {
    /// Path of the robot model; errors name it where no option chose the link.
    pub urdf: PathBuf,
    /// The base link; the root where it is absent.
    pub base: Option<String>,
    /// The tip link; the end of the longest arm where it is absent.
    pub tip: Option<String>,
    /// Path of the groups, named postures and pairs that may touch; they are optional.
    pub srdf: Option<PathBuf>,
    /// The group of the SRDF file that base and tip are taken from, in place of `base` and `tip`.
    pub group: Option<String>,
}

/// An arm, with the model that it is a part of.
#[derive(Debug, Clone)]
pub struct ArmModel {
    /// The whole robot, also what is beside the arm.
    pub model: Model,
    /// Groups, postures and pairs that may touch; `None` without an SRDF file.
    pub semantics: Option<Semantics>,
    /// The joints from base to tip.
    pub chain: SerialChain,
    urdf: PathBuf,
    is_tip_given: bool,
}

impl ArmFiles {
    /// Reads the files and returns the arm.
    ///
    /// # Errors
    /// When a file, a link or a group is wrong.
    pub fn load(&self) -> Result<ArmModel, InputError> {
        let model = Model::load(&self.urdf)?;
        let semantics = self.srdf.as_ref().map(|path| Semantics::load(path, &model)).transpose()?;
        let chain = self.chain(&model, semantics.as_ref())?;
        let is_tip_given = self.tip.is_some() || self.group.is_some();
        Ok(ArmModel { model, semantics, chain, urdf: self.urdf.clone(), is_tip_given })
    }

    fn chain(
        &self,
        model: &Model,
        semantics: Option<&Semantics>,
    ) -> Result<SerialChain, InputError> {
        if let (Some(name), Some(semantics)) = (&self.group, semantics) {
            let (base, tip) = semantics.ends("--group", name, model)?;
            return SerialChain::new(model, base, tip, "--group");
        }
        let base = match &self.base {
            Some(name) => model.link("--base", name)?,
            None => model.root,
        };
        let tip = match &self.tip {
            Some(name) => model.link("--tip", name)?,
            None => model.default_tip(),
        };
        let place = match (&self.tip, &self.base) {
            (Some(_), _) => "--tip".into(),
            (None, Some(_)) => "--base".into(),
            (None, None) => self.urdf.display().to_string(),
        };
        SerialChain::new(model, base, tip, &place)
    }
}

impl ArmModel {
    /// Returns the joint values of a named posture of the SRDF file, or those at rest.
    ///
    /// # Errors
    /// When there is no such posture.
    pub fn named_posture(&self, name: Option<&str>) -> Result<Vec<f64>, InputError> {
        let Some(name) = name else { return Ok(self.chain.rest_values()) };
        let Some(semantics) = &self.semantics else {
            let cause = format!("`{name}` is a posture of an SRDF file, and there is none");
            return Err(InputError::new("--posture", cause, "give the SRDF file as well"));
        };
        let posture = semantics.posture("--posture", name)?;
        Ok(self.chain.posture_values(&self.model, &posture))
    }

    /// Returns what was not taken as it stood in its files.
    pub fn findings(&self) -> Vec<&Finding> {
        let semantics = self.semantics.iter().flat_map(|semantics| &semantics.report.findings);
        if self.is_tip_given {
            return self.model.findings_with_tip().chain(semantics).collect();
        }
        self.model.report.findings.iter().chain(semantics).collect()
    }

    /// Returns the shapes of its links, and remarks on those that are not among them or stand as others.
    pub fn body(&self) -> (ArmBody, Vec<String>) {
        let Solids { solids, report } = self.model.solids(&self.urdf);
        let links: BTreeSet<usize> = solids.iter().map(|solid| solid.link).collect();
        let may_touch = self.semantics.as_ref().map_or_else(Vec::new, |s| s.may_touch(&links));
        let body = ArmBody::new(&self.model, &self.chain, &solids, &may_touch);
        let mut remarks = Vec::new();
        let hulls = body.hulls();
        if hulls > 0 {
            remarks.push(format!("meshes stand as their convex hulls: {hulls}"));
        }
        let meshes =
            solids.iter().filter(|solid| matches!(solid.shape, Shape::Hull { .. })).count();
        if meshes > hulls {
            let flat = meshes - hulls;
            remarks.push(format!("meshes without thickness stand as boxes: {flat}"));
        }
        remarks.extend(report.findings.iter().map(ToString::to_string));
        (body, remarks)
    }
}
