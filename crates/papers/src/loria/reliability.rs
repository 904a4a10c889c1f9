//! Reliability: the same floors under the four regimes, and sensors against effectors at equal
//! error level.

use super::LoriaConfig;
use super::errors::{BeamCount, ErrorSpread};
use super::floor::{AvoidancePolicy, Floor};
use super::measure::{ErrorTables, LoriaVariant, Measure, RunMeasures, measure_all, values};
use crate::case_results::figure;
use crate::study::Progress;
use serde::Serialize;
use sidestep::statistics::holm;
use sidestep::worlds::robots::effector::ObstacleRule;
use sidestep::worlds::robots::world::Regime;
use sidestep_document::{Estimate, Figure, FigureKind, Series, Table};
use std::sync::Arc;

/// A variant and its outcomes by seed.
#[derive(Debug, Clone, Serialize)]
pub(super) struct VariantOutcomes {
    /// Name of the floor, which the variant does not serialize.
    pub(super) floor: String,
    pub(super) variant: LoriaVariant,
    /// By seed, from 1 on.
    pub(super) outcomes: Vec<RunMeasures>,
}

impl VariantOutcomes {
    fn new(variant: LoriaVariant, outcomes: Vec<RunMeasures>) -> Self {
        Self { floor: variant.floor.name.into(), variant, outcomes }
    }

    fn is_selected(&self, key: VariantKey<'_>, regime: Regime) -> bool {
        let variant = &self.variant;
        self.floor == key.floor
            && variant.obstacle_rule == key.rule
            && variant.mind == key.mind
            && variant.regime == regime
            && same_errors(variant.tables, key.tables, regime)
    }
}

/// All runs of the reliability experiment.
#[derive(Debug, Clone, Serialize)]
pub(super) struct ReliabilityResults {
    /// The floors, in words.
    pub(super) floors: Vec<String>,
    /// The four regimes at all places first, then the sweep over error levels.
    #[serde(rename = "cells")]
    pub(super) variants: Vec<VariantOutcomes>,
    /// Error levels of the sweep.
    pub(super) levels: Vec<f64>,
}

/// The selection of a variant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VariantKey<'a> {
    /// Name of the floor in tables.
    pub(super) floor: &'a str,
    /// Law for blocked paths.
    pub(super) rule: ObstacleRule,
    /// The behavior of the robots.
    pub(super) mind: AvoidancePolicy,
    /// Their errors.
    pub(super) tables: ErrorTables,
}

impl VariantKey<'_> {
    /// The medium floor, rule `cut`, avoiding robots, presets.
    pub(super) const BASE: VariantKey<'static> = VariantKey {
        floor: "medium",
        rule: ObstacleRule::Cut,
        mind: AvoidancePolicy::Avoid,
        tables: ErrorTables::Presets,
    };
}

/// Measures that are reported, with their names.
pub(super) const MEASURES: [(&str, Measure); 6] = [
    ("contacts / 1000 actions", |o| o.contacts),
    ("with walls", |o| o.wall_contacts),
    ("with robots", |o| o.robot_contacts),
    ("trip, cycles", |o| o.trip_cycles),
    ("straightness", |o| o.straightness),
    ("sideways moves / 1000 actions", |o| o.lateral_moves),
];

/// Contacts per 1000 actions.
pub(super) const CONTACTS: Measure = MEASURES[0].1;
/// Cycles of a to-and-fro trip.
pub(super) const TRIP: Measure = MEASURES[3].1;
/// Straightness of trajectories.
pub(super) const STRAIGHTNESS: Measure = MEASURES[4].1;
/// Sideways moves per 1000 actions.
pub(super) const LATERAL: Measure = MEASURES[5].1;

impl ReliabilityResults {
    /// Runs every variant with all seeds of the plan.
    pub(super) fn run(plan: &LoriaConfig, report: &mut Progress<'_>) -> Self {
        let floors = [Floor::medium(), Floor::small(), Floor::large()].map(Arc::new);
        let variants = variants(&floors, plan);
        let outcomes = measure_all(&variants, plan, "reliability", report);
        let measured = variants.into_iter().zip(outcomes);
        Self {
            floors: floors.iter().map(|floor| floor.describe()).collect(),
            variants: measured.map(|(v, outcomes)| VariantOutcomes::new(v, outcomes)).collect(),
            levels: plan.error_levels.clone(),
        }
    }

    /// Returns made-up outcomes of every variant, by seed.
    #[cfg(test)]
    pub(super) fn synthetic(
        plan: &LoriaConfig,
        of: impl Fn(&LoriaVariant, usize) -> RunMeasures,
    ) -> Self {
        let floors = [Floor::medium(), Floor::small(), Floor::large()].map(Arc::new);
        let variants = variants(&floors, plan).into_iter().map(|variant| {
            let outcomes = (1..=plan.seeds).map(|seed| of(&variant, seed)).collect();
            VariantOutcomes::new(variant, outcomes)
        });
        let variants = variants.collect();
        Self { floors: Vec::new(), variants, levels: plan.error_levels.clone() }
    }

