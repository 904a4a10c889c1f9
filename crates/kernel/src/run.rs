//! The one simulation: a world, its state, the engine, and the rows to record.

use crate::checkpoint::{self, CheckpointError, Header};
use crate::control::{
    self, CellsMut, ControlBook, ControlRow, OrderBook, OrderError, OrderRow, Orders, Team, Teams,
};
use crate::cycle::{Observer, PhaseTimes, Scratches};
use crate::digest::Digest;
use crate::engine::{Engine, Span};
use crate::interrupt::Interrupt;
use crate::plan::{Effort, GroupSizes, Plan};
use crate::ports::{Buffer, RecordError, Recorder, RowBuffer, SystemClock, TableSchema};
use crate::simulation::Simulation;
use crate::units::{Cycle, EntityId};
use crate::view::{Frame, Inspection, Look, PlaceRows, Scenery, Who};
use crate::words::{Lines, Said};
use crate::world::{Decides, World};
use serde_json::Value;
use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A run of a world.
pub struct Run<W: World> {
    world: Arc<W>,
    plan: Plan,
    /// Digest of the scenario's text, to which checkpoints belong.
    scenario: [u8; 16],
    state: W::State,
    books: W::Books,
    engine: Engine<W>,
    /// Conflict groups up to the checkpoint from which the run was resumed.
    groups_before: GroupSizes,
    cycle: Cycle,
    clock: SystemClock,
    /// Whether rows are kept for a recorder.
    records: bool,
    teams: Arc<Teams>,
    /// Orders to be given when the run reaches their cycles.
    ahead: OrderBook,
    /// Controls to be handed over likewise.
    controls: ControlBook,
    /// The last cycle for which that was done.
    obeyed: Option<Cycle>,
    /// Orders that were given and wait to be recorded.
    given: RowBuffer<OrderRow>,
    /// Controls that were handed over and wait to be recorded.
    handed: RowBuffer<ControlRow>,
}

impl<W: World> Run<W> {
    /// Creates a run at its start, with `workers` workers; the world is shared, not copied.
    /// `scenario` is the resolved scenario's text.
    pub fn new(
        world: Arc<W>,
        plan: Plan,
        state: W::State,
        books: W::Books,
        scenario: &str,
        workers: usize,
    ) -> Self {
        let engine = Engine::new(&*world, world.bodies(&state), workers);
        let scenario = *Digest::of(scenario.as_bytes()).as_bytes();
        let clock = SystemClock::default();
        let groups_before = GroupSizes::default();
        let (cycle, records) = (0, false);
        let teams = world.teams();
        let (ahead, given) = (OrderBook::default(), RowBuffer::default());
        Self {
            world,
            plan,
            scenario,
            state,
            books,
            engine,
            groups_before,
            cycle,
            clock,
            records,
            teams,
            ahead,
            controls: ControlBook::default(),
            obeyed: None,
            given,
            handed: RowBuffer::default(),
        }
    }

    /// Uses all workers even where one would be faster; for tests and benchmarks.
    pub fn share_always(&mut self) {
        self.engine.share_always();
    }

    /// The world.
    pub fn world(&self) -> &Arc<W> {
        &self.world
    }

    /// The state.
    pub fn state(&self) -> &W::State {
        &self.state
    }

    /// The sums, rows and events that are kept beside the state.
    pub fn books(&self) -> &W::Books {
        &self.books
    }

    /// Returns the content that a checkpoint of the present state would have.
    pub fn saved(&self) -> W::Saved {
        self.world.save(&self.state, &self.books, self.cycle)
    }

    /// Returns the measurements of the run so far.
    pub fn metrics(&self) -> W::Metrics {
        self.world.metrics(&self.state, &self.books, self.cycle, &self.effort())
    }

    /// Bytes on the heap of the engine, which grow with the bodies.
    pub fn engine_heap_bytes(&self) -> usize {
        self.engine.heap_bytes()
    }

    /// Returns the conflict groups since the start of the run, and the processor time of all workers.
    pub fn effort(&self) -> Effort {
        let mut effort = Effort { groups: self.groups_before, cpu_ns: 0 };
        for mate in self.engine.crew() {
            effort.groups.merge(&mate.tally.groups);
            effort.cpu_ns += mate.tally.cpu_ns;
        }
        effort
    }

    fn header(&self) -> Header {
        Header {
            format: checkpoint::FORMAT,
            program_version: env!("CARGO_PKG_VERSION").into(),
            world: W::NAME.into(),
            scenario: self.scenario,
            cycle: self.cycle,
        }
    }

    /// Takes over the results of all workers.
    fn gather(&mut self) {
        let Self { world, books, engine, .. } = self;
        engine.crew_mut().for_each(|mate| world.gather(books, &mut mate.scratch));
        world.book(books);
    }

