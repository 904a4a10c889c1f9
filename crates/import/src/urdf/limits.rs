//! Limits of a joint: its range and its highest speed.

use super::numbers::MAX_COORDINATE;
use super::unused::record_units_of_limits;
use super::{JointKind, Limits};
use crate::xml::Element;
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;

/// The attributes of `<limit>` that are a range.
const LIMITS: [&str; 2] = ["lower", "upper"];

/// The attributes of `<safety_controller>` that are a range.
const SOFT_LIMITS: [&str; 2] = ["soft_lower_limit", "soft_upper_limit"];

/// The range in which the controller of a joint keeps it.
struct SoftLimits<'a> {
    element: Element<'a>,
    range: [f64; 2],
}

impl SoftLimits<'_> {
    /// Returns what they leave of the limits of the joint. `MoveIt` (`jointBoundsFromURDF`), TRAC-IK and `ros_control`
    /// obey both, so that a posture outside is one that the robot refuses. The file says so: it is no guess.
    fn narrow(&self, [lower, upper]: [f64; 2]) -> Result<[f64; 2], InputError> {
        let [soft_lower, soft_upper] = self.range;
        let narrowed = [lower.max(soft_lower), upper.min(soft_upper)];
        if narrowed[0] > narrowed[1] {
            let cause = format!(
                "the soft limits {soft_lower} to {soft_upper} leave nothing of {lower} to {upper}"
            );
            let remedy = "give soft limits inside the limits, or remove <safety_controller>";
            return Err(self.element.error(cause, remedy));
        }
        Ok(narrowed)
    }
}

/// What a reader of limits needs to know of a joint.
#[derive(Clone, Copy)]
pub(super) struct LimitedJoint<'a> {
    pub(super) element: Element<'a>,
    pub(super) kind: JointKind,
}

impl<'a> LimitedJoint<'a> {
    /// Returns the range of the joint; none of one that has no limits.
    pub(super) fn range(self, report: &mut ImportReport) -> Result<Option<Limits>, InputError> {
        match self.kind {
            JointKind::Revolute | JointKind::Prismatic => {}
            JointKind::Continuous => {
                self.record_unused_range(report)?;
                return Ok(None);
            }
            JointKind::Fixed | JointKind::Floating | JointKind::Planar => return Ok(None),
        }
        let element = self.element.required_child("limit")?;
        if element.attribute("lower").is_none() && element.attribute("upper").is_none() {
            let rule = "limits without `lower` and `upper`, which are 0 then";
            let remedy = "write lower=\"...\" upper=\"...\" into <limit>";
            report.record(Treatment::Suspicious, rule, element.line(), remedy);
        }
        let bounds = [bound(element, "lower", report)?, bound(element, "upper", report)?];
        record_units_of_limits(element, self.kind, bounds, report);
        let mut range = check_order(element, LIMITS, bounds)?;
        if let Some(soft) = self.soft_limits(report)? {
            let narrowed = soft.narrow(range)?;
            if narrowed != range {
                report.count_kept("joints with soft limits inside their limits, which hold");
            }
            range = narrowed;
        }
        Ok(closed_range(range))
    }