    /// Returns the values by seed of one measure in one variant; empty for a variant that was not run.
    pub(super) fn values(
        &self,
        key: VariantKey<'_>,
        regime: Regime,
        measure: Measure,
    ) -> Vec<Option<f64>> {
        let selected = self.variants.iter().find(|variant| variant.is_selected(key, regime));
        selected.map_or_else(Vec::new, |variant| values(&variant.outcomes, measure))
    }

    /// Returns the mean of a measure in one variant.
    pub(super) fn estimate(
        &self,
        key: VariantKey<'_>,
        regime: Regime,
        measure: Measure,
    ) -> Estimate {
        Estimate::from_values(self.values(key, regime, measure))
    }

    /// Returns the paired difference of a measure between two regimes, `a - b`.
    pub(super) fn difference(
        &self,
        key: VariantKey<'_>,
        [a, b]: [Regime; 2],
        measure: Measure,
    ) -> Estimate {
        Estimate::paired_difference(&self.values(key, a, measure), &self.values(key, b, measure))
    }

    /// Returns the ratio of a measure between two regimes seed by seed, `a / b`.
    pub(super) fn ratio(
        &self,
        key: VariantKey<'_>,
        [a, b]: [Regime; 2],
        measure: Measure,
    ) -> Estimate {
        Estimate::geometric_ratio(&self.values(key, a, measure), &self.values(key, b, measure))
    }

    /// Returns the paired difference of a measure between two minds under one regime, `a - b`.
    pub(super) fn between_policies(
        &self,
        [a, b]: [AvoidancePolicy; 2],
        regime: Regime,
        measure: Measure,
    ) -> Estimate {
        let [a, b] = [a, b]
            .map(|mind| self.values(VariantKey { mind, ..VariantKey::BASE }, regime, measure));
        Estimate::paired_difference(&a, &b)
    }

