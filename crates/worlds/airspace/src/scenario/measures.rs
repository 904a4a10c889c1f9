//! The measures that a run takes.

use super::compile::Compiler;
use super::optimizer::{LookAhead, OnOffSwitch};
use crate::flight::SeparationMinima;
use crate::measures::{
    DEFAULT_LIFT_TO_DRAG, FlightMeasures, MeasureSettings, NMAC, PairMeasures, WellClearVolume,
};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_scenario::{Closed, LeftOpen, Number};

/// Seconds by which conflicts are looked for farther ahead than any method looks, unless a scenario says otherwise: else a
/// method, which keeps a margin beside the separation, would solve many of them before they are counted.
const LOOK_AHEAD_MARGIN_S: f64 = 30.0;

/// Switches and settings of measures.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct MeasuresSection {
    /// Whether conflicts, violations of well clear and near mid-air collisions are counted.
    pub(super) pairs: OnOffSwitch,
    /// Whether distance, fuel and maneuvers of flights are measured.
    pub(super) flights: OnOffSwitch,
    /// Time within which a predicted loss of separation is a conflict.
    pub(super) look_ahead_s: Option<Number<LookAhead>>,
    /// Lift-to-drag ratio, by which a climb weighs against a distance.
    pub(super) lift_to_drag: Option<Number<LeftOpen<0, 1000>>>,
}

/// The volume that airplanes that are well clear of each other keep out of.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WellClearSection {
    /// The volume that is meant: that of the separation, or of a standard.
    standard: WellClearStandard,
    /// Largest modified tau, in place of that of the standard.
    tau_s: Option<Number<Closed<0, 100_000>>>,
    /// DMOD and HMD.
    horizontal_m: Option<Number<VolumeSize>>,
    /// Vertical threshold.
    vertical_m: Option<Number<VolumeSize>>,
}

/// Minima below which two airplanes have had a near mid-air collision.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NmacSection {
    /// Horizontal minimum.
    horizontal_m: Option<Number<VolumeSize>>,
    /// Vertical minimum.
    vertical_m: Option<Number<VolumeSize>>,
}

/// A size of a volume in meters.
type VolumeSize = LeftOpen<0, 1_000_000>;

/// Definitions of well clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum WellClearStandard {
    /// The separation of the scenario, 35 s ahead.
    #[default]
    Separation,
    /// RTCA DO-365, en route: 35 s, 4000 ft and 450 ft.
    #[serde(rename = "do-365")]
    Do365,
    /// ASTM F3442, of small unmanned aircraft: 2000 ft and 250 ft.
    F3442,
}

impl WellClearStandard {
    fn volume(self) -> WellClearVolume {
        match self {
            Self::Separation => WellClearVolume::SEPARATION,
            Self::Do365 => WellClearVolume::DO_365,
            Self::F3442 => WellClearVolume::F3442,
        }
    }
}

impl WellClearSection {
    fn volume(&self) -> WellClearVolume {
        let standard = self.standard.volume();
        WellClearVolume {
            tau_s: self.tau_s.map_or(standard.tau_s, f64::from),
            horizontal_m: self.horizontal_m.map(f64::from).or(standard.horizontal_m),
            vertical_m: self.vertical_m.map(f64::from).or(standard.vertical_m),
        }
    }
}

impl NmacSection {
    fn minima(&self) -> SeparationMinima {
        SeparationMinima {
            gap_m: self.horizontal_m.map_or(NMAC.gap_m, f64::from),
            vertical_m: self.vertical_m.map_or(NMAC.vertical_m, f64::from),
        }
    }
}

impl Compiler<'_> {
    /// Returns the measures that a run takes; `methods_look_ahead_s` is how far the methods of the scenario look ahead.
    pub(super) fn measures(&self, methods_look_ahead_s: f64) -> MeasureSettings {
        let section = &self.file.airspace;
        let measures = &section.measures;
        let pairs = PairMeasures {
            look_ahead_s: measures
                .look_ahead_s
                .map_or(methods_look_ahead_s + LOOK_AHEAD_MARGIN_S, f64::from),
            well_clear: section
                .well_clear
                .as_ref()
                .map_or(WellClearVolume::SEPARATION, WellClearSection::volume),
            nmac: section.nmac.as_ref().map_or(NMAC, NmacSection::minima),
        };
        let flights = FlightMeasures {
            lift_to_drag: measures.lift_to_drag.map_or(DEFAULT_LIFT_TO_DRAG, f64::from),
        };
        MeasureSettings {
            pairs: measures.pairs.0.then_some(pairs),
            flights: measures.flights.0.then_some(flights),
        }
    }
}
