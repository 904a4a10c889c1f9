//! Surveillance: what each airplane knows of others by the reports that it has received.
//!
//! Without `[airspace.surveillance]` all see all others in every cycle, at once, and with the errors of positions that
//! all share. With it each airplane is an *observer* of its own:
//!
//! - *Reports.* Every airplane sends a report of its state at fixed times: position, velocity over the ground, altitude
//!   and rate of climb, with the errors of its own navigation (`nac_p`, `nac_v`), which all who receive it share.
//! - *Reception.* Whether an observer receives a report is one draw, from the observer, the airplane and the time. So
//!   nothing is kept of a pair: the last report that an observer has received is found from the latest one backward, and
//!   the state keeps nothing but the past of each airplane (`state_vector.rs`).
//! - *Tracks.* An observer extrapolates the last report, with the errors of its own sensor, to the present
//!   (`track.rs`). A track whose report is older than the coast time is dropped: the observer does not see that airplane.
//!
//! **Who uses it.** Methods by which each airplane decides by itself from the positions of others (`mvp`, `orca`,
//! `bands` and a program's own), where no agents send positions to each other; and what callers of
//! `external` observe. Airplanes
//! that optimize together tell each other their states, so `pc` and all agents know those of their group exactly, and so
//! does the shield: its clearances are a link of its own. Of *non-cooperative* airplanes a group knows the latest report
//! that any of it has received, because its members tell each other that, too.
//!
//! **The shield's promise** beside non-cooperative airplanes rests on where they can be (`src/avoid.rs`). The bound on
//! the error of a track grows with its age `a`: since the report the airplane may have flown `s a` at its greatest speed
//! `s` in the common air, which contains the largest drift of any air by any rule of the scenario, and the track was
//! moved on by `v a` at the reported velocity; where rules change the common wind, that has carried it by up to `w a`
//! otherwise. So it is within `E + (s + v + w) a` of its track, where `E` bounds the errors of the report. One of which nobody in the group has a track cannot be avoided. The run, which
//! knows where it is, names each pair with it before that pair may lose separation.

mod observation_counts;
mod observations;
mod perceived_traffic;
mod report_archive;
mod state_report;
mod state_vector;
#[cfg(test)]
mod tests;
mod track;

pub use observation_counts::ObservationCounts;
pub(crate) use observations::{GroupObservations, each_decides_by_tracks};
pub(crate) use perceived_traffic::PerceivedTraffic;
pub(crate) use state_report::present_state;
pub use state_vector::{StateVector, StateVectorHistory};
pub(crate) use track::SurveillanceTrack;