    /// Returns keys of the places where the four regimes were run under the presets.
    pub(super) fn base_keys(&self) -> Vec<VariantKey<'static>> {
        let rules = ObstacleRule::ALL.map(|rule| VariantKey { rule, ..VariantKey::BASE });
        let floors = ["small", "large"].map(|floor| VariantKey { floor, ..VariantKey::BASE });
        let minds = [AvoidancePolicy::Touch, AvoidancePolicy::Filter]
            .map(|mind| VariantKey { mind, ..VariantKey::BASE });
        rules.into_iter().chain(floors).chain(minds).collect()
    }

    /// Returns the errors that cause more contacts, at every point of the sweep over equal error levels.
    pub(super) fn dominant_errors(&self) -> Vec<DominantError> {
        let pair = [Regime::Sensors, Regime::Effectors];
        let mut all = Vec::new();
        for case in SweepCase::all() {
            for &level in &self.levels {
                let sensors_less_effectors = self.difference(case.key(level), pair, CONTACTS);
                all.push(DominantError { case, level, sensors_less_effectors, by: INCONCLUSIVE });
            }
        }
        // Of so many points some would differ by chance: Holm's correction is over all of them.
        let p_values: Vec<Option<f64>> =
            all.iter().map(|point| point.sensors_less_effectors.p_value(0.0)).collect();
        for (point, p) in all.iter_mut().zip(holm(&p_values)) {
            if p.is_some_and(|p| p < 0.05) {
                let sensors_more = point.sensors_less_effectors.mean_or_zero() > 0.0;
                point.by = if sensors_more { SENSORS } else { EFFECTORS };
            }
        }
        all
    }

    pub(super) fn tables(&self) -> Vec<Table> {
        vec![
            self.regimes_table(),
            self.differences_table(),
            self.sweep_table(),
            self.policies_table(),
        ]
    }

    fn regimes_table(&self) -> Table {
        let mut columns = vec!["floor", "rule", "behaviour", "errors"];
        columns.extend(MEASURES.map(|(name, _)| name));
        let note = format!(
            "Mean [95 % interval by Student's t] over seeds. Floors: {}.",
            self.floors.join("; ")
        );
        let mut table = Table::new("Four regimes", note, &columns);
        for key in self.base_keys() {
            for regime in Regime::ALL {
                let mut row = names(key).to_vec();
                row.push(regime.name().into());
                row.extend(MEASURES.map(|(_, m)| self.estimate(key, regime, m).to_string()));
                table.push_row(row);
            }
        }
        table
    }

    fn differences_table(&self) -> Table {
        use Regime::{Both, Effectors, Reliable, Sensors};
        let columns = [
            "floor",
            "rule",
            "behaviour",
            "contacts: effectors - reliable",
            "contacts: sensors - reliable",
            "contacts: sensors - effectors",
            "trip: effectors / reliable",
            "trip: sensors / reliable",
            "trip: both / reliable",
            "trip: both / sensors",
        ];
        let note = "Paired by seed: both runs of a pair start alike and share every draw that the \
                    regime does not change. Contacts per 1000 actions; mean [95 % interval].";
        let mut table = Table::new("What each error adds", note, &columns);
        for key in self.base_keys() {
            let contacts = [[Effectors, Reliable], [Sensors, Reliable], [Sensors, Effectors]]
                .map(|pair| self.difference(key, pair, CONTACTS).to_string());
            let pairs =
                [[Effectors, Reliable], [Sensors, Reliable], [Both, Reliable], [Both, Sensors]];
            let trips = pairs.map(|pair| self.ratio(key, pair, TRIP).to_string());
            table.push_row(names(key).into_iter().chain(contacts).chain(trips));
        }
        table
    }

    fn sweep_table(&self) -> Table {
        let columns = [
            "behaviour",
            "beams",
            "sensor recipe",
            "e",
            "effectors only",
            "sensors only",
            "sensors - effectors",
            "more contacts by",
        ];
        let note = "Contacts per 1000 actions on the medium floor, rule `cut`; paired difference. \
                    `even`: an error of a sensor is any other observation, so a thing is missed \
                    with probability e/4; `blind`: a thing is missed with probability e. 16 \
                    beams on robots of 2 x 2 boxes; 4 beams on robots of 1 box. Who causes more is said \
                    where it is sure by Holm's correction over all rows.";
        let title = "Sensors against effectors at equal error level e";
        let mut table = Table::new(title, note, &columns);
        for DominantError { case, level, sensors_less_effectors, by } in self.dominant_errors() {
            let mut row = case.names().to_vec();
            row.push(level.to_string());
            for regime in [Regime::Effectors, Regime::Sensors] {
                row.push(self.estimate(case.key(level), regime, CONTACTS).to_string());
            }
            row.push(sensors_less_effectors.to_string());
            row.push(by.into());
            table.push_row(row);
        }
        table
    }

    fn policies_table(&self) -> Table {
        let columns = [
            "errors",
            "contacts: touch - avoid",
            "contacts: filter - avoid",
            "trip: touch - avoid",
            "trip: filter - avoid",
        ];
        let note = "Paired by seed, medium floor, rule `cut`, presets. `touch` keeps to its way \
                    until it touches something, `avoid` steps around what one beam reports near, \
                    `filter` believes two reports only.";
        let mut table = Table::new("Behaviours under each regime", note, &columns);
        for regime in Regime::ALL {
            let pairs = [
                [AvoidancePolicy::Touch, AvoidancePolicy::Avoid],
                [AvoidancePolicy::Filter, AvoidancePolicy::Avoid],
            ];
            let contacts = pairs.map(|p| self.between_policies(p, regime, CONTACTS).to_string());
            let trips = pairs.map(|p| self.between_policies(p, regime, TRIP).to_string());
            table.push_row([regime.name().into()].into_iter().chain(contacts).chain(trips));
        }
        table
    }

    pub(super) fn figures(&self) -> Vec<Figure> {
        let bars = [
            self.regime_bars(
                "Contacts under the four regimes",
                "contacts per 1000 actions",
                CONTACTS,
            ),
            self.regime_bars("A to-and-fro trip under the four regimes", "cycles per trip", TRIP),
            self.regime_bars(
                "Straightness of trajectories",
                "net displacement / path length",
                STRAIGHTNESS,
            ),
        ];
        let sweeps = SweepCase::POLICIES.map(|(mind, beams)| self.sweep_figure(mind, beams));
        bars.into_iter().chain(sweeps).collect()
    }

    /// Returns one bar per regime, one series per obstacle rule.
    fn regime_bars(&self, title: &str, y_label: &str, measure: Measure) -> Figure {
        let series = ObstacleRule::ALL.map(|rule| {
            let key = VariantKey { rule, ..VariantKey::BASE };
            let mut points = Vec::new();
            for (x, regime) in Regime::ALL.into_iter().enumerate() {
                points.extend(self.estimate(key, regime, measure).point(x as f64));
            }
            Series { name: format!("rule {}", rule.name()), points }
        });
        let categories = Regime::ALL.map(|regime| regime.name().to_string()).to_vec();
        Figure {
            kind: FigureKind::Bars { categories },
            ..figure(title, ["unreliable", y_label], series)
        }
    }

    fn sweep_figure(&self, mind: AvoidancePolicy, beams: BeamCount) -> Figure {
        // Errors of effectors alone do not depend on how those of sensors are spread.
        let lines = [
            ("effectors only", Regime::Effectors, ErrorSpread::Even),
            ("sensors only, even", Regime::Sensors, ErrorSpread::Even),
            ("sensors only, blind", Regime::Sensors, ErrorSpread::Blind),
        ];
        let series = lines.map(|(name, regime, spread)| {
            self.contacts_by_level(name, SweepCase { mind, beams, spread }, regime)
        });
        let n = beams.bearings_deg().len();
        figure(
            &format!("Contacts at equal error level: {}, {n} beams", mind.name()),
            ["error level e", "contacts per 1000 actions"],
            series,
        )
    }

    fn contacts_by_level(&self, name: &str, case: SweepCase, regime: Regime) -> Series {
        let mut points = Vec::new();
        for &level in &self.levels {
            points.extend(self.estimate(case.key(level), regime, CONTACTS).point(level));
        }
        Series { name: name.into(), points }
    }
}

