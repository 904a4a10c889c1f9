//! The rows of a table of displacements: those to learn from, and those that are left out.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::EffectorOptions;
use super::delays::Pause;
use super::displacements::{Displacements, DisplacementsBuilder, MeasuredDisplacement};
use crate::left_out;
use crate::log_table::{Cell, CellValue, LogRow, LogTable};
use sidestep_error_models::delay::MAX_DELAY_CYCLES;
use sidestep_error_models::effector::STANDARD_ACTIONS;
use sidestep_kernel::InputError;

/// A longer displacement is not a single action; two such make the longest path of a profile.
const MAX_BOXES: f64 = 8.0;
/// A wider turn is not a single action either.
const MAX_TURN_DEG: f64 = 360.0;
/// Largest number of actions of an effector; those beyond the standard ones are its own.
const MAX_ACTIONS: usize = 120;

/// A table of displacements as far as it can be read.
pub(super) struct ParsedRows<'t> {
    /// Displacements that nothing stopped, in the order of time.
    pub(super) free: Displacements<'t>,
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
pub(super) fn parse<'t>(
    table: &'t dyn LogTable,
    options: &EffectorOptions,
) -> Result<ParsedRows<'t>, InputError> {
    let columns = DisplacementColumns::find(table)?;
    let chosen = columns.choose(table, options)?;
    let box_m = columns.box_m(table, &chosen, options)?;
    let (misfit_count, misfit_error) = table.misfits();
    let misfits = left_out::misfits_among(table.row_count(), misfit_count, chosen.count);
    let mut rejected = Rejected { counts: [0; 3], first_error: misfit_error };
    rejected.counts[DAMAGED] = misfits;
    let mut free = DisplacementsBuilder::new(table, [columns.ahead, columns.left, columns.turn]);
    let mut pauses = columns.delay.map(|_| Vec::new());
    table.visit_rows(&columns.all(), &mut |_, row| {
        if !columns.is_chosen(row, &chosen) {
            free.push(None);
            return Ok(());
        }
        let read = columns.read_with_pause(row).map(|(read, pause)| {
            pauses.iter_mut().for_each(|pauses| pauses.extend(pause));
            read
        });
        free.push(rejected.judge(read));
        Ok(())
    })?;
    let damaged = rejected.counts[DAMAGED];
    let by_cause = rejected.by_cause();
    let mut damage = None;
    if let Some(error) = rejected.first_error {
        if 2 * damaged > chosen.count as u64 + misfits {
            return Err(error);
        }
        damage = Some(left_out::damage_warning(damaged, &error));
    }
    let free = free.finish();
    if free.count() == 0 {
        let cause = "the table has no displacements without contact";
        return Err(InputError::new(table.place(), cause, "write one a row"));
    }
    Ok(ParsedRows { free, pauses, rejected: by_cause, damage, effector: chosen.effector, box_m })
}

/// The rows that were left out.
struct Rejected {
    /// Number of rows by cause, in the order of [`CAUSES`].
    counts: [u64; 3],
    first_error: Option<InputError>,
}

const CAUSES: [&str; 3] = ["contact", "own_action", "damaged_row"];
const CONTACT: usize = 0;
const OWN_ACTION: usize = 1;
const DAMAGED: usize = 2;

impl Rejected {
    /// Returns the displacement of a row that is learned from, and counts any other row.
    fn judge(&mut self, read: Result<Row, InputError>) -> Option<MeasuredDisplacement> {
        let cause = match read {
            Ok(Row::Free(displacement)) => return Some(displacement),
            Ok(Row::Contact) => CONTACT,
            Ok(Row::OwnAction) => OWN_ACTION,
            Err(error) => {
                self.first_error.get_or_insert(error);
                DAMAGED
            }
        };
        self.counts[cause] += 1;
        None
    }

    fn by_cause(&self) -> BTreeMap<String, u64> {
        let counts = CAUSES.into_iter().zip(self.counts).filter(|(_, count)| *count > 0);
        counts.map(|(cause, count)| (cause.to_string(), count)).collect()
    }
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

/// The rows that are learned from: those of one effector, of some robots.
struct ChosenRows<'o> {
    /// Numbers of the robots; all where empty.
    robots: &'o [u32],
    /// The effector that was asked for: where none was, all rows are of one.
    wanted: Option<&'o str>,
    /// Name of the effector, where the table names it.
    effector: Option<String>,
    /// Number of rows.
    count: usize,
}

