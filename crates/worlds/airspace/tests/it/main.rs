//! Tests of the airspace from outside, in one program: each program of tests takes seconds to link.

mod agents;
mod approaches;
mod areas;
mod bluesky;
mod bluesky_files;
mod bluesky_flights;
mod bluesky_resolutions;
mod bluesky_wide;
mod earth;
mod networks;
mod winds;
