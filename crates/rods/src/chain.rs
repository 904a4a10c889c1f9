//! The chain: connectors joined by rods (slides V1 to V7, K1 to K6).
//!
//! A rod's length is never stored: it is the distance between its ends (V7), so that it cannot disagree
//! with them.

use super::geometry::{self, Point, angle_between_rad, distance, dot, norm, sub};
use super::veto::VetoReason;
use sidestep_kernel::InputError;
use std::f64::consts::{PI, SQRT_2};
use std::ops::Range;

/// Tolerance of the rods' lengths, meters. One motion keeps lengths to about 1e-14 m, so a tolerance far above rounding
/// refuses no motion, and errors of many motions do not add up because each one sets the length anew.
pub const LENGTH_TOLERANCE_M: f64 = 1e-9;
/// Clearance that a turn aims at, meters. It is a hundred times the tolerance: a master that touches a wall blocks a
/// half-plane of directions, and with equal values it counts as inside the wall in the next step, which is a veto.
pub const SKIN_M: f64 = 1e-7;

/// Largest coordinate: farther from the origin, rounding is no longer small against the tolerances.
pub const MAX_COORDINATE_M: f64 = 1e6;

/// Returns whether a connector may be at a point at all: the point must be finite, and at most 1e6 m
/// from the origin along every axis.
pub fn is_in_range<const D: usize>(point: &Point<D>) -> bool {
    point.iter().all(|x| x.abs() <= MAX_COORDINATE_M)
}

/// Returns the error for a target that no connector can be sent to.
pub(super) fn out_of_range<const D: usize>(target: &Point<D>) -> InputError {
    InputError::new("target", format!("is {target:?}"), "give finite coordinates up to 1e6 m")
}

/// Constraint on the places of a connector (slide K1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mobility<const D: usize> {
    /// Anywhere.
    Free,
    /// The segment between two points.
    OnSegment([Point<D>; 2]),
    /// A plane, in two dimensions a line: `normal . x = offset_m`. The normal has length 1.
    OnPlane {
        /// Unit vector perpendicular to the plane.
        normal: Point<D>,
        /// Distance of the plane from the origin along the normal, meters.
        offset_m: f64,
    },
    /// Inside a box along the axes.
    InBox {
        /// Lower corner.
        lo: Point<D>,
        /// Upper corner.
        hi: Point<D>,
    },
    /// Nowhere else, as the base of an arm (slide R7).
    Fixed,
}

impl<const D: usize> Mobility<D> {
    /// Returns the allowed point nearest to `p`; `at` is the connector's present place.
    pub fn project(&self, p: Point<D>, at: Point<D>) -> Point<D> {
        match self {
            Self::Free => p,
            Self::OnSegment([a, b]) => geometry::nearest_on_segment(p, *a, *b),
            Self::OnPlane { normal, offset_m } => {
                geometry::add_scaled(p, *normal, offset_m - dot(*normal, p))
            }
            Self::InBox { lo, hi } => std::array::from_fn(|i| p[i].clamp(lo[i], hi[i])),
            Self::Fixed => at,
        }
    }

    /// Returns whether `p` is allowed, within 1e-9 m.
    pub fn allows(&self, p: Point<D>, at: Point<D>) -> bool {
        matches!(self, Self::Free) || distance(self.project(p, at), p) <= LENGTH_TOLERANCE_M
    }
}

/// A ball joint between two rods, or an end of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Connector<const D: usize> {
    /// Radius of its body, meters.
    pub radius_m: f64,
    /// Constraint on its place.
    pub mobility: Mobility<D>,
    /// Whether it has broken down and stays where it is (slide R8).
    pub failed: bool,
    /// The greatest angle between the directions of its rods, in (0, pi]; pi = any (slide K6).
    pub max_bend_rad: f64,
}

impl<const D: usize> Connector<D> {
    /// Returns a connector that may go anywhere and bend without limit.
    pub fn free(radius_m: f64) -> Self {
        Self { radius_m, mobility: Mobility::Free, failed: false, max_bend_rad: PI }
    }

