//! Bodies of any shape in the plane and in space: obstacles, chains of discs and rods, trails.
//!
//! ```text
//! plane.rs    seen from above, with axes in meters
//! space.rs    in parallel projection, far things first
//! ```

mod plane;
mod space;

pub(crate) use space::{RIGHT, TO_EYE, UP};

use crate::error::DrawError;
use crate::legend::{Entry, Symbol};
use crate::style::{Style, series_color};

/// The most bodies, connectors and points of trails together.
const MOST_PARTS: u64 = 1 << 22;
/// Beyond this, in meters, pictures say nothing.
const FURTHEST_M: f64 = 1e9;
/// The time whose way a moving body's arrow shows, in seconds.
const ARROW_S: f64 = 1.0;
/// Chains and trails beyond this have no line in the legend.
const MOST_NAMED: usize = 10;

/// A shape in `D` (2 or 3) dimensions, in meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape<const D: usize> {
    /// A disc or a sphere.
    Ball {
        /// Its middle.
        center: [f64; D],
        /// Its radius.
        radius_m: f64,
    },
    /// All points within a radius of a segment; a wall where the radius is 0.
    Capsule {
        /// Ends of the segment.
        ends: [[f64; D]; 2],
        /// Its radius.
        radius_m: f64,
    },
    /// A box.
    Cuboid {
        /// Its middle.
        center: [f64; D],
        /// Directions of its edges: unit vectors, each perpendicular to the others.
        axes: [[f64; D]; D],
        /// Half its extent along each of them.
        half_m: [f64; D],
    },
}

/// An obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle<const D: usize> {
    /// What it is.
    pub shape: Shape<D>,
    /// Where it moves, in m/s; zero where it does not. Drawn as an arrow as long as the way of a
    /// second.
    pub velocity_m_s: [f64; D],
}

/// Discs or spheres joined by rods; the first one leads.
#[derive(Debug, Clone, PartialEq)]
pub struct Strand<const D: usize> {
    /// The middles of its connectors, the leader first.
    pub points: Vec<[f64; D]>,
    /// Radius of the connectors.
    pub connector_radius_m: f64,
    /// Radius of the rods.
    pub rod_radius_m: f64,
    /// Its line in the legend; may be empty.
    pub label: String,
}

/// A way that something took, as a thin line.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail<const D: usize> {
    /// Where it was.
    pub points: Vec<[f64; D]>,
    /// The number of its color: that of the strand of this number.
    pub color: usize,
    /// Its line in the legend; may be empty.
    pub label: String,
}

/// Obstacles, chains and trails, in the plane (`D = 2`) or in space (`D = 3`).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyScene<const D: usize> {
    /// Things in the way.
    pub obstacles: Vec<Obstacle<D>>,
    /// Chains; the number of a chain is its color.
    pub strands: Vec<Strand<D>>,
    /// Ways, under the chains.
    pub trails: Vec<Trail<D>>,
    /// Lower and upper corner of what is shown, in meters; all that there is where not given.
    pub view_m: Option<[[f64; D]; 2]>,
    /// Heading of the picture; may be empty.
    pub title: String,
    /// Small print under the picture; may be empty.
    pub caption: String,
}

impl BodyScene<2> {
    /// Draws the scene from above, with axes in meters: what stands still dark, what moves light
    /// with an arrow, chains in color with a ring for the leader.
    ///
    /// # Errors
    /// [`DrawError::Value`] for coordinates and sizes that are not finite, negative radii, a view
    /// that is empty, an impossible style; [`DrawError::TooLarge`] above four million parts.
    pub fn to_svg(&self, style: &Style) -> Result<String, DrawError> {
        plane::draw(self, style)
    }
}

impl BodyScene<3> {
    /// Draws the scene in parallel projection, from the side of low x, high y and from above:
    /// lengths across the picture are alike near and far. Far things are drawn first and paler;
    /// obstacles are translucent, so that a chain among them stays visible.
    ///
    /// # Errors
    /// As for the plane.
    pub fn to_svg(&self, style: &Style) -> Result<String, DrawError> {
        space::draw(self, style)
    }
}

impl<const D: usize> Shape<D> {
    /// Points whose box, grown by the radius, holds the shape.
    fn marks(&self) -> (Vec<[f64; D]>, f64) {
        match self {
            Self::Ball { center, radius_m } => (vec![*center], *radius_m),
            Self::Capsule { ends, radius_m } => (ends.to_vec(), *radius_m),
            Self::Cuboid { .. } => (self.corners(), 0.0),
        }
    }

    /// The corners of a box; of another shape none. Bit `i` of a corner's number tells on which
    /// side along axis `i` it is.
    fn corners(&self) -> Vec<[f64; D]> {
        let Self::Cuboid { center, axes, half_m } = self else { return Vec::new() };
        let corner = |bits: usize| {
            let side = |i: usize| if bits >> i & 1 == 1 { half_m[i] } else { -half_m[i] };
            (0..D).fold(*center, |at, i| std::array::from_fn(|k| at[k] + side(i) * axes[i][k]))
        };
        (0..1 << D).map(corner).collect()
    }

    fn middle(&self) -> [f64; D] {
        match self {
            Self::Ball { center, .. } | Self::Cuboid { center, .. } => *center,
            Self::Capsule { ends: [a, b], .. } => std::array::from_fn(|k| 0.5 * (a[k] + b[k])),
        }
    }
}

