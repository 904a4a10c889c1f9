//! The tables that a run records, and their rows until they are recorded.

use super::decide::OptimizationRecord;
use super::encounters::EncounterRecord;
use super::events::{Event, EventKind, EventQuantity};
use super::flown_leg::FlownLeg;
use super::settings::RecordSection;
use super::world::AirspaceWorld;
use sidestep_kernel::ports::table::label_index;
use sidestep_kernel::ports::{Table, TableBuffer, TableBuffers, TableRowsBuffer};

fn trajectories_table(world: &AirspaceWorld) -> Table<FlownLeg> {
    let callsigns = callsigns(world);
    let mut names: Vec<String> = callsigns.iter().flatten().cloned().collect();
    names.sort_unstable();
    names.dedup();
    let labels: Vec<Option<u32>> = callsigns
        .iter()
        .map(|callsign| {
            let label = callsign.as_ref().and_then(|name| names.binary_search(name).ok())?;
            Some(label as u32)
        })
        .collect();
    let chart = world.chart();
    let table = Table::new("trajectories")
        .u64("cycle", "cycle of dt in which this leg is flown", |f: &FlownLeg| f.cycle)
        .u32("airplane", "entity id", |f| f.airplane)
        .f64("x_m", "position east at the start of the leg", move |f| chart.point(f.start.at)[0])
        .f64("y_m", "position north", move |f| chart.point(f.start.at)[1])
        .f64("heading_rad", "heading, counterclockwise from east", |f| f.start.heading_rad)
        .f64("altitude_m", "altitude", |f| f.leg.altitude_m)
        .f64("from_s", "start of the leg, after the start of the run", |f| f.leg.from_s)
        .f64("until_s", "its end; the same as its start where the flight ends", |f| f.leg.until_s)
        .f64("speed_m_s", "airspeed, constant on the leg", |f| f.leg.v_m_s)
        .f64("turn_rad_s", "turn rate, constant, positive to the left", |f| f.leg.omega_rad_s)
        .f64("climb_m_s", "rate of climb, constant", |f| f.leg.climb_m_s)
        .f64("drift_x_m_s", "velocity of the air east", |f| f.leg.drift_m_s[0])
        .f64("drift_y_m_s", "velocity of the air north", |f| f.leg.drift_m_s[1])
        .label("callsign", "call sign of the airplane", names, move |f| {
            labels.get(f.airplane as usize).copied().flatten()
        });
    with_earth_columns(table, world)
}

/// Adds where on earth and when a leg starts, as far as the scenario says so.
fn with_earth_columns(mut table: Table<FlownLeg>, world: &AirspaceWorld) -> Table<FlownLeg> {
    let chart = world.chart();
    if chart.is_on_earth() {
        let [latitude, longitude] =
            [0, 1].map(|axis| move |f: &FlownLeg| Some(chart.lat_lon_deg(f.start.at)?[axis]));
        table = table.f64("latitude_deg", "latitude at the start of the leg", latitude).f64(
            "longitude_deg",
            "longitude",
            longitude,
        );
    }
    if let Some(start_utc_s) = world.start_utc_s {
        let utc_s = move |f: &FlownLeg| start_utc_s + f.leg.from_s;
        table = table.f64("utc_s", "start of the leg, seconds since 1970, UTC", utc_s);
    }
    table
}

fn events_table(world: &AirspaceWorld) -> Table<Event> {
    let callsigns = callsigns(world);
    let kinds = EventKind::ALL.map(EventKind::name);
    let table = Table::new("events")
        .u64("cycle", "cycle of dt in which it happened", |e: &Event| e.cycle)
        .label("event", "what happened", kinds, |e| label_index(&EventKind::ALL, &e.kind))
        .u32("airplane", "entity id", |e| e.airplane)
        .text("callsign", "its call sign", move |e: &Event| {
            callsigns.get(e.airplane as usize).cloned().flatten()
        })
        .u32("other", "the other airplane", Event::other_airplane)
        .f64("distance_m", "how near they were", |e| e.value_of_quantity(EventQuantity::Distance))
        .f64("delay_s", "time beyond that of the flight alone", |e| {
            e.value_of_quantity(EventQuantity::Delay)
        })
        .f64("number", "a number, by event", |e| e.value_of_quantity(EventQuantity::Number));
    with_event_place(table, world)
}

/// Adds where on earth the airplane is and when, at the end of the cycle of an event.
fn with_event_place(mut table: Table<Event>, world: &AirspaceWorld) -> Table<Event> {
    let chart = world.chart();
    if chart.is_on_earth() {
        let [latitude, longitude] = [0, 1].map(|axis| {
            move |e: &Event| {
                let [x_m, y_m, _] = e.at_m?;
                Some(chart.lat_lon_of_drawn_deg([x_m, y_m])?[axis])
            }
        });
        table = table.f64("latitude_deg", "latitude at the end of the cycle", latitude).f64(
            "longitude_deg",
            "longitude",
            longitude,
        );
    }
    if let Some(start_utc_s) = world.start_utc_s {
        let dt_s = world.timing.dt_s;
        let utc_s = move |e: &Event| start_utc_s + (e.cycle + 1) as f64 * dt_s;
        table = table.f64("utc_s", "end of the cycle, seconds since 1970, UTC", utc_s);
    }
    table
}

