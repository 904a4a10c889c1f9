//! Genericity: bodies of 1 to 5 boxes a side and an added camera, as data alone.
//!
//! The paper changed the number of occupied boxes in its source, and wrote code for the camera.
//! Here the scenario states both, and the behavior accepts any beams.

use super::LoriaConfig;
use super::floor::Floor;
use super::measure::{LoriaVariant, Measure, RunMeasures, measure_all, values};
use super::reliability::{CONTACTS, TRIP};
use crate::case_results::{figure, table};
use crate::study::Progress;
use serde::Serialize;
use sidestep::worlds::robots::world::Regime;
use sidestep_document::{Estimate, Figure, Series, Table};
use std::sync::Arc;

/// Sides of the bodies, in boxes.
pub(super) const SIZES: [u32; 5] = [1, 2, 3, 4, 5];

/// Outcomes of one body size and set of sensors.
#[derive(Debug, Clone, Serialize)]
pub(super) struct BuildOutcomes {
    /// Side of the body in boxes.
    pub(super) size: u32,
    /// Whether a camera was added to the sonar ring.
    pub(super) camera: bool,
    /// Outcomes by seed.
    pub(super) outcomes: Vec<RunMeasures>,
}

impl BuildOutcomes {
    fn mean(&self, measure: Measure) -> Estimate {
        Estimate::from_values(values(&self.outcomes, measure))
    }
}

#[derive(Debug, Clone, Serialize)]
pub(super) struct GenericityResults {
    /// Those without a camera first, each by size.
    pub(super) builds: Vec<BuildOutcomes>,
    /// Cycles of each run.
    pub(super) cycles: u64,
}

impl GenericityResults {
    /// Runs the experiment: both sensors and effectors unreliable, medium floor.
    pub(super) fn run(plan: &LoriaConfig, report: &mut Progress<'_>) -> Self {
        let floor = Arc::new(Floor::medium());
        let mut variants = Vec::new();
        for camera in [false, true] {
            for size in SIZES {
                variants.push(LoriaVariant {
                    size,
                    camera,
                    ..LoriaVariant::new(&floor, Regime::Both)
                });
            }
        }
        let outcomes = measure_all(&variants, plan, "genericity", report);
        let mut builds = Vec::new();
        for (variant, outcomes) in variants.iter().zip(outcomes) {
            builds.push(BuildOutcomes { size: variant.size, camera: variant.camera, outcomes });
        }
        Self { builds, cycles: plan.cycles }
    }

    fn builds_with_camera(&self, camera: bool) -> impl Iterator<Item = &BuildOutcomes> {
        self.builds.iter().filter(move |build| build.camera == camera)
    }

    /// Returns, of the runs with or without a camera, how many kept the laws, in how many trips
    /// were completed, and how many there are.
    pub(super) fn runs(&self, camera: bool) -> [usize; 3] {
        let runs: Vec<&RunMeasures> =
            self.builds_with_camera(camera).flat_map(|build| &build.outcomes).collect();
        let lawful = runs.iter().filter(|outcome| outcome.lawful).count();
        let with_trips = runs.iter().filter(|outcome| outcome.trip_cycles.is_some()).count();
        [lawful, with_trips, runs.len()]
    }

    /// Returns contacts with a camera minus those without, over all sizes and seeds.
    pub(super) fn camera_effect(&self) -> Estimate {
        let [with_camera, without] = [true, false].map(|camera| -> Vec<Option<f64>> {
            let builds = self.builds_with_camera(camera);
            builds.flat_map(|build| values(&build.outcomes, CONTACTS)).collect()
        });
        Estimate::paired_difference(&with_camera, &without)
    }

    /// Returns contacts and trips by size and sensors.
    pub(super) fn table(&self) -> Table {
        let note = format!(
            "Mean [95 % interval] over seeds, runs of {} cycles; sensors and effectors \
             unreliable, medium floor, behavior `avoid`. Only `size` and `sensors` of the \
             scenario differ. Trips are those completed: where they are few, long ones are missing. Bodies of 4 and 5 \
             boxes jam in corridors of 12 boxes.",
            self.cycles
        );
        table(
            "Body sizes and an added camera",
            note,
            &self.builds,
            &[
                ("body, boxes", &|b| format!("{0} x {0}", b.size)),
                ("sensors", &|b| sensors(b.camera).into()),
                ("contacts / 1000 actions", &|b| b.mean(CONTACTS).to_string()),
                ("trip, cycles", &|b| b.mean(TRIP).to_string()),
                ("trips per robot", &|b| b.mean(|o| o.trips).to_string()),
                ("straightness", &|b| b.mean(|o| o.straightness).to_string()),
            ],
        )
    }

    /// Returns contacts over body size.
    pub(super) fn figure(&self) -> Figure {
        let series = [false, true].map(|camera| {
            let builds = self.builds_with_camera(camera);
            let points = builds.filter_map(|b| b.mean(CONTACTS).point(f64::from(b.size)));
            Series { name: sensors(camera).into(), points: points.collect() }
        });
        figure(
            "Contacts by body size and sensors",
            ["side of the body, boxes", "contacts per 1000 actions"],
            series,
        )
    }
}

fn sensors(camera: bool) -> &'static str {
    if camera { "sonar ring and camera" } else { "sonar ring" }
}
