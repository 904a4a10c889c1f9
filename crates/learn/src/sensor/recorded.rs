//! The shape of a sensor as the recording of a run knows it.

use super::LearnedSensor;
use super::options::SensorOptions;
use super::readings::only_sensor;
use crate::EstimateOptions;
use crate::log_table::LogTable;
use sidestep_kernel::InputError;

/// Options of learning a sensor from a recorded run: the recording gives what is left out here.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSensorOptions {
    /// The rule by which counts become probabilities.
    pub estimate: EstimateOptions,
    /// Name of the sensor to learn, for a run with several.
    pub sensor: Option<String>,
    /// Edges between distance classes in meters; refused where they are others than those of the run.
    pub distance_edges_m: Option<Vec<f64>>,
    /// Names of the distance classes, near to far; those of the run where empty.
    pub distance_classes: Vec<String>,
    /// Bearings of the profile's beams in degrees, + to the left.
    pub bearings_deg: Option<Vec<f64>>,
    /// Range of the profile's sensor in meters.
    pub range_m: Option<f64>,
}

/// The shape of one sensor of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct RecordedShape {
    range_m: Option<f64>,
    bearings_deg: Option<Vec<f64>>,
    distance_edges_m: Option<Vec<f64>>,
    distance_classes: Vec<String>,
    /// Kinds that it takes for something else.
    designates: Vec<(String, String)>,
    /// Whether its reports are ranges in meters, which another table has.
    measures_ranges: bool,
}

impl RecordedShape {
    /// Returns the shape of a sensor by the facts that the recording has of all rows.
    pub(super) fn from_facts(sensor: &str, facts: &[(String, String)]) -> Self {
        let fact = |key: &str| {
            let name = format!("sensor.{sensor}.{key}");
            facts.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_str())
        };
        let edges_m = fact("distance_edges_m").and_then(numbers);
        let classes: Vec<String> = fact("distance_classes").map(words).unwrap_or_default();
        // A name with a comma in it cannot be told from two names.
        let are_named = edges_m.as_ref().is_some_and(|edges| classes.len() == edges.len() + 1);
        Self {
            range_m: fact("range_m").and_then(|range| range.parse().ok()),
            bearings_deg: fact("bearings_deg").and_then(numbers).map(wrapped_deg),
            distance_edges_m: edges_m,
            distance_classes: if are_named { classes } else { Vec::new() },
            designates: fact("designates").map(pairs).unwrap_or_default(),
            measures_ranges: fact("table") == Some("ranges"),
        }
    }
}

fn words(list: &str) -> Vec<String> {
    list.split(',').map(String::from).collect()
}

fn numbers(list: &str) -> Option<Vec<f64>> {
    let items = list.split(',').filter(|item| !item.is_empty());
    items.map(|item| item.parse().ok()).collect()
}

/// Returns bearings from -180 to 180 degrees; scenarios may count on to 360.
fn wrapped_deg(bearings_deg: Vec<f64>) -> Vec<f64> {
    let wrapped = |deg: f64| {
        let turned = deg.rem_euclid(360.0);
        if turned > 180.0 { turned - 360.0 } else { turned }
    };
    bearings_deg.into_iter().map(wrapped).collect()
}

fn pairs(list: &str) -> Vec<(String, String)> {
    let pairs = list.split(',').filter_map(|pair| pair.split_once('='));
    pairs.map(|(kind, seen)| (kind.to_string(), seen.to_string())).collect()
}

/// Returns the table of a recorded run from which a sensor is learned: `ranges` where it measures them, else `readings`.
/// `table` and `facts` are those of `readings`.
pub fn recorded_table(
    table: &dyn LogTable,
    facts: &[(String, String)],
    sensor: Option<&str>,
) -> &'static str {
    let name = sensor.map(String::from).or_else(|| only_sensor(table));
    let shape = name.map(|name| RecordedShape::from_facts(&name, facts)).unwrap_or_default();
    if shape.measures_ranges { "ranges" } else { "readings" }
}

/// Learns from the table `readings` or `ranges` of a recorded run, see [`recorded_table`]; `facts` are what the recording says of all of its rows, by name.
///
/// The run knows the bearings, the range and the distance classes of its sensors, and whether they erred at all.
///
/// # Errors
/// Those of [`learn_csv`](super::learn_csv); when other edges or classes are given than those of the run.
pub fn learn_run(
    table: &dyn LogTable,
    facts: &[(String, String)],
    options: &RunSensorOptions,
) -> Result<LearnedSensor, InputError> {
    let name = options.sensor.clone().or_else(|| only_sensor(table));
    let shape = name.map(|name| RecordedShape::from_facts(&name, facts)).unwrap_or_default();
    let full = full_options(table, options, &shape)?;
    let mut model = if shape.distance_edges_m.is_some() {
        super::learn_known_csv(table, &full)?
    } else {
        super::learn_csv(table, &full)?
    };
    if !shape.designates.is_empty() {
        model
            .profile
            .designates
            .retain(|(kind, _)| shape.designates.iter().all(|(k, _)| k != kind));
        model.profile.designates.extend(shape.designates);
        model.profile.designates.retain(|(_, seen)| model.profile.observations.contains(seen));
    }
    let regime = facts.iter().find(|(known, _)| known == "regime").map(|(_, value)| value.as_str());
    if let Some(regime @ ("reliable" | "effectors")) = regime {
        model.report.warnings.push(format!(
            "the run was recorded with regime = \"{regime}\", in which sensors never err, whatever their tables say"
        ));
    }
    Ok(model)
}