    /// Returns whether it never moves: fixed, or failed.
    pub fn is_still(&self) -> bool {
        self.failed || self.mobility == Mobility::Fixed
    }

    /// Returns the reason for which a connector that never moves objects.
    pub(super) fn still_reason(&self) -> VetoReason {
        if self.failed { VetoReason::Failed } else { VetoReason::Fixed }
    }

    fn is_plain(&self) -> bool {
        !self.failed && self.mobility == Mobility::Free && self.max_bend_rad >= PI
    }
}

/// A link of two connectors: a distance within limits (slides V3, K2, K3, K5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rod {
    /// Least length, meters; above 0.
    pub min_m: f64,
    /// Greatest length, meters; equal to the least for a rod of fixed length.
    pub max_m: f64,
    /// Radius of its body, meters; at most that of the connectors at its ends. It should be well
    /// below theirs for swarms, whose rods are virtual, because thick rods make slaves jump.
    pub radius_m: f64,
}

impl Rod {
    /// Returns a rod of one length; its radius is at most that of its connectors.
    #[inline]
    pub fn with_fixed_length(length_m: f64, radius_m: f64) -> Self {
        Self { min_m: length_m, max_m: length_m, radius_m }
    }
}

/// A chain of `n` rods and `n + 1` connectors.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain<const D: usize> {
    points: Vec<Point<D>>,
    connectors: Vec<Connector<D>>,
    rods: Vec<Rod>,
    /// Number of connectors that are not free, have failed, or have a bend limit.
    special: usize,
    measures: FixedMeasures,
}

/// Fraction of its greatest length below which the least length of a rod means that its ends can meet.
const CLOSABLE_FRACTION: f64 = 1e-3;

/// Returns the least of radii and rod lengths. Rods that can close would make every sub-step tiny, so they
/// count only where there is nothing else.
fn smallest_part_m(rods: &[Rod], radii: impl Iterator<Item = f64>) -> f64 {
    let open = rods.iter().filter(|rod| !can_retract_fully(rod)).map(|rod| rod.min_m);
    let min_m = open.chain(radii).fold(f64::INFINITY, f64::min);
    if min_m.is_finite() {
        return min_m;
    }
    rods.iter().map(|rod| rod.min_m).fold(f64::INFINITY, f64::min)
}

/// Returns whether the ends of a rod can meet, or nearly so. A least length of 0 is not allowed, so the joints of
/// prismatic arms that retract to nothing have a tiny one.
fn can_retract_fully(rod: &Rod) -> bool {
    rod.min_m < CLOSABLE_FRACTION * rod.max_m
}

/// Measures that only new rods or radii change.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FixedMeasures {
    max_rod_m: f64,
    min_size_m: f64,
    max_radius_m: f64,
    max_rod_radius_m: f64,
    min_rod_m: f64,
}

impl<const D: usize> Chain<D> {
    /// Returns a chain with its connectors at `points`.
    ///
    /// # Errors
    /// When counts do not match, numbers are not finite or not in range, neighbors coincide, or
    /// rods are outside their limits (the place names the connector or rod).
    pub fn new(
        points: Vec<Point<D>>,
        connectors: Vec<Connector<D>>,
        rods: Vec<Rod>,
    ) -> Result<Self, InputError> {
        let chain = Self::new_broken(points, connectors, rods)?;
        if let Some(i) = (0..chain.rods.len()).find(|&i| !chain.is_rod_within_limits(i)) {
            return Err(InputError::new(
                format!("chain, rod {i}"),
                format!(
                    "its ends are {} m apart, which is outside [{}, {}] m",
                    chain.length_m(i),
                    chain.rods[i].min_m,
                    chain.rods[i].max_m
                ),
                "move its connectors or widen its limits",
            ));
        }
        Ok(chain)
    }