fn optimizations_table() -> Table<OptimizationRecord> {
    Table::new("optimizations")
        .u64("cycle", "cycle of dt before which it was made", |o: &OptimizationRecord| o.cycle)
        .u32("airplane", "smallest entity id of the group", |o| o.airplane)
        .u32("airplanes", "members of the group", |o| o.airplanes)
        .u32("rounds", "rounds made", |o| o.rounds)
        .label("converged", "whether the distributions had settled", ["no", "yes"], |o| {
            u32::from(o.converged)
        })
        .f64("cost", "objective G of the joint action chosen; none from agents that sample", |o| {
            o.reached.map(|reached| reached.cost)
        })
        .f64("bound", "lower bound on G of every joint action", |o| {
            o.reached.map(|reached| reached.bound)
        })
        .f64("minimum", "true minimum of G, in groups of up to minimum_up_to", |o| o.minimum)
        .u64("messages", "messages, one per receiver", |o| o.traffic.messages)
        .u64("bytes", "their bytes", |o| o.traffic.bytes)
}

fn pairs_table(world: &AirspaceWorld) -> Table<EncounterRecord> {
    let [callsigns, other_callsigns] = [callsigns(world), callsigns(world)];
    let table = Table::new("pairs")
        .u64(
            "cycle",
            "cycle of dt in which the encounter ended; of one that is open, the first that was not flown",
            |e: &EncounterRecord| e.cycle,
        )
        .u32("airplane", "entity id", |e| e.airplanes[0])
        .text("callsign", "its call sign", move |e: &EncounterRecord| {
            callsigns.get(e.airplanes[0] as usize).cloned().flatten()
        })
        .u32("other", "the other airplane", |e| e.airplanes[1])
        .text("other_callsign", "its call sign", move |e: &EncounterRecord| {
            other_callsigns.get(e.airplanes[1] as usize).cloned().flatten()
        })
        .f64("from_s", "start of the encounter, after the start of the run", |e| e.encounter.from_s)
        .f64("until_s", "its end; of one that is open, the end of the recording", |e| {
            e.encounter.until_s
        })
        .f64("nearest_m", "closest horizontal approach in it", |e| e.encounter.nearest_m)
        .f64("vertical_m", "difference of altitude at that time", |e| e.encounter.vertical_m)
        .u64("conflicts", "conflicts in it", |e| e.encounter.counts.conflicts)
        .u64("intrusions", "conflicts in which separation was lost", |e| {
            e.encounter.counts.intrusions
        })
        .f64("severity", "largest severity of a loss of separation, 0 to 1", |e| {
            e.encounter.counts.max_severity
        })
        .u64("well_clear_violations", "violations of well clear", |e| {
            e.encounter.counts.well_clear_violations
        })
        .u64("nmacs", "near mid-air collisions", |e| e.encounter.counts.nmacs)
        .label("reported", "whether the shield had reported the pair", ["no", "yes"], |e| {
            u32::from(e.is_reported)
        })
        .label("open", "whether it lasted at the end of the recording", ["no", "yes"], |e| {
            u32::from(e.is_open)
        });
    with_encounter_time(table, world)
}

/// Adds the time of day at which an encounter began, where the scenario has one.
fn with_encounter_time(
    table: Table<EncounterRecord>,
    world: &AirspaceWorld,
) -> Table<EncounterRecord> {
    let Some(start_utc_s) = world.start_utc_s else { return table };
    let utc_s = move |e: &EncounterRecord| start_utc_s + e.encounter.from_s;
    table.f64("utc_s", "start of the encounter, seconds since 1970, UTC", utc_s)
}

fn callsigns(world: &AirspaceWorld) -> Vec<Option<String>> {
    world.airplanes.iter().map(|airplane| airplane.callsign.clone()).collect()
}

/// Rows that wait to be recorded.
#[derive(Debug, Default)]
pub(super) struct RecordBuffers {
    record: RecordSection,
    flown: TableRowsBuffer<FlownLeg>,
    events: TableRowsBuffer<Event>,
    optimizations: TableRowsBuffer<OptimizationRecord>,
    pairs: TableRowsBuffer<EncounterRecord>,
}

impl RecordBuffers {
    /// Returns empty rows, which later keep the tables that `record` asks for.
    pub(super) fn new(record: RecordSection) -> Self {
        Self { record, ..Self::default() }
    }

    /// Returns whether controls from outside of the run are to be kept.
    pub(super) fn is_recording_controls(&self) -> bool {
        self.record.controls
    }

    /// Returns whether rows of encounters are kept.
    pub(super) fn is_recording_pairs(&self) -> bool {
        self.pairs.is_enabled()
    }

    /// Starts to keep rows of the tables that the scenario asks for; before this call none are kept.
    pub(super) fn start(&mut self, world: &AirspaceWorld) {
        self.flown.set_table(self.record.trajectories.then(|| trajectories_table(world)));
        self.events.set_table(self.record.events.then(|| events_table(world)));
        self.optimizations.set_table(self.record.optimizations.then(optimizations_table));
        // Without their measures there are no rows, and an empty table would say that nothing was found.
        let with_pairs = self.record.pairs && world.measures.pairs.is_some();
        self.pairs.set_table(with_pairs.then(|| pairs_table(world)));
    }

    pub(super) fn push_flown_leg(&mut self, flown: FlownLeg) {
        self.flown.push(flown);
    }

    pub(super) fn push_event(&mut self, event: Event) {
        self.events.push(event);
    }

    pub(super) fn push_encounter(&mut self, encounter: EncounterRecord) {
        self.pairs.push(encounter);
    }

    pub(super) fn push_optimization(&mut self, optimization: OptimizationRecord) {
        self.optimizations.push(optimization);
    }
}

impl TableBuffers for RecordBuffers {
    fn table_buffers(&self) -> Vec<&dyn TableBuffer> {
        vec![&self.flown, &self.events, &self.optimizations, &self.pairs]
    }

    fn table_buffers_mut(&mut self) -> Vec<&mut dyn TableBuffer> {
        vec![&mut self.flown, &mut self.events, &mut self.optimizations, &mut self.pairs]
    }
}
