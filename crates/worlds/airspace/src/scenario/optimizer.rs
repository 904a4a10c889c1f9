//! The objective and the settings of the optimizer.

use super::compile::Compiler;
use crate::baseline::mvp::ResolutionSettings;
use crate::flight::{DetourAlternatives, SpeedFactors};
use crate::objective::Objective;
use crate::settings::{Held, ReactiveSettings, Resolution};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::json;
use sidestep_collectives::{
    Choice, Estimator, LocalSearch, OptimizerConfig, StopCriterion, Update, UpdateOrder, Utility,
};
use sidestep_kernel::{InputError, math};
use sidestep_scenario::{Closed, LeftOpen, Number, Rule as _, invalid_value, schema_by_hand};

/// Largest number of samples of a block. All of them are kept in memory, and with more an exact estimator is faster.
const MAX_BLOCK_SAMPLES: usize = 10_000;
/// Random starts of a local search. With this number it finds the minimum in nine of ten random games of two to twenty
/// airplanes (`benches/optima.rs`), and takes less time than the rounds; with two more of three, in one more of twenty.
const RANDOM_STARTS: u32 = 8;
/// Largest number of times in a list. Each adds as many actions as there are turn rates, and the cost of a pair grows
/// with the square of the number of actions.
const MAX_TIMES: usize = 20;

/// Weight of a square meter of altitude against one of place: a change of level by 300 m costs as much as a detour of
/// 300 m.
const LEVEL_WEIGHT: f64 = 1.0;

/// A list of times.
#[derive(Debug, Clone, Default)]
pub(super) struct TimeList(pub(super) Vec<f64>);

impl<'de> Deserialize<'de> for TimeList {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let times_s = Vec::<f64>::deserialize(deserializer)?;
        if times_s.iter().all(|t| Held::allows(*t)) && times_s.len() <= MAX_TIMES {
            return Ok(Self(times_s));
        }
        let remedy = format!("give up to {MAX_TIMES} times, each {}", Held::description());
        Err(invalid_value(format_args!("{times_s:?}"), &remedy))
    }
}

schema_by_hand!(TimeList, {
    let mut time = Held::limits();
    time["type"] = "number".into();
    json!({ "type": "array", "items": time, "maxItems": MAX_TIMES })
});

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LegsSection {
    /// Times for which an airplane turns.
    turns_s: TimeList,
    /// Times until which it then flies straight on.
    until_s: TimeList,
}

/// The settings of a method that looks ahead anew in every step.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ReactiveSection {
    /// Time within which conflicts are seen.
    look_ahead_s: Option<Number<LookAhead>>,
    /// Factor on the separation that is kept.
    margin: Option<Number<SeparationFactor>>,
}

/// The settings of MVP.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct MvpSection {
    /// Time within which conflicts are seen.
    look_ahead_s: Option<Number<LookAhead>>,
    /// Factor on the separation that is kept.
    margin: Option<Number<SeparationFactor>>,
    /// Further factor on the zone out of which a conflict is moved (RFACH of BlueSky).
    resolution_factor: Option<Number<ResolutionFactor>>,
    /// What airplanes change to resolve a conflict (RMETHH and RMETHV of BlueSky).
    pub(super) resolution: Option<Resolution>,
    /// Factor on vertical_m out of which a conflict is moved, where levels are changed (RFACV of BlueSky).
    vertical_factor: Option<Number<ResolutionFactor>>,
    /// Time before a loss by which levels are apart, where they are changed; 0, as in BlueSky, unless given. With the shield
    /// about 40 s are needed, because it plans until both of a pair orbit.
    vertical_lead_s: Option<Number<VerticalLead>>,
    /// Smallest and largest commanded speed as factors of those that are filed, where speeds are changed; limits of the
    /// airplane hold, too.
    speed_factors: Option<SpeedFactorPair>,
}

/// A smallest and a largest factor on speeds.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpeedFactorPair(SpeedFactors);

