//! Reliability: the same floors under the four regimes, and sensors against effectors at equal
//! error level.

use super::LoriaConfig;
use super::errors::{BeamCount, ErrorSpread};
use super::floor::{AvoidancePolicy, Floor};
use super::measure::{ErrorTables, LoriaVariant, Measure, RunMeasures, measure_all, values};
use crate::cells::figure;
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
    /// Name of the floor.
    pub(super) floor: String,
    /// The variant that was run.
    pub(super) variant: LoriaVariant,
    /// Its outcomes.
    pub(super) outcomes: Vec<RunMeasures>,
}

/// All runs of the reliability experiment.
#[derive(Debug, Clone, Serialize)]
pub(super) struct ReliabilityResults {
    /// The floors, in words.
    pub(super) floors: Vec<String>,
    /// Every variant with its outcomes.
    pub(super) cells: Vec<VariantOutcomes>,
    /// Error levels of the sweep.
    pub(super) levels: Vec<f64>,
}

/// The selection of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CellKey<'a> {
    /// Name of the floor.
    pub(super) floor: &'a str,
    /// Law for blocked paths.
    pub(super) rule: ObstacleRule,
    /// The behavior of the robots.
    pub(super) mind: AvoidancePolicy,
    /// Their errors.
    pub(super) tables: ErrorTables,
}

impl CellKey<'_> {
    /// The medium floor, rule `cut`, avoiding robots, presets.
    pub(super) const BASE: CellKey<'static> = CellKey {
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
    /// Runs the experiment.
    pub(super) fn run(plan: &LoriaConfig, report: &mut Progress<'_>) -> Self {
        let floors = [Floor::medium(), Floor::small(), Floor::large()].map(Arc::new);
        let variants = variants(&floors, plan);
        let outcomes = measure_all(&variants, plan, "reliability", report);
        let cell = |(variant, outcomes): (LoriaVariant, _)| VariantOutcomes {
            floor: variant.floor.name.into(),
            variant,
            outcomes,
        };
        Self {
            floors: floors.iter().map(|floor| floor.describe()).collect(),
            cells: variants.into_iter().zip(outcomes).map(cell).collect(),
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
        let cell = |variant: LoriaVariant| VariantOutcomes {
            floor: variant.floor.name.into(),
            outcomes: (1..=plan.seeds).map(|seed| of(&variant, seed)).collect(),
            variant,
        };
        let cells = variants(&floors, plan).into_iter().map(cell).collect();
        Self { floors: Vec::new(), cells, levels: plan.error_levels.clone() }
    }

    /// Returns the values by seed of one measure in one cell; empty for a cell that was not run.
    pub(super) fn values(
        &self,
        key: CellKey<'_>,
        regime: Regime,
        measure: Measure,
    ) -> Vec<Option<f64>> {
        // A regime that switches an error off does not depend on that error's table, so those cells
        // are run for one table only.
        let is_cell = |cell: &&VariantOutcomes| {
            let v = &cell.variant;
            (cell.floor.as_str(), v.obstacle_rule, v.mind, v.regime)
                == (key.floor, key.rule, key.mind, regime)
                && same_errors(v.tables, key.tables, regime)
        };
        self.cells.iter().find(is_cell).map_or_else(Vec::new, |c| values(&c.outcomes, measure))
    }

    /// Returns the mean of a measure in one cell.
    pub(super) fn estimate(&self, key: CellKey<'_>, regime: Regime, measure: Measure) -> Estimate {
        Estimate::from_values(self.values(key, regime, measure))
    }

    /// Returns the paired difference of a measure between two regimes, `a - b`.
    pub(super) fn difference(
        &self,
        key: CellKey<'_>,
        [a, b]: [Regime; 2],
        measure: Measure,
    ) -> Estimate {
        Estimate::paired_difference(&self.values(key, a, measure), &self.values(key, b, measure))
    }

    /// Returns the ratio of a measure between two regimes seed by seed, `a / b`.
    pub(super) fn ratio(
        &self,
        key: CellKey<'_>,
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
        let of = |mind| self.values(CellKey { mind, ..CellKey::BASE }, regime, measure);
        Estimate::paired_difference(&of(a), &of(b))
    }

    /// Returns keys of the places where the four regimes were run under the presets.
    pub(super) fn base_keys(&self) -> Vec<CellKey<'static>> {
        let rules = ObstacleRule::ALL.map(|rule| CellKey { rule, ..CellKey::BASE });
        let floors = ["small", "large"].map(|floor| CellKey { floor, ..CellKey::BASE });
        let minds = [AvoidancePolicy::Touch, AvoidancePolicy::Filter]
            .map(|mind| CellKey { mind, ..CellKey::BASE });
        rules.into_iter().chain(floors).chain(minds).collect()
    }

    /// Returns the errors that cause more contacts, at every point of the sweep over equal error levels.
    pub(super) fn dominant_errors(&self) -> Vec<DominantError> {
        let points = SweepCase::all().flat_map(|case| self.levels.iter().map(move |&e| (case, e)));
        let pair = [Regime::Sensors, Regime::Effectors];
        let difference = |case: SweepCase, e| self.difference(case.key(e), pair, CONTACTS);
        let all: Vec<_> = points.map(|(case, e)| (case, e, difference(case, e))).collect();
        let p_values: Vec<_> = all.iter().map(|(.., difference)| difference.p_value(0.0)).collect();
        let named =
            |((case, level, of), p): ((SweepCase, f64, Estimate), Option<f64>)| DominantError {
                case,
                level,
                by: match (p.is_some_and(|p| p < 0.05), of.mean_or_zero() > 0.0) {
                    (false, _) => INCONCLUSIVE,
                    (true, true) => SENSORS,
                    (true, false) => EFFECTORS,
                },
                sensors_less_effectors: of,
            };
        all.into_iter().zip(holm(&p_values)).map(named).collect()
    }

    /// Returns the tables of this experiment.
    pub(super) fn tables(&self) -> Vec<Table> {
        vec![
            self.regimes_table(),
            self.differences_table(),
            self.sweep_table(),
            self.policies_table(),
        ]
    }

    fn regimes_table(&self) -> Table {
        let columns: Vec<&str> = ["floor", "rule", "behaviour", "errors"]
            .into_iter()
            .chain(MEASURES.map(|m| m.0))
            .collect();
        let note = format!(
            "Mean [95 % interval by Student's t] over seeds. Floors: {}.",
            self.floors.join("; ")
        );
        let mut table = Table::new("Four regimes", note, &columns);
        for key in self.base_keys() {
            for regime in Regime::ALL {
                let estimates = MEASURES.map(|(_, m)| self.estimate(key, regime, m).to_string());
                table.push_row(
                    names(key).into_iter().chain([regime.name().into()]).chain(estimates),
                );
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
            let of = |regime| self.estimate(case.key(level), regime, CONTACTS).to_string();
            let contacts = [of(Regime::Effectors), of(Regime::Sensors)];
            let names = case.names().into_iter().chain([format!("{level}")]);
            let told = [sensors_less_effectors.to_string(), by.into()];
            table.push_row(names.chain(contacts).chain(told));
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

    /// Returns the figures of this experiment.
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
            let at = |(x, &regime): (usize, &Regime)| {
                self.estimate(CellKey { rule, ..CellKey::BASE }, regime, measure).point(x as f64)
            };
            let points = Regime::ALL.iter().enumerate().filter_map(at).collect();
            Series { name: format!("rule {}", rule.name()), points }
        });
        let categories = Regime::ALL.map(|regime| regime.name().to_string()).to_vec();
        Figure {
            kind: FigureKind::Bars { categories },
            ..figure(title, ["unreliable", y_label], series)
        }
    }

    fn sweep_figure(&self, mind: AvoidancePolicy, beams: BeamCount) -> Figure {
        let line = |name: &str, regime, spread| {
            let case = SweepCase { mind, beams, spread };
            let at = |&e: &f64| self.estimate(case.key(e), regime, CONTACTS).point(e);
            Series { name: name.into(), points: self.levels.iter().filter_map(at).collect() }
        };
        let n = beams.bearings_deg().len();
        figure(
            &format!("Contacts at equal error level: {}, {n} beams", mind.name()),
            ["error level e", "contacts per 1000 actions"],
            vec![
                line("effectors only", Regime::Effectors, ErrorSpread::Even),
                line("sensors only, even", Regime::Sensors, ErrorSpread::Even),
                line("sensors only, blind", Regime::Sensors, ErrorSpread::Blind),
            ],
        )
    }
}

