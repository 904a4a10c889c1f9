//! What initiators are to do.

use super::super::driver::{Driver, MAX_MOTIONS, Targets, Task, Wander};
use super::super::geometry::Bounds;
use super::super::script::{Motion, Script, Turtle};
use super::navigators::NavigatorSection;
use super::{Compiler, MOST};
use serde::Deserialize;
use sidestep_kernel::InputError;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;

/// How fast initiators go, unless it is said.
const SPEED_M_S: f64 = 0.5;
/// How near counts as at a target, meters.
const TOLERANCE_M: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Rest,
    Wander,
    Script,
    Targets,
    Navigate,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TaskSection {
    kind: Kind,
    #[serde(default)]
    connector: usize,
    speed_m_s: Option<Spanned<f64>>,
    lasts_s: Option<Spanned<f64>>,
    patience_s: Option<Spanned<f64>>,
    turn_deg: Option<Spanned<f64>>,
    within_m: Option<Spanned<[Vec<f64>; 2]>>,
    script: Option<Spanned<String>>,
    script_file: Option<Spanned<String>>,
    targets_m: Option<Spanned<Vec<Vec<f64>>>>,
    tolerance_m: Option<Spanned<f64>>,
    navigator: Option<Spanned<NavigatorSection>>,
}

impl TaskSection {
    /// The connector that moves.
    pub(super) fn connector(&self) -> usize {
        self.connector
    }

    /// Whether it drives on wheels.
    pub(super) fn navigates(&self) -> bool {
        self.kind == Kind::Navigate
    }
}

