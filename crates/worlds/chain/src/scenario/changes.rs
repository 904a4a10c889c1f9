//! Changes to a chain during a run.

use super::super::world::{ChainChange, ChainChangeKind};
use super::mobility::MobilitySection;
use super::tasks::DEFAULT_SPEED_M_S;
use super::{ChainScenarioCompiler, PointValue, PositiveNumber};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::InputError;
use sidestep_rods::Chain;
use sidestep_rods::rebuild::MovableEnd;
use sidestep_scenario::{FixedList, NonNegative, Number, Open, Spanned};
use std::ops::Range;

/// Standard deviation of each coordinate of a scattered connector, unless it is given, meters.
const DEFAULT_THROW_M: f64 = 1.0;

#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "MayComeWord")]
enum MovableEndWord {
    #[default]
    Nobody,
    First,
    Last,
}

/// One change: exactly one of the keys beside the time.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ChangeSection")]
pub(super) struct ChangeSection<const D: usize> {
    /// Time of the change.
    at_s: NonNegative,
    /// Number of the connector that changes, from 0.
    connector: Option<usize>,
    failed: Option<bool>,
    /// Greatest angle between its two rods from then on.
    max_bend_deg: Option<f64>,
    /// Places where it may be from then on.
    mobility: Option<MobilitySection<D>>,
    scatter: Option<FixedList<usize, 2>>,
    by_m: Option<Number<Open<0, 10_000>>>,
    apart_m: Option<PointValue<D>>,
    reform: Option<bool>,
    may_come: Option<MovableEndWord>,
    /// Speed at which they come back.
    speed_m_s: Option<PositiveNumber>,
}

impl<const D: usize> ChangeSection<D> {
    /// Returns the cycle at the start of which it takes effect.
    fn cycle_of_change(&self, dt_s: f64) -> u64 {
        (self.at_s.get() / dt_s).round() as u64
    }

    /// Returns the cycle in which it breaks the chain, if it does.
    pub(super) fn cycle_of_break(&self, dt_s: f64) -> Option<u64> {
        self.scatter.is_some().then(|| self.cycle_of_change(dt_s))
    }

    /// Returns whether it may let a connector go that is held or has failed.
    pub(super) fn may_release_connector(&self, connector: usize) -> bool {
        self.connector == Some(connector) && (self.failed == Some(false) || self.mobility.is_some())
    }

    /// Returns whether it would take an arm away from any place that its joints allow: apart, or off its base.
    pub(super) fn takes_apart(&self) -> bool {
        self.scatter.is_some() || (self.connector == Some(0) && self.mobility.is_some())
    }

