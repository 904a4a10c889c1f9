//! The cost of a motion (slides P5, P6, E4): by the number of connectors, by how many of them it
//! reaches, and by the number of obstacles that are far away.

use super::{SerpentineConfig, draws};
use crate::case_results::{figure, median, table};
use crate::study::Progress;
use cpu_time::ThreadTime;
use serde::Serialize;
use sidestep::kernel::math::{cos, sin};
use sidestep::kernel::{Digest, InputError};
use sidestep::rods::geometry::{Point, add_scaled, normalized};
use sidestep::rods::{Chain, Connector, MotionRequest, Obstacle, Obstacles, Propagator, Rod};
use sidestep_document::figure::{Point as FigurePoint, Scale};
use sidestep_document::{Estimate, Figure, Series, Table};

/// Repeats of each timing: the fewest that decide a claim.
const REPEATS: usize = 5;
/// Length of a rod.
const ROD_M: f64 = 0.1;
/// Length of the head's step in a motion.
const STEP_M: f64 = 0.01;
/// Connectors of the chain among obstacles: as many as the slides' snake has agents.
const CLUTTERED_CONNECTORS: usize = 450;

/// One chain that is led through the open.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct OpenTiming {
    /// Number of connectors, the head included.
    pub(super) connectors: usize,
    /// Time of a motion, microseconds: rods of fixed length,
    pub(super) fixed_us: f64,
    /// the same by repeat,
    pub(super) fixed_us_by_repeat: Vec<f64>,
    /// and how many connectors move in one.
    pub(super) fixed_moved: f64,
    /// The same for rods that may be half as long again,
    pub(super) slack_us: f64,
    /// of which fewer move.
    pub(super) slack_moved: f64,
}

impl OpenTiming {
    /// Returns the time of a motion of fixed rods per connector that it moves, by repeat.
    fn us_per_moved(&self) -> Vec<Option<f64>> {
        let moved = self.fixed_moved.max(1.0);
        self.fixed_us_by_repeat.iter().map(|us| Some(us / moved)).collect()
    }
}

/// One chain among balls, with others far away.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct FarObstacleTiming {
    /// Balls that the chain never comes near to.
    pub(super) balls: usize,
    /// Time of a motion, microseconds.
    pub(super) us: f64,
    /// The same by repeat.
    pub(super) us_by_repeat: Vec<f64>,
    /// Whether the chain ends where it does without them, to the bit.
    pub(super) same: bool,
}

