//! `sidestep learn`: error distributions of a real robot, from its logs.

use crate::console::{Console, LINE_COLS, wrap_text};
use crate::exit::{ExitCode, Failure};
use clap::{Args, Subcommand};
use serde::Serialize;
use sidestep::import::bag::{NoEcho, PoseTopic, TopicSelection};
use sidestep::kernel::InputError;
use sidestep::learn::EstimateOptions;
use sidestep::learn::effector::{self, EffectorOptions, EffectorProfile, LearnedEffector};
use sidestep::learn::profile;
use sidestep::learn::sensor::{
    self, LearnedSensor, RunSensorOptions, Scanner, SensorOptions, SensorProfile,
};
use sidestep::scenario::file::read_text;
use sidestep_session::{csv_table, write_atomically};
use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep learn sensor --mrclam logs/hall --profile my.toml --name camera
  sidestep learn effector --mrclam logs/hall --box 0.25 \\
      --profile my.toml --name create
  sidestep learn effector --carmen intel.log.gz --json | jq .transitions
  sidestep learn effector --bag hall.mcap --odom /odom --truth /vicon/pose

A scenario uses what was learned with profiles = [\"my.toml\"], sensors = [\"camera\"] and \
effector = \"create\". Files may be packed with gzip.";

const SENSOR_EXAMPLES: &str = "\
Examples:
  sidestep learn sensor --mrclam logs/hall
  sidestep learn sensor --mrclam logs/hall --edges 2,4 --classes near,medium,far
  sidestep learn sensor --csv readings.csv --range 3.75 \\
      --profile my.toml --name sonar
  sidestep learn sensor --run runs/hall --sensor sonar-ring
  sidestep learn sensor --bag hall.mcap --truth /amcl_pose --odom /odom \\
      --scan /scan --map hall.yaml

A bag is a file (.mcap, .db3, or .bag of ROS 1) or a folder of `ros2 bag record`. Truth is an Odometry, PoseStamped, \
PoseWithCovarianceStamped, TransformStamped or, with two frames, a TFMessage topic, in the frame of the \
map: /tf:map:base_link. The scanner's place on the robot is read from /tf_static.

CSV columns: true, reported (one word each; `nothing` for no observation), and true_distance_m, \
reported_distance_m, or true_class, reported_class; sensor and robot where you have them. A run knows the \
distance classes, bearings and range of its sensors.";

/// Usage as it would be made, but in lines that fit.
const SENSOR_USAGE: &str = "\
sidestep learn sensor [OPTIONS]
           <--mrclam <DIR>|--bag <PATH>|--csv <FILE>|--run <DIR>>";
const EFFECTOR_USAGE: &str = "\
sidestep learn effector [OPTIONS]
           <--mrclam <DIR>|--carmen <FILE>|--bag <PATH>|--csv <FILE>|
            --run <DIR>>";

const EFFECTOR_EXAMPLES: &str = "\
Examples:
  sidestep learn effector --mrclam logs/hall --box 0.25
  sidestep learn effector --carmen intel.log.gz --profile my.toml --name pioneer
  sidestep learn effector --bag hall.mcap --box 0.5 \\
      --odom /odom --truth /vicon/pose
  sidestep learn effector --bag run/ --odom /tf:odom:base_link \\
      --truth /tf:map:base_link
  sidestep learn effector --csv motions.csv --box 0.25 --json
  sidestep learn effector --run runs/hall
  sidestep learn effector --run runs/mixed --effector nomad --robots 0,1,2

CSV columns: action (forward, left, right, stay), ahead_boxes, left_boxes, turn_deg; contact, robot, effector, \
box_m and delay_cycles (steps between command and motion) where you have them. Moves that an obstacle cut short are left out: record logs in an open place. A run is recorded with \
--set record.calibration=true. A bag is a file (.mcap, .db3, or .bag of ROS 1) or a folder of `ros2 bag record`; poses are of type \
Odometry, PoseStamped, PoseWithCovarianceStamped, TransformStamped or TFMessage.";

/// Learn the error models of a real robot's sensors and wheels from its logs.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct LearnArgs {
    #[command(subcommand)]
    what: LearnCommand,
}

