//! Compilation of sensor and effector sections to checked models.

use super::kinds::Kinds;
use super::located_section::LocatedSection;
use super::{
    DelayDistribution, DelaySection, DurationSection, EffectorSection, MatrixRows, SensorSection,
    TransitionSection,
};
use crate::effector::{EffectorModel, STANDARD_ACTIONS, Transition};
use crate::sensor::SensorModel;
use sidestep_error_models::beam::BeamModel;
use sidestep_error_models::delay::{
    DelayDuration, DelayModel, gaussian_durations, uniform_durations,
};
use sidestep_kernel::InputError;
use sidestep_kernel::distr::check_probability_row;
use sidestep_scenario::{Spanned, suggestion};
use std::collections::BTreeMap;

/// Largest number of beams, observations, classes and actions, because readings name them with a
/// byte.
const MAX_NAMES: usize = 250;
/// Largest number of actions, because an intent holds an action and a flag in one byte.
const MAX_ACTIONS: usize = 120;
/// Largest number of beams; more are refused before their boxes are tabulated.
const MAX_BEAMS: usize = 1024;

/// Checks a sensor and puts its rows in order.
pub(super) fn sensor(
    name: &str,
    at: &LocatedSection<SensorSection>,
    kinds: &Kinds,
    is_mounted: bool,
) -> Result<SensorModel, InputError> {
    let s = at.section.get_ref();
    let observations = observations(at)?;
    let (edges, classes) = classes(at)?;
    let bearings = s.bearings_deg.get_ref();
    if !(1..=MAX_BEAMS).contains(&bearings.len()) || bearings.iter().any(|b| !b.is_finite()) {
        let cause = format!("{} bearings, or one that is not finite", bearings.len());
        let remedy = "give 1 to 1024 finite bearings in degrees";
        return Err(at.error(s.bearings_deg.span(), cause, remedy));
    }
    let beam = beam(name, at)?;
    Ok(SensorModel {
        name: name.into(),
        bearings_deg: bearings.clone(),
        range_m: s.range_m.get(),
        beam,
        confusion: confusion(at, &observations, &classes)?,
        designates: designates(name, at, kinds, is_mounted)?,
        distance_confusion: distance_confusion(at, &classes)?,
        observations,
        distance_edges_m: edges,
        distance_classes: classes,
    })
}

/// Checks the beam model of a sensor that measures ranges, and that it has no rows beside it.
fn beam(name: &str, at: &LocatedSection<SensorSection>) -> Result<Option<BeamModel>, InputError> {
    let s = at.section.get_ref();
    let Some(section) = &s.beam else { return Ok(None) };
    let rows = [&s.confusion, &s.distance_confusion].into_iter().flatten().map(Spanned::span);
    let by_class = s.confusion_by_class.keys().map(Spanned::span);
    if let Some(span) = rows.chain(by_class).next() {
        let cause = format!("sensor `{name}` has rows beside its beam model, which do nothing");
        return Err(at.error(span, cause, "leave out the rows, or `beam`"));
    }
    if s.observations.get_ref().len() != 2 {
        let cause = format!("sensor `{name}` measures ranges, which do not tell things apart");
        let remedy = "write observations = [\"nothing\", \"wall\"], and with `designates` that each kind is a wall";
        return Err(at.error(s.observations.span(), cause, remedy));
    }
    let b = section.get_ref();
    let model = BeamModel {
        hit: b.hit.get(),
        short: b.short.get(),
        max: b.max.get(),
        random: b.random.get(),
        sigma_hit_m: b.sigma_hit_m.get(),
        lambda_short_per_m: b.lambda_short_per_m.get(),
    };
    let normalized = model.normalized().map_err(|cause| {
        let remedy = "give four weights that sum to 1, and a positive noise and rate";
        at.error(section.span(), format!("the beam model of sensor `{name}`: {cause}"), remedy)
    });
    normalized.map(Some)
}