    /// Reads the soft limits of a joint, which its own controller keeps; none where it has none that can be kept.
    fn soft_limits(self, report: &mut ImportReport) -> Result<Option<SoftLimits<'a>>, InputError> {
        let Some(element) = self.element.child("safety_controller")? else { return Ok(None) };
        let [lower, upper] = SOFT_LIMITS.map(|name| element.attribute(name));
        if lower.is_none() && upper.is_none() {
            // Gains alone: they say nothing about where the joint may be.
            return Ok(None);
        }
        if lower.is_none() || upper.is_none() {
            let rule = "soft limits of which one is not given, which is 0 then";
            let remedy =
                "write soft_lower_limit=\"...\" soft_upper_limit=\"...\" into <safety_controller>";
            report.record(Treatment::Suspicious, rule, element.line(), remedy);
        }
        let [lower, upper] = SOFT_LIMITS;
        let bounds = [bound(element, lower, report)?, bound(element, upper, report)?];
        if bounds[0] == bounds[1] {
            let rule = "soft limits that leave one value, which stand where nobody knew them";
            let remedy = "write type=\"fixed\" if the joint does not move";
            report.record(Treatment::NotUsed, rule, element.line(), remedy);
            return Ok(None);
        }
        Ok(Some(SoftLimits { element, range: check_order(element, SOFT_LIMITS, bounds)? }))
    }

    /// Records limits that a continuous joint has and does not obey, by the definition of the format.
    fn record_unused_range(self, report: &mut ImportReport) -> Result<(), InputError> {
        if let Some(element) = self.element.child("limit")?
            && has_real_bound(element, LIMITS)
        {
            let rule = "`lower` and `upper` of continuous joints, which turn without end";
            let remedy = "write type=\"revolute\" if they hold";
            report.record(Treatment::NotUsed, rule, element.line(), remedy);
        }
        if let Some(element) = self.element.child("safety_controller")?
            && has_real_bound(element, SOFT_LIMITS)
        {
            let rule = "soft limits of continuous joints, which turn without end";
            let remedy = "write type=\"revolute\" and a <limit> if they hold";
            report.record(Treatment::NotUsed, rule, element.line(), remedy);
        }
        Ok(())
    }

    /// Returns the highest speed of the joint; none where it is not limited.
    pub(super) fn max_speed(self, report: &mut ImportReport) -> Result<Option<f64>, InputError> {
        if !self.kind.has_one_value() {
            return Ok(None);
        }
        let Some(element) = self.element.child("limit")? else { return Ok(None) };
        let Some(value) = element.attribute("velocity") else { return Ok(None) };
        let speed = value.extended_number()?;
        if 0.0 < speed && speed <= MAX_COORDINATE {
            return Ok(Some(speed));
        }
        // SDFormat writes -1 or the largest double where no speed is too high. A speed of 0 would make the
        // joint a fixed one; files have it where nobody knew the speed.
        let (treatment, rule) = if speed == 0.0 {
            (Treatment::Guessed, "a velocity of 0 is no limit".to_owned())
        } else if speed < 0.0 {
            (Treatment::Repaired, "a velocity below 0, which is no limit".to_owned())
        } else {
            let rule = format!("a velocity beyond {MAX_COORDINATE:e}, which is no limit");
            (Treatment::Repaired, rule)
        };
        let remedy = "write the highest speed, in rad/s or m/s, above 0";
        report.record(treatment, rule, element.line(), remedy);
        Ok(None)
    }
}

/// Returns whether one of these bounds would narrow the range of a joint. Files have 0 and numbers such as 1e16 where
/// there is none.
fn has_real_bound(element: Element, names: [&str; 2]) -> bool {
    let values = names.into_iter().filter_map(|name| element.attribute(name));
    let mut bounds = values.filter_map(|value| value.extended_number().ok());
    bounds.any(|bound| bound != 0.0 && bound.abs() <= MAX_COORDINATE)
}

/// Reads one end of a range, 0 where it is absent; infinite where the file says by a large number that there is none.
fn bound(
    element: Element,
    name: &'static str,
    report: &mut ImportReport,
) -> Result<f64, InputError> {
    let Some(value) = element.attribute(name) else { return Ok(0.0) };
    let number = value.extended_number()?;
    if number.abs() <= MAX_COORDINATE {
        return Ok(number);
    }
    let rule = format!("limits beyond {MAX_COORDINATE:e}, which are none");
    report.record(Treatment::Repaired, rule, element.line(), "");
    Ok(f64::INFINITY.copysign(number))
}

/// Refuses ends that leave nothing between them.
fn check_order(
    element: Element,
    names: [&str; 2],
    [lower, upper]: [f64; 2],
) -> Result<[f64; 2], InputError> {
    let is_empty = lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY;
    if is_empty {
        let cause = format!("lower {lower} is above upper {upper}");
        return Err(element.error(cause, format!("write the smaller number into `{}`", names[0])));
    }
    Ok([lower, upper])
}

/// Returns the range between two ends, none if both are infinite. If one is, a number stands for it that no joint
/// reaches: all that draw from ranges, or print them, need finite ones.
fn closed_range([lower, upper]: [f64; 2]) -> Option<Limits> {
    if lower == f64::NEG_INFINITY && upper == f64::INFINITY {
        return None;
    }
    let lower = lower.max(-MAX_COORDINATE);
    let upper = upper.min(MAX_COORDINATE);
    Some(Limits { lower, upper })
}