#[derive(Debug, Subcommand)]
enum LearnCommand {
    /// Learn the errors of a sensor: its readings against the truth
    Sensor(SensorArgs),
    /// Learn the errors of an effector: the real motion against the command
    Effector(EffectorArgs),
}

/// The log to learn a sensor from, and how.
#[derive(Debug, Args)]
#[command(after_help = SENSOR_EXAMPLES, override_usage = SENSOR_USAGE)]
struct SensorArgs {
    #[command(flatten)]
    log: SensorLog,

    /// Edges between the distance classes in meters, e.g. 2,4
    #[arg(long, value_name = "M,M,...", value_delimiter = ',')]
    edges: Option<Vec<f64>>,

    /// Names of the distance classes, near to far; one more than edges
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    classes: Vec<String>,

    /// Bearings of the beams in the profile, in degrees, positive to the left
    #[arg(long, value_name = "DEG,...", value_delimiter = ',', allow_negative_numbers = true)]
    bearings: Option<Vec<f64>>,

    /// Range of the sensor in the profile, in meters
    #[arg(long, value_name = "M")]
    range: Option<f64>,

    /// Name of the sensor, if the log has several
    #[arg(long, value_name = "SENSOR", conflicts_with_all = ["mrclam", "bag"])]
    sensor: Option<String>,

    /// Also fit the four-part beam model to ranges in meters (with --csv; scans, and runs with ranges, always are)
    #[arg(long, requires = "csv")]
    beam: bool,

    #[command(flatten)]
    topics: TopicArgs,

    /// Topic of the scans (with --bag)
    #[arg(long, value_name = "TOPIC", requires = "bag")]
    scan: Option<String>,

    /// What the scanner writes where nothing answers [default: recognized by counts]
    #[arg(long, value_name = "VALUE", requires = "bag")]
    #[arg(value_parser = ["inf", "nan", "zero", "max", "near"])]
    no_echo: Option<String>,

    /// Map that the scans are compared with (with --bag)
    #[arg(long, value_name = "MAP.yaml", requires = "bag")]
    map: Option<PathBuf>,

    #[command(flatten)]
    estimate: EstimateArgs,

    #[command(flatten)]
    target: TargetArgs,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct SensorLog {
    /// A UTIAS MRCLAM folder
    #[arg(long, value_name = "DIR")]
    mrclam: Option<PathBuf>,

    /// Bag of ROS 2 or ROS 1: a file, or a folder
    #[arg(long, value_name = "PATH", requires_all = ["truth", "scan", "map"])]
    bag: Option<PathBuf>,

    /// CSV file of readings with their true values
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// A run recorded with record.calibration = true
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
}

/// The log to learn an effector from, and how.
#[derive(Debug, Args)]
#[command(after_help = EFFECTOR_EXAMPLES, override_usage = EFFECTOR_USAGE)]
struct EffectorArgs {
    #[command(flatten)]
    log: EffectorLog,

    #[command(flatten)]
    topics: TopicArgs,

    /// Side of a box in meters [default: 0.25 for --mrclam, 1 for --bag; a run knows its own; unknown for --csv and
    /// --carmen, which give moves in boxes]
    #[arg(long = "box", value_name = "B")]
    box_size_m: Option<f64>,

    /// Name of the effector, if the table has several (with --csv, --run)
    #[arg(long, value_name = "EFFECTOR", conflicts_with_all = ["mrclam", "carmen", "bag"])]
    effector: Option<String>,

    /// Learn from these robots only (with --csv, --run)
    #[arg(long, value_name = "ID,...", value_delimiter = ',')]
    #[arg(conflicts_with_all = ["mrclam", "carmen", "bag"])]
    robots: Vec<u32>,

    #[command(flatten)]
    estimate: EstimateArgs,

