//! Collects all that a replay shows of a run, while the run is computed again.

use super::TrialReplay;
use super::agent_rows::AgentRows;
use super::agents::InspectionRequest;
use super::chunk::ChunkBuilder;
use super::extent::finest_step_exponent;
use super::parts::Parts;
use super::tables::TableParts;
use crate::encode::{FrameColumns, FrameEncoder, scan, scene};
use crate::event_store::EventStore;
use crate::metric_history::MetricHistory;
use crate::protocol::{
    FrameText, ReplayChunk, ReplayEvents, ReplayInspection, ReplayRun, ReplaySpan, ReplyBody,
    RunEvent, SessionState, SessionStatus, Speed,
};
use sidestep_kernel::view::{Body, Frame, FrameOptions, ScanSelection, Scenery};
use sidestep_kernel::{Cycle, InputError, Simulation};
use sidestep_session::{Error, FrameSink, Thumbnail};

/// Maximum number of events in a file, so that it stays one that is sent: further ones are counted.
const MAX_EVENTS: u64 = 100_000;
/// Number of events in a part: a browser reads one within a picture.
const EVENTS_PER_PART: u32 = 5000;
/// Maximum number of inspections: some gigabytes of text before it is compressed.
const MAX_INSPECTIONS: usize = 100_000;
/// Size of the text of inspections from which a part is complete: a browser reads one within a picture.
const INSPECTIONS_PART_BYTES: usize = 1 << 20;

/// The frames, events, metrics and inspections of a run, so far.
pub(super) struct ReplayCollector<'a> {
    parts: &'a mut Parts,
    options: &'a ReplayOptions<'a>,
    scenery: Scenery,
    encoder: FrameEncoder,
    /// Made with the first frame, which tells how large the scene is.
    chunk: Option<ChunkBuilder>,
    chunks: Vec<ReplayChunk>,
    /// Runs of evenly spaced cycles of frames: first cycle, cycles between two frames, number of frames.
    cycles: Vec<[Cycle; 3]>,
    tables: TableParts,
    log: EventStore,
    metrics: MetricHistory,
    agents: AgentRows,
    inspections: InspectionParts,
    /// Digests of the states of all frames, if they are kept.
    digests: Vec<u8>,
    /// The picture of a run of a sweep.
    thumbnail: Option<Thumbnail>,
}

/// What a replay holds of each of its runs.
pub(super) struct ReplayOptions<'a> {
    /// Number of cycles between two frames.
    pub(super) every: Cycle,
    /// Whether it has the digest of each frame, by which two runs are compared.
    pub(super) has_digests: bool,
    pub(super) inspections: &'a InspectionRequest,
    /// What it is of a sweep; none for a run of its own.
    pub(super) trial: Option<TrialReplay<'a>>,
}

/// What a replay says about itself beside the run.
pub(super) struct ReplayOrigin {
    pub(super) name: String,
    pub(super) scenario: String,
    pub(super) banner: String,
    /// Digest of the state at the last frame, if the run ends there.
    pub(super) digest: Option<String>,
}

impl<'a> ReplayCollector<'a> {
    /// Returns a collector for a run at the first of its cycles, with its metrics there.
    pub(super) fn new(
        run: &mut dyn Simulation,
        metrics: MetricHistory,
        agents: AgentRows,
        options: &'a ReplayOptions<'a>,
        parts: &'a mut Parts,
    ) -> Self {
        run.enable_events();
        let scenery = run.scenery();
        Self {
            parts,
            options,
            encoder: FrameEncoder::new(0, &scenery),
            scenery,
            chunk: None,
            chunks: Vec::new(),
            cycles: Vec::new(),
            tables: TableParts::default(),
            log: EventStore::new(MAX_EVENTS),
            metrics,
            agents,
            inspections: InspectionParts::default(),
            digests: Vec::new(),
            thumbnail: options.trial.map(|_| Thumbnail::new(run)),
        }
    }

    /// Returns the picture of a run of a sweep at its end, as PNG.
    pub(super) fn picture(&mut self, run: &mut dyn Simulation) -> Result<Option<Vec<u8>>, Error> {
        let picture = self.thumbnail.take().zip(self.options.trial);
        picture.map(|(thumbnail, trial)| thumbnail.png(run, trial.picture_px)).transpose()
    }

    /// Returns the number of inspections.
    pub(super) fn inspection_count(&self) -> usize {
        self.inspections.count
    }