impl<const D: usize> Obstacle<D> {
    fn moves(&self) -> bool {
        self.velocity_m_s.iter().any(|&v| v != 0.0)
    }

    /// Where the arrow of a moving body begins and ends.
    fn arrow(&self) -> [[f64; D]; 2] {
        let from = self.shape.middle();
        [from, std::array::from_fn(|k| from[k] + ARROW_S * self.velocity_m_s[k])]
    }
}

impl<const D: usize> BodyScene<D> {
    fn check(&self) -> Result<(), DrawError> {
        let points = self.strands.iter().map(|s| s.points.len());
        let points = points.chain(self.trails.iter().map(|t| t.points.len())).sum::<usize>();
        let found = (points + self.obstacles.len()) as u64;
        if found > MOST_PARTS {
            return Err(DrawError::TooLarge { what: "bodies", found, limit: MOST_PARTS });
        }
        for obstacle in &self.obstacles {
            check_shape(&obstacle.shape)?;
            check_point(&obstacle.velocity_m_s)?;
        }
        for strand in &self.strands {
            check_size(strand.connector_radius_m)?;
            check_size(strand.rod_radius_m)?;
            strand.points.iter().try_for_each(check_point)?;
        }
        self.trails.iter().flat_map(|t| &t.points).try_for_each(check_point)
    }

    /// Lower and upper corner of what is shown; never empty.
    fn shown(&self) -> Result<[[f64; D]; 2], DrawError> {
        let [lo, hi] = match self.view_m {
            Some(view) => view,
            None => self.extent(),
        };
        check_point(&lo)?;
        check_point(&hi)?;
        for k in 0..D {
            DrawError::positive("extent of what is shown in m", hi[k] - lo[k])?;
        }
        Ok([lo, hi])
    }

    /// A box around everything, with a small margin.
    fn extent(&self) -> [[f64; D]; 2] {
        let (mut lo, mut hi) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        let mut hold = |p: &[f64; D], by_m: f64| {
            for k in 0..D {
                lo[k] = lo[k].min(p[k] - by_m);
                hi[k] = hi[k].max(p[k] + by_m);
            }
        };
        for obstacle in &self.obstacles {
            let (marks, radius_m) = obstacle.shape.marks();
            marks.iter().for_each(|p| hold(p, radius_m));
        }
        for strand in &self.strands {
            strand.points.iter().for_each(|p| hold(p, strand.connector_radius_m));
        }
        self.trails.iter().flat_map(|t| &t.points).for_each(|p| hold(p, 0.0));
        if lo[0] > hi[0] {
            return [[0.0; D], [1.0; D]];
        }
        let longest_m = (0..D).map(|k| hi[k] - lo[k]).fold(0.0, f64::max);
        let margin_m = if longest_m > 0.0 { 0.03 * longest_m } else { 0.5 };
        [lo.map(|x| x - margin_m), hi.map(|x| x + margin_m)]
    }

    /// The legend: only what the picture has. `looks` are those of what stands still and moves.
    fn entries(&self, [still, moving]: [Symbol; 2]) -> Vec<Entry> {
        let some = |moving| self.obstacles.iter().any(|o| o.moves() == moving);
        let leads = self.strands.iter().any(|s| !s.points.is_empty());
        let kinds = [
            (some(false), still, "obstacle"),
            (some(true), moving, "moving obstacle (arrow: way of 1 s)"),
            (leads, Symbol::Ring, "leader"),
        ];
        let shown = kinds.into_iter().filter(|(present, ..)| *present);
        let mut entries: Vec<Entry> =
            shown.map(|(_, symbol, words)| Entry::new(symbol, words)).collect();
        let line = |index, label: &String| {
            Entry::new(Symbol::Line { color: series_color(index), marker: None }, label)
        };
        let strands = self.strands.iter().enumerate().map(|(k, s)| line(k, &s.label));
        let trails = self.trails.iter().map(|t| line(t.color, &t.label));
        entries.extend(strands.chain(trails).take(MOST_NAMED));
        entries
    }
}

fn check_shape<const D: usize>(shape: &Shape<D>) -> Result<(), DrawError> {
    if let Shape::Cuboid { axes, half_m, .. } = shape {
        axes.iter().try_for_each(check_point)?;
        half_m.iter().try_for_each(|&m| check_size(m))?;
    }
    let (marks, radius_m) = shape.marks();
    check_size(radius_m)?;
    marks.iter().try_for_each(check_point)
}

fn check_point<const D: usize>(p: &[f64; D]) -> Result<(), DrawError> {
    match p.iter().find(|x| !(-FURTHEST_M..=FURTHEST_M).contains(*x)) {
        None => Ok(()),
        Some(&value) => {
            Err(DrawError::Value { what: "a coordinate in m", value, must: "from -1e9 to 1e9" })
        }
    }
}

fn check_size(value: f64) -> Result<(), DrawError> {
    match (0.0..=FURTHEST_M).contains(&value) {
        true => Ok(()),
        false => Err(DrawError::Value { what: "a size in m", value, must: "from 0 to 1e9" }),
    }
}

/// Points in pixels without those that nobody could tell from the one before.
fn thinned(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    const APART_PX: f64 = 0.7;
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut last = None;
    for (x, y) in points {
        let is_apart = |&(a, b): &(f64, f64)| (x - a).abs().max(y - b).max(b - y) >= APART_PX;
        last = Some((x, y));
        if kept.last().is_none_or(is_apart) {
            kept.push((x, y));
            last = None;
        }
    }
    kept.extend(last);
    kept
}