impl DisplacementColumns {
    fn find(table: &dyn LogTable) -> Result<Self, InputError> {
        let [action, ahead, left, turn] =
            table.require(["action", "ahead_boxes", "left_boxes", "turn_deg"])?;
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

    /// Returns all columns that a row is read by.
    fn all(&self) -> Vec<usize> {
        let optional = [self.contact, self.delay, self.robot, self.effector, self.box_m];
        let needed = [self.action, self.ahead, self.left, self.turn];
        needed.into_iter().chain(optional.into_iter().flatten()).collect()
    }

    /// Returns which rows are of the wanted robots and effector; where none is wanted, they must be of a single one.
    fn choose<'o>(
        &self,
        table: &dyn LogTable,
        options: &'o EffectorOptions,
    ) -> Result<ChosenRows<'o>, InputError> {
        let wanted = options.effector.as_deref();
        let robots = &options.robots[..];
        if self.robot.is_none() && !robots.is_empty() {
            let cause = "the table has no column `robot`, by which robots are chosen";
            let remedy = format!("leave out {}", table.option_name("--robots", "robots"));
            return Err(InputError::new(table.place(), cause, remedy));
        }
        let counts = self.effector_counts(table, robots)?;
        if let Some(wanted) = wanted
            && !counts.contains_key(wanted)
        {
            let cause = format!("no motions of the effector `{wanted}`");
            let remedy = match self.effector {
                Some(_) => format!("effectors in the table: {}", listed(counts.keys())),
                None => {
                    let option = table.option_name("--effector", "name");
                    format!("leave out {option}: the table has no column `effector`")
                }
            };
            return Err(InputError::new(table.place(), cause, remedy));
        }
        if wanted.is_none() && counts.len() > 1 {
            let names = listed(counts.keys());
            let cause = format!("the table has robots with different effectors: {names}");
            let first = counts.keys().find(|name| !name.is_empty()).cloned().unwrap_or_default();
            let option = table.option("--effector", "name", &first);
            let remedy = format!("choose one of them, e.g. {option}");
            return Err(InputError::new(table.place(), cause, remedy));
        }
        let count = match wanted {
            Some(wanted) => counts[wanted],
            None => counts.values().sum(),
        };
        // A table without the column has one effector without a name.
        let named = self.effector.and_then(|_| counts.keys().next().cloned());
        let effector = wanted.map(String::from).or(named);
        Ok(ChosenRows { robots, wanted, effector, count })
    }

    /// Returns the number of rows of some robots by the effector; all are of one without a name where the table has
    /// no such column.
    fn effector_counts(
        &self,
        table: &dyn LogTable,
        robots: &[u32],
    ) -> Result<BTreeMap<String, usize>, InputError> {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        if robots.is_empty() && self.effector.is_none() {
            return Ok(counts_of_all(table.row_count()));
        }
        let columns: Vec<usize> = self.robot.into_iter().chain(self.effector).collect();
        table.visit_rows(&columns, &mut |_, row| {
            if self.is_of_robots(row, robots) {
                let name = self.effector_of(row);
                match counts.get_mut(name.as_ref()) {
                    Some(count) => *count += 1,
                    None => drop(counts.insert(name.into_owned(), 1)),
                }
            }
            Ok(())
        })?;
        Ok(counts)
    }

    fn is_chosen(&self, row: &dyn LogRow, chosen: &ChosenRows<'_>) -> bool {
        self.is_of_robots(row, chosen.robots)
            && chosen.wanted.is_none_or(|wanted| self.effector_of(row) == wanted)
    }

    fn is_of_robots(&self, row: &dyn LogRow, robots: &[u32]) -> bool {
        let Some(column) = self.robot.filter(|_| !robots.is_empty()) else { return true };
        Cell::new(row, column).text().parse().is_ok_and(|robot: u32| robots.contains(&robot))
    }

    fn effector_of<'r>(&self, row: &'r dyn LogRow) -> Cow<'r, str> {
        self.effector.map_or(Cow::Borrowed(""), |column| Cell::new(row, column).text())
    }

    /// Returns the side of a box by the table's own column or by the options, which must agree. Cells that are none are
    /// those of damaged rows.
    fn box_m(
        &self,
        table: &dyn LogTable,
        chosen: &ChosenRows<'_>,
        options: &EffectorOptions,
    ) -> Result<Option<f64>, InputError> {
        let mut side_m = options.box_m;
        let Some(column) = self.box_m else { return Ok(side_m) };
        table.visit_rows(&self.all(), &mut |_, row| {
            if !self.is_chosen(row, chosen) {
                return Ok(());
            }
            let Ok(Some(own_m)) = self.own_box_m(row) else { return Ok(()) };
            if let Some(other_m) = side_m
                && (own_m - other_m).abs() > 1e-9 * other_m
            {
                let cause = format!("a box of {own_m} m beside one of {other_m} m");
                let remedy = "learn from one size of boxes at a time";
                return Err(Cell::new(row, column).error(cause, remedy));
            }
            side_m = Some(own_m);
            Ok(())
        })?;
        Ok(side_m)
    }

    /// Returns the side of the box that a row gives, where the table has such a column.
    fn own_box_m(&self, row: &dyn LogRow) -> Result<Option<f64>, InputError> {
        let Some(column) = self.box_m else { return Ok(None) };
        let cell = Cell::new(row, column);
        let side_m = cell.number()?;
        super::check_box(side_m)
            .map_err(|error| cell.error(error.cause().into(), error.remedy()))?;
        Ok(Some(side_m))
    }

    fn read_with_pause(&self, row: &dyn LogRow) -> Result<(Row, Option<Pause>), InputError> {
        Ok((self.read(row)?, self.pause(row)?))
    }

    /// Returns the pause before an action, where the table has them.
    fn pause(&self, row: &dyn LogRow) -> Result<Option<Pause>, InputError> {
        let Some(column) = self.delay else { return Ok(None) };
        let cell = Cell::new(row, column);
        let cycles = cell.integer()?;
        if cycles > MAX_DELAY_CYCLES {
            let cause = format!("a delay of {cycles} cycles is more than a scenario takes");
            let remedy = format!("give at most {MAX_DELAY_CYCLES}, or leave the row out");
            return Err(cell.error(cause, &remedy));
        }
        Ok(Some(Pause { robot: self.robot(row)?, cycles }))
    }

    fn robot(&self, row: &dyn LogRow) -> Result<u32, InputError> {
        self.robot.map_or(Ok(0), |column| Cell::new(row, column).integer())
    }

    fn read(&self, row: &dyn LogRow) -> Result<Row, InputError> {
        let Some(action) = action(Cell::new(row, self.action))? else {
            return Ok(Row::OwnAction);
        };
        self.own_box_m(row)?;
        let displacement = MeasuredDisplacement {
            robot: self.robot(row)?,
            action,
            ahead_boxes: parse_limited(Cell::new(row, self.ahead), MAX_BOXES)?,
            left_boxes: parse_limited(Cell::new(row, self.left), MAX_BOXES)?,
            turn_deg: parse_limited(Cell::new(row, self.turn), MAX_TURN_DEG)?,
        };
        let has_contact = self.has_contact(row)?;
        Ok(if has_contact { Row::Contact } else { Row::Free(displacement) })
    }

    fn has_contact(&self, row: &dyn LogRow) -> Result<bool, InputError> {
        let Some(column) = self.contact else { return Ok(false) };
        let cell = Cell::new(row, column);
        if let CellValue::Whole(number) = cell.value()
            && (number == 0.0 || number == 1.0)
        {
            return Ok(number == 1.0);
        }
        match cell.text().as_ref() {
            "no" | "false" | "0" => Ok(false),
            "yes" | "true" | "1" => Ok(true),
            other => Err(cell.error(format!("contact is `{other}`"), "write yes or no")),
        }
    }
}

