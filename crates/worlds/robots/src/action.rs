//! Actions prepared for a body on the padded grid: the boxes that each transition enters and leaves.

use super::effector::{HEADINGS, Side, Transition};
use sidestep_kernel::distr::{Categorical, DistributionError};

/// A unit step of a body of given size at a given heading, as box offsets from the anchor
/// that the body had before the whole transition.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    /// Boxes that the body enters, as index offsets.
    pub(crate) enter: Box<[i32]>,
    /// Boxes that it leaves, as index offsets.
    pub(crate) leave: Box<[i32]>,
    /// Move of the anchor in columns and rows.
    pub(crate) delta: (i32, i32),
    /// Side of the body that moves first.
    pub(crate) side: Side,
}

/// A transition at a heading, prepared for walking on the grid.
#[derive(Debug, Clone)]
pub(crate) struct StepPath {
    /// In the order in which they are made; empty for a turn in place and for staying.
    pub(crate) steps: Vec<Step>,
    /// Quarter turns to the left after the steps, 0 to 3.
    pub(crate) turn: u8,
    /// All steps together, for the many walks that meet no obstacle.
    pub(crate) whole: NetEffect,
}

/// The effect of a walk that meets no obstacle, as index offsets from the anchor before it.
#[derive(Debug, Clone, Default)]
pub(crate) struct NetEffect {
    /// Boxes entered that the body did not cover at the start; all of them must be free.
    pub(crate) enter: Box<[i32]>,
    /// Boxes covered at the start and not at the end.
    pub(crate) leave: Box<[i32]>,
    /// Boxes covered at the end and not at the start.
    pub(crate) fill: Box<[i32]>,
    /// Move of the anchor in columns and rows.
    pub(crate) delta: (i32, i32),
}

impl NetEffect {
    fn new(steps: &[Step], own: &[i32]) -> Self {
        let mut delta = (0, 0);
        let mut covered: Vec<i32> = own.to_vec();
        let mut enter: Vec<i32> = Vec::new();
        for step in steps {
            delta = (delta.0 + step.delta.0, delta.1 + step.delta.1);
            covered.retain(|offset| !step.leave.contains(offset));
            covered.extend_from_slice(&step.enter);
            for offset in &step.enter {
                if !own.contains(offset) && !enter.contains(offset) {
                    enter.push(*offset);
                }
            }
        }
        Self {
            leave: own.iter().copied().filter(|offset| !covered.contains(offset)).collect(),
            fill: enter.iter().copied().filter(|offset| covered.contains(offset)).collect(),
            enter: enter.into(),
            delta,
        }
    }
}

/// The boxes that an action may sweep, as a tree of steps, depth first. It is a tree because boxes
/// behind a wall need not be claimed: a blocked step leaves out its subtree.
#[derive(Debug, Clone, Default)]
pub(crate) struct SweptVolume {
    /// Depth first: the steps that may follow a step stand directly behind it.
    pub(crate) nodes: Box<[SweptVolumeNode]>,
    /// Index offsets of the boxes entered, step after step.
    pub(crate) boxes: Box<[i32]>,
}

/// One step of a [`SweptVolume`]; paths that start alike share it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SweptVolumeNode {
    /// Start of its boxes in [`SweptVolume::boxes`].
    pub(crate) first: u32,
    /// End of its boxes there.
    pub(crate) end: u32,
    /// Index of the next step when a wall blocks this one: the one behind its whole subtree.
    pub(crate) after: u32,
}

/// An action of a body type at a heading.
#[derive(Debug, Clone)]
pub(crate) struct Action {
    /// By which one of `walks` is drawn.
    pub(crate) distribution: Categorical,
    /// Probabilities as given, kept for exact computations and for rescaling.
    pub(crate) probabilities: Vec<f64>,
    /// One for each transition of the effector, the intended one first.
    pub(crate) walks: Vec<StepPath>,
    /// The tree of everything that the action may sweep.
    pub(crate) sweep: SweptVolume,
    /// The boxes of `sweep`, each listed once.
    pub(crate) claims: Box<[i32]>,
}