    /// Number of cycles that may run before rows must be handed over.
    fn room(&self) -> u64 {
        let room = self.world.room(&self.state, &self.books, self.cycle);
        // Orders come from outside of cycles, so one more cycle never makes it worse.
        if self.given.is_full() || self.handed.is_full() { room.min(1) } else { room }
    }

    /// Runs up to `cycles` cycles in which no order is ahead.
    fn stretch(&mut self, cycles: u64) -> u64 {
        let cycles = cycles.min(self.room());
        let Self { world, state, books, engine, clock, .. } = self;
        let span = Span { from: self.cycle, cycles };
        let done = match W::LOOKS_EACH_CYCLE {
            false => {
                engine.advance(world, state, span, clock);
                cycles
            }
            true => {
                let mut onlooker = Onlooker { world: &**world, books };
                engine.advance_observed(world, state, span, clock, &mut onlooker)
            }
        };
        self.cycle += done;
        done
    }

    /// Gives an order, or refuses it as a whole.
    fn give(&mut self, orders: &Orders<'_>) -> Result<(), OrderError> {
        self.examine(orders)?;
        let Self { world, state, teams, .. } = self;
        teams.each(orders, |order| {
            world.order(state, order);
            Ok(())
        })?;
        if self.given.is_kept() {
            let names = self.teams.order_names();
            let name = names.iter().position(|name| name == orders.order).unwrap_or(0) as u32;
            let (cycle, given) = (self.cycle, &mut self.given);
            self.teams.each(orders, |order| {
                let row = |(part, &value): (u32, &f64)| {
                    let (agent, order) = (order.agent, name);
                    OrderRow { cycle, agent, order, part, value }
                };
                given.extend((0..).zip(order.values).map(row));
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Refuses orders that cannot be obeyed.
    fn examine(&self, orders: &Orders<'_>) -> Result<(), OrderError> {
        self.teams.each(orders, |order| {
            self.world.check_order(order).map_err(|cause| {
                let who = format!("{} {}", self.teams.noun(), order.agent);
                let order = orders.order.into();
                OrderError::Senseless { order, who, cause }
            })
        })
    }

    /// Gives the orders that are ahead for the present cycle, and hands over the controls.
    fn obey(&mut self) {
        if self.obeyed.replace(self.cycle) == Some(self.cycle) {
            return;
        }
        let ahead = std::mem::take(&mut self.ahead);
        for orders in ahead.due(self.cycle) {
            self.give(&orders).expect("`follow` has checked it");
        }
        self.ahead = ahead;
        let controls = std::mem::take(&mut self.controls);
        if let Some(handed) = controls.of(self.cycle) {
            // A control that can no longer be carried out is skipped. The run then differs, and its digest shows it.
            let taken = self.hand_over(handed);
            if taken.is_err() {
                let _ = self.hand_over(&[]);
            }
        }
        self.controls = controls;
    }

    /// Returns the first cycle after the present one before which orders are given or controls handed over.
    fn next_given(&self) -> Option<Cycle> {
        let orders = self.ahead.next_after(self.cycle);
        orders.into_iter().chain(self.controls.next_after(self.cycle)).min()
    }

    /// Sets up all workers for gathering the rows and events that are now wanted.
    fn prepare(&mut self) {
        let Self { world, books, engine, .. } = self;
        engine.crew_mut().for_each(|mate| world.prepare(books, &mut mate.scratch));
    }
}

impl<W: World> fmt::Debug for Run<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Run").field("world", &W::NAME).field("cycle", &self.cycle).finish()
    }
}

/// An observer between cycles, for worlds that ask for one.
struct Onlooker<'a, W: World> {
    world: &'a W,
    books: &'a mut W::Books,
}

impl<W: World> Observer<W> for Onlooker<'_, W> {
    fn before_cycle(&mut self, now: Cycle, state: &W::State) {
        self.world.before_cycle(state, self.books, now);
    }

    fn after_cycle(
        &mut self,
        now: Cycle,
        state: &W::State,
        mut scratches: Scratches<'_, W::Scratch>,
    ) -> ControlFlow<()> {
        scratches.for_each(|scratch| self.world.gather(self.books, scratch));
        self.world.book(self.books);
        let is_full = self.world.room(state, self.books, now + 1) == 0;
        match is_full || self.world.is_over(state) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl<W: World> Simulation for Run<W> {
    fn world(&self) -> &'static str {
        W::NAME
    }

    fn agent(&self) -> &'static str {
        W::AGENT
    }

