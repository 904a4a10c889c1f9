//! The section of generated traffic, and its airplanes.

use super::compile::Compiler;
use crate::flight::{AircraftModel, AirplaneStart, Performance, Surface};
use crate::generate::{GeneratorKind, GeneratorParams, TerminalParams, TrafficKind, generate};
use crate::settings::Speed;
use crate::shield::ErrorBounds;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::InputError;
use sidestep_kernel::stream::Streams;
use sidestep_scenario::{Integer, LeftOpen, Number, Open, Point, RightOpen, Spanned};

/// Radius in meters of the paper's circle.
const PAPER_RADIUS_M: f64 = 6_500.0;
/// Default of the random displacement of generated starts: as much as breaks all symmetries, and far less than the
/// separation.
const DEFAULT_JITTER_M: f64 = 20.0;
/// Default radius of a terminal area, in separations: 36 nautical miles where airplanes keep three from each other, about
/// as far as an approach control reaches.
const TERMINAL_SEPARATIONS: f64 = 12.0;
/// Default of the share of a terminal area's airplanes that arrive, and of those that fly over.
const TERMINAL_FRACTION: f64 = 0.3;
/// Default times between two departures, and between two arrivals, in those that an airplane takes for its separation.
const DEPARTURE_SEPARATIONS: f64 = 3.0;
const ARRIVAL_SEPARATIONS: f64 = 5.0;
/// Default levels of cruise, by their numbers from the ground: from 10,000 to 30,000 feet where levels are 1,000 feet
/// apart.
const CRUISE_LEVELS: [f64; 2] = [10.0, 30.0];
/// Default rates of climb and descent in meters per second: those of airliners near a field, 1,200 to 2,900 ft/min.
const CLIMBS_M_S: [f64; 2] = [6.0, 15.0];

/// A time between two airplanes.
type Interval = Number<Open<0, 1_000_000_000>>;

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct GeneratorSection {
    kind: GeneratorKind,
    /// Number of airplanes.
    n: Integer<1, 1_000_000>,
    radius_m: Option<Number<Open<0, 1_000_000_000>>>,
    jitter_m: Option<Number<RightOpen<0, 1_000_000>>>,
    /// How many of n descend to the field of a terminal area; those that neither arrive nor fly over depart.
    arrivals: Option<Spanned<Integer<0, 1_000_000>>>,
    /// How many of n cross a terminal area.
    overflights: Option<Spanned<Integer<0, 1_000_000>>>,
    /// Mean time between two departures of a terminal area.
    departure_interval_s: Option<Interval>,
    /// Mean time between two arrivals of a terminal area.
    arrival_interval_s: Option<Interval>,
    /// The lowest and the highest level of cruise of a terminal area.
    levels_m: Option<Spanned<Point<2, LeftOpen<0, 1_000_000>>>>,
    /// The smallest and the largest airspeed of a terminal area.
    speeds_m_s: Option<Spanned<Point<2, Speed>>>,
    /// The smallest and the largest rate of climb and descent of a terminal area.
    climbs_m_s: Option<Spanned<Point<2, LeftOpen<0, 1_000_000>>>>,
}

impl GeneratorSection {
    /// Returns the keys that only a terminal area has, as far as they are given.
    fn terminal_keys(&self) -> Vec<&'static str> {
        let given = [
            ("arrivals", self.arrivals.is_some()),
            ("overflights", self.overflights.is_some()),
            ("departure_interval_s", self.departure_interval_s.is_some()),
            ("arrival_interval_s", self.arrival_interval_s.is_some()),
            ("levels_m", self.levels_m.is_some()),
            ("speeds_m_s", self.speeds_m_s.is_some()),
            ("climbs_m_s", self.climbs_m_s.is_some()),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key).collect()
    }
}

/// The airplanes of a generator: all have the same abilities.
struct Fleet<'a> {
    n: usize,
    model: &'a AircraftModel,
    performance: &'a Performance,
}

