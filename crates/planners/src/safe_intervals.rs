//! Safe interval path planning: the earliest arrival of one agent among others whose paths are known.
//!
//! A body can be at a box as long as no other covers any of its boxes; a state is a node and one such interval, and of
//! each state only the earliest arrival matters, because the agent can wait there (Phillips and Likhachev 2011, "SIPP:
//! Safe interval path planning for dynamic environments").

use crate::distances::GoalDistances;
use crate::graph::AnchorGraph;
use crate::pose::ActionModel;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashMap};

/// A time that never comes.
const FOREVER: u32 = u32::MAX;

/// Times from the first to the last, both included.
type Interval = (u32, u32);

/// Who covers which box when.
#[derive(Debug, Clone)]
pub(crate) struct Reservations {
    /// The times at which each box is covered, in no order.
    covered: Vec<Vec<Interval>>,
    /// Moves of agents of one box: the step that begins at this time, from one box to the other.
    moves: BTreeSet<(u32, u32, u32)>,
}

impl Reservations {
    pub(crate) fn new(boxes: usize) -> Self {
        Self { covered: vec![Vec::new(); boxes], moves: BTreeSet::new() }
    }

    /// Adds an agent that goes along some nodes and stays at the last one.
    pub(crate) fn insert(&mut self, graph: &AnchorGraph, path: &[u32]) {
        let mut from = 0;
        for (time, &node) in path.iter().enumerate() {
            let next = path.get(time + 1);
            if next.is_some_and(|next| next / 4 == node / 4) {
                continue;
            }
            let to = if next.is_some() { time as u32 } else { FOREVER };
            for covered in graph.body(node / 4) {
                self.covered[covered].push((from, to));
            }
            from = time as u32 + 1;
            if let Some(next) = next.filter(|_| graph.size() == 1) {
                self.moves.insert((time as u32, node / 4, next / 4));
            }
        }
    }

    /// Returns the intervals in which a body can be at an anchor, in their order.
    fn safe_intervals(&self, graph: &AnchorGraph, anchor: u32) -> Vec<Interval> {
        let boxes = graph.body(anchor);
        let mut unsafe_ones: Vec<Interval> =
            boxes.flat_map(|covered| self.covered[covered].iter().copied()).collect();
        unsafe_ones.sort_unstable();
        let mut safe = Vec::new();
        let mut from = 0;
        for (first, last) in unsafe_ones {
            if first > from {
                safe.push((from, first - 1));
            }
            if last == FOREVER {
                return safe;
            }
            from = from.max(last + 1);
        }
        safe.push((from, FOREVER));
        safe
    }
}

/// The one agent whose path is looked for.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) graph: &'a AnchorGraph,
    pub(crate) model: ActionModel,
    pub(crate) distances: &'a GoalDistances,
    pub(crate) start: u32,
    pub(crate) goal: u32,
}

/// The earliest known arrival in a state.
#[derive(Debug, Clone, Copy)]
struct Label {
    node: u32,
    interval: u32,
    time: u32,
    parent: Option<u32>,
}

struct Search<'a> {
    query: Query<'a>,
    reservations: &'a Reservations,
    /// Intervals of the anchors that were reached.
    intervals: HashMap<u32, Vec<Interval>>,
    labels: Vec<Label>,
    /// Earliest arrival by node and interval.
    arrivals: HashMap<(u32, u32), u32>,
    /// Labels by the lower bound of their arrival at the goal; of equal ones the latest, which is the nearest.
    open: BinaryHeap<(Reverse<u32>, u32, Reverse<u32>)>,
}

/// Returns the nodes of a path that arrives as early as possible and can stay at the goal; none if there is none.
pub(crate) fn search(query: Query<'_>, reservations: &Reservations) -> Option<Vec<u32>> {
    let mut search = Search {
        query,
        reservations,
        intervals: HashMap::new(),
        labels: Vec::new(),
        arrivals: HashMap::new(),
        open: BinaryHeap::new(),
    };
    let first = search.intervals(query.start / 4).first().copied();
    first.filter(|interval| interval.0 == 0)?;
    search.reach(Label { node: query.start, interval: 0, time: 0, parent: None });
    while let Some((_, _, Reverse(index))) = search.open.pop() {
        let label = search.labels[index as usize];
        if search.arrivals[&(label.node, label.interval)] < label.time {
            continue;
        }
        let (_, last) = search.intervals(label.node / 4)[label.interval as usize];
        if label.node / 4 == query.goal && last == FOREVER {
            return Some(search.path_to(index));
        }
        search.expand(index, label, last);
    }
    None
}

impl Search<'_> {
    fn intervals(&mut self, anchor: u32) -> &[Interval] {
        self.intervals
            .entry(anchor)
            .or_insert_with(|| self.reservations.safe_intervals(self.query.graph, anchor))
    }

    fn reach(&mut self, label: Label) {
        let distance = self.query.distances.steps(label.node);
        if distance == GoalDistances::UNREACHABLE {
            return;
        }
        let arrival = self.arrivals.entry((label.node, label.interval)).or_insert(FOREVER);
        if label.time >= *arrival {
            return;
        }
        *arrival = label.time;
        let index = self.labels.len() as u32;
        self.labels.push(label);
        self.open.push((Reverse(label.time + distance), label.time, Reverse(index)));
    }

    /// Adds the states after one action, each as early as can be.
    fn expand(&mut self, index: u32, label: Label, last: u32) {
        let successors = self.query.graph.successors(self.query.model, label.node);
        for &node in successors.as_slice() {
            if node == label.node {
                continue;
            }
            if node / 4 != label.node / 4 {
                self.enter(index, node, last);
            } else if label.time < last {
                let time = label.time + 1;
                self.reach(Label { node, time, parent: Some(index), ..label });
            }
        }
    }

    /// Goes to a neighbor in each of its intervals that begins before the present one is over.
    fn enter(&mut self, index: u32, node: u32, last: u32) {
        let from = self.labels[index as usize];
        let latest = last.saturating_add(1);
        for interval in 0..self.intervals(node / 4).len() {
            let (first, end) = self.intervals(node / 4)[interval];
            let time = first.max(from.time + 1);
            // Another one that comes the other way in this very step; later this box is no longer safe.
            let is_swap = self.query.graph.size() == 1
                && self.reservations.moves.contains(&(time - 1, node / 4, from.node / 4));
            if time <= end && time <= latest && !is_swap {
                let interval = interval as u32;
                self.reach(Label { node, interval, time, parent: Some(index) });
            }
        }
    }

    fn path_to(&self, index: u32) -> Vec<u32> {
        let mut path = Vec::new();
        let mut next = Some(index);
        while let Some(index) = next {
            let label = self.labels[index as usize];
            path.push(label.node);
            next = label.parent;
            // It waited before the last action.
            if let Some(parent) = next {
                let parent = self.labels[parent as usize];
                let waits = label.time - parent.time - 1;
                path.extend((0..waits).map(|_| parent.node));
            }
        }
        path.reverse();
        path
    }
}
