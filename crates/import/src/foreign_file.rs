//! Files of other programs, told apart by their content and their names, and the report of each.

use std::path::{Path, PathBuf};

use super::extension::extension;
use super::map_file::is_image;
use super::mesh::Mesh;
use super::report::{ImportReport, ItemCount, Treatment};
use super::table::{CsvTable, data_lines};
use super::traffic::begins_as_traffic;
use super::{bag, carmen, lorr, mesh, movingai, mrclam, rosmap, stage};
use crate::urdf::Model;
use crate::urdf::srdf::Semantics;
use crate::{GridOptions, ImportedMap, import_map};
use sidestep_kernel::InputError;
use sidestep_kernel::shell::sidestep_command;
use sidestep_map::UnknownPolicy;
use sidestep_scenario::file::read_start;

/// Number of bytes by which a file is recognized: the names of a table's columns, or the first messages of a log.
const START_BYTES: u64 = 4096;
/// Side of a box in meters for maps in characters, whose report is in boxes.
const CHARACTER_M: f64 = 1.0;

/// A kind of file of another program, apart from traffic, which worlds read; and of tables that people make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForeignFormat {
    /// A map of ROS: the YAML file beside an image.
    RosMap,
    /// An image without the size of its pixels.
    Image,
    /// A map in characters: that of MovingAI, or text.
    CharMap,
    /// Starts and goals of MovingAI.
    Scen,
    /// A problem of the League of Robot Runners.
    RobotRunners,
    /// A robot model.
    Urdf,
    /// Groups and postures of a robot model.
    Srdf,
    /// A world of the Stage simulator.
    Stage,
    /// A mesh.
    Mesh,
    /// A log of CARMEN.
    Carmen,
    /// The folder of a UTIAS MRCLAM data set.
    Mrclam,
    /// A bag of ROS 1 or ROS 2.
    Bag,
    /// A table for this program: readings or motions to learn from, or targets of an arm.
    Table(TableKind),
}

/// What the rows of a table are, by the names of its columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableKind {
    /// What a sensor reported, and what was there.
    Readings,
    /// How a robot moved.
    Motions,
    /// Where the tip of an arm is to go.
    Targets,
}

impl TableKind {
    /// The kinds with the columns that all tables of a kind have, and the format of its report.
    const ALL: [(Self, &[&str], &str); 3] = [
        (
            Self::Readings,
            &["true", "reported"],
            "table of a sensor's readings (learn sensor --csv)",
        ),
        (
            Self::Motions,
            &["action", "ahead_boxes"],
            "table of a robot's motions (learn effector --csv)",
        ),
        (Self::Targets, &["x", "y", "z"], "table of an arm's targets (ik --targets)"),
    ];

    /// Returns the kind of the table that begins with this text.
    fn of_text(text: &str) -> Option<Self> {
        let (_, header) = data_lines(text).next()?;
        let names: Vec<&str> =
            header.split([',', ';', '\t']).map(|name| name.trim().trim_matches('"')).collect();
        let has_all = |columns: &[&str]| columns.iter().all(|column| names.contains(column));
        Self::ALL.iter().find(|(_, columns, _)| has_all(columns)).map(|(kind, ..)| *kind)
    }

    fn format(self) -> &'static str {
        let own = Self::ALL.iter().find(|(kind, ..)| *kind == self);
        own.map_or("table", |(.., format)| format)
    }
}