    /// Returns some connectors and the rods between them as a chain of its own; these rods need not be within their limits.
    ///
    /// # Errors
    /// When two neighbors are at the same place.
    ///
    /// # Panics
    /// If the chain does not have these connectors.
    pub fn part(&self, connectors: Range<usize>) -> Result<Self, InputError> {
        let rods = connectors.start..connectors.end.saturating_sub(1).max(connectors.start);
        Self::new_broken(
            self.points[connectors.clone()].to_vec(),
            self.connectors[connectors].to_vec(),
            self.rods[rods].to_vec(),
        )
    }

    /// Returns a chain whose rods need not be within their limits yet, because it is to be
    /// re-formed.
    ///
    /// # Errors
    /// As [`Self::new`], except for the lengths.
    pub fn new_broken(
        points: Vec<Point<D>>,
        connectors: Vec<Connector<D>>,
        rods: Vec<Rod>,
    ) -> Result<Self, InputError> {
        check_counts(&points, &connectors, &rods)?;
        for (i, (point, connector)) in points.iter().zip(&connectors).enumerate() {
            check_connector(i, point, connector)?;
        }
        for i in 0..rods.len() {
            check_rod(i, &rods[i], [&connectors[i], &connectors[i + 1]])?;
            // The direction of a rod without length is undefined, and a slave is led along it.
            if points[i] == points[i + 1] {
                return Err(InputError::new(
                    format!("chain, connector {}", i + 1),
                    format!("is at the same place as connector {i}"),
                    "merge the two, or move them apart",
                ));
            }
        }
        let special = connectors.iter().filter(|c| !c.is_plain()).count();
        let max_rod_m = rods.iter().map(|r| r.max_m).fold(0.0, f64::max);
        let radii = connectors.iter().map(|c| c.radius_m).filter(|&r| r > 0.0);
        let min_size_m = smallest_part_m(&rods, radii);
        let max_radius_m = connectors.iter().map(|c| c.radius_m).fold(0.0, f64::max);
        let measures = FixedMeasures {
            max_rod_m,
            min_size_m,
            max_radius_m,
            max_rod_radius_m: rods.iter().map(|rod| rod.radius_m).fold(0.0, f64::max),
            min_rod_m: rods.iter().map(|rod| rod.min_m).fold(f64::INFINITY, f64::min),
        };
        Ok(Self { points, connectors, rods, special, measures })
    }