/// A behavior, its beams and their recipe of errors, swept over the error level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SweepCase {
    pub(super) mind: AvoidancePolicy,
    /// Their number of beams.
    pub(super) beams: BeamCount,
    /// The distribution of the sensor's error mass.
    pub(super) spread: ErrorSpread,
}

impl SweepCase {
    const POLICIES: [(AvoidancePolicy, BeamCount); 3] = [
        (AvoidancePolicy::Avoid, BeamCount::Sixteen),
        (AvoidancePolicy::Filter, BeamCount::Sixteen),
        (AvoidancePolicy::Avoid, BeamCount::Four),
    ];

    /// Each behavior with its beams, under either recipe.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        Self::POLICIES
            .into_iter()
            .flat_map(|(mind, beams)| ErrorSpread::ALL.map(|spread| Self { mind, beams, spread }))
    }

    fn key(self, e: f64) -> VariantKey<'static> {
        let tables = ErrorTables::Equal(e, self.spread, self.beams);
        VariantKey { mind: self.mind, tables, ..VariantKey::BASE }
    }

    /// Returns behavior, number of beams and recipe, for tables.
    pub(super) fn names(self) -> [String; 3] {
        let beams = self.beams.bearings_deg().len().to_string();
        [self.mind.name().into(), beams, self.spread.name().into()]
    }
}

/// The errors that cause more contacts, where they are those of sensors.
pub(super) const SENSORS: &str = "sensors";
/// See [`SENSORS`].
pub(super) const EFFECTORS: &str = "effectors";
/// See [`SENSORS`].
pub(super) const INCONCLUSIVE: &str = "cannot be told";

/// A point of the sweep over equal error levels.
#[derive(Debug, Clone)]
pub(super) struct DominantError {
    pub(super) case: SweepCase,
    pub(super) level: f64,
    /// Contacts by sensor errors alone minus those by effector errors alone.
    pub(super) sensors_less_effectors: Estimate,
    /// The errors that cause more, if that is conclusive by Holm's correction over all points.
    pub(super) by: &'static str,
}

fn names(key: VariantKey<'_>) -> [String; 3] {
    [key.floor.into(), key.rule.name().into(), key.mind.name().into()]
}

/// Returns whether two tables err alike under a regime. A regime that switches an error off does not depend on that error's
/// table, so that each of those variants is run for one table only.
fn same_errors(a: ErrorTables, b: ErrorTables, regime: Regime) -> bool {
    match (a, b, regime) {
        (ErrorTables::Equal(e, _, m), ErrorTables::Equal(f, _, n), Regime::Effectors) => {
            (e, m) == (f, n)
        }
        _ => a == b,
    }
}

fn variants(floors: &[Arc<Floor>; 3], plan: &LoriaConfig) -> Vec<LoriaVariant> {
    let [medium, small, large] = floors;
    let mut variants = Vec::new();
    for regime in Regime::ALL {
        let base = LoriaVariant::new(medium, regime);
        for obstacle_rule in ObstacleRule::ALL {
            variants.push(LoriaVariant { obstacle_rule, ..base.clone() });
        }
        for floor in [small, large] {
            variants.push(LoriaVariant::new(floor, regime));
        }
        for mind in [AvoidancePolicy::Touch, AvoidancePolicy::Filter] {
            variants.push(LoriaVariant { mind, ..base.clone() });
        }
    }
    for (mind, beams) in SweepCase::POLICIES {
        for &e in &plan.error_levels {
            for (regime, spread) in [
                (Regime::Effectors, ErrorSpread::Even),
                (Regime::Sensors, ErrorSpread::Even),
                (Regime::Sensors, ErrorSpread::Blind),
            ] {
                variants.push(LoriaVariant {
                    mind,
                    tables: ErrorTables::Equal(e, spread, beams),
                    size: beams.size(),
                    ..LoriaVariant::new(medium, regime)
                });
            }
        }
    }
    variants
}