/// Returns the options with what the recording knows of the sensor.
fn full_options(
    table: &dyn LogTable,
    options: &RunSensorOptions,
    shape: &RecordedShape,
) -> Result<SensorOptions, InputError> {
    let default = SensorOptions::default();
    refuse_other(
        table.place(),
        table.option_name("--edges", "edges_m"),
        options.distance_edges_m.as_ref(),
        shape.distance_edges_m.as_ref(),
    )?;
    let own_classes = Some(&options.distance_classes).filter(|classes| !classes.is_empty());
    let classes = Some(&shape.distance_classes).filter(|classes| !classes.is_empty());
    let name = table.option_name("--classes", "classes");
    refuse_other(table.place(), name, own_classes, classes)?;
    let edges_m = options.distance_edges_m.clone().or_else(|| shape.distance_edges_m.clone());
    Ok(SensorOptions {
        estimate: options.estimate,
        distance_edges_m: edges_m.unwrap_or(default.distance_edges_m),
        distance_classes: own_classes.or(classes).cloned().unwrap_or_default(),
        bearings_deg: options
            .bearings_deg
            .clone()
            .or_else(|| shape.bearings_deg.clone())
            .unwrap_or(default.bearings_deg),
        range_m: options.range_m.or(shape.range_m).unwrap_or(default.range_m),
        sensor: options.sensor.clone(),
        beam: shape.measures_ranges,
    })
}

/// Refuses a value that is not the one with which a run was recorded.
fn refuse_other<T: PartialEq + std::fmt::Debug>(
    place: &str,
    option: &str,
    given: Option<&T>,
    recorded: Option<&T>,
) -> Result<(), InputError> {
    match (given, recorded) {
        (Some(given), Some(recorded)) if given != recorded => {
            let cause =
                format!("{option} is {given:?}, and the run was recorded with {recorded:?}");
            Err(InputError::new(
                place,
                cause,
                format!("leave out {option}: the recording knows it"),
            ))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::table::CsvTable;

    const ROWS: &str = "cycle,robot,sensor,true,true_class,reported,reported_class,sensor_name\n\
        0,0,1,wall,near,wall,near,skin\n0,1,1,wall,far,nothing,beyond,sonar\n\
        1,1,1,nothing,beyond,nothing,beyond,sonar\n";

    fn facts() -> Vec<(String, String)> {
        let facts = [
            ("sensor.sonar.range_m", "3"),
            ("sensor.sonar.bearings_deg", "0,90,315"),
            ("sensor.sonar.distance_edges_m", "1"),
            ("sensor.sonar.distance_classes", "near,far"),
            ("sensor.sonar.designates", "door=wall,person=nothing"),
            ("sensor.skin.distance_edges_m", ""),
            ("sensor.skin.distance_classes", "near"),
            ("regime", "effectors"),
        ];
        facts.map(|(name, value)| (name.to_string(), value.to_string())).to_vec()
    }

    fn learned(options: RunSensorOptions) -> Result<LearnedSensor, InputError> {
        learn_run(&CsvTable::parse(&"readings", ROWS)?, &facts(), &options)
    }

    fn sonar() -> RunSensorOptions {
        RunSensorOptions { sensor: Some("sonar".into()), ..RunSensorOptions::default() }
    }

    #[test]
    fn a_run_knows_the_shape_of_its_sensors_and_tells_them_apart_by_name() {
        let model = learned(sonar()).unwrap();
        assert_eq!(model.report.sightings, 2, "the skin of robot 0 is another sensor 1");
        let profile = model.profile;
        assert_eq!((profile.range_m, profile.bearings_deg), (3.0, vec![0.0, 90.0, -45.0]));
        assert_eq!((profile.distance_edges_m, profile.distance_classes.len()), (vec![1.0], 2));
        assert!(profile.designates.contains(&("door".into(), "wall".into())));
        assert!(model.report.warnings.iter().any(|words| words.contains("never err")));
        let error = learned(RunSensorOptions::default()).unwrap_err();
        assert!(error.cause().contains("skin, sonar"), "{error}");
    }

    #[test]
    fn other_edges_than_those_of_the_run_are_refused() {
        let error =
            learned(RunSensorOptions { distance_edges_m: Some(vec![1.5]), ..sonar() }).unwrap_err();
        assert!(error.remedy().contains("leave out --edges"));
        let names = ["a", "b"].map(String::from).to_vec();
        assert!(learned(RunSensorOptions { distance_classes: names, ..sonar() }).is_err());
        let same = RunSensorOptions { distance_edges_m: Some(vec![1.0]), ..sonar() };
        assert!(learned(same).is_ok());
    }
}
