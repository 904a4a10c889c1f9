//! The extent of flights, and what was kept of a file.

use super::{Sample, Track, format_utc};
use crate::local_plane::{self, wrap_deg};
use crate::report::ImportReport;

/// Adds the extent in time and space of flights to a report, and how many there are.
pub(super) fn describe(report: &mut ImportReport, tracks: &[Track]) {
    let samples = || tracks.iter().flat_map(|track| &track.samples);
    let [begin_s, end_s] = range(samples().map(|sample| sample.time_s));
    let duration_s = end_s - begin_s;
    report.add_fact(
        "time",
        format!("{} to {} ({duration_s:.0} s)", format_utc(begin_s), format_utc(end_s)),
    );
    report.add_fact("extent", extent(&samples().copied().collect::<Vec<_>>()));
    let [low_ft, high_ft] = range(samples().map(|sample| sample.altitude_ft));
    report.add_fact("altitude", format!("{low_ft:.0} to {high_ft:.0} ft"));
    let with_speed = samples().filter(|sample| sample.ground_speed_kt.is_some()).count();
    let [slow_kt, fast_kt] = range(samples().filter_map(|sample| sample.ground_speed_kt));
    report.add_fact(
        "speed",
        match with_speed {
            0 => "not in the file".to_string(),
            n => format!("{slow_kt:.0} to {fast_kt:.0} kt in {n} rows"),
        },
    );
    report.add_kept("flights", tracks.len());
    report.add_kept("rows", samples().count());
}

/// Returns the least and the greatest latitude and longitude; across the date line where that is shorter.
fn extent(samples: &[Sample]) -> String {
    let positions = || samples.iter().map(|sample| sample.position);
    let middle_deg = local_plane::center(positions()).map_or(0.0, |center| center.lon_deg);
    let [south, north] = range(positions().map(|at| at.lat_deg));
    let [west, east] = range(positions().map(|at| wrap_deg(at.lon_deg - middle_deg)));
    let [west, east] = [west, east].map(|deg| wrap_deg(deg + middle_deg));
    format!("latitude {south:.4} to {north:.4}, longitude {west:.4} to {east:.4}")
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}