    /// Returns a chain of equal rods and connectors, straight from `start` along the unit vector
    /// `u`, every rod at its greatest length.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn straight(
        start: Point<D>,
        u: Point<D>,
        n_rods: usize,
        rod: Rod,
        connector: Connector<D>,
    ) -> Result<Self, InputError> {
        let along_m = (0..=n_rods).map(|i| rod.max_m * i as f64);
        let points = along_m.map(|along_m| geometry::add_scaled(start, u, along_m)).collect();
        Self::new(points, vec![connector; n_rods + 1], vec![rod; n_rods])
    }

    /// Returns a chain of connector `k` alone, in which moves and steps count as in this one.
    pub(super) fn single_connector(&self, k: usize) -> Self {
        let connector = self.connectors[k];
        Self {
            points: vec![self.points[k]],
            connectors: vec![connector],
            rods: Vec::new(),
            special: usize::from(!connector.is_plain()),
            measures: self.measures,
        }
    }

    /// Returns the positions of the connectors along the chain, meters.
    pub fn points(&self) -> &[Point<D>] {
        &self.points
    }

    /// Returns the positions of all connectors, for a caller that itself keeps rods, bends and mobilities
    /// within their limits: none is checked.
    pub fn points_mut(&mut self) -> &mut [Point<D>] {
        &mut self.points
    }

    /// Returns the positions, to be changed, and the rods.
    pub(super) fn parts_mut(&mut self) -> (&mut [Point<D>], &[Rod]) {
        (&mut self.points, &self.rods)
    }

    /// Returns radius, constraints and state of the connectors; [`Self::points`] has their
    /// positions.
    pub fn connectors(&self) -> &[Connector<D>] {
        &self.connectors
    }

    /// Returns the rods; rod `i` joins connectors `i` and `i + 1`.
    pub fn rods(&self) -> &[Rod] {
        &self.rods
    }

    /// Returns the rod between two neighbors, given in any order.
    #[inline]
    pub fn rod_between(&self, i: usize, j: usize) -> Rod {
        self.rods[i.min(j)]
    }

    /// Returns the present length of a rod, meters: the distance of its ends.
    pub fn length_m(&self, rod: usize) -> f64 {
        distance(self.points[rod], self.points[rod + 1])
    }

    /// Returns whether a rod is within its limits, to a tolerance of `LENGTH_TOLERANCE_M`.
    pub fn is_rod_within_limits(&self, i: usize) -> bool {
        let rod = self.rods[i];
        let allowed = rod.min_m - LENGTH_TOLERANCE_M..=rod.max_m + LENGTH_TOLERANCE_M;
        allowed.contains(&self.length_m(i))
    }

    /// Returns the greatest amount by which a rod is outside its limits, meters; 0 if all are
    /// inside.
    pub fn max_rod_violation_m(&self) -> f64 {
        self.max_rod_violation_of_first_m(self.rods.len())
    }

    /// Returns the same of the first rods, meters.
    pub(super) fn max_rod_violation_of_first_m(&self, rods: usize) -> f64 {
        (0..rods).map(|i| self.rod_violation_m(i)).fold(0.0, f64::max)
    }

    /// Returns the amount by which a rod is outside its limits, meters; negative inside.
    fn rod_violation_m(&self, i: usize) -> f64 {
        let rod = self.rods[i];
        let length_m = self.length_m(i);
        (length_m - rod.max_m).max(rod.min_m - length_m)
    }

    /// Returns the angle between the directions of the rods at an inner connector, rad; `None` at
    /// the ends.
    pub fn bend_rad(&self, i: usize) -> Option<f64> {
        (i > 0 && i + 1 < self.points.len()).then(|| {
            let into = sub(self.points[i], self.points[i - 1]);
            angle_between_rad(into, sub(self.points[i + 1], self.points[i]))
        })
    }

    /// Returns the length below which a move counts as none, meters. A slave stays if it would move by
    /// less; with exact equality, rounding decides how far a motion propagates (in a chain of a million connectors
    /// it ended after 22 % of them).
    pub fn min_move_m(&self) -> f64 {
        1e-12 * self.measures.max_rod_m
    }

    /// Returns the longest sub-step of an initiator if anything may be in the way, meters: a quarter of
    /// the least rod or radius; rods that can close do not count. A rod reacts to obstacles only at the end of a
    /// sub-step, so a step of a small part of its size keeps the turns small that it then needs.
    pub fn step_m(&self) -> f64 {
        0.25 * self.measures.min_size_m
    }

    /// Returns the greatest length of any rod, meters.
    pub fn max_rod_m(&self) -> f64 {
        self.measures.max_rod_m
    }

    /// Returns the least length that a rod may have, meters; infinite without rods.
    pub(super) fn min_rod_m(&self) -> f64 {
        self.measures.min_rod_m
    }

    /// Returns the greatest radius of any part, meters; no rod is thicker than its connectors.
    pub(super) fn max_radius_m(&self) -> f64 {
        self.measures.max_radius_m
    }

    /// Returns a distance by which each rod of a stretch must lead forward along some direction, so that no two of its
    /// parts touch, meters. It makes room for a connector and a rod with one rod between them; two rods are no thicker,
    /// and between two connectors there are two rods.
    pub(super) fn neighbor_separation_m(&self) -> f64 {
        self.measures.max_radius_m + self.measures.max_rod_radius_m
    }

    /// Returns whether parts near each other along the chain keep their distances at every bend of up to a right angle:
    /// with one rod between them they are as far apart as it is long, and the ends of two rods the diagonal of a
    /// square.
    pub(super) fn clears_right_angles(&self) -> bool {
        let diagonal_m = SQRT_2 * self.measures.min_rod_m;
        self.neighbor_separation_m() <= self.measures.min_rod_m
            && 2.0 * self.measures.max_radius_m <= diagonal_m
    }

    /// Returns whether every connector is free and bends without limit.
    pub fn is_plain(&self) -> bool {
        self.special == 0
    }

    /// Marks a connector as failed, or as repaired (slide R8).
    pub fn set_connector_failed(&mut self, i: usize, failed: bool) {
        self.change(i, |c| c.failed = failed);
    }

    /// Gives a connector a new mobility (slide R10).
    ///
    /// # Errors
    /// When numbers are not finite, a normal is not of length 1, or a box has lo above hi.
    pub fn set_mobility(&mut self, i: usize, mobility: Mobility<D>) -> Result<(), InputError> {
        check_mobility(i, &mobility)?;
        self.change(i, |c| c.mobility = mobility);
        Ok(())
    }

    /// Gives a connector a new bend limit, rad, in (0, pi].
    ///
    /// # Errors
    /// When the limit is out of range.
    pub fn set_max_bend_rad(&mut self, i: usize, max_bend_rad: f64) -> Result<(), InputError> {
        check_bend_limit(i, max_bend_rad)?;
        self.change(i, |c| c.max_bend_rad = max_bend_rad);
        Ok(())
    }

    fn change(&mut self, i: usize, change: impl FnOnce(&mut Connector<D>)) {
        self.special -= usize::from(!self.connectors[i].is_plain());
        change(&mut self.connectors[i]);
        self.special += usize::from(!self.connectors[i].is_plain());
    }
}