impl Compiler<'_> {
    /// Refuses generated traffic, which is in a plane, beside positions on the earth.
    pub(super) fn check_generator_surface(&self) -> Result<(), InputError> {
        match &self.file.airspace.generator {
            Some(generator) if self.surface()? == Surface::Earth => {
                let cause =
                    "generated airplanes, which fly over a plane, beside positions in degrees";
                let remedy =
                    "leave out [airspace.generator], or give all airplanes at_m and way_points_m";
                Err(self.source.error(generator.span(), cause, remedy))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn generate_airplanes(
        &self,
        section: &Spanned<GeneratorSection>,
        streams: &Streams,
    ) -> Result<Vec<AirplaneStart>, InputError> {
        let s = section.get_ref();
        self.check_generator_keys(s)?;
        let abilities = self.abilities(None);
        let performance = &abilities.performance();
        let model = &abilities.model(performance, abilities.v_m_s());
        let n = s.n.get() as usize;
        let fleet = Fleet { n, model, performance };
        let kind = match s.kind {
            GeneratorKind::Superconflict => TrafficKind::Superconflict,
            GeneratorKind::Random => TrafficKind::Random,
            GeneratorKind::Streams => TrafficKind::Streams,
            GeneratorKind::Terminal => TrafficKind::Terminal(self.terminal(section, &fleet)?),
        };
        let default_radius_m = match s.kind {
            // With five or more as dense as five airplanes in the paper's circle.
            GeneratorKind::Random => PAPER_RADIUS_M * (n as f64 / 5.0).max(1.0).sqrt(),
            GeneratorKind::Terminal => TERMINAL_SEPARATIONS * model.separation_m,
            GeneratorKind::Superconflict | GeneratorKind::Streams => PAPER_RADIUS_M,
        };
        let radius_m = s.radius_m.map_or(default_radius_m, f64::from);
        let jitter_m = s.jitter_m.map_or(DEFAULT_JITTER_M, f64::from);
        let errors_m = self.error_margin_m(model);
        let changes = &abilities.changes;
        let params =
            GeneratorParams { kind, n, radius_m, jitter_m, model, performance, changes, errors_m };
        let generated = generate(&params, streams).map_err(|placed| {
            let cause = format!("no place is left after {placed} of {n} airplanes");
            let remedy = match s.kind {
                GeneratorKind::Terminal => {
                    "give a larger radius_m, more levels_m, a longer arrival_interval_s or a smaller n"
                }
                _ => "give a larger radius_m or a smaller n",
            };
            self.source.error(section.span(), cause, remedy)
        })?;
        // All have the same limits, and those of a terminal area speeds and levels of their own.
        for airplane in &generated {
            self.check_performance(airplane, None)?;
        }
        Ok(generated)
    }

    /// Refuses keys that other kinds have.
    fn check_generator_keys(&self, s: &GeneratorSection) -> Result<(), InputError> {
        let because = match s.kind {
            GeneratorKind::Random => "for kind = \"random\", whose places are all drawn",
            GeneratorKind::Terminal => "for kind = \"terminal\", whose places are all drawn",
            GeneratorKind::Superconflict | GeneratorKind::Streams => "",
        };
        if !because.is_empty() && s.jitter_m.is_some() {
            return Err(self.source.unused_key("airspace.generator.jitter_m", because));
        }
        if s.kind != GeneratorKind::Terminal
            && let Some(key) = s.terminal_keys().first()
        {
            let because = "for another kind than \"terminal\"";
            return Err(self.source.unused_key(&format!("airspace.generator.{key}"), because));
        }
        Ok(())
    }

    /// Returns the settings of a terminal area.
    fn terminal(
        &self,
        section: &Spanned<GeneratorSection>,
        fleet: &Fleet<'_>,
    ) -> Result<TerminalParams, InputError> {
        let s = section.get_ref();
        let &Fleet { n, model, performance } = fleet;
        let default_count = (TERMINAL_FRACTION * n as f64) as usize;
        let count_of = |given: &Option<Spanned<Integer<0, 1_000_000>>>| {
            given.as_ref().map_or(default_count, |given| given.get_ref().get() as usize)
        };
        let arrivals = count_of(&s.arrivals);
        let overflights = count_of(&s.overflights);
        if arrivals + overflights > n {
            let span = s.arrivals.as_ref().or(s.overflights.as_ref()).map(Spanned::span);
            let cause =
                format!("{arrivals} arrivals and {overflights} overflights of {n} airplanes");
            let remedy = "give a larger n, or fewer arrivals or overflights";
            return Err(self.source.error(span, cause, remedy));
        }
        let separation_s = model.separation_m / model.v_m_s;
        let vertical_m = self.file.airspace.vertical_m.map_or(300.0, f64::from);
        let terminal = TerminalParams {
            arrivals,
            overflights,
            departure_interval_s: s
                .departure_interval_s
                .map_or(DEPARTURE_SEPARATIONS * separation_s, f64::from),
            arrival_interval_s: s
                .arrival_interval_s
                .map_or(ARRIVAL_SEPARATIONS * separation_s, f64::from),
            levels_m: s
                .levels_m
                .as_ref()
                .map_or(CRUISE_LEVELS.map(|k| k * vertical_m), |given| given.get_ref().get()),
            vertical_m,
            speeds_m_s: s
                .speeds_m_s
                .as_ref()
                .map_or([model.v_m_s; 2], |given| given.get_ref().get()),
            climbs_m_s: s.climbs_m_s.as_ref().map_or(
                CLIMBS_M_S.map(|rate| {
                    rate.min(performance.climb_max_m_s).min(performance.descent_max_m_s)
                }),
                |given| given.get_ref().get(),
            ),
        };
        self.check_terminal(s, &terminal, performance)?;
        Ok(terminal)
    }

    /// Refuses ranges that are empty, and such beyond what the airplanes can fly.
    fn check_terminal(
        &self,
        s: &GeneratorSection,
        terminal: &TerminalParams,
        performance: &Performance,
    ) -> Result<(), InputError> {
        let levels_span = s.levels_m.as_ref().map(Spanned::span);
        let climbs_span = s.climbs_m_s.as_ref().map(Spanned::span);
        let ranges = [
            ("levels_m", terminal.levels_m, levels_span.clone()),
            ("speeds_m_s", terminal.speeds_m_s, s.speeds_m_s.as_ref().map(Spanned::span)),
            ("climbs_m_s", terminal.climbs_m_s, climbs_span.clone()),
        ];
        for (key, [low, high], span) in ranges {
            if low > high {
                let cause = format!("{key} from {low} to {high}");
                let remedy = format!("give the smaller one first: {key} = [{high:?}, {low:?}]");
                return Err(self.source.error(span, cause, remedy));
            }
        }
        for range_m in [terminal.levels_m, terminal.approach_levels_m()] {
            let [low, high] = terminal.level_numbers(range_m);
            if low > high || low < 1.0 {
                let cause = format!(
                    "no level from {} to {} m, of those every vertical_m = {} m",
                    range_m[0], range_m[1], terminal.vertical_m
                );
                let remedy = format!(
                    "give levels_m from {} m on, so that arrivals, which end between three and six tenths of the \
                     lowest, have one, too",
                    4.0 * terminal.vertical_m
                );
                return Err(self.source.error(levels_span, cause, remedy));
            }
        }
        let [_, fastest_m_s] = terminal.climbs_m_s;
        let max_m_s = performance.climb_max_m_s.min(performance.descent_max_m_s);
        if fastest_m_s > max_m_s {
            let cause = format!(
                "climbs_m_s up to {fastest_m_s}, of airplanes that climb and descend at {max_m_s} m/s"
            );
            let remedy = format!("give climbs_m_s up to {max_m_s}, or leave it out");
            return Err(self.source.error(climbs_span, cause, remedy));
        }
        let [_, highest_m] = terminal.levels_m;
        if !performance.allows_altitude(highest_m) || !performance.allows_altitude(0.0) {
            let cause = format!(
                "levels from the ground to {highest_m} m, of airplanes that fly from {} to {} m",
                performance.floor_m, performance.ceiling_m
            );
            let remedy =
                "give levels_m below their ceiling_m, and a floor_m that is not above the ground";
            return Err(self.source.error(levels_span, cause, remedy));
        }
        Ok(())
    }

    /// Returns how much farther from each other two airplanes of a model have to start, because of errors: they are
    /// perceived at other places, and their orbits are wider.
    fn error_margin_m(&self, model: &AircraftModel) -> f64 {
        let position_m = self.position_error(None).bound_m;
        let bounds = ErrorBounds { position_m, ..self.error_bounds() };
        let dt_s = self.file.airspace.dt_s.as_ref().map_or(5.0, |v| v.get_ref().get());
        let Some(rate_rad_s) = bounds.max_orbit_rate_rad_s(model, dt_s) else { return 0.0 };
        let wider_m = model.v_m_s / rate_rad_s - model.turn_radius_m();
        // Two orbits, each with a diameter that grows by twice the radius.
        4.0 * wider_m + 2.0 * bounds.position_m + 2.0 * bounds.error_m(model.v_m_s, dt_s)
    }
}

#[cfg(test)]
mod tests {
    use crate::flight::{AirplaneStart, FlightTask};
    use crate::scenario::CompiledAirspace;
    use sidestep_scenario::Source;

    fn compiled(keys: &str) -> Result<CompiledAirspace, String> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = 7\n[airspace]\nvertical_m = 305.0\n\
             [airspace.generator]\n{keys}\n[airplane]\nv_m_s = 135.0\nomega_max_deg_s = 1.5\n\
             separation_m = 5556.0\nclimb_max_m_s = 20.0\nceiling_m = 12000.0\n"
        );
        CompiledAirspace::new(&Source::new("g", text, "")).map_err(|error| error.to_string())
    }

    fn airplanes(keys: &str) -> Vec<AirplaneStart> {
        compiled(keys).expect("a scenario").world.airplanes.to_vec()
    }

    #[test]
    fn a_terminal_area_has_departures_arrivals_and_overflights_within_its_ranges() {
        let keys = "kind = \"terminal\"\nn = 40\narrivals = 12\noverflights = 8\n\
                    departure_interval_s = 100.0\nlevels_m = [3050.0, 6100.0]\n\
                    speeds_m_s = [110.0, 160.0]\nclimbs_m_s = [6.0, 12.0]";
        let all = airplanes(keys);
        let named = |start: &str| {
            let of = |one: &&AirplaneStart| {
                one.callsign.as_ref().is_some_and(|callsign| callsign.starts_with(start))
            };
            all.iter().filter(of).collect::<Vec<_>>()
        };
        let [departures, arrivals, overflights] = ["DEP", "ARR", "OVR"].map(named);
        assert_eq!([departures.len(), arrivals.len(), overflights.len()], [20, 12, 8]);
        let order_of = |one: &AirplaneStart| match &one.orders[..] {
            [order] => match order.task {
                FlightTask::Altitude { altitude_m, climb_m_s } => {
                    assert!((6.0..=12.0).contains(&climb_m_s) && order.at_s >= one.appears_s);
                    altitude_m
                }
                _ => panic!("{order:?}"),
            },
            // An overflight whose two levels are one.
            _ => one.altitude_m,
        };
        for one in &all {
            assert!((110.0..=160.0).contains(&one.model.v_m_s));
        }
        for one in &departures {
            assert_eq!((one.start.at, one.altitude_m), ([0.0; 2], 0.0));
            assert!((3050.0..=6100.0).contains(&order_of(one)));
        }
        for pair in departures.windows(2) {
            let between_s = pair[1].appears_s - pair[0].appears_s;
            assert!((60.0..=140.0).contains(&between_s), "{between_s}");
        }
        for one in &arrivals {
            assert!(order_of(one) < 3050.0 && order_of(one) >= 0.3 * 3050.0);
        }
        for one in arrivals.iter().chain(&overflights) {
            assert!((3050.0..=6100.0).contains(&one.altitude_m));
            let level = one.altitude_m / 305.0;
            assert!((level - level.round()).abs() < 1e-9, "{level}");
        }
    }

    #[test]
    fn a_terminal_area_has_defaults_for_all_keys_but_the_number_and_grows_with_it() {
        let few = airplanes("kind = \"terminal\"\nn = 10");
        let starts = |start: &str| {
            let of = |one: &&AirplaneStart| {
                one.callsign.as_ref().is_some_and(|callsign| callsign.starts_with(start))
            };
            few.iter().filter(of).count()
        };
        assert_eq!(["DEP", "ARR", "OVR"].map(starts), [4, 3, 3]);
        assert_ne!(few, airplanes("kind = \"terminal\"\nn = 10\nradius_m = 80000.0"));
        assert_eq!(few, airplanes("kind = \"terminal\"\nn = 10"));
    }

    #[test]
    fn mistakes_of_a_generator_say_what_would_be_right() {
        for (keys, cause, remedy) in [
            ("kind = \"random\"\nn = 4\narrivals = 2", "arrivals", "terminal"),
            ("kind = \"streams\"\nn = 4\nlevels_m = [900, 1800]", "levels_m", "terminal"),
            ("kind = \"terminal\"\nn = 4\njitter_m = 5.0", "jitter_m", "terminal"),
            ("kind = \"terminal\"\nn = 4\narrivals = 5", "5 arrivals", "larger n"),
            (
                "kind = \"terminal\"\nn = 4\nlevels_m = [6100, 3050]",
                "levels_m from 6100 to 3050",
                "levels_m = [3050.0, 6100.0]",
            ),
            (
                "kind = \"terminal\"\nn = 4\nlevels_m = [3060, 3100]",
                "no level",
                "levels_m from 1220",
            ),
            ("kind = \"terminal\"\nn = 4\nclimbs_m_s = [6, 25]", "up to 25", "climbs_m_s up to 20"),
            ("kind = \"terminal\"\nn = 4\nlevels_m = [3050, 15250]", "15250 m", "ceiling_m"),
            (
                "kind = \"terminal\"\nn = 400\nradius_m = 9000.0\narrival_interval_s = 1.0\narrivals = 280",
                "no place is left",
                "longer arrival_interval_s",
            ),
        ] {
            let error = compiled(keys).expect_err(keys);
            assert!(error.contains(cause) && error.contains(remedy), "{keys}: {error}");
        }
    }
}
