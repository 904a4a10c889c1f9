//! Displacements of a table, which stay in its columns as far as these have numbers.

use crate::columns::{BLOCK_ROWS, NumberColumn, RobotColumn};
use crate::log_table::LogTable;
use sidestep_error_models::effector::STANDARD_ACTIONS;

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

/// Number of the standard actions.
pub(super) const ACTIONS: usize = STANDARD_ACTIONS.len();
/// In place of an action: the row is left out.
const LEFT_OUT: u8 = u8::MAX;

/// The displacements of a table, in the order of its rows.
pub(super) struct Displacements<'t> {
    /// The action of each row; [`LEFT_OUT`] where the row is.
    actions: Vec<u8>,
    robots: RobotColumn,
    /// Boxes ahead and to the left, and degrees of the turn.
    columns: [NumberColumn<'t>; 3],
    /// Number of displacements by action.
    counts: [usize; ACTIONS],
}

impl Displacements<'_> {
    /// Returns the number of all displacements.
    pub(super) fn count(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Returns the number of displacements of an action.
    pub(super) fn count_of(&self, action: usize) -> usize {
        self.counts[action]
    }

    /// Visits all displacements of some actions in order.
    pub(super) fn visit(
        &self,
        wanted: [bool; ACTIONS],
        visit: &mut dyn FnMut(&MeasuredDisplacement),
    ) {
        let mut block = [(); 3].map(|()| vec![0.0; BLOCK_ROWS]);
        for (index, actions) in self.actions.chunks(BLOCK_ROWS).enumerate() {
            let first_row = index * BLOCK_ROWS;
            for (column, numbers) in self.columns.iter().zip(&mut block) {
                column.read(first_row, &mut numbers[..actions.len()]);
            }
            for (offset, &action) in actions.iter().enumerate() {
                let action = usize::from(action);
                if !wanted.get(action).is_some_and(|is_wanted| *is_wanted) {
                    continue;
                }
                visit(&MeasuredDisplacement {
                    robot: self.robots.get(first_row + offset),
                    action,
                    ahead_boxes: block[0][offset],
                    left_boxes: block[1][offset],
                    turn_deg: block[2][offset],
                });
            }
        }
    }
}

/// Displacements that are told row by row.
pub(super) struct DisplacementsBuilder<'t> {
    displacements: Displacements<'t>,
}

impl<'t> DisplacementsBuilder<'t> {
    /// `columns` are those of boxes ahead and to the left and of the turn.
    pub(super) fn new(table: &'t dyn LogTable, columns: [usize; 3]) -> Self {
        let row_count = table.row_count();
        let displacements = Displacements {
            actions: Vec::with_capacity(row_count),
            robots: RobotColumn::new(row_count),
            columns: columns.map(|column| NumberColumn::new(table, column)),
            counts: [0; ACTIONS],
        };
        Self { displacements }
    }

    /// Adds the displacement of the next row; `None` where the row is left out.
    pub(super) fn push(&mut self, displacement: Option<MeasuredDisplacement>) {
        let all = &mut self.displacements;
        all.actions.push(displacement.map_or(LEFT_OUT, |one| one.action as u8));
        all.robots.push(displacement.map_or(0, |one| one.robot));
        let numbers = displacement
            .map_or([f64::NAN; 3], |one| [one.ahead_boxes, one.left_boxes, one.turn_deg]);
        for (column, number) in all.columns.iter_mut().zip(numbers) {
            column.push(number);
        }
        if let Some(one) = displacement {
            all.counts[one.action] += 1;
        }
    }

    pub(super) fn finish(self) -> Displacements<'t> {
        self.displacements
    }
}
