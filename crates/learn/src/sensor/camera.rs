//! The rows from which a simulation draws a sensor's reports.

use super::detection::Detection;
use super::options::{BEYOND, DistanceClasses, SensorOptions};
use super::tables::{LANDMARK, NO_SUBJECT, ROBOT};
use crate::counts::{rounded, smooth};
use crate::{CountTable, LowCountRow};
use sidestep_error_models::sensor::SensorModel;

/// The report when nothing is seen.
pub(super) const NOTHING: &str = "nothing";

/// A sensor in the form of a profile; every row sums to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorProfile {
    /// Bearings of the beams in degrees relative to the heading, + to the left.
    pub bearings_deg: Vec<f64>,
    /// Length of the beams in meters; nothing farther off is seen.
    pub range_m: f64,
    /// The possible reports; the first is `nothing`.
    pub observations: Vec<String>,
    /// Kinds of objects that are observed under another name than their own.
    pub designates: Vec<(String, String)>,
    /// Edges between the distance classes, in meters.
    pub distance_edges_m: Vec<f64>,
    /// Names of the distance classes, near to far.
    pub distance_classes: Vec<String>,
    /// P(reported | true): a row per observation, columns in the order of the observations.
    pub confusion: Vec<NamedRow>,
    /// Rows that replace those of `confusion` in a distance class.
    pub confusion_by_class: Vec<(String, Vec<NamedRow>)>,
    /// P(reported class | true class): a row per class and one, `beyond`, for spurious
    /// reports; columns in the order of the classes.
    pub distance_confusion: Vec<NamedRow>,
    /// Rows without any count, and the values that were assumed for them.
    pub assumed: Vec<String>,
    /// The rule by which counts became rows.
    pub rule: String,
}

impl SensorProfile {
    /// Returns the sensor `name` as a model for bodies of these kinds, the first of which is the empty box. A kind
    /// that the sensor has no observation for reads as nothing.
    ///
    /// # Panics
    /// When the profile's rows do not fit its observations and distance classes.
    pub fn model(&self, name: &str, kinds: &[String]) -> SensorModel {
        let classes = [&self.distance_classes[..], &[BEYOND.to_string()]].concat();
        let everywhere = rows_of(&self.confusion, &self.observations);
        let mut confusion = vec![everywhere; classes.len()];
        for (class, rows) in &self.confusion_by_class {
            let index = classes.iter().position(|known| known == class);
            let matrix = &mut confusion[index.expect("one of the classes")];
            for (row, observation) in matrix.iter_mut().zip(&self.observations) {
                if let Some(own) = row_of(rows, observation) {
                    *row = own;
                }
            }
        }
        SensorModel {
            name: name.into(),
            bearings_deg: self.bearings_deg.clone(),
            range_m: self.range_m,
            observations: self.observations.clone(),
            confusion,
            distance_edges_m: self.distance_edges_m.clone(),
            distance_classes: self.distance_classes.clone(),
            distance_confusion: rows_of(&self.distance_confusion, &classes),
            designates: kinds.iter().map(|kind| self.designated_observation(kind)).collect(),
            beam: None,
        }
    }

    /// Returns 0, which is nothing, where the sensor has no observation for the kind.
    fn designated_observation(&self, kind: &str) -> u8 {
        let own = self.designates.iter().find(|(name, _)| name == kind);
        let designated = own.map_or(kind, |(_, observation)| observation);
        let index = self.observations.iter().position(|known| known == designated);
        index.unwrap_or_default() as u8
    }
}

/// Every name must have a row.
fn rows_of(rows: &[NamedRow], names: &[String]) -> Vec<Vec<f64>> {
    names.iter().map(|name| row_of(rows, name).expect("a row for each name")).collect()
}

/// Returns the row of a name, brought to sum to 1: printed digits may leave it short.
fn row_of(rows: &[NamedRow], name: &str) -> Option<Vec<f64>> {
    let row = rows.iter().find(|row| row.name == name)?;
    let sum: f64 = row.probabilities.iter().sum();
    Some(row.probabilities.iter().map(|p| p / sum).collect())
}

/// One row of a table of probabilities.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedRow {
    /// Name of the true value.
    pub name: String,
    /// One probability per column; they sum to 1.
    pub probabilities: Vec<f64>,
}

impl NamedRow {
    pub(super) fn new(name: &str, probabilities: &[f64]) -> Self {
        Self { name: name.to_owned(), probabilities: rounded(probabilities) }
    }
}

/// The rule by which the rows of a camera are computed.
const RULE: &str = "P(nothing | subject) is 1 minus the detection rate of its kind in 1 s bins \
    (one simulation cycle stands for one bin), per distance class; a detected subject is \
    reported by the kind confusion, where an unknown code counts as nothing; P(spurious | \
    nothing) is spurious readings per beam and bin without a subject; every count plus alpha";

/// The counts that a camera's rows are computed from.
pub(super) struct CameraCountTables<'a> {
    /// True kind against decoded kind.
    pub(super) kinds: &'a CountTable,
    /// Detection by kind and class.
    pub(super) detection: &'a Detection,
    /// True class against measured class.
    pub(super) distance: &'a CountTable,
    /// Class of spurious readings.
    pub(super) beyond: &'a CountTable,
}