impl ForeignFormat {
    /// Returns the kind of the file or folder at `path`; `None` where it is of no kind in this list.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn recognize(path: &Path) -> Result<Option<Self>, InputError> {
        if path.is_dir() {
            return Ok(folder_format(path));
        }
        let start = read_start(path, START_BYTES)?;
        if BAG_MAGICS.iter().any(|magic| start.starts_with(magic)) {
            return Ok(Some(Self::Bag));
        }
        let text = String::from_utf8_lossy(&start);
        if text.starts_with(ROBOT_RUNNERS_LIST) {
            let cause =
                "is a list of a problem of the League of Robot Runners, which is read as a whole";
            let remedy = "give the JSON file that names it as its `agentFile` or `taskFile`";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        if lorr::begins_as_problem(&text) {
            return Ok(Some(Self::RobotRunners));
        }
        if is_mrclam_part(path, &text) {
            return Err(mrclam_part_error(path));
        }
        Ok(match extension(path).as_str() {
            "yaml" | "yml" if text.contains(BAG_METADATA_KEY) => Some(Self::Bag),
            "yaml" | "yml" => Some(Self::RosMap),
            kind if is_image(kind) => Some(Self::Image),
            // An image that is not read: its own reader says so.
            _ if is_image_content(&start) => Some(Self::Image),
            "map" => Some(Self::CharMap),
            // Any text may end so; a map in characters has no words.
            "txt" if is_text_of_map(&text) => Some(Self::CharMap),
            "scen" => Some(Self::Scen),
            "csv" | "tsv" => TableKind::of_text(&text).map(Self::Table),
            "urdf" | "xacro" => Some(Self::Urdf),
            "srdf" => Some(Self::Srdf),
            "xml" if text.contains("<robot") => Some(Self::Urdf),
            "world" | "inc" => Some(Self::Stage),
            kind if mesh::EXTENSIONS.contains(&kind) => Some(Self::Mesh),
            _ if has_carmen_message(&text) => Some(Self::Carmen),
            "data" | "dat" if is_table(&text) => {
                let cause = "is a table of another program, whose columns have no known names";
                let remedy = "give the columns the names that `sidestep learn sensor --help` or \
                              `sidestep learn effector --help` lists, and let its name end with .csv";
                return Err(InputError::new(path.display(), cause, remedy));
            }
            _ => None,
        })
    }

    /// Returns the report of the file or folder at `path`, which is of this kind.
    ///
    /// # Errors
    /// When it cannot be read, or nothing in it is of use: those of its reader.
    pub fn inspect(self, path: &Path) -> Result<ImportReport, InputError> {
        match self {
            Self::RosMap => Ok(rosmap::load(path)?.into_report()),
            Self::Image => inspect_image(path),
            Self::CharMap => inspect_char_map(path),
            Self::Scen => movingai::load_scen(path).map(|file| file.report),
            Self::RobotRunners => lorr::load(path).map(|problem| problem.report),
            Self::Urdf => inspect_urdf(path),
            Self::Srdf => inspect_srdf(path),
            Self::Stage => stage::load(path).map(|world| world.report),
            Self::Mesh => inspect_mesh(path),
            Self::Carmen => carmen::read(path, None).map(|log| log.report),
            Self::Mrclam => mrclam::read(path, None).map(|data| data.report),
            Self::Bag => bag::inspect(path),
            Self::Table(kind) => inspect_table(path, kind),
        }
    }
}