/// Returns one matrix for each distance class and one beyond; a class without rows of its own has
/// those that hold anywhere. That of a beam model reports the truth.
fn confusion(
    at: &LocatedSection<SensorSection>,
    observations: &[String],
    classes: &[String],
) -> Result<Vec<Vec<Vec<f64>>>, InputError> {
    let s = at.section.get_ref();
    let everywhere = match (&s.confusion, &s.beam) {
        (Some(rows), _) => matrix(at, rows, observations, observations)?,
        (None, Some(_)) => {
            let n = observations.len();
            (0..n).map(|observation| certain_row(observation, n)).collect()
        }
        (None, None) => {
            let cause = "the sensor has no `confusion`";
            let remedy =
                "give one row per observation, or `beam` for a sensor that measures ranges";
            return Err(at.error(at.section.span(), cause, remedy));
        }
    };
    let mut confusion = vec![everywhere; classes.len() + 1];
    for (class, rows) in &s.confusion_by_class {
        let mut names = classes.iter().map(String::as_str).chain(["beyond"]);
        let index = names.position(|name| name == class.get_ref()).ok_or_else(|| {
            let known: Vec<&str> = classes.iter().map(String::as_str).collect();
            let cause = format!("unknown distance class `{}`", class.get_ref());
            at.error(class.span(), cause, &suggestion(class.get_ref(), &known))
        })?;
        for (row_name, row) in rows.get_ref() {
            let observation = position(at, "row", row_name, observations)?;
            confusion[index][observation] = checked_row(at, row_name, row, observations.len())?;
        }
    }
    Ok(confusion)
}

fn observations(at: &LocatedSection<SensorSection>) -> Result<Vec<String>, InputError> {
    let list = &at.section.get_ref().observations;
    let names = list.get_ref();
    if names.first().map(String::as_str) != Some("nothing") {
        return Err(at.error(
            list.span(),
            "the first observation is not `nothing`",
            "write observations = [\"nothing\", ...]",
        ));
    }
    let doubled = (1..names.len()).any(|i| names[..i].contains(&names[i]));
    if doubled || names.len() > MAX_NAMES {
        return Err(at.error(
            list.span(),
            "an observation stands twice, or there are more than 250",
            "name each observation once",
        ));
    }
    Ok(names.clone())
}

/// Returns edges and names of the distance classes; without edges there is one class, and without names they
/// are `class0`, `class1` and so on.
fn classes(at: &LocatedSection<SensorSection>) -> Result<(Vec<f64>, Vec<String>), InputError> {
    let s = at.section.get_ref();
    let edges = s.distance_edges_m.as_ref().map_or(vec![], |e| e.get_ref().clone());
    if let Some(list) = &s.distance_edges_m {
        let rising = edges.windows(2).all(|w| w[0] < w[1])
            && edges.iter().all(|e| *e > 0.0 && e.is_finite());
        if !rising || edges.len() >= MAX_NAMES {
            return Err(at.error(
                list.span(),
                "the edges do not rise from above 0",
                "write rising edges in meters, e.g. [0.5, 1.5]",
            ));
        }
    }
    let names = match &s.distance_classes {
        Some(names) => names.get_ref().clone(),
        None => (0..=edges.len()).map(|k| format!("class{k}")).collect(),
    };
    if names.len() != edges.len() + 1 {
        let span = s.distance_classes.as_ref().map_or(at.section.span(), Spanned::span);
        let cause = format!("{} class names for {} edges", names.len(), edges.len());
        return Err(at.error(span, cause, "give one name more than there are edges"));
    }
    check_class_names(at, &names)?;
    Ok((edges, names))
}

fn check_class_names(
    at: &LocatedSection<SensorSection>,
    names: &[String],
) -> Result<(), InputError> {
    let doubled = (1..names.len()).find(|&k| names[..k].contains(&names[k]));
    let cause = if names.iter().any(|name| name == "beyond") {
        "a class named `beyond`, which means out of range".into()
    } else if let Some(k) = doubled {
        format!("the class `{}` stands twice", names[k])
    } else {
        return Ok(());
    };
    let section = &at.section;
    let span = section.get_ref().distance_classes.as_ref().map_or(section.span(), Spanned::span);
    Err(at.error(span, cause, "give each class a name of its own"))
}

/// Returns rows over the classes. The row `beyond`, for spurious reports, may be left out and then
/// puts all probability on the farthest class. Without any row every class is reported as it is.
fn distance_confusion(
    at: &LocatedSection<SensorSection>,
    classes: &[String],
) -> Result<Vec<Vec<f64>>, InputError> {
    let n = classes.len();
    let mut rows: Vec<Vec<f64>> = (0..n).map(|class| certain_row(class, n)).collect();
    rows.push(certain_row(n - 1, n));
    let Some(given) = &at.section.get_ref().distance_confusion else { return Ok(rows) };
    let mut names = classes.to_vec();
    names.push("beyond".into());
    for (row_name, row) in given.get_ref() {
        let index = position(at, "row", row_name, &names)?;
        rows[index] = checked_row(at, row_name, row, n)?;
    }
    if let Some(missing) =
        classes.iter().find(|c| !given.get_ref().keys().any(|k| k.get_ref() == *c))
    {
        return Err(at.error(
            given.span(),
            format!("the row `{missing}` is missing"),
            "give one row per distance class",
        ));
    }
    Ok(rows)
}