    /// Returns the cycle in which it joins the chain again, if it does.
    pub(super) fn cycle_of_reform(&self, dt_s: f64) -> Option<u64> {
        (self.reform == Some(true)).then(|| self.cycle_of_change(dt_s))
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    pub(super) fn change(
        &self,
        section: &Spanned<ChangeSection<D>>,
        chain: &Chain<D>,
        dt_s: f64,
    ) -> Result<ChainChange<D>, InputError> {
        let s = section.get_ref();
        let at = section.span();
        Ok(ChainChange { cycle: s.cycle_of_change(dt_s), what: self.change_kind(s, chain, at)? })
    }

    fn change_kind(
        &self,
        s: &ChangeSection<D>,
        chain: &Chain<D>,
        at: Range<usize>,
    ) -> Result<ChainChangeKind<D>, InputError> {
        self.check_single_change_key(s, at.clone())?;
        let n = chain.points().len();
        if let Some([first, last]) = s.scatter.map(FixedList::get) {
            return self.scatter(s, [first, last], n, at);
        }
        if s.reform == Some(true) {
            let may_come = match s.may_come.unwrap_or_default() {
                MovableEndWord::Nobody => MovableEnd::Nobody,
                MovableEndWord::First => MovableEnd::First,
                MovableEndWord::Last => MovableEnd::Last,
            };
            return Ok(ChainChangeKind::Reform {
                may_come,
                speed_m_s: s.speed_m_s.map_or(DEFAULT_SPEED_M_S, f64::from),
            });
        }
        let Some(connector) = s.connector.filter(|&k| k < n) else {
            let cause = match s.connector {
                Some(connector) => format!("connector = {connector} of a chain of {n}"),
                None => "a change of no connector".into(),
            };
            let at = self.source.key_span(at, &["connector"]);
            let remedy = format!("give connector, counted from 0: the last is {}", n - 1);
            return Err(self.source.error(at, cause, remedy));
        };
        let what = match (s.failed, s.max_bend_deg, &s.mobility) {
            (Some(failed), ..) => ChainChangeKind::Failed { connector, failed },
            (_, Some(deg), _) => {
                ChainChangeKind::MaxBend { connector, max_bend_rad: deg.to_radians() }
            }
            (_, _, Some(given)) => {
                ChainChangeKind::Mobility { connector, mobility: given.mobility() }
            }
            _ => unreachable!("one of them is given"),
        };
        self.check_constraint(&what, chain, at)?;
        Ok(what)
    }

    /// Refuses two changes at once, and keys that have no effect beside the one.
    fn check_single_change_key(
        &self,
        s: &ChangeSection<D>,
        at: Range<usize>,
    ) -> Result<(), InputError> {
        let throws = s.scatter.is_some();
        let joins = s.reform == Some(true);
        let others = [s.failed.is_some(), s.max_bend_deg.is_some(), s.mobility.is_some()];
        if others.into_iter().chain([throws, joins]).filter(|is_given| *is_given).count() != 1 {
            let remedy = "give one of failed, max_bend_deg, mobility, scatter = [first, last], \
                          reform = true";
            let given = ["reform", "scatter", "mobility", "max_bend_deg", "failed"];
            let at = self.source.key_span(at, &given);
            return Err(self.source.error(at, "a change that is not one thing", remedy));
        }
        let keys = [
            ("connector", s.connector.is_some(), !throws && !joins),
            ("by_m", s.by_m.is_some(), throws),
            ("apart_m", s.apart_m.is_some(), throws),
            ("may_come", s.may_come.is_some(), joins),
            ("speed_m_s", s.speed_m_s.is_some(), joins),
        ];
        self.source.refuse_unused_keys(at, &keys, "in this change")
    }

    /// Tries a constraint on a copy, so that it cannot fail during a run.
    fn check_constraint(
        &self,
        what: &ChainChangeKind<D>,
        chain: &Chain<D>,
        at: Range<usize>,
    ) -> Result<(), InputError> {
        let mut chain = chain.clone();
        let tried = match what {
            ChainChangeKind::Mobility { connector, mobility } => {
                chain.set_mobility(*connector, *mobility)
            }
            ChainChangeKind::MaxBend { connector, max_bend_rad } => {
                chain.set_max_bend_rad(*connector, *max_bend_rad)
            }
            _ => Ok(()),
        };
        tried.map_err(|error| {
            let at = self.source.key_span(at, &["max_bend_deg", "mobility"]);
            self.source.error_from(at, &error)
        })
    }

    fn scatter(
        &self,
        s: &ChangeSection<D>,
        [first, last]: [usize; 2],
        n: usize,
        at: Range<usize>,
    ) -> Result<ChainChangeKind<D>, InputError> {
        if first == 0 || first > last || last + 1 >= n {
            let cause = format!("scatter = [{first}, {last}] of a chain of {n}");
            let remedy = "leave a whole end on both sides: at least connectors 0 and the last";
            let at = self.source.key_span(at, &["scatter"]);
            return Err(self.source.error(at, cause, remedy));
        }
        let by_m = s.by_m.map_or(DEFAULT_THROW_M, f64::from);
        let apart_m = s.apart_m.map_or([0.0; D], PointValue::get);
        Ok(ChainChangeKind::Scatter { connectors: first..=last, by_m, apart_m })
    }
}
