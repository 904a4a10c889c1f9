//! The rows of a table of displacements: those to learn from, and those that are left out.

use std::collections::{BTreeMap, BTreeSet};

use super::EffectorOptions;
use super::delays::Pause;
use crate::left_out;
use sidestep_error_models::delay::MAX_DELAY_CYCLES;
use sidestep_error_models::effector::STANDARD_ACTIONS;
use sidestep_import::table::{CsvRow, CsvTable, Token};
use sidestep_kernel::InputError;
use sidestep_kernel::shell::shell_quote;

/// A longer displacement is not a single action; two such make the longest path of a profile.
const MAX_BOXES: f64 = 8.0;
/// A wider turn is not a single action either.
const MAX_TURN_DEG: f64 = 360.0;
/// Largest number of actions of an effector; those beyond the standard ones are its own.
const MAX_ACTIONS: usize = 120;

/// The end of one action, in the frame of its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeasuredDisplacement {
    /// Number of the robot; 0 where the table names none.
    pub(super) robot: u32,
    /// Index in [`STANDARD_ACTIONS`].
    pub(super) action: usize,
    pub(super) ahead_boxes: f64,
    pub(super) left_boxes: f64,
    pub(super) turn_deg: f64,
}

/// A table of displacements as far as it can be read.
pub(super) struct ParsedRows {
    /// Displacements that nothing stopped, in the order of time.
    pub(super) free: Vec<MeasuredDisplacement>,
    /// The pause before each action, of rows with contact and of an effector's own actions too, in the order of time;
    /// `None` where the table has none.
    pub(super) pauses: Option<Vec<Pause>>,
    /// Number of rows that were left out, by cause.
    pub(super) rejected: BTreeMap<String, u64>,
    /// The warning on damaged rows.
    pub(super) damage: Option<String>,
    /// Name of the effector, where the table names it.
    pub(super) effector: Option<String>,
    /// Side of a box in meters, where it is known.
    pub(super) box_m: Option<f64>,
}

/// Reads the rows of the wanted effector and robots.
pub(super) fn parse(table: &CsvTable, options: &EffectorOptions) -> Result<ParsedRows, InputError> {
    let columns = DisplacementColumns::find(table)?;
    let chosen = columns.choose(table, options)?;
    let mut parsed = ParsedRows {
        free: Vec::new(),
        pauses: columns.delay.map(|_| Vec::new()),
        rejected: BTreeMap::new(),
        damage: None,
        effector: chosen.effector,
        box_m: columns.box_m(&chosen.rows, options)?,
    };
    let mut first_error = table.misfits().first().map(|misfit| table.misfit_error(*misfit));
    let misfits = left_out::misfits_among(table, chosen.rows.len());
    if misfits > 0 {
        parsed.rejected.insert("damaged_row".to_string(), misfits);
    }
    for row in &chosen.rows {
        let read = columns.read_with_pause(table.place(), *row);
        let cause = match read.map(|(row, pause)| {
            parsed.pauses.iter_mut().for_each(|pauses| pauses.extend(pause));
            row
        }) {
            Ok(Row::Free(displacement)) => {
                parsed.free.push(displacement);
                continue;
            }
            Ok(Row::Contact) => "contact",
            Ok(Row::OwnAction) => "own_action",
            Err(error) => {
                first_error.get_or_insert(error);
                "damaged_row"
            }
        };
        *parsed.rejected.entry(cause.to_string()).or_insert(0) += 1;
    }
    let damaged = parsed.rejected.get("damaged_row").copied().unwrap_or(0);
    if let Some(error) = first_error {
        if 2 * damaged > chosen.rows.len() as u64 + misfits {
            return Err(error);
        }
        parsed.damage = Some(left_out::damage_warning(damaged, &error));
    }
    if parsed.free.is_empty() {
        let cause = "the file has no displacements without contact";
        return Err(InputError::new(table.place(), cause, "write one a row"));
    }
    Ok(parsed)
}

/// A row that can be read.
enum Row {
    Free(MeasuredDisplacement),
    /// An obstacle stopped it.
    Contact,
    /// The action is not among the standard ones.
    OwnAction,
}