fn check_counts<const D: usize>(
    points: &[Point<D>],
    connectors: &[Connector<D>],
    rods: &[Rod],
) -> Result<(), InputError> {
    if D != 2 && D != 3 {
        return Err(InputError::new("chain", format!("has {D} dimensions"), "use 2 or 3"));
    }
    if points.is_empty() || points.len() != connectors.len() || points.len() != rods.len() + 1 {
        return Err(InputError::new(
            "chain",
            format!(
                "has {} points, {} connectors and {} rods",
                points.len(),
                connectors.len(),
                rods.len()
            ),
            "both ends of a chain are connectors: give n rods, n + 1 connectors and their points",
        ));
    }
    Ok(())
}

fn check_connector<const D: usize>(
    i: usize,
    point: &Point<D>,
    connector: &Connector<D>,
) -> Result<(), InputError> {
    let place = format!("chain, connector {i}");
    if !is_in_range(point) {
        let cause = format!("is at {point:?}");
        return Err(InputError::new(place, cause, "give finite coordinates up to 1e6 m"));
    }
    if !(0.0..=MAX_COORDINATE_M).contains(&connector.radius_m) {
        let cause = format!("has radius {} m", connector.radius_m);
        return Err(InputError::new(place, cause, "give 0 to 1e6 m"));
    }
    check_bend_limit(i, connector.max_bend_rad)?;
    check_mobility(i, &connector.mobility)?;
    if !connector.mobility.allows(*point, *point) {
        let cause = format!("is at {point:?}, where its mobility does not allow it");
        return Err(InputError::new(place, cause, "move it, or change its mobility"));
    }
    Ok(())
}

fn check_bend_limit(i: usize, max_bend_rad: f64) -> Result<(), InputError> {
    if max_bend_rad > 0.0 && max_bend_rad <= PI {
        return Ok(());
    }
    Err(InputError::new(
        format!("chain, connector {i}"),
        format!("has a bend limit of {max_bend_rad} rad"),
        "give an angle above 0 and up to pi",
    ))
}

