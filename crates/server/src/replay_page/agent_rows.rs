//! The metrics of each agent over time, by which the page of a replay colors agents.

use super::parts::Parts;
use super::plane;
use crate::agent_metrics::AgentMetrics;
use crate::metric_history::MetricWords;
use crate::protocol::{MetricName, ReplayAgentMetrics};
use sidestep_kernel::{Cycle, Simulation};
use sidestep_session::Error;

/// Maximum number of rows: a color that is a half percent of the run old differs little from the present one.
const MAX_ROWS: usize = 200;
/// Maximum number of values of all agents, metrics and rows: some megabytes before they are compressed.
const MAX_VALUES: usize = 1 << 20;
/// Exponent of the finest step of values that matters to a color.
const FINEST_STEP_EXPONENT: i8 = -14;

/// Rows of the metrics of each agent, evenly spaced.
pub(super) struct AgentRows {
    words: MetricWords,
    names: Vec<MetricName>,
    agents: usize,
    /// Number of frames from one row to the next: a power of two.
    stride: usize,
    frames: usize,
    cycles: Vec<Cycle>,
    /// For each row, the values of each metric.
    rows: Vec<Vec<Vec<f32>>>,
}

impl AgentRows {
    pub(super) fn new(words: MetricWords) -> Self {
        Self {
            words,
            names: Vec::new(),
            agents: 0,
            stride: 1,
            frames: 0,
            cycles: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Adds the row of the next frame, if it has one.
    pub(super) fn add_frame(&mut self, run: &dyn Simulation) {
        let is_due = self.frames.is_multiple_of(self.stride);
        self.frames += 1;
        if !is_due || (self.frames > 1 && self.names.is_empty()) {
            return;
        }
        self.add_row(run);
        if self.rows.len() > self.max_rows() {
            self.thin();
        }
    }

    fn add_row(&mut self, run: &dyn Simulation) {
        let metrics = AgentMetrics::from_run(run);
        if self.cycles.is_empty() {
            self.names = metrics.names(self.words);
            self.agents = metrics.agent_count();
        }
        let values = |name: &MetricName| {
            let values = metrics.values(&name.key).into_iter();
            let mut values: Vec<f32> = values.map(|v| v.map_or(f32::NAN, |v| v as f32)).collect();
            values.resize(self.agents, f32::NAN);
            values
        };
        let row = self.names.iter().map(values).collect();
        self.rows.push(row);
        self.cycles.push(metrics.cycle());
    }

    fn max_rows(&self) -> usize {
        let values = (self.agents * self.names.len()).max(1);
        (MAX_VALUES / values).clamp(2, MAX_ROWS)
    }

    /// Drops every second row.
    fn thin(&mut self) {
        let mut k = 0;
        self.rows.retain(|_| {
            k += 1;
            k % 2 == 1
        });
        self.cycles = self.cycles.iter().copied().step_by(2).collect();
        self.stride *= 2;
    }

    /// Writes all rows, the one of the last frame among them; none for a world without metrics of agents.
    pub(super) fn finish(
        &mut self,
        run: &dyn Simulation,
        parts: &mut Parts,
    ) -> Result<Option<ReplayAgentMetrics>, Error> {
        if self.names.is_empty() {
            return Ok(None);
        }
        if self.cycles.last().is_some_and(|last| *last != run.cycle()) {
            self.add_row(run);
        }
        let mut numbers = Vec::with_capacity(self.names.len());
        for metric in 0..self.names.len() {
            let column: Vec<&[f32]> = self.rows.iter().map(|row| row[metric].as_slice()).collect();
            numbers.push(parts.push(&plane::encode(&column, FINEST_STEP_EXPONENT))?);
        }
        Ok(Some(ReplayAgentMetrics {
            names: std::mem::take(&mut self.names),
            agents: self.agents as u32,
            cycles: self.cycles.iter().map(|&cycle| cycle as f64).collect(),
            parts: numbers,
        }))
    }
}