    #[command(flatten)]
    target: TargetArgs,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct EffectorLog {
    /// A UTIAS MRCLAM folder
    #[arg(long, value_name = "DIR")]
    mrclam: Option<PathBuf>,

    /// A CARMEN log with corrected poses
    #[arg(long, value_name = "FILE")]
    carmen: Option<PathBuf>,

    /// Bag of ROS 2 or ROS 1: a file, or a folder
    #[arg(long, value_name = "PATH", requires_all = ["odom", "truth"])]
    bag: Option<PathBuf>,

    /// CSV file of measured displacements
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// A run recorded with record.calibration = true
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
}

/// The topics of a bag with the robot's poses.
#[derive(Debug, Args)]
struct TopicArgs {
    /// Topic of odometry (with --bag), e.g. /odom; of transforms with frames: /tf:odom:base_link
    #[arg(long, value_name = "TOPIC", requires = "bag")]
    odom: Option<String>,

    /// Topic of true poses (with --bag), e.g. /amcl_pose; of transforms: /tf:map:base_link
    #[arg(long, value_name = "TOPIC", requires = "bag")]
    truth: Option<String>,

    /// Greatest speed of the robot in m/s: what is faster is no motion of it [default: three times its usual speed, at
    /// least 1]
    #[arg(long, value_name = "M/S", conflicts_with_all = ["csv", "run"])]
    max_speed: Option<f64>,
}

impl TopicArgs {
    fn topic_selection(&self, scans: Option<&String>) -> Result<TopicSelection, InputError> {
        let odometry = self.odom.as_deref().map(PoseTopic::parse).transpose()?;
        let truth = self.truth.as_deref().map(PoseTopic::parse).transpose()?;
        Ok(TopicSelection {
            odometry,
            truth: truth.ok_or_else(no_log)?,
            scans: scans.cloned(),
            max_speed_mps: self.max_speed_mps()?,
            no_echo: None,
        })
    }

    /// Returns the greatest speed that was given.
    fn max_speed_mps(&self) -> Result<Option<f64>, InputError> {
        match self.max_speed {
            Some(speed) if !(speed.is_finite() && speed > 0.0) => {
                let cause = format!("no robot moves at {speed} m/s at most");
                Err(InputError::new("--max-speed", cause, "give a positive speed, such as 1.5"))
            }
            speed => Ok(speed),
        }
    }
}

/// The rule by which counts become probabilities.
#[derive(Debug, Args)]
struct EstimateArgs {
    /// Smoothing: added to every count before rows are normalized
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    #[arg(default_value_t = EstimateOptions::default().alpha)]
    alpha: f64,

    /// Hold out every N-th event to test the fit
    #[arg(long, value_name = "N", default_value_t = EstimateOptions::default().hold_out_every)]
    hold_out: usize,

    /// Give no intervals if a greater share of samples is left out for a reason that nothing explains
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    #[arg(default_value_t = EstimateOptions::default().max_unexplained)]
    max_unexplained: f64,
}

impl EstimateArgs {
    fn options(&self) -> EstimateOptions {
        EstimateOptions {
            alpha: self.alpha,
            hold_out_every: self.hold_out,
            max_unexplained: self.max_unexplained,
            ..EstimateOptions::default()
        }
    }
}

/// The profile that the result is added to.
#[derive(Debug, Args)]
struct TargetArgs {
    /// Profile to add the result to; created if missing
    #[arg(long, value_name = "OUT.toml")]
    profile: Option<PathBuf>,