/// Returns a camera that reports `nothing`, `robot` or `landmark`.
pub(super) fn camera(
    looks: &CameraCountTables<'_>,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> SensorProfile {
    let alpha = options.estimate.alpha;
    let mut confusion = vec![NamedRow::new(NOTHING, &spurious_row(looks, options))];
    confusion.extend(subject_rows(looks, None, alpha));
    let mut confusion_by_class = Vec::new();
    for (class, name) in classes.names.iter().enumerate() {
        let rows = subject_rows(looks, Some(class), alpha).to_vec();
        confusion_by_class.push((name.clone(), rows));
    }
    let mut assumed = Vec::new();
    for (kind, name) in [(ROBOT, "robot"), (LANDMARK, "landmark")] {
        assumed.extend(assumed_detections(looks, kind, name));
    }
    let distance_confusion = distance_rows(looks.distance, looks.beyond, alpha, &mut assumed);
    SensorProfile {
        bearings_deg: options.bearings_deg.clone(),
        range_m: options.range_m,
        observations: [NOTHING, "robot", "landmark"].map(String::from).to_vec(),
        // The arena has landmarks where a building has walls; no other kind has a code.
        designates: [("wall", "landmark"), ("door", NOTHING), ("person", NOTHING)]
            .map(|(kind, observation)| (kind.to_string(), observation.to_string()))
            .to_vec(),
        distance_edges_m: classes.edges_m.clone(),
        distance_classes: classes.names.clone(),
        confusion,
        confusion_by_class,
        distance_confusion,
        assumed,
        rule: RULE.to_string(),
    }
}

/// Returns the row of reports in a direction where nothing stands.
fn spurious_row(looks: &CameraCountTables<'_>, options: &SensorOptions) -> Vec<f64> {
    let beams = looks.detection.looks as f64 * options.bearings_deg.len() as f64;
    let in_view: f64 = looks.detection.all.cells().iter().flatten().sum();
    let spurious = looks.kinds.row(NO_SUBJECT);
    let robot_or_landmark = spurious[ROBOT] + spurious[LANDMARK];
    // With more readings than beams nothing would be left; one keeps the row a distribution.
    let empty = (beams - in_view - robot_or_landmark).max(1.0);
    smooth(&[empty, spurious[ROBOT], spurious[LANDMARK]], options.estimate.alpha)
}

/// Returns the rows of robots and landmarks, in one class or in all.
fn subject_rows(looks: &CameraCountTables<'_>, class: Option<usize>, alpha: f64) -> [NamedRow; 2] {
    [
        NamedRow::new("robot", &subject_row(looks, ROBOT, class, alpha)),
        NamedRow::new("landmark", &subject_row(looks, LANDMARK, class, alpha)),
    ]
}

/// Returns the row of reports in the direction of a robot or landmark, in one class or in all.
fn subject_row(
    looks: &CameraCountTables<'_>,
    kind: usize,
    class: Option<usize>,
    alpha: f64,
) -> Vec<f64> {
    let detected = detection_rate(looks, kind, class, alpha);
    // Without a sighting of this kind its code is taken to be read right. This need not be listed
    // as assumed: either all subjects of the kind were missed, and the row hardly counts, or none
    // was in view, and their detection is listed.
    let mut as_kind = looks.kinds.smoothed(kind, alpha).unwrap_or_else(|| {
        let mut truly = vec![0.0; 3];
        truly[kind] = 1.0;
        truly
    });
    as_kind.iter_mut().for_each(|p| *p *= detected);
    vec![1.0 - as_kind[ROBOT] - as_kind[LANDMARK], as_kind[ROBOT], as_kind[LANDMARK]]
}

/// Returns the detection rate in a class; over all classes where none was in view in that one.
fn detection_rate(
    looks: &CameraCountTables<'_>,
    kind: usize,
    class: Option<usize>,
    alpha: f64,
) -> f64 {
    let table = detection_table(looks, kind);
    if let Some(row) = class.and_then(|class| table.smoothed(class, alpha)) {
        return row[0];
    }
    let pooled: [f64; 2] =
        [0, 1].map(|column: usize| table.cells().iter().map(|row| row[column]).sum());
    // A kind that was never in view is taken to be always detected; [`assumed_detections`] lists
    // its classes.
    if pooled == [0.0, 0.0] { 1.0 } else { smooth(&pooled, alpha)[0] }
}

fn detection_table<'a>(looks: &CameraCountTables<'a>, kind: usize) -> &'a CountTable {
    if kind == ROBOT { &looks.detection.robots } else { &looks.detection.landmarks }
}

fn assumed_detections(looks: &CameraCountTables<'_>, kind: usize, name: &str) -> Vec<String> {
    let mut assumed = Vec::new();
    for LowCountRow { row: class, .. } in detection_table(looks, kind).low_count_rows(1) {
        assumed.push(format!("detection of {name} in {class}: as over all classes"));
    }
    assumed
}

/// Returns the rows of the distance classes and of `beyond`. A class without counts is reported
/// truly; a spurious report without counts may have any class.
pub(super) fn distance_rows(
    distance: &CountTable,
    beyond: &CountTable,
    alpha: f64,
    assumed: &mut Vec<String>,
) -> Vec<NamedRow> {
    let mut rows = Vec::new();
    for (class, name) in distance.rows().iter().enumerate() {
        let row = distance.smoothed(class, alpha).unwrap_or_else(|| {
            assumed.push(format!("distance {name}: reported truly"));
            certain_row(distance.columns().len(), class)
        });
        rows.push(NamedRow::new(name, &row));
    }
    if beyond.total(0) == 0.0 {
        assumed.push("distance of spurious reports: all classes alike".to_string());
    }
    rows.push(NamedRow::new(BEYOND, &smooth(beyond.row(0), alpha)));
    rows
}

/// Returns the row of a value that is always reported truly.
pub(super) fn certain_row(n: usize, column: usize) -> Vec<f64> {
    let mut row = vec![0.0; n];
    row[column] = 1.0;
    row
}
