//! What happens to a chain while it runs.

use super::super::chain::Chain;
use super::super::rebuild::MayCome;
use super::super::world::{Change, What};
use super::Compiler;
use super::chains::MobilitySection;
use serde::Deserialize;
use sidestep_kernel::InputError;
use std::ops::Range;
use toml::Spanned;

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum MayComeWord {
    #[default]
    Nobody,
    First,
    Last,
}

/// One thing that happens: exactly one of the keys beside the time.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChangeSection {
    at_s: f64,
    connector: Option<usize>,
    failed: Option<bool>,
    max_bend_deg: Option<f64>,
    mobility: Option<Spanned<MobilitySection>>,
    scatter: Option<[usize; 2]>,
    by_m: Option<f64>,
    apart_m: Option<Vec<f64>>,
    reform: Option<bool>,
    may_come: Option<MayComeWord>,
    speed_m_s: Option<Spanned<f64>>,
}

impl Compiler<'_> {
    /// Something that happens to `chain`.
    pub(super) fn change<const D: usize>(
        &self,
        section: &Spanned<ChangeSection>,
        chain: &Chain<D>,
        dt_s: f64,
    ) -> Result<Change<D>, InputError> {
        let (s, at) = (section.get_ref(), section.span());
        if !(s.at_s >= 0.0 && s.at_s.is_finite()) {
            return Err(self.error(Some(at), format!("at_s = {}", s.at_s), "give 0 or more"));
        }
        let cycle = (s.at_s / dt_s).round() as u64;
        Ok(Change { cycle, what: self.what(s, chain, at)? })
    }

    fn what<const D: usize>(
        &self,
        s: &ChangeSection,
        chain: &Chain<D>,
        at: Range<usize>,
    ) -> Result<What<D>, InputError> {
        let n = chain.points().len();
        let given = [
            s.failed.is_some(),
            s.max_bend_deg.is_some(),
            s.mobility.is_some(),
            s.scatter.is_some(),
            s.reform == Some(true),
        ];
        if given.iter().filter(|&&is_given| is_given).count() != 1 {
            let remedy = "give one of failed, max_bend_deg, mobility, scatter = [first, last], reform = true";
            return Err(self.error(Some(at), "a change that is not one thing", remedy));
        }
        self.is_one_thing(s, at.clone())?;
        if let Some([first, last]) = s.scatter {
            return self.scatter((first, last), (s.by_m, s.apart_m.as_deref()), n, at);
        }
        if s.reform == Some(true) {
            let may_come = match s.may_come.unwrap_or_default() {
                MayComeWord::Nobody => MayCome::Nobody,
                MayComeWord::First => MayCome::First,
                MayComeWord::Last => MayCome::Last,
            };
            let speed_m_s = self.positive(s.speed_m_s.as_ref(), "speed_m_s", 0.5)?;
            return Ok(What::Reform { may_come, speed_m_s });
        }
        let Some(connector) = s.connector.filter(|&k| k < n) else {
            let cause = format!("a change of connector {:?} of {n}", s.connector);
            return Err(self.error(Some(at), cause, "give connector, counted from 0"));
        };
        let what = match (s.failed, s.max_bend_deg, &s.mobility) {
            (Some(failed), ..) => What::Failed { connector, failed },
            (_, Some(deg), _) => What::MaxBend { connector, max_bend_rad: deg.to_radians() },
            (_, _, Some(given)) => What::Mobility { connector, mobility: self.mobility(given)? },
            _ => unreachable!("one of them is given"),
        };
        self.try_constraint(&what, chain, at)?;
        Ok(what)
    }

    /// Refuses keys that do nothing beside what happens.
    fn is_one_thing(&self, s: &ChangeSection, at: Range<usize>) -> Result<(), InputError> {
        let (throws, joins) = (s.scatter.is_some(), s.reform == Some(true));
        let keys = [
            ("connector", s.connector.is_some(), !throws && !joins),
            ("by_m", s.by_m.is_some(), throws),
            ("apart_m", s.apart_m.is_some(), throws),
            ("may_come", s.may_come.is_some(), joins),
            ("speed_m_s", s.speed_m_s.is_some(), joins),
        ];
        match keys.iter().find(|(_, is_given, does_something)| *is_given && !does_something) {
            None => Ok(()),
            Some((key, ..)) => Err(self.error(
                Some(at),
                format!("`{key}` does nothing in this change"),
                "leave it out",
            )),
        }
    }

    /// Tries a constraint on a copy, so that it cannot fail while a run goes on.
    fn try_constraint<const D: usize>(
        &self,
        what: &What<D>,
        chain: &Chain<D>,
        at: Range<usize>,
    ) -> Result<(), InputError> {
        let mut chain = chain.clone();
        let tried = match what {
            What::Mobility { connector, mobility } => chain.set_mobility(*connector, *mobility),
            What::MaxBend { connector, max_bend_rad } => {
                chain.set_max_bend_rad(*connector, *max_bend_rad)
            }
            _ => Ok(()),
        };
        tried.map_err(|error| self.at(at, &error))
    }

    fn scatter<const D: usize>(
        &self,
        (first, last): (usize, usize),
        (by_m, apart_m): (Option<f64>, Option<&[f64]>),
        n: usize,
        at: Range<usize>,
    ) -> Result<What<D>, InputError> {
        let by_m = by_m.unwrap_or(1.0);
        if first == 0 || first > last || last + 1 >= n {
            let cause = format!("scatter = [{first}, {last}] of a chain of {n}");
            let remedy = "leave a whole end on both sides: at least connectors 0 and the last";
            return Err(self.error(Some(at), cause, remedy));
        }
        if !(by_m > 0.0 && by_m < 1e4) {
            return Err(self.error(Some(at), format!("by_m = {by_m}"), "give meters above 0"));
        }
        let apart_m = match apart_m {
            Some(given) => self.point(given, "apart_m", at)?,
            None => [0.0; D],
        };
        Ok(What::Scatter { connectors: first..=last, by_m, apart_m })
    }
}
