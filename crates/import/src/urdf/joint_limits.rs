//! `joint_limits.yaml` of `MoveIt`: the rates that a planner may ask of joints, which a URDF lacks but for the speed.
//!
//! Read as `MoveIt` reads it: a number counts only where its `has_..._limits` is true, and replaces that of the URDF.

use saphyr::{LoadableYamlNode, Yaml};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest size of a file in bytes; those of robots with fifty joints have 10 KiB.
const MAX_BYTES: u64 = 1 << 20;
/// Longest line in bytes. Without brackets it bounds the depth of the tree that the parser builds by calling itself.
const MAX_LINE_BYTES: usize = 400;
/// Largest rate that is no mistake: the joints of arms accelerate by less than 1e3, and jerk by less than 1e5.
const MAX_RATE: f64 = 1e9;
/// The key under which the joints are.
const JOINTS: &str = "joint_limits";
/// Keys under which programs of ROS 2 put all of the file.
const WRAPPERS: [&str; 3] = ["/**", "ros__parameters", "robot_description_planning"];
const REMEDY: &str = "give the joint_limits.yaml of a MoveIt configuration";

/// The highest rates of one joint, in rad or m per s, s2 and s3; none where the file sets no limit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GivenRates {
    /// Highest speed.
    pub speed: Option<f64>,
    /// Highest acceleration.
    pub acceleration: Option<f64>,
    /// Highest jerk.
    pub jerk: Option<f64>,
}

/// The rates of joints by name, which may be joints of other robots.
pub type JointRates = BTreeMap<String, GivenRates>;

/// Reads the file at `path`.
///
/// # Errors
/// When it cannot be read, or is no such file.
pub fn load(path: &Path) -> Result<JointRates, InputError> {
    parse(&path.display().to_string(), &read_text(path, MAX_BYTES)?)
}

/// Reads the text of a file; `place` is its name in errors.
///
/// # Errors
/// When it is no such file, or a rate is not above 0.
pub fn parse(place: &str, text: &str) -> Result<JointRates, InputError> {
    let error = |cause: String, remedy: &str| InputError::new(place, cause, remedy);
    let is_deep = |line: &str| line.len() > MAX_LINE_BYTES || line.contains(['[', '{']);
    let uncommented = |line: &str| line.split('#').next().unwrap_or_default().to_string();
    if let Some(i) = text.lines().position(|line| is_deep(&uncommented(line))) {
        let cause = format!("line {} is long or has brackets", i + 1);
        return Err(error(cause, "write a key and its value on each line"));
    }
    let documents = Yaml::load_from_str(text).map_err(|e| error(e.to_string(), REMEDY))?;
    let mut root = documents.first().ok_or_else(|| error("is empty".into(), REMEDY))?;
    for key in WRAPPERS {
        root = root.as_mapping_get(key).unwrap_or(root);
    }
    let joints = root.as_mapping_get(JOINTS).and_then(Yaml::as_mapping);
    let joints = joints.ok_or_else(|| error(format!("has no `{JOINTS}`"), REMEDY))?;
    let mut rates = JointRates::new();
    for (name, limits) in joints {
        let Some(name) = name.as_str() else { continue };
        let reader = JointReader { place, name, limits };
        rates.insert(name.to_string(), reader.rates()?);
    }
    Ok(rates)
}

/// The entry of one joint.
struct JointReader<'a> {
    place: &'a str,
    name: &'a str,
    limits: &'a Yaml<'a>,
}

impl JointReader<'_> {
    fn rates(&self) -> Result<GivenRates, InputError> {
        Ok(GivenRates {
            speed: self.rate("velocity")?,
            acceleration: self.rate("acceleration")?,
            jerk: self.rate("jerk")?,
        })
    }

    /// Returns a rate that the entry says to have.
    fn rate(&self, quantity: &str) -> Result<Option<f64>, InputError> {
        let has_limit = self.limits.as_mapping_get(&format!("has_{quantity}_limits"));
        if has_limit.and_then(Yaml::as_bool) != Some(true) {
            return Ok(None);
        }
        let key = format!("max_{quantity}");
        let node = self.limits.as_mapping_get(&key);
        let number = node.and_then(|node| {
            node.as_floating_point().or_else(|| node.as_integer().map(|whole| whole as f64))
        });
        match number {
            Some(rate) if rate > 0.0 && rate <= MAX_RATE => Ok(Some(rate)),
            Some(rate) => {
                let cause = format!("joint `{}` has {key}: {rate}", self.name);
                let remedy = format!("give a number above 0 and up to {MAX_RATE:e}");
                Err(InputError::new(self.place, cause, remedy))
            }
            None => {
                let cause = format!("joint `{}` has has_{quantity}_limits and no {key}", self.name);
                let remedy = format!("add {key}: NUMBER, or write has_{quantity}_limits: false");
                Err(InputError::new(self.place, cause, remedy))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# of MoveIt\ndefault_velocity_scaling_factor: 0.1\njoint_limits:\n  \
        j1:\n    has_velocity_limits: true\n    max_velocity: 2\n    has_acceleration_limits: true\n    \
        max_acceleration: 3.5\n    has_jerk_limits: false\n    max_jerk: 9.0\n  \
        j2:\n    has_velocity_limits: false\n    max_velocity: 1.0\n";

    #[test]
    fn rates_count_where_the_file_says_that_it_has_them() {
        let rates = parse("l.yaml", TEXT).expect("right");
        let j1 = GivenRates { speed: Some(2.0), acceleration: Some(3.5), jerk: None };
        assert_eq!(rates["j1"], j1);
        assert_eq!(rates["j2"], GivenRates::default());
        let nested: String = TEXT.lines().map(|line| format!("    {line}\n")).collect();
        let wrapped = format!(
            "/**:\n  ros__parameters:\n    robot_description_planning:\n  {}",
            nested.replace("\n", "\n  ")
        );
        assert_eq!(parse("l.yaml", wrapped.trim_end()).expect("right"), rates);
    }

    #[test]
    fn errors_name_the_joint_and_the_key() {
        for (text, cause) in [
            ("", "is empty"),
            ("a: 1", "has no `joint_limits`"),
            ("joint_limits: {}", "line 1 is long or has brackets"),
            (
                "joint_limits:\n  j:\n    has_jerk_limits: true",
                "joint `j` has has_jerk_limits and no max_jerk",
            ),
            (
                "joint_limits:\n  j:\n    has_jerk_limits: true\n    max_jerk: -1",
                "joint `j` has max_jerk: -1",
            ),
        ] {
            assert_eq!(parse("l.yaml", text).expect_err("wrong").cause(), cause);
        }
    }
}