    /// Returns the directory of the run, all of which is then in the parts.
    pub(super) fn finish(
        &mut self,
        run: &mut dyn Simulation,
        origin: ReplayOrigin,
    ) -> Result<ReplayRun, Error> {
        let last = self.chunk.as_mut().and_then(ChunkBuilder::take);
        self.push_chunk(last)?;
        self.metrics.add(&run.take_series());
        let status = self.first_status(run, origin.banner);
        let scene = scene(run.world_name(), run.agent_noun(), &self.scenery, true);
        let place = "scenario.toml".to_string();
        let source = ReplyBody::Source { place, text: origin.scenario, read_only: true };
        let events = self.push_events()?;
        let events_lost = self.log.lost();
        let events_left_out = events_lost.iter().map(|(_, count)| count).sum();
        self.inspections.flush(self.parts)?;
        let mut digests = None;
        if self.options.has_digests {
            digests = Some(self.parts.push(&self.digests)?);
        }
        Ok(ReplayRun {
            name: origin.name,
            scene,
            status,
            digest: origin.digest,
            digests,
            cycles: self.cycles.iter().map(|run| run.map(|n| n as f64)).collect(),
            tables: self.tables.finish(self.parts)?,
            source: self.parts.push_json(&source)?,
            metrics: self.parts.push_json(&self.metrics.metrics_reply(run, 0, false))?,
            agents: self.agents.finish(run, self.parts)?,
            chunks: std::mem::take(&mut self.chunks),
            events,
            events_left_out,
            events_lost: events_lost.iter().map(|&(cycle, n)| [cycle as f64, n as f64]).collect(),
            inspections: std::mem::take(&mut self.inspections.spans),
            inspected: self.options.inspections.describe(run.agent_noun()),
        })
    }

    fn first_status(&self, run: &dyn Simulation, banner: String) -> SessionStatus {
        let cycle = self.cycles.first().map_or(0, |[first, _, _]| *first);
        SessionStatus {
            session: 0,
            state: SessionState::Paused,
            cycle: cycle as f64,
            cycles_planned: run.cycle() as f64,
            time_s: cycle as f64 * self.scenery.cycle_s,
            speed: first_speed(run.cycle() as f64 * self.scenery.cycle_s),
            cycles_per_s: 0.0,
            seed: run.config().seed.to_string(),
            digest: None,
            banner: Some(banner),
            fleet: None,
        }
    }

    fn add_cycle(&mut self, cycle: Cycle) {
        match self.cycles.last_mut() {
            Some([first, step, count @ 1]) => {
                *step = cycle - *first;
                *count = 2;
            }
            Some([first, step, count]) if *first + *step * *count == cycle => *count += 1,
            _ => self.cycles.push([cycle, 1, 1]),
        }
    }

    fn push_frame(&mut self, frame: &Frame) -> Result<(), Error> {
        let text = FrameText { scans: Vec::new(), events: Vec::new(), events_left_out: 0 };
        let (table, bytes) = self.encoder.encode(frame, &text, 0);
        if let Some(table) = table {
            self.tables.push(&table, self.parts)?;
        }
        let scenery = &self.scenery;
        let chunk = self
            .chunk
            .get_or_insert_with(|| ChunkBuilder::new(finest_step_exponent(scenery, frame)));
        let complete = chunk.push(FrameColumns::from_frame(&bytes));
        self.push_chunk(complete)
    }

    fn push_chunk(&mut self, chunk: Option<(Vec<u8>, u32)>) -> Result<(), Error> {
        if let Some((bytes, frames)) = chunk {
            let part = self.parts.push(&bytes)?;
            self.chunks.push(ReplayChunk { part, frames });
        }
        Ok(())
    }

    fn push_inspections(&mut self, run: &mut dyn Simulation, frame: &Frame) -> Result<(), Error> {
        let inspected: Vec<&Body> = self.options.inspections.agents_of(frame);
        if inspected.is_empty() {
            return Ok(());
        }
        let ids: Vec<_> = inspected.iter().map(|body| body.id()).collect();
        // A frame of its own: which agents there are is only known from the one before it.
        let scans = run.frame(FrameOptions { scans: ScanSelection::Of(ids.clone()) }).scans;
        for id in ids {
            let Some(inspection) = run.inspect(id) else { continue };
            let own = scans.iter().filter(|scan| scan.of == id);
            let item = ReplayInspection { inspection, scans: own.map(scan).collect() };
            self.inspections.push(frame.cycle, &item, self.parts)?;
        }
        Ok(())
    }