/// Returns the row that puts all probability on one of `n` classes.
fn certain_row(class: usize, n: usize) -> Vec<f64> {
    let mut row = vec![0.0; n];
    row[class] = 1.0;
    row
}

fn matrix(
    at: &LocatedSection<SensorSection>,
    rows: &Spanned<MatrixRows>,
    row_names: &[String],
    columns: &[String],
) -> Result<Vec<Vec<f64>>, InputError> {
    let mut by_index: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (row_name, row) in rows.get_ref() {
        let index = position(at, "row", row_name, row_names)?;
        by_index.insert(index, checked_row(at, row_name, row, columns.len())?);
    }
    let missing = (0..row_names.len()).find(|i| !by_index.contains_key(i));
    if let Some(i) = missing {
        let cause = format!("the row `{}` is missing", row_names[i]);
        return Err(at.error(
            rows.span(),
            cause,
            "give one row per observation, `nothing` included",
        ));
    }
    Ok(by_index.into_values().collect())
}

fn position<T>(
    at: &LocatedSection<T>,
    what: &str,
    name: &Spanned<String>,
    names: &[String],
) -> Result<usize, InputError> {
    names.iter().position(|n| n == name.get_ref()).ok_or_else(|| {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        at.error(
            name.span(),
            format!("unknown {what} `{}`", name.get_ref()),
            &suggestion(name.get_ref(), &known),
        )
    })
}

fn checked_row<T>(
    at: &LocatedSection<T>,
    name: &Spanned<String>,
    row: &Spanned<Vec<f64>>,
    columns: usize,
) -> Result<Vec<f64>, InputError> {
    let values = row.get_ref();
    if values.len() != columns {
        let cause = format!("row `{}` has {} entries, not {columns}", name.get_ref(), values.len());
        return Err(at.error(
            row.span(),
            cause,
            "give one entry per column, in the order of the list of names",
        ));
    }
    check_probability_row(values).map_err(|e| {
        let cause = format!("row `{}`: {e}", name.get_ref());
        at.error(row.span(), cause, "make the entries probabilities that sum to 1")
    })?;
    // Rounded entries are accepted, and scaled to sum to 1.
    let sum: f64 = values.iter().sum();
    Ok(values.iter().map(|v| v / sum).collect())
}

/// Returns this sensor's true observation of each kind.
fn designates(
    sensor: &str,
    at: &LocatedSection<SensorSection>,
    kinds: &Kinds,
    is_mounted: bool,
) -> Result<Vec<u8>, InputError> {
    let section = at.section.get_ref();
    for observation in section.designates.values() {
        position(at, "observation", observation, section.observations.get_ref())?;
    }
    // A profile may name kinds of other scenarios, but not a sensor in use.
    if is_mounted || kinds.is_in_scenario(at) {
        kinds.check_designates(at)?;
    }
    kinds.designations(sensor, at, is_mounted)
}

/// Checks an effector; `left`, `right` and `stay` are perfect where they are left out.
pub(super) fn effector(
    name: &str,
    at: &LocatedSection<EffectorSection>,
) -> Result<EffectorModel, InputError> {
    let section = at.section.get_ref();
    let mut model = EffectorModel { name: name.into(), ..EffectorModel::perfect() };
    let span = at.section.span();
    if !section.actions.contains_key("forward") {
        return Err(at.error(
            span,
            format!("effector `{name}` has no action `forward`"),
            "give at least forward = [{ p = 1.0, path = \"F\" }]",
        ));
    }
    for (action, transitions) in &section.actions {
        let span = transitions.span();
        let list: Vec<Transition> = transitions.get_ref().iter().map(transition).collect();
        let row: Vec<f64> = list.iter().map(|t| t.p).collect();
        check_probability_row(&row).map_err(|e| {
            let cause = format!("action `{action}` of effector `{name}`: {e}");
            at.error(span, cause, "make the probabilities `p` of its transitions sum to 1")
        })?;
        match STANDARD_ACTIONS.iter().position(|s| s == action) {
            Some(id) => model.transitions[id] = list,
            None => {
                model.actions.push(action.clone());
                model.transitions.push(list);
            }
        }
    }
    if model.actions.len() > MAX_ACTIONS {
        return Err(at.error(span, "more than 120 actions", "give fewer"));
    }
    model.delays = section.delays.as_ref().map(|section| delays(name, at, section)).transpose()?;
    Ok(model)
}

