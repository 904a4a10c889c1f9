//! How the air of an airplane moves relative to that of others.

use crate::flight::Point;
use sidestep_kernel::geometry::{add_scaled, norm, scaled};

/// How the air of an airplane moves relative to the air in which it is compared with others; 0 where all are in one wind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AirDrift {
    /// During this `dt`, in meters per second.
    pub now_m_s: Point,
    /// After it, on the level that the airplane is on then, in meters per second.
    pub next_m_s: Point,
    /// Whether it is another one in other places.
    pub varies_by_place: bool,
}

impl AirDrift {
    /// Returns the greatest speed of the air, in meters per second.
    pub(super) fn max_speed_m_s(&self) -> f64 {
        norm(self.now_m_s).max(norm(self.next_m_s))
    }

    /// Returns the drift of a path that begins now.
    pub(super) fn drift_from_now(&self, dt_s: f64) -> PathDrift {
        PathDrift { now_m_s: self.now_m_s, now_until_s: dt_s, ..self.drift_after_cycle(0.0) }
    }

    /// Returns the drift of a path that begins at the end of a `dt` of so many seconds.
    pub(super) fn drift_after_cycle(&self, dt_s: f64) -> PathDrift {
        PathDrift {
            offset_m: scaled(self.now_m_s, dt_s),
            now_m_s: [0.0; 2],
            now_until_s: 0.0,
            next_m_s: self.next_m_s,
        }
    }
}

/// The drift of the air of a path, with times from the start of the path.
#[derive(Debug, Clone, Copy)]
pub(super) struct PathDrift {
    /// How far the air has moved when the path begins, in meters.
    offset_m: Point,
    now_m_s: Point,
    /// When the airplane comes into the next wind, in seconds.
    pub(super) now_until_s: f64,
    pub(super) next_m_s: Point,
}

impl PathDrift {
    /// Returns how far the air has moved after some seconds of the path, in meters.
    pub(super) fn at_m(&self, t_s: f64) -> Point {
        let now_s = t_s.min(self.now_until_s);
        let by_now_m = add_scaled(self.offset_m, self.now_m_s, now_s);
        add_scaled(by_now_m, self.next_m_s, t_s - now_s)
    }

    pub(super) fn max_speed_m_s(&self) -> f64 {
        norm(self.now_m_s).max(norm(self.next_m_s))
    }
}
