//! Aircraft on the ground in files that say neither that nor how fast they are: before they take off and after they land,
//! their rows hardly move.

use super::columns::NAUTICAL_MILE_M;
use super::plausibility::distance_m;
use super::rows::Row;

/// The shortest time in s over which rows tell a speed: noise of positions is some 10 m.
const MIN_STEP_S: f64 = 30.0;

/// Returns for each row of an aircraft whether it is on the ground by the places of the rows around it: it is slower than
/// the limit at the begin or the end of a part without gaps. On the way slow rows are frozen ones.
pub(super) fn stands_by_rows(rows: &[Row], limit_kt: f64, max_gap_s: f64) -> Vec<bool> {
    let mut stands = Vec::with_capacity(rows.len());
    let is_together = |a: &Row, b: &Row| b.sample.time_s - a.sample.time_s <= max_gap_s;
    for part in rows.chunk_by(is_together) {
        let has_neither = part
            .iter()
            .all(|row| row.sample.ground_speed_kt.is_none() && row.is_on_ground.is_none());
        let mut part_stands = vec![false; part.len()];
        if has_neither {
            let limit_m_s = limit_kt * NAUTICAL_MILE_M / 3600.0;
            let first = slow_count(part.iter(), limit_m_s);
            let last = slow_count(part.iter().rev(), limit_m_s);
            part_stands[..first].fill(true);
            part_stands[part.len() - last..].fill(true);
        }
        stands.append(&mut part_stands);
    }
    stands
}

/// Returns how many of the first rows are slow, each up to the first row that is long enough after it; all where the
/// aircraft never moves.
fn slow_count<'a>(rows: impl Iterator<Item = &'a Row> + Clone, limit_m_s: f64) -> usize {
    let mut later = rows.clone();
    let mut to = later.next();
    let mut count = 0;
    for from in rows.clone() {
        let step_s = |to: &Row| (to.sample.time_s - from.sample.time_s).abs();
        while to.is_some_and(|row| step_s(row) < MIN_STEP_S) {
            to = later.next();
        }
        let Some(row) = to else {
            // Too little time is left to tell.
            return if count > 0 { rows.count() } else { 0 };
        };
        if distance_m(from.sample.position, row.sample.position) >= limit_m_s * step_s(row) {
            return count;
        }
        count += 1;
    }
    count
}