    /// Writes all kept events; returns where they are.
    fn push_events(&mut self) -> Result<Vec<ReplaySpan>, Error> {
        let mut spans = Vec::new();
        let mut done = 0;
        loop {
            let reply = self.log.events_reply(0..Cycle::MAX, done, EVENTS_PER_PART);
            let ReplyBody::Events { entries, .. } = reply else { break };
            let Some((first, last)) = entries.first().zip(entries.last()) else {
                return Ok(spans);
            };
            let from = first.cycle;
            let until = last.cycle;
            let count = entries.len() as u32;
            let part = self.parts.push_json(&event_columns(entries))?;
            spans.push(ReplaySpan { part, from, until, count });
            done += count;
        }
        Ok(spans)
    }
}

/// Longest time in seconds that a replay takes to play as it opens.
const MAX_PLAY_S: f64 = 60.0;
/// Speeds that a page offers, from that of the run on.
const SPEEDS: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// Returns the lowest speed at which a run is over within a minute, for nobody watches for longer; the fastest for runs
/// that take even longer.
fn first_speed(run_s: f64) -> Speed {
    let [.., fastest] = SPEEDS;
    Speed::Times(SPEEDS.into_iter().find(|speed| run_s <= speed * MAX_PLAY_S).unwrap_or(fastest))
}

impl FrameSink for ReplayCollector<'_> {
    fn interval(&self) -> Cycle {
        self.options.every
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let cycle = run.cycle();
        let mut frame = run.frame(FrameOptions::WITHOUT_SCANS);
        self.log.record_ahead(&mut frame);
        // The last cycle may be captured twice: at its own multiple, and at the end.
        let last = self.cycles.last().map(|[first, step, count]| first + step * (count - 1));
        if last == Some(cycle) {
            return Ok(());
        }
        self.add_cycle(cycle);
        self.push_frame(&frame)?;
        if let Some(thumbnail) = &mut self.thumbnail {
            thumbnail.add(&frame);
        }
        if self.options.has_digests {
            self.digests.extend(run.digest().as_bytes());
        }
        self.metrics.add(&run.take_series());
        self.agents.add_frame(run);
        self.push_inspections(run, &frame)
    }
}

/// Returns events as columns.
fn event_columns(events: Vec<RunEvent>) -> ReplayEvents {
    let mut columns = ReplayEvents::default();
    let mut before = 0.0;
    for event in events {
        columns.cycle.push(event.cycle - before);
        before = event.cycle;
        columns.level.push(event.level);
        columns.kind.push(event.kind);
        columns.body.push(event.body);
        columns.other.push(event.other);
        columns.at_m.push(event.at_m);
        columns.value.push(event.value);
        columns.unit.push(event.unit);
        columns.text.push(event.text);
    }
    columns
}

/// Inspections as JSON, in parts.
#[derive(Default)]
struct InspectionParts {
    /// The text of the part that is not complete yet, without its brackets.
    text: Vec<u8>,
    /// The first and the last cycle in it, and the number of inspections.
    open: Option<(Cycle, Cycle, u32)>,
    spans: Vec<ReplaySpan>,
    count: usize,
}

impl InspectionParts {
    fn push(
        &mut self,
        cycle: Cycle,
        item: &ReplayInspection,
        parts: &mut Parts,
    ) -> Result<(), Error> {
        if self.count == MAX_INSPECTIONS {
            let cause = format!("there would be more than {MAX_INSPECTIONS} inspections");
            let remedy =
                "name fewer agents with --agents, or fewer cycles with --cycles or --every";
            return Err(InputError::new("--to page", cause, remedy).into());
        }
        self.count += 1;
        let is_other_cycle = self.open.is_some_and(|(_, last, _)| last != cycle);
        if self.text.len() >= INSPECTIONS_PART_BYTES && is_other_cycle {
            self.flush(parts)?;
        }
        if !self.text.is_empty() {
            self.text.push(b',');
        }
        serde_json::to_writer(&mut self.text, item).map_err(|e| super::unwritable(&e))?;
        let (first, _, count) = self.open.unwrap_or((cycle, cycle, 0));
        self.open = Some((first, cycle, count + 1));
        Ok(())
    }

    fn flush(&mut self, parts: &mut Parts) -> Result<(), Error> {
        let Some((first, last, count)) = self.open.take() else { return Ok(()) };
        let text = [&b"["[..], &std::mem::take(&mut self.text), b"]"].concat();
        let part = parts.push(&text)?;
        self.spans.push(ReplaySpan { part, from: first as f64, until: last as f64, count });
        Ok(())
    }
}