/// Returns the count of all rows of a table as those of one effector without a name.
fn counts_of_all(row_count: usize) -> BTreeMap<String, usize> {
    (row_count > 0).then(|| (String::new(), row_count)).into_iter().collect()
}

fn listed<'n>(names: impl Iterator<Item = &'n String>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// Returns an action by its name, or by the number that a recording gives it; `None` for an effector's own.
fn action(cell: Cell<'_>) -> Result<Option<usize>, InputError> {
    let of_number = |id: usize| (id < STANDARD_ACTIONS.len()).then_some(id);
    if let CellValue::Whole(number) = cell.value()
        && (0.0..MAX_ACTIONS as f64).contains(&number)
    {
        return Ok(of_number(number as usize));
    }
    let text = cell.text();
    if let Some(id) = STANDARD_ACTIONS.iter().position(|name| *name == text) {
        return Ok(Some(id));
    }
    if let Ok(id) = text.parse()
        && id < MAX_ACTIONS
    {
        return Ok(of_number(id));
    }
    let cause = format!("`{text}` is not an action");
    Err(cell.error(cause, &format!("use one of {}", STANDARD_ACTIONS.join(", "))))
}

fn parse_limited(cell: Cell<'_>, max: f64) -> Result<f64, InputError> {
    let value = cell.number()?;
    if value.abs() <= max {
        return Ok(value);
    }
    let cause = format!("{value} is more than one action moves");
    Err(cell.error(cause, &format!("give a number from -{max} to {max}")))
}