    /// Name of the result in the profile
    #[arg(long, value_name = "NAME", default_value = "learned", requires = "profile")]
    name: String,
}

/// # Errors
/// When a log, an option or the profile is wrong, or the profile cannot be written.
pub(crate) fn learn(args: &LearnArgs, console: Console) -> Result<ExitCode, Failure> {
    match &args.what {
        LearnCommand::Sensor(args) => {
            let model = learn_sensor(args)?;
            let written = args.target.add("sensors", |place, text, name| {
                profile::with_sensor(place, text, name, &model)
            })?;
            let beam = beam_note(&model, &args.target.name);
            let assumptions =
                [assumptions(&model.profile), smoothing(&args.estimate), beam].concat();
            print_report(&model.report, &written, &assumptions, console)?;
        }
        LearnCommand::Effector(args) => {
            let model = learn_effector(args)?;
            let written = args.target.add("effectors", |place, text, name| {
                profile::with_effector(place, text, name, &model)
            })?;
            let assumptions = [box_note(&model.profile), smoothing(&args.estimate)].concat();
            print_report(&model.report, &written, &assumptions, console)?;
        }
    }
    Ok(ExitCode::Done)
}

/// Prints the result and `written`, the line about the profile, with the assumptions of the profile; if quiet, that line
/// alone.
fn print_report(
    report: &(impl Serialize + Display),
    written: &str,
    assumptions: &str,
    console: Console,
) -> Result<(), Failure> {
    console.print_result_or_short(report, written, || {
        if written.is_empty() {
            return report.to_string();
        }
        format!("{report}\n{written}{assumptions}")
    })
}

/// Returns the facts about a sensor that a profile must state although the log does not contain them.
fn assumptions(profile: &SensorProfile) -> String {
    let bearings: Vec<String> = profile.bearings_deg.iter().map(f64::to_string).collect();
    let bearings = bearings.join(", ");
    let range_m = profile.range_m;
    let beams =
        format!("Its beams look at {bearings} degrees, {range_m} m far (--bearings, --range).");
    let mut text = indented(&beams);
    for (kind, class) in &profile.designates {
        text.push_str(&indented(&format!("It sees a {kind} as `{class}` (designates).")));
    }
    text
}

/// Returns the line on the sensor that has the beam model.
fn beam_note(model: &LearnedSensor, name: &str) -> String {
    if model.report.beam.is_none() {
        return String::new();
    }
    let beam = profile::beam_name(name);
    indented(&format!(
        "Its beam model is the sensor `{beam}`, which draws ranges in place of classes."
    ))
}

/// Returns the line on a profile that does not say for which boxes it is.
fn box_note(profile: &EffectorProfile) -> String {
    if profile.box_m.is_some() {
        return String::new();
    }
    indented(
        "It does not say for which boxes it is, so every scenario that uses it warns: give --box.",
    )
}

/// Returns the line on how probabilities of the profile differ from shares of counts.
fn smoothing(estimate: &EstimateArgs) -> String {
    let alpha = estimate.alpha;
    if alpha <= 0.0 {
        return String::new();
    }
    indented(&format!(
        "Its probabilities are of counts with {alpha} added to each (--alpha), so that nothing is impossible."
    ))
}

fn indented(text: &str) -> String {
    format!("  {}\n", wrap_text(text, LINE_COLS - 2).join("\n  "))
}

fn learn_sensor(args: &SensorArgs) -> Result<LearnedSensor, InputError> {
    let default = SensorOptions::default();
    let options = SensorOptions {
        estimate: args.estimate.options(),
        distance_edges_m: args.edges.clone().unwrap_or(default.distance_edges_m),
        distance_classes: args.classes.clone(),
        bearings_deg: args.bearings.clone().unwrap_or(default.bearings_deg),
        range_m: args.range.unwrap_or(default.range_m),
        sensor: args.sensor.clone(),
        beam: args.beam,
    };
    let log = &args.log;
    match (&log.mrclam, &log.bag, &log.csv, &log.run) {
        (Some(folder), ..) => sensor::from_mrclam(folder, args.topics.max_speed_mps()?, &options),
        (_, Some(bag), ..) => learn_scanner(args, bag, &options),
        (_, _, Some(file), _) => sensor::from_csv(file, &options),
        (.., Some(folder)) => learn_recorded_sensor(args, folder),
        (None, None, None, None) => Err(no_log()),
    }
}

fn learn_recorded_sensor(args: &SensorArgs, folder: &Path) -> Result<LearnedSensor, InputError> {
    let mut recorded = csv_table(folder, "readings")?;
    let sensor = args.sensor.as_deref();
    let table = sensor::recorded_table(&recorded.table, &recorded.facts, sensor);
    if table != "readings" {
        recorded = csv_table(folder, table)?;
    }
    let options = RunSensorOptions {
        estimate: args.estimate.options(),
        sensor: args.sensor.clone(),
        distance_edges_m: args.edges.clone(),
        distance_classes: args.classes.clone(),
        bearings_deg: args.bearings.clone(),
        range_m: args.range,
    };
    sensor::learn_run(&recorded.table, &recorded.facts, &options)
}

fn learn_scanner(
    args: &SensorArgs,
    bag: &Path,
    options: &SensorOptions,
) -> Result<LearnedSensor, InputError> {
    let scanner = Scanner {
        map: args.map.as_deref().ok_or_else(no_log)?,
        range_m: args.range,
        bearings_deg: args.bearings.as_deref(),
    };
    let mut selection = args.topics.topic_selection(args.scan.as_ref())?;
    selection.no_echo = args.no_echo.as_deref().and_then(NoEcho::from_name);
    sensor::from_bag(bag, &selection, &scanner, options)
}

/// Default side of a box for MRCLAM logs, in m.
const MRCLAM_BOX_M: f64 = 0.25;

/// Default side of a box for bags: moves are in meters.
const BAG_BOX_M: f64 = 1.0;

fn learn_effector(args: &EffectorArgs) -> Result<LearnedEffector, InputError> {
    let estimate = args.estimate.options();
    let log = &args.log;
    let options = EffectorOptions {
        estimate,
        box_m: args.box_size_m,
        effector: args.effector.clone(),
        robots: args.robots.clone(),
    };
    match (&log.mrclam, &log.carmen, &log.bag, &log.csv, &log.run) {
        (Some(folder), ..) => {
            let box_m = args.box_size_m.unwrap_or(MRCLAM_BOX_M);
            effector::from_mrclam(folder, box_m, args.topics.max_speed_mps()?, &estimate)
        }
        (_, Some(file), ..) => {
            let speed_mps = args.topics.max_speed_mps()?;
            let learned = effector::from_carmen(file, speed_mps, &estimate)?;
            args.box_size_m.map_or(Ok(learned.clone()), |box_m| learned.with_box(box_m))
        }
        (_, _, Some(bag), ..) => {
            let box_m = args.box_size_m.unwrap_or(BAG_BOX_M);
            effector::from_bag(bag, &args.topics.topic_selection(None)?, box_m, &estimate)
        }
        (.., Some(file), _) => effector::from_csv(file, &options),
        (.., Some(folder)) => {
            let recorded = csv_table(folder, "motions")?;
            effector::learn_run(&recorded.table, &recorded.facts, &options)
        }
        (None, None, None, None, None) => Err(no_log()),
    }
}

fn no_log() -> InputError {
    InputError::new("sidestep learn", "no log is given", "see `sidestep learn --help`")
}

/// Largest profile in bytes that can be added to. A profile has kilobytes; a wrong path may lead to a log of gigabytes.
const MAX_PROFILE_BYTES: u64 = 64 << 20;

impl TargetArgs {
    /// Adds a section to the profile, if one is named, in one step. Returns a line that says so.
    fn add(
        &self,
        group: &str,
        section: impl FnOnce(&str, &str, &str) -> Result<String, InputError>,
    ) -> Result<String, Failure> {
        let Some(path) = &self.profile else { return Ok(String::new()) };
        let text = if path.exists() {
            read_text(path, MAX_PROFILE_BYTES)?
        } else {
            profile::empty(&path.file_stem().unwrap_or_default().to_string_lossy())
        };
        let new = section(&path.display().to_string(), &text, &self.name)?;
        write_atomically(path, |file| file.write_all(new.as_bytes()))?;
        let name = &self.name;
        let path = path.display();
        if profile::has_section(&text, group, name) {
            return Ok(format!("Replaced `{name}` in {path}\n"));
        }
        Ok(format!("Added `{name}` to {path}\n"))
    }
}