/// Smallest and largest factor that a scenario may give: an airplane that hardly flies, and one that is faster than any.
const MIN_SPEED_FACTOR: f64 = 0.1;
const MAX_SPEED_FACTOR: f64 = 10.0;

impl<'de> Deserialize<'de> for SpeedFactorPair {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let [least, largest] = <[f64; 2]>::deserialize(deserializer)?;
        if (MIN_SPEED_FACTOR..=1.0).contains(&least) && (1.0..=MAX_SPEED_FACTOR).contains(&largest)
        {
            return Ok(Self(SpeedFactors { least, largest }));
        }
        let remedy = format!(
            "give two factors, {MIN_SPEED_FACTOR} to 1 and 1 to {MAX_SPEED_FACTOR}, as [0.8, 1.2]"
        );
        Err(invalid_value(format_args!("[{least:?}, {largest:?}]"), &remedy))
    }
}

schema_by_hand!(SpeedFactorPair, {
    let least = json!({ "type": "number", "minimum": MIN_SPEED_FACTOR, "maximum": 1.0 });
    let largest = json!({ "type": "number", "minimum": 1.0, "maximum": MAX_SPEED_FACTOR });
    json!({ "type": "array", "prefixItems": [least, largest], "minItems": 2, "maxItems": 2 })
});

/// A time before a loss.
type VerticalLead = Closed<0, 100_000>;
/// A factor on the zone out of which a conflict is moved.
type ResolutionFactor = LeftOpen<0, 10>;

impl MvpSection {
    /// Returns whether the scenario gives any of them.
    pub(super) fn is_given(&self) -> bool {
        let is_resolution_given = self.resolution_factor.is_some()
            || self.resolution.is_some()
            || self.vertical_factor.is_some()
            || self.vertical_lead_s.is_some()
            || self.speed_factors.is_some();
        self.look_ahead_s.is_some() || self.margin.is_some() || is_resolution_given
    }

    /// Returns the keys that are given and have no effect with some resolution.
    pub(super) fn effectless_keys(&self, resolution: Resolution) -> Vec<&'static str> {
        let mut keys = Vec::new();
        if self.resolution_factor.is_some() && resolution == Resolution::Vertical {
            keys.push("resolution_factor");
        }
        if !resolution.changes_level() {
            keys.extend(self.vertical_keys());
        }
        if self.speed_factors.is_some() && !resolution.changes_speed() {
            keys.push("speed_factors");
        }
        keys
    }

    /// Returns the keys of changes of level that are given.
    pub(super) fn vertical_keys(&self) -> impl Iterator<Item = &'static str> {
        let given = [
            ("vertical_factor", self.vertical_factor.is_some()),
            ("vertical_lead_s", self.vertical_lead_s.is_some()),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key)
    }

    /// Returns how conflicts are resolved, as `default` where nothing is given.
    pub(super) fn resolution_or_default(&self, default: ResolutionSettings) -> ResolutionSettings {
        ResolutionSettings {
            resolution: self.resolution.unwrap_or(default.resolution),
            vertical_factor: self.vertical_factor.map_or(default.vertical_factor, f64::from),
            vertical_lead_s: self.vertical_lead_s.map_or(default.vertical_lead_s, f64::from),
            speeds: self.speed_factors.map_or(default.speeds, |pair| pair.0),
        }
    }

    /// Returns the settings, with those of `default` where none are given.
    pub(super) fn or_default(&self, default: ReactiveSettings) -> ReactiveSettings {
        ReactiveSettings {
            look_ahead_s: self.look_ahead_s.map_or(default.look_ahead_s, f64::from),
            margin: self.margin.map_or(default.margin, f64::from),
            resolution_factor: self.resolution_factor.map_or(default.resolution_factor, f64::from),
        }
    }
}

/// A time in which an airplane looks ahead.
pub(super) type LookAhead = LeftOpen<0, 100_000>;
/// A factor on separations.
type SeparationFactor = Closed<1, 10>;

