//! A run of any world: advanced by its caller, looked at, and recorded.

use crate::kernel::ports::{ColumnValues, TableSchema};
use crate::kernel::{Cycle, Digest, Simulation};
use crate::session::{Error, ManagedRun, NoWatcher, Summary};
use std::any::Any;

/// A run of a scenario, from [`Scenario::start`](crate::Scenario::start).
pub struct Run {
    inner: ManagedRun,
}

/// The rows of a table, by column.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Its name, its columns, and facts about all rows.
    pub schema: TableSchema,
    /// The values of each column, in the order of the schema; all of one length.
    pub columns: Vec<ColumnValues>,
}

impl Table {
    /// Its name, e.g. `events`.
    pub fn name(&self) -> &str {
        &self.schema.name
    }

    /// Returns the values of the column with this name; `None` if the table has no such column.
    pub fn column(&self, name: &str) -> Option<&ColumnValues> {
        let index = self.schema.columns.iter().position(|column| column.name == name)?;
        self.columns.get(index)
    }
}

impl Run {
    pub(crate) fn new(inner: ManagedRun) -> Self {
        Self { inner }
    }

    /// Advances by up to `cycles` cycles, and returns the number done: fewer only when nothing can happen anymore.
    ///
    /// # Errors
    /// When something cannot be stored; a bug of the simulation.
    pub fn advance(&mut self, cycles: Cycle) -> Result<Cycle, Error> {
        let from = self.inner.cycle();
        self.inner.advance_to(from.saturating_add(cycles), &NoWatcher)?;
        Ok(self.inner.cycle() - from)
    }

    /// Advances to the end that the scenario plans, stores everything, and returns the summary.
    ///
    /// # Errors
    /// The same.
    pub fn finish(self) -> Result<Summary, Error> {
        self.inner.run_to_end(&NoWatcher)
    }

    /// Stores everything, and returns the summary. A recorded run that is not at its end can be continued by
    /// `sidestep resume`.
    ///
    /// # Errors
    /// When something cannot be stored.
    pub fn stop(self) -> Result<Summary, Error> {
        self.inner.finish(&NoWatcher)
    }

    /// Cycles done.
    pub fn cycle(&self) -> Cycle {
        self.inner.cycle()
    }

    /// The digest of the state: equal for equal build, scenario, seed and cycle, on any number of workers.
    pub fn digest(&self) -> Digest {
        self.simulation().digest()
    }

    /// The metrics so far, by name.
    pub fn metrics(&self) -> serde_json::Value {
        self.simulation().metrics()
    }

    /// Takes the rows since the start or the last call, by table: those of all tables in the scenario's section
    /// `record`; none without [`Scenario::keep_tables`](crate::Scenario::keep_tables).
    ///
    /// # Errors
    /// When the last rows cannot be handed over.
    pub fn tables(&mut self) -> Result<Vec<Table>, Error> {
        let rows = self.inner.take_rows()?;
        Ok(rows.into_iter().map(|(schema, columns)| Table { schema, columns }).collect())
    }

    /// The simulation, for all that is the same in every world: frames, teams, checkpoints.
    pub fn simulation(&self) -> &dyn Simulation {
        self.inner.simulation()
    }

    /// The simulation, for callers that give orders or hand controls over.
    pub fn simulation_mut(&mut self) -> &mut dyn Simulation {
        self.inner.simulation_mut()
    }

    /// Returns the run as that of one world, e.g. [`RobotsRun`](crate::worlds::robots::RobotsRun), for all that only
    /// this world has; `None` if it is of another one.
    pub fn downcast<W: Any>(&self) -> Option<&W> {
        (self.simulation() as &dyn Any).downcast_ref()
    }
}