    fn decides(&self) -> Decides {
        W::DECIDES
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agents(&self) -> usize {
        self.world.agents()
    }

    fn is_over(&self) -> bool {
        self.world.is_over(&self.state)
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        let mut done = 0;
        while done < cycles {
            self.obey();
            let next = self.next_given();
            let wanted = next.map_or(cycles - done, |next| (next - self.cycle).min(cycles - done));
            let made = self.stretch(wanted);
            done += made;
            if made < wanted {
                break;
            }
        }
        done
    }

    fn heed(&mut self, interrupt: Interrupt) {
        self.engine.heed(interrupt);
    }

    fn digest(&self) -> Digest {
        self.world.digest(&self.state, self.cycle)
    }

    fn checkpoint(&self) -> Vec<u8> {
        checkpoint::encode(&self.header(), &(self.effort().groups, self.saved()))
    }

    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let (cycle, (groups, saved)) = checkpoint::decode(checkpoint, &self.header())?;
        self.state = self.world.restore(saved, &mut self.books)?;
        self.groups_before = groups;
        self.engine.crew_mut().for_each(|mate| mate.tally.groups = GroupSizes::default());
        self.cycle = cycle;
        self.obeyed = None;
        Ok(())
    }

    fn begin_recording(&mut self) {
        self.records = true;
        self.world.begin_recording(&mut self.state, &mut self.books, self.cycle);
        if self.teams.take_orders() {
            self.given.begin(Some(control::table(self.teams.order_names().to_vec())));
        }
        if self.world.keeps_controls(&self.books) {
            self.handed.begin(Some(control::controls_table()));
        }
        self.prepare();
    }

    fn schemas(&self) -> Vec<TableSchema> {
        let mut schemas = self.world.schemas(&self.books);
        schemas.extend(self.given.schema());
        schemas.extend(self.handed.schema());
        schemas
    }

    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        // Rows of past cycles are lost: an empty recording would hide that.
        if !self.records {
            let cause = "no rows were kept; call `begin_recording` before the first `advance`";
            return Err(RecordError::new(format!("the recording of `{}`", self.plan.name), cause));
        }
        self.gather();
        self.world.record(&mut self.state, &mut self.books, self.cycle, recorder)?;
        // These tables follow those of the world.
        let blocks = [self.given.take(), self.handed.take()].into_iter().flatten();
        let mut tables = self.world.schemas(&self.books).len()..;
        blocks.zip(&mut tables).try_for_each(|(block, table)| recorder.append(table, &block))
    }

    fn scenery(&self) -> Scenery {
        self.world.scenery(&self.plan.name)
    }

    fn watch(&mut self) {
        self.world.watch(&mut self.books);
        self.prepare();
    }

    fn watch_odometry(&mut self) {
        self.world.watch_odometry(&mut self.books);
        self.prepare();
    }

    fn frame(&mut self, look: Look) -> Frame {
        self.gather();
        self.world.frame(&self.state, &mut self.books, self.cycle, look)
    }

    fn inspect(&self, who: Who) -> Option<Inspection> {
        self.world.inspect(&self.state, &self.books, self.cycle, who)
    }

    fn teams(&self) -> &[Team] {
        self.teams.all()
    }

    fn observe(&self, team: usize, room: &mut [CellsMut<'_>]) -> Result<(), OrderError> {
        self.teams.check_room(team, room)?;
        self.world.observe(&self.state, self.cycle, team, room);
        Ok(())
    }

    fn check(&self, orders: &Orders<'_>) -> Result<(), OrderError> {
        self.examine(orders)
    }

    fn order(&mut self, orders: &Orders<'_>) -> Result<(), OrderError> {
        self.give(orders)
    }

    fn follow(&mut self, orders: OrderBook) -> Result<(), OrderError> {
        orders.iter().try_for_each(|(_, orders)| self.examine(&orders))?;
        (self.ahead, self.obeyed) = (orders, None);
        Ok(())
    }

    fn hand_over(&mut self, controls: &[(EntityId, Vec<u8>)]) -> Result<(), OrderError> {
        if self.records && !self.handed.is_kept() {
            let cause = "it is recorded, and its controls are not, so nobody could compute it again; set \
                         record.controls = true";
            return Err(OrderError::NobodyOutside { cause: cause.into() });
        }
        self.world.hand_over(&mut self.state, self.cycle, controls)?;
        self.handed.extend(control::rows_of(self.cycle, controls));
        Ok(())
    }

    fn retrace(&mut self, controls: ControlBook) {
        (self.controls, self.obeyed) = (controls, None);
    }

    fn place_rows(&self) -> Vec<PlaceRows> {
        self.world.place_rows(&self.books)
    }

    fn metrics(&self) -> Value {
        serde_json::to_value(Run::metrics(self)).unwrap_or_default()
    }

    fn agent_metrics(&self) -> Value {
        self.world.agent_metrics(&self.state, &self.books, self.cycle)
    }

    fn pair_metrics(&self) -> Value {
        self.world.pair_metrics(&self.books)
    }

    fn outcome(&self) -> Lines {
        self.world.outcome(&Run::metrics(self))
    }

    fn poses(&self) -> Said {
        self.world.poses(&self.state, self.cycle)
    }

    fn phase_times(&self) -> PhaseTimes {
        self.engine.times()
    }
}