/// Checks the delays of an effector.
fn delays(
    name: &str,
    at: &LocatedSection<EffectorSection>,
    section: &Spanned<DelaySection>,
) -> Result<DelayModel, InputError> {
    let s = section.get_ref();
    let durations = match &s.durations {
        Some(list) => listed_durations(name, at, s, list),
        None => drawn_durations(name, at, section),
    };
    Ok(DelayModel { p: s.p.get(), per: s.per, durations: durations? })
}

/// Returns the durations of a list, which stands alone.
fn listed_durations(
    name: &str,
    at: &LocatedSection<EffectorSection>,
    s: &DelaySection,
    list: &Spanned<Vec<DurationSection>>,
) -> Result<Vec<DelayDuration>, InputError> {
    let is_alone = s.min.is_none() && s.max.is_none() && s.distribution.is_none();
    if !is_alone || s.mean_ratio.is_some() || s.sd_ratio.is_some() {
        let cause =
            format!("the delays of effector `{name}` have `durations` beside a distribution");
        let remedy = "leave out min, max, distribution, mean_ratio and sd_ratio, or `durations`";
        return Err(at.error(list.span(), cause, remedy));
    }
    let row: Vec<f64> = list.get_ref().iter().map(|duration| duration.p.get()).collect();
    check_probability_row(&row).map_err(|e| {
        let cause = format!("the durations of the delays of effector `{name}`: {e}");
        at.error(list.span(), cause, "make the probabilities `p` of its durations sum to 1")
    })?;
    let durations = list.get_ref().iter();
    let cycles = durations.map(|duration| duration.cycles.get() as u32);
    Ok(cycles.zip(row).map(|(cycles, p)| DelayDuration { cycles, p }).collect())
}

/// Returns the durations of a distribution.
fn drawn_durations(
    name: &str,
    at: &LocatedSection<EffectorSection>,
    section: &Spanned<DelaySection>,
) -> Result<Vec<DelayDuration>, InputError> {
    let s = section.get_ref();
    let Some((min, max)) = s.min.zip(s.max) else {
        let cause = format!("the delays of effector `{name}` do not say how long they are");
        let remedy = "give min and max in cycles, e.g. min = 1 and max = 5, or durations = [{ cycles = 2, p = 1.0 }]";
        return Err(at.error(section.span(), cause, remedy));
    };
    let [min, max] = [min, max].map(|cycles| cycles.get() as u32);
    if min > max {
        let cause = format!("the delays of effector `{name}` last from {min} to {max} cycles");
        return Err(at.error(section.span(), cause, "give a `max` that is not below `min`"));
    }
    match s.distribution.as_ref().map(|kind| *kind.get_ref()).unwrap_or_default() {
        DelayDistribution::Uniform if s.mean_ratio.is_some() || s.sd_ratio.is_some() => {
            let cause = format!(
                "the delays of effector `{name}` have a mean or a deviation that nothing uses"
            );
            let remedy = "leave out mean_ratio and sd_ratio, or add distribution = \"gaussian\"";
            Err(at.error(section.span(), cause, remedy))
        }
        DelayDistribution::Uniform => Ok(uniform_durations(min, max)),
        DelayDistribution::Gaussian => {
            let Some((mean, sd)) = s.mean_ratio.zip(s.sd_ratio) else {
                let cause = format!(
                    "the Gaussian delays of effector `{name}` have no mean or no deviation"
                );
                let remedy =
                    "give both as shares of max - min, e.g. mean_ratio = 0.5 and sd_ratio = 0.25";
                return Err(at.error(section.span(), cause, remedy));
            };
            let width = f64::from(max - min);
            let mean = f64::from(min) + mean.get() * width;
            Ok(gaussian_durations(min, max, mean, sd.get() * width))
        }
    }
}

fn transition(t: &TransitionSection) -> Transition {
    Transition { p: t.p, path: t.path.0.clone(), turn: t.turn.0 }
}