fn check_mobility<const D: usize>(i: usize, mobility: &Mobility<D>) -> Result<(), InputError> {
    let is_right = match mobility {
        Mobility::Free | Mobility::Fixed => true,
        Mobility::OnSegment(ends) => ends.iter().all(geometry::is_finite),
        Mobility::OnPlane { normal, offset_m } => {
            (norm(*normal) - 1.0).abs() < 1e-9 && offset_m.is_finite()
        }
        Mobility::InBox { lo, hi } => (0..D).all(|k| lo[k] <= hi[k]),
    };
    if is_right {
        return Ok(());
    }
    Err(InputError::new(
        format!("chain, connector {i}"),
        format!("has the mobility {mobility:?}"),
        "give finite points, a normal of length 1, a box whose lower corner is below the upper",
    ))
}

fn check_rod<const D: usize>(
    i: usize,
    rod: &Rod,
    ends: [&Connector<D>; 2],
) -> Result<(), InputError> {
    let place = format!("chain, rod {i}");
    if !(rod.min_m > 0.0 && rod.min_m <= rod.max_m && rod.max_m <= MAX_COORDINATE_M) {
        let cause = format!("has the limits [{}, {}] m", rod.min_m, rod.max_m);
        return Err(InputError::new(place, cause, "give 0 < min <= max <= 1e6 m"));
    }
    if !(rod.radius_m >= 0.0 && ends.iter().all(|c| rod.radius_m <= c.radius_m)) {
        let cause = format!(
            "has radius {} m, and its connectors have {} and {} m",
            rod.radius_m, ends[0].radius_m, ends[1].radius_m
        );
        return Err(InputError::new(place, cause, "make it at most as thick as its connectors"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain_of(points: Vec<[f64; 2]>, rod: Rod) -> Result<Chain<2>, InputError> {
        let n = points.len();
        Chain::new(points, vec![Connector::free(0.1); n], vec![rod; n.saturating_sub(1)])
    }

    #[test]
    fn wrong_chains_name_the_part() {
        let rod = Rod::with_fixed_length(1.0, 0.05);
        let place = |r: Result<Chain<2>, InputError>| r.unwrap_err().place().to_string();
        assert_eq!(place(chain_of(vec![], rod)), "chain");
        assert_eq!(place(chain_of(vec![[0.0, f64::NAN]], rod)), "chain, connector 0");
        assert_eq!(place(chain_of(vec![[0.0, 0.0], [0.0, 0.0]], rod)), "chain, connector 1");
        assert_eq!(place(chain_of(vec![[0.0, 0.0], [0.0, 2.0]], rod)), "chain, rod 0");
        let swapped = Rod { min_m: 2.0, max_m: 1.0, radius_m: 0.0 };
        assert_eq!(place(chain_of(vec![[0.0, 0.0], [0.0, 1.0]], swapped)), "chain, rod 0");
        let thick = Rod::with_fixed_length(1.0, 0.2);
        assert_eq!(place(chain_of(vec![[0.0, 0.0], [0.0, 1.0]], thick)), "chain, rod 0");
    }

    #[test]
    fn one_connector_alone_is_a_chain() {
        assert!(chain_of(vec![[1.0, 2.0]], Rod::with_fixed_length(1.0, 0.0)).is_ok());
    }

    #[test]
    fn constraints_come_and_go_while_it_runs() {
        let mut chain =
            chain_of(vec![[0.0, 0.0], [1.0, 0.0]], Rod::with_fixed_length(1.0, 0.05)).unwrap();
        assert!(chain.is_plain());
        chain.set_connector_failed(1, true);
        chain.set_mobility(1, Mobility::Fixed).unwrap();
        assert!(!chain.is_plain());
        chain.set_connector_failed(1, false);
        assert!(!chain.is_plain());
        chain.set_mobility(1, Mobility::Free).unwrap();
        assert!(chain.is_plain());
        assert!(chain.set_max_bend_rad(0, 0.0).is_err());
        let crooked = Mobility::OnPlane { normal: [1.0, 1.0], offset_m: 0.0 };
        assert!(chain.set_mobility(0, crooked).is_err());
    }
}
