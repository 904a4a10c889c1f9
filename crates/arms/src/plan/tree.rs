//! Two trees of postures that grow toward each other.

use super::ConfigurationSpace;
use sidestep_kernel::interrupt;
use sidestep_kernel::stream::Draws;

/// Longest move of a connector between two postures of a tree, in lengths of the chain. The path of a stride is checked in
/// far shorter steps, so it sets only how dense the trees are.
const MAX_STRIDE: f64 = 0.1;
/// Longest straight move of a connector, in lengths of the chain: what a growth of one tree may add.
const MAX_SEGMENT: f64 = 4.0;
/// Pairs of postures between which a shortcut is tried: each costs a check of a path, and gains get
/// ever smaller.
const MAX_SHORTCUTS: usize = 120;

/// Postures, each with its parent.
struct PostureTree<S: ConfigurationSpace> {
    postures: Vec<S::Posture>,
    parents: Vec<Option<usize>>,
}

impl<S: ConfigurationSpace> PostureTree<S> {
    fn new(roots: Vec<S::Posture>) -> Self {
        Self { parents: vec![None; roots.len()], postures: roots }
    }

    /// Adds postures of a path that begins at the last one.
    fn extend_from_last(&mut self, path: Vec<S::Posture>) {
        for posture in path {
            self.parents.push(self.postures.len().checked_sub(1));
            self.postures.push(posture);
        }
    }

    /// Returns the posture nearest to another; of equal ones the first.
    fn nearest(&self, space: &S, to: &S::Posture) -> usize {
        let spreads = self.postures.iter().map(|posture| space.squared_distance(posture, to));
        let nearest = spreads.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b));
        nearest.map_or(0, |(i, _)| i)
    }

    /// Grows toward a posture stride by stride, as far as the path is free; returns the last posture
    /// and whether that is the target, or `None` if there was no stride at all.
    fn grow_toward(
        &mut self,
        space: &S,
        to: &S::Posture,
        stride_m: f64,
        max_strides: usize,
    ) -> Option<(usize, bool)> {
        let mut last = self.nearest(space, to);
        for stride in 0..max_strides {
            let from = &self.postures[last];
            let fraction = stride_m / space.distance_m(from, to).max(f64::MIN_POSITIVE);
            let next = space.interpolate(from, to, fraction);
            if !space.is_path_free(from, &next) {
                return (stride > 0).then_some((last, false));
            }
            self.postures.push(next);
            self.parents.push(Some(last));
            last = self.postures.len() - 1;
            if fraction >= 1.0 {
                return Some((last, true));
            }
        }
        Some((last, false))
    }

    fn postures_to_root(&self, mut i: usize) -> Vec<S::Posture> {
        let mut path = vec![self.postures[i].clone()];
        while let Some(from) = self.parents[i] {
            i = from;
            path.push(self.postures[i].clone());
        }
        path
    }
}

/// Returns postures from the present one to one of the goals, both included. The first tree begins with `trail`, a path
/// from the present posture; the way straight to a goal is tried first.
pub(super) fn find_path<S: ConfigurationSpace>(
    space: &S,
    trail: Vec<S::Posture>,
    goals: Vec<S::Posture>,
    draws: &mut Draws,
) -> Option<Vec<S::Posture>> {
    let stride_m = MAX_STRIDE * space.length_m();
    let max_strides = (MAX_SEGMENT / MAX_STRIDE).ceil() as usize;
    let mut trees =
        [PostureTree::new(vec![space.present_posture()]), PostureTree::new(goals.clone())];
    trees[0].extend_from_last(trail);
    let towards_goals = goals.into_iter().map(|to| (to, max_strides));
    let drawn = std::iter::repeat_with(|| None).take(space.max_samples());
    for (i, toward) in towards_goals.map(Some).chain(drawn).enumerate() {
        interrupt::check();
        // The trees take turns; the first tries are straight to the goals.
        let (one, other) = if toward.is_some() { (0, 1) } else { (i % 2, 1 - i % 2) };
        let (to, strides) = toward.unwrap_or_else(|| (space.sample(draws), 1));
        let Some((tip, _)) = trees[one].grow_toward(space, &to, stride_m, strides) else {
            continue;
        };
        let tip_posture = trees[one].postures[tip].clone();
        let Some((meeting, true)) =
            trees[other].grow_toward(space, &tip_posture, stride_m, max_strides)
        else {
            continue;
        };
        let ends = if one == 0 { [tip, meeting] } else { [meeting, tip] };
        let mut path = trees[0].postures_to_root(ends[0]);
        path.reverse();
        path.extend(trees[1].postures_to_root(ends[1]).into_iter().skip(1));
        return Some(path);
    }
    None
}

/// Returns the path after its first posture, with shortcuts where they are free: from each posture as far ahead as
/// halving the rest of the path shows, then between random postures.
pub(super) fn shorten_path<S: ConfigurationSpace>(
    space: &S,
    path: Vec<S::Posture>,
    draws: &mut Draws,
) -> Vec<S::Posture> {
    let mut path = skip_ahead(space, path);
    for _ in 0..MAX_SHORTCUTS {
        if path.len() < 3 {
            break;
        }
        let [i, j] = [0, 1].map(|_| draws.uniform_below(path.len() as u32) as usize);
        let [i, j] = [i.min(j), i.max(j)];
        if j > i + 1 && space.is_path_free(&path[i], &path[j]) {
            path.drain(i + 1..j);
        }
    }
    path.split_off(1)
}

/// Returns a path that leaves out what lies between a posture and the farthest one of the rest, of its half, its quarter,
/// and so on, to which the straight path is free.
fn skip_ahead<S: ConfigurationSpace>(space: &S, path: Vec<S::Posture>) -> Vec<S::Posture> {
    let mut kept = vec![0];
    let mut from = 0;
    while from + 1 < path.len() {
        let mut ahead = path.len() - 1 - from;
        while ahead > 1 && !space.is_path_free(&path[from], &path[from + ahead]) {
            ahead /= 2;
        }
        from += ahead;
        kept.push(from);
    }
    kept.into_iter().map(|i| path[i].clone()).collect()
}