impl Action {
    /// Prepares an action of a `width` x `height` body for grid rows of `stride` boxes.
    ///
    /// # Errors
    /// Returns an error when the probabilities are not a distribution; scenarios check that
    /// earlier.
    pub(crate) fn new(
        transitions: &[Transition],
        heading: u8,
        body: (u32, u32),
        stride: u32,
    ) -> Result<Self, DistributionError> {
        let probabilities: Vec<f64> = transitions.iter().map(|t| t.p).collect();
        let own = own_boxes(body, stride);
        let mut walks = Vec::with_capacity(transitions.len());
        for transition in transitions {
            let steps = steps(&transition.path, heading, body, stride);
            let whole = NetEffect::new(&steps, &own);
            walks.push(StepPath { steps, turn: transition.turn, whole });
        }
        // A transition that never happens sweeps nothing, and needs no claim.
        let possible: Vec<(&[Side], &[Step])> = transitions
            .iter()
            .zip(&walks)
            .filter(|(transition, _)| transition.p > 0.0)
            .map(|(transition, walk)| (&transition.path[..], &walk.steps[..]))
            .collect();
        let mut nodes = Vec::new();
        let mut boxes = Vec::new();
        push_sweep(&possible, 0, &mut nodes, &mut boxes);
        let mut claims: Vec<i32> =
            boxes.iter().copied().filter(|offset| !own.contains(offset)).collect();
        claims.sort_unstable();
        claims.dedup();
        Ok(Self {
            distribution: Categorical::new(&probabilities)?,
            probabilities,
            walks,
            sweep: SweptVolume { nodes: nodes.into(), boxes: boxes.into() },
            claims: claims.into(),
        })
    }
}

/// Returns the offsets of the boxes that a body covers, row by row from its anchor.
pub(crate) fn own_boxes(body: (u32, u32), stride: u32) -> Box<[i32]> {
    let (width, height) = body;
    (0..height).flat_map(|y| (0..width).map(move |x| (y * stride + x) as i32)).collect()
}

/// Appends the tree of the paths' steps from `depth` on; paths that start alike share nodes.
fn push_sweep(
    paths: &[(&[Side], &[Step])],
    depth: usize,
    nodes: &mut Vec<SweptVolumeNode>,
    boxes: &mut Vec<i32>,
) {
    for side in Side::ALL {
        let along: Vec<_> =
            paths.iter().copied().filter(|(path, _)| path.get(depth) == Some(&side)).collect();
        let Some((_, steps)) = along.first() else { continue };
        let first = boxes.len() as u32;
        let node = nodes.len();
        boxes.extend_from_slice(&steps[depth].enter);
        nodes.push(SweptVolumeNode { first, end: boxes.len() as u32, after: 0 });
        push_sweep(&along, depth + 1, nodes, boxes);
        nodes[node].after = nodes.len() as u32;
    }
}

fn steps(path: &[Side], heading: u8, body: (u32, u32), stride: u32) -> Vec<Step> {
    let mut steps = Vec::with_capacity(path.len());
    // Index offset of the anchor before the step.
    let mut anchor = 0;
    for &side in path {
        let delta = HEADINGS[usize::from((heading + side as u8) % 4)];
        let enter = edge(body, delta, true);
        let leave = edge(body, delta, false);
        steps.push(Step {
            enter: enter.into_iter().map(|at| anchor + index_offset(at, stride)).collect(),
            leave: leave.into_iter().map(|at| anchor + index_offset(at, stride)).collect(),
            delta,
            side,
        });
        anchor += index_offset(delta, stride);
    }
    steps
}

/// Returns the difference of two boxes' indices, by that of their columns and rows.
fn index_offset((columns, rows): (i32, i32), stride: u32) -> i32 {
    rows * stride as i32 + columns
}

/// Returns the row of boxes just outside a body in direction `u` (`ahead`), or the body's own
/// hindmost row, from left to right as seen along `u`. Of several obstacles the first in this order
/// is the one that a contact reports.
fn edge(body: (u32, u32), (ux, uy): (i32, i32), ahead: bool) -> Vec<(i32, i32)> {
    let w = body.0 as i32;
    let h = body.1 as i32;
    let across = if ux != 0 { h } else { w };
    (0..across)
        .map(|k| {
            let leftmost_first = across - 1 - k;
            match (ux, uy) {
                (1, _) => (if ahead { w } else { 0 }, leftmost_first),
                (-1, _) => (if ahead { -1 } else { w - 1 }, k),
                (_, 1) => (k, if ahead { h } else { 0 }),
                _ => (leftmost_first, if ahead { -1 } else { h - 1 }),
            }
        })
        .collect()
}