impl Compiler<'_> {
    /// A task of a chain of `n` connectors.
    pub(super) fn task<const D: usize>(
        &self,
        section: &Spanned<TaskSection>,
        n: usize,
    ) -> Result<Task<D>, InputError> {
        let (s, at) = (section.get_ref(), section.span());
        if s.connector >= n {
            let cause = format!("connector = {} of a chain of {n}", s.connector);
            return Err(self.error(Some(at), cause, "count from 0"));
        }
        self.has_only_its_own(s, at.clone())?;
        Ok(Task {
            agent: s.connector,
            speed_m_s: self.positive(s.speed_m_s.as_ref(), "speed_m_s", SPEED_M_S)?,
            lasts_s: self.positive(s.lasts_s.as_ref(), "lasts_s", f64::INFINITY)?,
            patience_s: self.positive(s.patience_s.as_ref(), "patience_s", 5.0)?,
            driver: self.driver::<D>(s, at)?,
        })
    }

    fn driver<const D: usize>(
        &self,
        s: &TaskSection,
        at: Range<usize>,
    ) -> Result<Driver<D>, InputError> {
        Ok(match s.kind {
            Kind::Rest => Driver::Rest,
            Kind::Wander => Driver::Wander(Wander {
                turn_rad: self.positive(s.turn_deg.as_ref(), "turn_deg", 30.0)?.to_radians(),
                within: s.within_m.as_ref().map(|w| self.within(w)).transpose()?,
            }),
            Kind::Script => {
                let script = self.script(s, at.clone())?;
                self.try_script(&script, at)?;
                Driver::Script(Arc::new(script))
            }
            Kind::Targets => Driver::Targets(self.targets(s, at)?),
            Kind::Navigate if D != 2 => {
                let remedy = "set chain.dimensions = 2, or give another kind";
                return Err(self.error(Some(at), "only who drives in the plane navigates", remedy));
            }
            Kind::Navigate => {
                let speed_m_s = self.positive(s.speed_m_s.as_ref(), "speed_m_s", SPEED_M_S)?;
                Driver::Navigate(Arc::new(self.navigator(s.navigator.as_ref(), speed_m_s)?))
            }
        })
    }

    /// A box by two corners.
    pub(super) fn within<const D: usize>(
        &self,
        given: &Spanned<[Vec<f64>; 2]>,
    ) -> Result<Bounds<D>, InputError> {
        let [lo, hi] = given.get_ref();
        let at = given.span();
        let (lo, hi) = (
            self.point::<D>(lo, "within_m", at.clone())?,
            self.point::<D>(hi, "within_m", at.clone())?,
        );
        if (0..D).all(|i| lo[i] < hi[i]) {
            return Ok(Bounds { lo, hi });
        }
        let cause = format!("within_m from {lo:?} to {hi:?}");
        Err(self.error(Some(at), cause, "give the lower corner first, then the upper"))
    }

    fn script(&self, s: &TaskSection, at: Range<usize>) -> Result<Script, InputError> {
        match (&s.script, &s.script_file) {
            (Some(text), None) => {
                let place = format!("{}, script", self.source.place);
                Script::parse(&place, text.get_ref())
            }
            (None, Some(file)) => {
                let path = self.source.path(file.get_ref().as_ref());
                let text =
                    sidestep_scenario::file::read_text(&path, crate::script::MAX_BYTES as u64)?;
                Script::parse(&path.display().to_string(), &text)
            }
            _ => {
                let remedy = "give script = \"\"\"...\"\"\" or script_file = \"...\"";
                Err(self.error(Some(at), "a task of kind script needs one script", remedy))
            }
        }
    }

    /// Carries a script out once, so that it cannot fail while a run goes on: whether it comes to
    /// motions does not depend on where it begins, but for places beyond all numbers.
    fn try_script(&self, script: &Script, at: Range<usize>) -> Result<(), InputError> {
        for (n, motion) in script.motions(Turtle::default()).enumerate() {
            let is_far = match motion? {
                Motion::MoveTo { position_m } => position_m.iter().any(|x| x.abs() > MOST),
                _ => false,
            };
            if is_far || n >= MAX_MOTIONS {
                let cause = match is_far {
                    true => "the script leads further than 1e6 m".into(),
                    false => format!("the script comes to more than {MAX_MOTIONS} motions"),
                };
                return Err(self.error(Some(at), cause, "go less far, or repeat less often"));
            }
        }
        Ok(())
    }

    fn targets<const D: usize>(
        &self,
        s: &TaskSection,
        at: Range<usize>,
    ) -> Result<Targets<D>, InputError> {
        let Some(given) = s.targets_m.as_ref().filter(|list| !list.get_ref().is_empty()) else {
            let remedy = "add targets_m = [[x, y], ...]";
            return Err(self.error(Some(at), "a task of kind targets needs targets", remedy));
        };
        let place = |p: &Vec<f64>| self.point::<D>(p, "targets_m", given.span());
        Ok(Targets {
            places: given.get_ref().iter().map(place).collect::<Result<_, _>>()?,
            tolerance_m: self.positive(s.tolerance_m.as_ref(), "tolerance_m", TOLERANCE_M)?,
        })
    }

    /// Refuses keys that do nothing in a task of this kind.
    fn has_only_its_own(&self, s: &TaskSection, at: Range<usize>) -> Result<(), InputError> {
        let keys = [
            ("turn_deg", s.turn_deg.is_some(), Kind::Wander),
            ("within_m", s.within_m.is_some(), Kind::Wander),
            ("script", s.script.is_some(), Kind::Script),
            ("script_file", s.script_file.is_some(), Kind::Script),
            ("targets_m", s.targets_m.is_some(), Kind::Targets),
            ("tolerance_m", s.tolerance_m.is_some(), Kind::Targets),
            ("navigator", s.navigator.is_some(), Kind::Navigate),
        ];
        let foreign = keys.iter().find(|(_, is_given, kind)| *is_given && *kind != s.kind);
        match foreign {
            None => Ok(()),
            Some((key, ..)) => {
                let cause = format!("`{key}` does nothing in a task of kind {:?}", s.kind);
                Err(self.error(Some(at), cause.to_lowercase(), "leave it out"))
            }
        }
    }
}