/// A behavior, its beams and their recipe of errors, swept over the error level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SweepCase {
    /// The behavior of the robots.
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

    /// Returns all cases of the sweep.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let case = |(mind, beams)| ErrorSpread::ALL.map(|spread| Self { mind, beams, spread });
        Self::POLICIES.into_iter().flat_map(case)
    }

    fn key(self, e: f64) -> CellKey<'static> {
        let tables = ErrorTables::Equal(e, self.spread, self.beams);
        CellKey { mind: self.mind, tables, ..CellKey::BASE }
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

fn names(key: CellKey<'_>) -> [String; 3] {
    [key.floor.into(), key.rule.name().into(), key.mind.name().into()]
}

/// Returns whether two tables err alike under a regime.
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
    let base = |floor, regime| LoriaVariant::new(floor, regime);
    let mut variants = Vec::new();
    for regime in Regime::ALL {
        let rules = ObstacleRule::ALL;
        variants.extend(
            rules.map(|obstacle_rule| LoriaVariant { obstacle_rule, ..base(medium, regime) }),
        );
        variants.extend([small, large].map(|floor| base(floor, regime)));
        variants.extend(
            [AvoidancePolicy::Touch, AvoidancePolicy::Filter]
                .map(|mind| LoriaVariant { mind, ..base(medium, regime) }),
        );
    }
    for (mind, beams) in SweepCase::POLICIES {
        for &e in &plan.error_levels {
            let at = |regime, spread| LoriaVariant {
                mind,
                tables: ErrorTables::Equal(e, spread, beams),
                size: beams.size(),
                ..base(medium, regime)
            };
            variants.push(at(Regime::Effectors, ErrorSpread::Even));
            variants.extend(ErrorSpread::ALL.map(|spread| at(Regime::Sensors, spread)));
        }
    }
    variants
}