impl FarObstacleTiming {
    fn us(&self) -> Vec<Option<f64>> {
        self.us_by_repeat.iter().map(|us| Some(*us)).collect()
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ScalingResults {
    /// Sizes by number of connectors.
    pub(super) sizes: Vec<OpenTiming>,
    /// Runs by number of far balls.
    pub(super) far: Vec<FarObstacleTiming>,
}

/// Returns a slightly bent chain, so that every connector moves at every motion: a bend lets
/// through only its cosine, so a longer chain is less bent.
fn snake(n: usize, max_m: f64) -> Result<Chain<3>, InputError> {
    let mut points = vec![[0.0; 3]];
    let bent = 0.2_f64.min(90.0 / n as f64);
    for i in 1..n {
        let u = [-1.0, bent * sin(i as f64 * 0.1), bent * cos(i as f64 * 0.07)];
        let u = normalized(u).unwrap_or([-1.0, 0.0, 0.0]);
        points.push(add_scaled(points[i - 1], u, ROD_M));
    }
    let rod = Rod { min_m: ROD_M, max_m, radius_m: 0.01 };
    Chain::new(points, vec![Connector::free(0.02); n], vec![rod; n - 1])
}

/// Returns the position of the head after `k` motions.
fn head(k: usize) -> Point<3> {
    let t = k as f64 * STEP_M;
    [t, 0.3 * sin(t), 0.3 * cos(t) - 0.3]
}

/// Leads a chain; returns microseconds and connectors per motion.
fn lead(
    chain: &mut Chain<3>,
    obstacles: &Obstacles<3>,
    motions: std::ops::Range<usize>,
) -> Result<(f64, f64), InputError> {
    let mut propagator = Propagator::default();
    let count = motions.len() as f64;
    let mut moved = 0;
    let began = ThreadTime::now();
    for k in motions {
        let outcome =
            propagator.propagate(chain, obstacles, &MotionRequest::from_operator(0, head(k)))?;
        moved += outcome.motion().map_or(0, |m| m.touched.len());
    }
    Ok((1e6 * began.elapsed().as_secs_f64() / count, moved as f64 / count))
}

/// Returns times by repeat, and connectors of a motion of a chain in the open.
fn time_in_open(n: usize, max_m: f64, motions: usize) -> Result<(Vec<f64>, f64), InputError> {
    let mut chain = snake(n, max_m)?;
    let nothing = Obstacles::default();
    let mut times_us = Vec::new();
    let mut moved = 0.0;
    for repeat in 0..REPEATS {
        let from = 1 + repeat * motions;
        let (us, touched) = lead(&mut chain, &nothing, from..from + motions)?;
        times_us.push(us);
        moved += touched / REPEATS as f64;
    }
    Ok((times_us, moved))
}

/// Returns balls beside the way of the head, which rods turn from, and `far` ones that nothing
/// meets.
fn balls(far: usize) -> Result<Obstacles<3>, InputError> {
    let mut all = Vec::new();
    for id in 0..60_u32 {
        let at = [0.5 * f64::from(id), 0.12, 0.0];
        all.push(Obstacle::ball(id, at, 0.05));
    }
    let draws = &mut draws(1);
    for id in 0..far {
        let at: [f64; 3] = [0; 3].map(|_: u8| 2.0 * draws.uniform() - 1.0);
        // The chain stays within some tens of meters of the origin, 400 m away from all of these.
        let at = add_scaled([0.0, 0.0, 500.0], at, 100.0);
        all.push(Obstacle::ball(1000 + id as u32, at, 0.2));
    }
    Obstacles::new(all, ROD_M + 0.1)
}

/// Returns times by repeat of a motion of the chain beside balls, and the digest of its end.
fn time_among_balls(far: usize, motions: usize) -> Result<(Vec<f64>, Option<Digest>), InputError> {
    let obstacles = balls(far)?;
    let mut times_us = Vec::new();
    let mut end = None;
    for _ in 0..REPEATS {
        let mut chain = snake(CLUTTERED_CONNECTORS, ROD_M)?;
        times_us.push(lead(&mut chain, &obstacles, 1..motions)?.0);
        end = Some(chain_digest(&chain));
    }
    Ok((times_us, end))
}

fn chain_digest(chain: &Chain<3>) -> Digest {
    let bytes: Vec<u8> = chain.points().iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    Digest::hash_bytes(&bytes)
}

impl ScalingResults {
    /// Runs the experiment; timings run alone, on one worker.
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let mut sizes = Vec::new();
        for (k, &connectors) in plan.sizes.iter().enumerate() {
            progress("cost of a motion", k as f64 / plan.sizes.len() as f64);
            // A motion of a chain twice as long takes twice the time, so that all timings take the same.
            let motions = (plan.timed_motions / connectors).max(4);
            let (fixed_us_by_repeat, fixed_moved) = time_in_open(connectors, ROD_M, motions)?;
            let (slack_us, slack_moved) = time_in_open(connectors, 1.5 * ROD_M, motions)?;
            sizes.push(OpenTiming {
                connectors,
                fixed_us: median(fixed_us_by_repeat.iter().copied()),
                fixed_us_by_repeat,
                fixed_moved,
                slack_us: median(slack_us),
                slack_moved,
            });
        }
        let motions = (plan.timed_motions / CLUTTERED_CONNECTORS).max(50);
        let mut far = Vec::new();
        let mut first_end = None;
        for &balls in &plan.far_balls {
            let (us_by_repeat, end) = time_among_balls(balls, motions)?;
            // The first number of far balls is none.
            let without = *first_end.get_or_insert(end);
            let us = median(us_by_repeat.iter().copied());
            far.push(FarObstacleTiming { balls, us, us_by_repeat, same: end == without });
        }
        progress("cost of a motion", 1.0);
        Ok(Self { sizes, far })
    }

    /// Returns the time per moved connector of the longest chain divided by that of the shortest.
    pub(super) fn growth(&self) -> Estimate {
        let longest = self.sizes.last().map_or_else(Vec::new, OpenTiming::us_per_moved);
        let shortest = self.sizes.first().map_or_else(Vec::new, OpenTiming::us_per_moved);
        Estimate::geometric_ratio(&longest, &shortest)
    }

    /// Returns the time of a motion with the most far balls divided by that with the fewest.
    pub(super) fn far_growth(&self) -> Estimate {
        let most = self.far.last().map_or_else(Vec::new, FarObstacleTiming::us);
        let fewest = self.far.first().map_or_else(Vec::new, FarObstacleTiming::us);
        Estimate::geometric_ratio(&most, &fewest)
    }

    pub(super) fn tables(&self) -> [Table; 2] {
        let note = "Processor time of one motion of 1 cm in space, medians of 5 repeats; slack rods \
                    may be half as long again, so that a motion soon ends.";

        let sizes = table(
            "Cost of a motion in the open",
            note,
            &self.sizes,
            &[
                ("connectors", &|s| s.connectors.to_string()),
                ("fixed rods, us", &|s| format!("{:.2}", s.fixed_us)),
                ("moved", &|s| format!("{:.0}", s.fixed_moved)),
                ("ns each", &|s| format!("{:.1}", 1e3 * s.fixed_us / s.fixed_moved.max(1.0))),
                ("slack rods, us", &|s| format!("{:.3}", s.slack_us)),
                ("moved", &|s| format!("{:.1}", s.slack_moved)),
            ],
        );
        let note = "450 connectors beside 60 balls, and so many more 400 m away.";
        let columns = ["far balls", "a motion, us", "same bits as without"];
        let mut far = Table::new("Cost of a motion with far obstacles", note, &columns);
        for f in &self.far {
            let same = if f.same { "yes" } else { "no" };
            far.push_row([f.balls.to_string(), format!("{:.1}", f.us), same.into()]);
        }
        [sizes, far]
    }

    pub(super) fn figure(&self) -> Figure {
        let all = [
            self.series("fixed rods: all move", |s| s.fixed_us),
            self.series("slack rods: it soon ends", |s| s.slack_us),
        ];
        let title = "Time of a motion by the length of the chain";
        let figure = figure(title, ["connectors", "microseconds"], all);
        Figure { x_scale: Scale::Log, y_scale: Scale::Log, ..figure }
    }

    fn series(&self, name: &str, us: fn(&OpenTiming) -> f64) -> Series {
        let points = self.sizes.iter().map(|s| FigurePoint::new(s.connectors as f64, us(s)));
        Series { name: name.into(), points: points.collect() }
    }
}