struct DisplacementColumns {
    action: usize,
    ahead: usize,
    left: usize,
    turn: usize,
    contact: Option<usize>,
    delay: Option<usize>,
    robot: Option<usize>,
    effector: Option<usize>,
    box_m: Option<usize>,
}

/// The box of a row.
struct OwnBox<'t> {
    word: Token<'t>,
    side_m: f64,
}

/// The rows of one effector.
struct ChosenRows<'t> {
    rows: Vec<CsvRow<'t>>,
    effector: Option<String>,
}

impl DisplacementColumns {
    fn find(table: &CsvTable) -> Result<Self, InputError> {
        let [action, ahead, left, turn] =
            table.columns(["action", "ahead_boxes", "left_boxes", "turn_deg"])?;
        Ok(Self {
            action,
            ahead,
            left,
            turn,
            contact: table.find("contact"),
            delay: table.find("delay_cycles"),
            robot: table.find("robot"),
            effector: table.find("effector"),
            box_m: table.find("box_m"),
        })
    }

    /// Returns the rows of the wanted robots and effector; where none is wanted, they must be of a single one.
    fn choose<'t>(
        &self,
        table: &'t CsvTable,
        options: &EffectorOptions,
    ) -> Result<ChosenRows<'t>, InputError> {
        let rows = self.rows_of_robots(table, &options.robots)?;
        let names: BTreeSet<&str> = rows.iter().filter_map(|row| self.effector_of(row)).collect();
        let listed = names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let wanted = options.effector.as_deref();
        if let Some(wanted) = wanted
            && !names.contains(wanted)
        {
            let cause = format!("no motions of the effector `{wanted}`");
            let remedy = match self.effector {
                Some(_) => format!("effectors in the table: {listed}"),
                None => "leave out --effector: the table has no column `effector`".to_string(),
            };
            return Err(InputError::new(table.place(), cause, remedy));
        }
        if wanted.is_none() && names.len() > 1 {
            let cause = format!("the table has robots with different effectors: {listed}");
            let first = names.iter().find(|name| !name.is_empty()).copied().unwrap_or_default();
            let remedy = format!("choose one of them, e.g. --effector {}", shell_quote(first));
            return Err(InputError::new(table.place(), cause, remedy));
        }
        let effector = wanted.or(names.first().copied()).map(String::from);
        let of_effector = |row: &CsvRow<'_>| wanted.is_none() || self.effector_of(row) == wanted;
        Ok(ChosenRows { rows: rows.into_iter().filter(of_effector).collect(), effector })
    }

    fn rows_of_robots<'t>(
        &self,
        table: &'t CsvTable,
        robots: &[u32],
    ) -> Result<Vec<CsvRow<'t>>, InputError> {
        if robots.is_empty() {
            return Ok(table.rows().collect());
        }
        let Some(column) = self.robot else {
            let cause = "the table has no column `robot`, by which robots are chosen";
            return Err(InputError::new(table.place(), cause, "leave out --robots"));
        };
        let is_wanted = |row: &CsvRow<'_>| {
            row.field(column).text.parse().is_ok_and(|robot: u32| robots.contains(&robot))
        };
        Ok(table.rows().filter(is_wanted).collect())
    }

    fn effector_of<'t>(&self, row: &CsvRow<'t>) -> Option<&'t str> {
        self.effector.map(|column| row.field(column).text)
    }

    /// Returns the side of a box by the table's own column or by the options, which must agree. Cells that are none are
    /// those of damaged rows.
    fn box_m(
        &self,
        rows: &[CsvRow<'_>],
        options: &EffectorOptions,
    ) -> Result<Option<f64>, InputError> {
        let mut side_m = options.box_m;
        for row in rows {
            let Ok(Some(own)) = self.own_box(row) else { continue };
            if let Some(other_m) = side_m
                && (own.side_m - other_m).abs() > 1e-9 * other_m
            {
                let cause = format!("a box of {} m beside one of {other_m} m", own.side_m);
                let remedy = "learn from one size of boxes at a time";
                return Err(own.word.error(&row.place(), cause, remedy));
            }
            side_m = Some(own.side_m);
        }
        Ok(side_m)
    }

    /// Returns the box that a row gives, where the table has such a column.
    fn own_box<'t>(&self, row: &CsvRow<'t>) -> Result<Option<OwnBox<'t>>, InputError> {
        let Some(column) = self.box_m else { return Ok(None) };
        let word = row.field(column);
        let side_m = word.number(&row.place())?;
        super::check_box(side_m)
            .map_err(|error| word.error(&row.place(), error.cause().into(), error.remedy()))?;
        Ok(Some(OwnBox { word, side_m }))
    }

    fn read_with_pause(
        &self,
        place: &str,
        row: CsvRow<'_>,
    ) -> Result<(Row, Option<Pause>), InputError> {
        Ok((self.read(place, row)?, self.pause(place, row)?))
    }

    /// Returns the pause before an action, where the table has them.
    fn pause(&self, place: &str, row: CsvRow<'_>) -> Result<Option<Pause>, InputError> {
        let Some(word) = self.delay.map(|column| row.field(column)) else { return Ok(None) };
        let cycles: u32 = word.integer(&place)?;
        if cycles > MAX_DELAY_CYCLES {
            let cause = format!("a delay of {cycles} cycles is more than a scenario takes");
            let remedy = format!("give at most {MAX_DELAY_CYCLES}, or leave the row out");
            return Err(word.error(&place, cause, &remedy));
        }
        Ok(Some(Pause { robot: self.robot(place, row)?, cycles }))
    }

    fn robot(&self, place: &str, row: CsvRow<'_>) -> Result<u32, InputError> {
        self.robot.map_or(Ok(0), |column| row.field(column).integer(&place))
    }

    fn read(&self, place: &str, row: CsvRow<'_>) -> Result<Row, InputError> {
        let Some(action) = action(place, row.field(self.action))? else {
            return Ok(Row::OwnAction);
        };
        self.own_box(&row)?;
        let displacement = MeasuredDisplacement {
            robot: self.robot(place, row)?,
            action,
            ahead_boxes: parse_limited(place, row.field(self.ahead), MAX_BOXES)?,
            left_boxes: parse_limited(place, row.field(self.left), MAX_BOXES)?,
            turn_deg: parse_limited(place, row.field(self.turn), MAX_TURN_DEG)?,
        };
        let has_contact = self.has_contact(place, row)?;
        Ok(if has_contact { Row::Contact } else { Row::Free(displacement) })
    }

    fn has_contact(&self, place: &str, row: CsvRow<'_>) -> Result<bool, InputError> {
        let Some(contact) = self.contact.map(|column| row.field(column)) else { return Ok(false) };
        match contact.text {
            "no" | "false" | "0" => Ok(false),
            "yes" | "true" | "1" => Ok(true),
            other => Err(contact.error(&place, format!("contact is `{other}`"), "write yes or no")),
        }
    }
}

/// Returns an action by its name, or by the number that a recording gives it; `None` for an effector's own.
fn action(place: &str, word: Token<'_>) -> Result<Option<usize>, InputError> {
    if let Some(id) = STANDARD_ACTIONS.iter().position(|name| *name == word.text) {
        return Ok(Some(id));
    }
    if let Ok(id) = word.text.parse()
        && id < MAX_ACTIONS
    {
        return Ok((id < STANDARD_ACTIONS.len()).then_some(id));
    }
    let cause = format!("`{}` is not an action", word.text);
    Err(word.error(&place, cause, &format!("use one of {}", STANDARD_ACTIONS.join(", "))))
}

fn parse_limited(place: &str, word: Token<'_>, max: f64) -> Result<f64, InputError> {
    let value = word.number(&place)?;
    if value.abs() <= max {
        return Ok(value);
    }
    let cause = format!("{value} is more than one action moves");
    Err(word.error(&place, cause, &format!("give a number from -{max} to {max}")))
}