impl ReactiveSection {
    /// Returns whether the scenario gives any of them.
    pub(super) fn is_given(&self) -> bool {
        self.look_ahead_s.is_some() || self.margin.is_some()
    }

    /// Returns the settings, with those of `default` where none are given.
    pub(super) fn or_default(&self, default: ReactiveSettings) -> ReactiveSettings {
        ReactiveSettings {
            look_ahead_s: self.look_ahead_s.map_or(default.look_ahead_s, f64::from),
            margin: self.margin.map_or(default.margin, f64::from),
            ..default
        }
    }
}

/// A yes or no; yes unless given.
#[derive(Debug)]
pub(super) struct OnOffSwitch(pub(super) bool);

impl Default for OnOffSwitch {
    fn default() -> Self {
        Self(true)
    }
}

impl<'de> Deserialize<'de> for OnOffSwitch {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let given = toml::Value::deserialize(deserializer)?;
        match given.as_str() {
            Some("on") => Ok(Self(true)),
            Some("off") => Ok(Self(false)),
            _ => Err(invalid_value(given, "give \"on\" or \"off\"")),
        }
    }
}

schema_by_hand!(OnOffSwitch, json!({ "enum": ["on", "off"], "default": "on" }));

impl Compiler<'_> {
    /// Returns the objective. Its sums are over points, and the scenario's weights are per second:
    /// however fine the points are, the same paths have the same order.
    pub(super) fn objective(&self, vertical_m: f64, dtau_s: f64) -> Objective {
        let section = &self.file.airspace;
        let is_paper = self.is_paper_preset();
        let beta_per_s = section.beta.map_or(0.995, f64::from);
        Objective {
            // With the paper's weight, and without a margin, the optimum itself gives up some meters of separation for
            // smaller deviations: with ten airplanes 7 of 500.
            alpha: section.alpha.map_or(if is_paper { 1.0 } else { 0.001 }, f64::from) / dtau_s,
            // The power is left out where it changes nothing, so that it rounds nothing either.
            beta: if dtau_s == 1.0 { beta_per_s } else { math::powf(beta_per_s, dtau_s) },
            // Of 1.06 to 1.15, and horizons of 90 to 110 s, 1.08 and 100 s delay super-conflicts of 20 and 30 the least
            // among those that lose separation in no more than one of twenty runs without the shield.
            inflation: section.inflation.map_or(if is_paper { 1.0 } else { 1.08 }, f64::from),
            mask: true,
            vertical_m,
            level_weight: section.level_weight.map_or(LEVEL_WEIGHT, f64::from),
            speed_weight: section.speed_weight.map_or(0.0, f64::from),
        }
    }

    pub(super) fn settings(&self) -> Result<OptimizerConfig, InputError> {
        let section = &self.file.airspace;
        let is_paper = self.is_paper_preset();
        let estimator =
            if is_paper { Estimator::Sampled { block: 20, ageing: 0.7 } } else { Estimator::Exact };
        let estimator = self.estimator()?.unwrap_or(estimator);
        let choice = if is_paper { Choice::Draw } else { Choice::Argmax };
        let order = if is_paper { UpdateOrder::Parallel } else { UpdateOrder::Sequence };
        let local_search = self.local_search(estimator)?;
        Ok(OptimizerConfig {
            estimator,
            update: self.update_rule()?.unwrap_or(Update::NearestNewton { step: 0.5 }),
            order: section.order.unwrap_or(order),
            utility: self.utility(estimator)?,
            cooling: section.cooling.map_or(if is_paper { 0.8 } else { 0.5 }, f64::from),
            stop: StopCriterion {
                threshold: 1e-3,
                calm_rounds: 3,
                max_rounds: section.max_rounds.map_or(200, |rounds| rounds.0),
            },
            choice: section.choice.unwrap_or(choice),
            local_search,
            random_starts: self.random_starts(local_search)?,
        })
    }

    /// Returns what follows the rounds. Samples show the costs of joint moves, and a local search asks for those of
    /// single players.
    fn local_search(&self, estimator: Estimator) -> Result<LocalSearch, InputError> {
        let is_exact = estimator == Estimator::Exact;
        let default = if is_exact { LocalSearch::Pairs } else { LocalSearch::None };
        let Some(given) = &self.file.airspace.local_search else { return Ok(default) };
        if !is_exact && *given.get_ref() != LocalSearch::None {
            let cause = "a local search after sampled rounds, which know no single costs";
            let remedy = "set estimator = { kind = \"exact\" }, or leave local_search out";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        Ok(*given.get_ref())
    }

    fn random_starts(&self, local_search: LocalSearch) -> Result<u32, InputError> {
        let Some(given) = &self.file.airspace.random_starts else {
            return Ok(RANDOM_STARTS);
        };
        if local_search == LocalSearch::None {
            let cause = "random_starts, but no local search that would start there";
            let remedy = "leave random_starts out; a local search is there with estimator = { kind = \
                          \"exact\" } and local_search = \"pairs\"";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        Ok(given.get_ref().get() as u32)
    }

    fn estimator(&self) -> Result<Option<Estimator>, InputError> {
        let Some(given) = &self.file.airspace.estimator else { return Ok(None) };
        if let Estimator::Sampled { block, ageing } = *given.get_ref()
            && !((1..=MAX_BLOCK_SAMPLES).contains(&block) && (0.0..=1.0).contains(&ageing))
        {
            let cause = format!("an estimator with block = {block}, ageing = {ageing}");
            let remedy =
                format!("give a block of 1 to {MAX_BLOCK_SAMPLES} samples, ageing from 0 to 1");
            return Err(self.source.error(given.span(), cause, remedy));
        }
        Ok(Some(*given.get_ref()))
    }

    /// Returns the cost that samples show. Exact expectations show all of it at once.
    fn utility(&self, estimator: Estimator) -> Result<Utility, InputError> {
        let Some(given) = &self.file.airspace.utility else { return Ok(Utility::default()) };
        if estimator == Estimator::Exact {
            let cause = "a utility, but expectations are exact: there are no samples to show it";
            let remedy = "leave utility out, or set estimator = { kind = \"sampled\", block = 20, \
                          ageing = 0.7 }";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        Ok(*given.get_ref())
    }

    fn update_rule(&self) -> Result<Option<Update>, InputError> {
        let Some(given) = &self.file.airspace.update else { return Ok(None) };
        let (Update::NearestNewton { step } | Update::Brouwer { step }) = *given.get_ref();
        if step > 0.0 && step <= 1.0 {
            return Ok(Some(*given.get_ref()));
        }
        let cause = format!("an update with step = {step}");
        Err(self.source.error(given.span(), cause, "give a step above 0 and at most 1"))
    }

    pub(super) fn detour_legs(&self) -> Result<DetourAlternatives, InputError> {
        let Some(given) = &self.file.airspace.legs else {
            return Ok(if self.is_paper_preset() {
                DetourAlternatives::default()
            } else {
                DetourAlternatives::default_preset()
            });
        };
        let LegsSection { turns_s: TimeList(turns_s), until_s: TimeList(until_s) } =
            given.get_ref();
        if turns_s.is_empty() != until_s.is_empty() {
            let cause = "legs with one of turns_s and until_s";
            let remedy = "give both, or neither for no legs";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        let longest_turn_s = turns_s.iter().copied().fold(0.0, f64::max);
        let earliest_end_s = until_s.iter().copied().fold(f64::INFINITY, f64::min);
        if longest_turn_s >= earliest_end_s {
            let cause = format!(
                "a leg whose turn takes {longest_turn_s} s, and that ends after {earliest_end_s} s"
            );
            let remedy = "give turns_s that are all shorter than each until_s; turns without a leg \
                          are holds_s";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        Ok(DetourAlternatives { turns_s: turns_s.clone(), until_s: until_s.clone() })
    }
}