/// First bytes of bags that are one file: MCAP, ROS 1, SQLite.
const BAG_MAGICS: [&[u8]; 3] = [b"\x89MCAP", b"#ROSBAG V", b"SQLite format 3\0"];
/// The length in m beyond which a mesh is in millimeters.
const MAX_MESH_M: f64 = 50.0;
/// First bytes of images: PNG, JPEG, GIF, TIFF in both byte orders, WebP and others in RIFF, BMP.
const IMAGE_MAGICS: [&[u8]; 7] =
    [b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*", b"RIFF", b"BM"];
/// The key of `metadata.yaml` by which it differs from the YAML file of a map.
const BAG_METADATA_KEY: &str = "rosbag2_bagfile_information";
/// How the lists of such a problem begin.
const ROBOT_RUNNERS_LIST: &str = "# version for LoRR";
/// Messages with which logs of CARMEN begin, after comments.
const CARMEN_MESSAGES: [&str; 8] =
    ["PARAM", "SYNC", "NEFF", "ODOM", "FLASER", "RLASER", "ROBOTLASER1", "TRUEPOS"];
/// Boxes for the report of a map in characters.
const CHARACTER_BOXES: GridOptions =
    GridOptions { box_size_m: CHARACTER_M, resolution_m: None, unknown: UnknownPolicy::Keep };

fn is_image_content(start: &[u8]) -> bool {
    // Any text may begin with two letters; an image has zeros.
    start.contains(&0) && IMAGE_MAGICS.iter().any(|magic| start.starts_with(magic))
}

/// Returns whether a text has a line that begins as a message of CARMEN.
fn has_carmen_message(text: &str) -> bool {
    let mut firsts = text.lines().filter_map(|line| line.split_ascii_whitespace().next());
    firsts.any(|word| CARMEN_MESSAGES.contains(&word))
}

/// Number of words from which on a text is one for people.
const MIN_WORDS: usize = 3;

/// Returns whether a text may be a map in characters: any text may end as one, and a map has no words.
fn is_text_of_map(text: &str) -> bool {
    let is_word =
        |word: &&str| word.len() >= 3 && word.bytes().all(|byte| byte.is_ascii_lowercase());
    let is_prose = text.split_ascii_whitespace().filter(is_word).count() >= MIN_WORDS;
    !is_prose && !has_carmen_message(text) && !begins_as_traffic(text)
}

/// Returns whether one of the first two rows of a text is that of a table: fields of which most are numbers.
fn is_table(text: &str) -> bool {
    let is_row_of_numbers = |(_, row): (usize, &str)| {
        let fields: Vec<&str> = row.split([',', ';', '\t']).map(str::trim).collect();
        let numbers = fields.iter().filter(|field| field.parse::<f64>().is_ok()).count();
        numbers >= 2 && 2 * numbers > fields.len()
    };
    data_lines(text).take(2).any(is_row_of_numbers)
}

/// Returns whether a file is one of those that make up a data set of MRCLAM, beside the others or alone.
fn is_mrclam_part(path: &Path, text: &str) -> bool {
    let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let Some(stem) = name.strip_suffix(".dat") else { return false };
    let is_of_robot = stem.strip_prefix("Robot").is_some_and(|rest| {
        ["_Groundtruth", "_Odometry", "_Measurement"].iter().any(|end| rest.ends_with(end))
    });
    let is_known = is_of_robot || ["Barcodes", "Landmark_Groundtruth"].contains(&stem);
    is_known || text.contains("# UTIAS") || path.parent().is_some_and(is_mrclam_folder)
}

fn mrclam_part_error(path: &Path) -> InputError {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let cause = "is a part of an MRCLAM data set, which is read as a whole";
    let remedy = if is_mrclam_folder(folder) {
        let inspect = sidestep_command("inspect", folder);
        let learn = sidestep_command("learn effector --mrclam", folder);
        format!("give the folder of the data set: `{inspect}`, `{learn}`")
    } else {
        "put all files of the data set into one folder, Barcodes.dat among them, and give that"
            .into()
    };
    InputError::new(path.display(), cause, remedy)
}

fn is_mrclam_folder(folder: &Path) -> bool {
    ["Barcodes.dat", "Barcodes.dat.gz"].iter().any(|name| folder.join(name).is_file())
}

/// Returns the kind of a folder by the names in it.
fn folder_format(folder: &Path) -> Option<ForeignFormat> {
    let has = |name: &str| folder.join(name).is_file();
    if is_mrclam_folder(folder) {
        return Some(ForeignFormat::Mrclam);
    }
    if has("metadata.yaml") {
        return Some(ForeignFormat::Bag);
    }
    let names = folder.read_dir().ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    let mut extensions = names.map(|path| extension(&path));
    extensions
        .any(|extension| ["mcap", "db3", "bag"].contains(&extension.as_str()))
        .then_some(ForeignFormat::Bag)
}

/// Returns the report of an image, in pixels: their size is not in the file.
fn inspect_image(path: &Path) -> Result<ImportReport, InputError> {
    let map = rosmap::load_image(path, 1.0)?;
    let [width, height] = [map.width(), map.height()];
    let mut report = map.into_report();
    report.facts.retain(|fact| !METRIC_FACTS.contains(&fact.name));
    report.add_fact("pixels", format!("{width} x {height}"));
    let needs = "the side of a pixel: `--resolution 0.05`, in a scenario `map.resolution_m = 0.05`";
    report.add_fact("not in the file", needs);
    Ok(report)
}

/// Returns the report of a map in characters, in boxes: their size is not in the file.
fn inspect_char_map(path: &Path) -> Result<ImportReport, InputError> {
    let ImportedMap { map, mut report } = import_map(path, CHARACTER_BOXES)?;
    report.facts.retain(|fact| fact.name != "boxes");
    report.add_fact("boxes", format!("{} x {}", map.width(), map.height()));
    let needs = "the side of a box: `--box 0.5`, in a scenario `map.box_size_m = 0.5`";
    report.add_fact("not in the file", needs);
    Ok(report)
}

/// Properties of a map that follow from the side of a pixel.
const METRIC_FACTS: [&str; 3] = ["pixels", "extent", "origin"];

/// Returns the report of a robot model, and of the meshes that it names.
fn inspect_urdf(path: &Path) -> Result<ImportReport, InputError> {
    let model = Model::load(path)?;
    let solids = model.solids(path).report;
    let mut report = model.report;
    for item in solids.kept.into_iter().filter(|item| item.count > 0) {
        report.kept.push(ItemCount { noun: format!("collision {}", item.noun), ..item });
    }
    report.findings.extend(solids.findings);
    Ok(report)
}

/// Returns the report of an SRDF file, read for the model beside it: `panda.urdf` for `panda.srdf`.
fn inspect_srdf(path: &Path) -> Result<ImportReport, InputError> {
    let candidates = ["urdf", "urdf.gz"].map(|extension| path.with_extension(extension));
    let model: Option<&PathBuf> = candidates.iter().find(|model| model.is_file());
    let model = model.ok_or_else(|| {
        let cause = "it is about a robot model, which is not beside it";
        let remedy = format!("put the model there as {}", candidates[0].display());
        InputError::new(path.display(), cause, remedy)
    })?;
    let semantics = Semantics::load(path, &Model::load(model)?)?;
    let mut report = semantics.report;
    report.add_fact("model", model.display().to_string());
    Ok(report)
}

fn inspect_table(path: &Path, kind: TableKind) -> Result<ImportReport, InputError> {
    let table = match kind {
        TableKind::Targets => CsvTable::read(path)?,
        TableKind::Readings | TableKind::Motions => CsvTable::read_recording(path)?,
    };
    let mut report = ImportReport::new(kind.format());
    report.add_fact("columns", table.header().join(", "));
    table.record_separators(&mut report);
    let rows = table.rows().count();
    report.add_kept("rows", rows);
    let misfits = table.misfits();
    if misfits.len() > rows {
        return Err(table.misfit_error(misfits[0]));
    }
    for misfit in misfits {
        let rule = "rows with another number of fields than the header";
        report.record(Treatment::Dropped, rule, format!("line {}", misfit.line), "");
    }
    Ok(report)
}

fn inspect_mesh(path: &Path) -> Result<ImportReport, InputError> {
    let mesh = Mesh::load(path)?;
    let mut report = ImportReport::new(format!("mesh ({})", extension(path).to_uppercase()));
    let [lo_m, hi_m] = mesh.bounds_m();
    let size_m = [0, 1, 2].map(|axis| format!("{:.4}", hi_m[axis] - lo_m[axis]));
    report.add_fact("extent", format!("{} m", size_m.join(" x ")));
    match mesh.unit_m {
        Some(unit_m) => report.add_fact("unit of the file", format!("{unit_m} m")),
        None => {
            let rule = "the unit is the meter: the file says none";
            report.record(Treatment::Guessed, rule, "", "give `scale` where a URDF names it");
        }
    }
    if (0..3).any(|axis| hi_m[axis] - lo_m[axis] > MAX_MESH_M) {
        let rule = format!("it is larger than {MAX_MESH_M} m, which looks like millimeters");
        report.record(
            Treatment::Suspicious,
            rule,
            "",
            "write scale=\"0.001 0.001 0.001\" where a URDF names it",
        );
    }
    for what in &mesh.not_used {
        report.record(Treatment::NotUsed, what.clone(), "", "");
    }
    report.add_kept("vertices", mesh.points_m.len());
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The report of a file among others in a folder, by its own name.
    fn inspected(name: &str, files: &[(&str, &[u8])]) -> Result<ImportReport, InputError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, bytes) in files {
            std::fs::write(folder.path().join(name), bytes).expect("written");
        }
        let path = folder.path().join(name);
        let format = ForeignFormat::recognize(&path)?.expect("a known kind");
        format.inspect(&path)
    }

    #[test]
    fn every_image_of_a_map_is_inspected_and_others_say_what_to_do() {
        for name in ["a.pgm", "A.PNM", "a.pbm"] {
            let report = inspected(name, &[(name, b"P5 1 2 255\n\xff\x00")]).expect(name);
            assert_eq!(report.kept[0].count, 1, "{name}");
        }
        for (name, bytes) in
            [("a.gif", &b"GIF89a\x01\0\x01\0"[..]), ("a.webp", b"RIFF\x1a\0\0\0WEBPVP8 ")]
        {
            let error = inspected(name, &[(name, bytes)]).expect_err(name);
            assert_eq!(error.remedy(), "save it as PNG, PGM (P2 or P5), JPEG or BMP", "{name}");
        }
    }

    #[test]
    fn the_report_of_a_model_has_its_meshes() {
        let mesh = |file: &str| {
            format!("<collision><geometry><mesh filename='{file}'/></geometry></collision>")
        };
        let model = format!(
            "<robot name='r'><link name='l'>{}{}</link></robot>",
            mesh("a.obj"),
            mesh("b.stl")
        );
        let obj = b"v 0 0 0\nv 90 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n";
        let report =
            inspected("r.urdf", &[("r.urdf", model.as_bytes()), ("a.obj", obj)]).expect("a model");
        let kept = report.kept.iter().find(|item| item.noun == "collision meshes").expect("meshes");
        assert_eq!(kept.count, 1);
        let said: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
        let has = |words: &str| said.iter().any(|line| line.contains(words));
        assert!(has("b.stl: the file is absent") && has("look like millimeters"), "{said:?}");
    }

    #[test]
    fn a_problem_of_the_robot_runners_is_read_and_its_lists_name_it() {
        let problem = b"{ \"mapFile\": \"m.map\", \"agentFile\": \"a.agents\" }";
        let error = inspected("a.json", &[("a.json", problem)]).expect_err("no tasks");
        assert!(error.cause().contains("lacks the key taskFile"), "{error}");
        let list = b"# version for LoRR 2026\n3\n";
        let error = inspected("a.tasks", &[("a.tasks", list)]).expect_err("a part");
        assert!(error.remedy().contains("the JSON file that names it"), "{error}");
    }

    #[test]
    fn what_is_not_in_a_file_is_said_and_not_invented() {
        let map = b"type octile\nheight 1\nwidth 2\nmap\n.@\n";
        let report = inspected("a.map", &[("a.map", map)]).expect("a map");
        let facts: Vec<&str> = report.facts.iter().map(|fact| &*fact.value).collect();
        assert_eq!(facts[0], "2 x 1");
        assert!(facts[1].starts_with("the side of a box"), "{facts:?}");
        let part = inspected(
            "Robot1_Odometry.dat",
            &[("Barcodes.dat", b""), ("Robot1_Odometry.dat", b"1 2 3")],
        );
        let part = part.expect_err("a part");
        assert!(part.remedy().contains("`sidestep learn effector --mrclam "), "{part}");
        let alone = inspected("Robot1_Odometry.dat", &[("Robot1_Odometry.dat", b"1 2 3")]);
        let alone = alone.expect_err("a part");
        assert!(alone.remedy().contains("Barcodes.dat among them"), "{alone}");
    }

    #[test]
    fn a_table_of_another_program_and_a_text_for_people_are_told_from_maps() {
        let rows = b"0.438,0.498,3.625,Slight-Right-Turn\n0.438,0.498,3.625,Move-Forward\n";
        let named = [b"S1,S2,S3,OUTPUT\n".as_slice(), rows].concat();
        for rows in [&rows[..], &named] {
            let error = inspected("a.data", &[("a.data", rows)]).expect_err("no known names");
            assert!(error.cause().starts_with("is a table of another program"), "{error}");
        }
        let known = |text: &[u8]| {
            let folder = tempfile::tempdir().expect("a temporary folder");
            let path = folder.path().join("a.txt");
            std::fs::write(&path, text).expect("written");
            ForeignFormat::recognize(&path).expect("a text")
        };
        assert_eq!(known(b"Read this first, then the other file.\n"), None);
        for map in [&b"#####\n#..x#\n#####\n"[..], b"..", b" ## \n"] {
            assert_eq!(known(map), Some(ForeignFormat::CharMap));
        }
    }

    #[test]
    fn rows_of_a_table_to_learn_from_that_do_not_fit_are_counted() {
        let text =
            b"action,ahead_boxes,left_boxes,turn_deg\nforward,1,0,0\nforward,1\nforward,1,0,0\n";
        let report = inspected("m.csv", &[("m.csv", text)]).expect("a table");
        assert_eq!((report.dropped(), report.kept[0].count), (1, 2));
        let targets = b"x,y,z\n1,2,3\n1,2\n";
        assert!(inspected("t.csv", &[("t.csv", targets)]).is_err(), "targets are a model");
    }
}
