//! Steps to many goals, turns included where the floor is small, in bounded memory and with bounded work per tick; where
//! those from each box do not fit, from each region.

use crate::graph::{AnchorGraph, NONE};
use crate::regions::{RegionField, Regions};

/// Most bytes that a planner keeps for the steps to the goals of its agents.
pub(crate) const MAX_FIELD_BYTES: usize = 1 << 30;
/// Most boxes of a floor where fields count turns: four numbers a box are too much memory beyond.
const MAX_BOXES_WITH_TURNS: usize = 1 << 14;
/// No path leads from there.
const UNREACHABLE: u16 = u16::MAX;

/// The steps that a move against a one-way street counts as.
const AGAINST: u32 = 8;
/// More than the most steps of a move.
const BUCKETS: usize = AGAINST as usize + 1;

/// Directions of streets of one box, where two that meet cannot pass each other: each second one leads back.
///
/// Rows and columns count as streets where an eighth of them has walls on both sides, as in warehouses.
#[derive(Debug, Clone)]
struct OneWayStreets {
    /// For each box, the directions that are against its streets, one bit each.
    against: Vec<u8>,
}

impl OneWayStreets {
    fn new(graph: &AnchorGraph) -> Self {
        let mut streets = Self { against: vec![0; graph.len()] };
        let [width, height] = graph.extent();
        let rows: Vec<Vec<u32>> =
            (0..height).map(|row| (0..width).map(|col| row * width + col).collect()).collect();
        let cols: Vec<Vec<u32>> =
            (0..width).map(|col| (0..height).map(|row| row * width + col).collect()).collect();
        streets.direct(graph, &rows, 0);
        streets.direct(graph, &cols, 1);
        streets
    }

    /// Gives every second street of some lines of boxes the direction, and the others the opposite one.
    fn direct(&mut self, graph: &AnchorGraph, lines: &[Vec<u32>], direction: u8) {
        let sides = 0b1010 >> direction;
        let is_street = |at: u32| graph.is_anchor(at) && graph.exits(at) & sides == 0;
        let mut count = 0u8;
        for line in lines {
            let boxes = line.iter().filter(|&&at| is_street(at)).count();
            if boxes == 0 || boxes * 8 < line.len() {
                continue;
            }
            count = (count + 2) % 4;
            for &at in line.iter().filter(|&&at| is_street(at)) {
                self.against[at as usize] |= 1 << ((direction + count) % 4);
            }
        }
    }

    #[inline]
    fn weight(&self, from: u32, to: u32, direction: u8) -> u32 {
        let against = self.against[from as usize] | self.against[to as usize];
        if against >> direction & 1 == 1 { AGAINST } else { 1 }
    }
}

#[derive(Debug, Clone)]
struct GoalField {
    goal: u32,
    used: u64,
    steps: Vec<u16>,
    /// Instead of `steps` on floors with regions.
    by_region: RegionField,
}

/// Fields of goals. What it forgets is computed again; where no field is known yet, the steps are those of a floor
/// without walls.
#[derive(Debug, Clone)]
pub(crate) struct GoalFields {
    has_turns: bool,
    fields: Vec<GoalField>,
    /// Index of the field of a goal.
    index: Vec<u32>,
    capacity: usize,
    /// Boxes that may still be visited in this tick.
    work_left: usize,
    now: u64,
    queue: Vec<u32>,
    /// Boxes by their steps, of those that come next.
    buckets: Vec<Vec<u32>>,
    one_way: OneWayStreets,
    /// Where the steps from each box do not fit.
    regions: Option<Regions>,
}

impl GoalFields {
    /// Creates fields for so many goals at once.
    pub(crate) fn new(graph: &AnchorGraph, goals: usize, max_bytes: usize) -> Self {
        let has_turns = graph.len() <= MAX_BOXES_WITH_TURNS;
        let headings = if has_turns { 4 } else { 1 };
        let field_bytes = 2 * headings * graph.len();
        let regions = (max_bytes / field_bytes.max(1) < goals).then(|| Regions::new(graph));
        let field_bytes = regions.as_ref().map_or(field_bytes, Regions::field_bytes);
        let capacity = (max_bytes / field_bytes.max(1)).max(1);
        Self {
            has_turns,
            regions,
            fields: Vec::new(),
            index: vec![NONE; graph.len()],
            capacity,
            work_left: 0,
            now: 0,
            queue: Vec::new(),
            buckets: vec![Vec::new(); BUCKETS],
            one_way: OneWayStreets::new(graph),
        }
    }

    /// Returns the steps to a goal by way of the neighbor of a box in a direction, as far as they compare with
    /// [`Self::steps`] from the box itself.
    #[inline]
    pub(crate) fn steps_by(&self, graph: &AnchorGraph, goal: u32, at: u32, direction: u8) -> u32 {
        let neighbor = graph.step(at, direction);
        if let (Some(regions), Some(field)) = (&self.regions, self.field(goal)) {
            let steps = regions.steps_by(&field.by_region, at, neighbor);
            return steps.unwrap_or(u32::from(UNREACHABLE));
        }
        let weight = if self.has_turns { 1 } else { self.one_way.weight(at, neighbor, direction) };
        self.steps(graph, goal, neighbor, direction) + weight
    }

    #[inline]
    fn field(&self, goal: u32) -> Option<&GoalField> {
        self.fields.get(self.index[goal as usize] as usize)
    }

    /// Returns whether so many fields are kept at once.
    pub(crate) fn holds(&self, fields: usize) -> bool {
        fields <= self.capacity
    }

    /// Returns whether fields are cheap enough to compare all tasks by them.
    pub(crate) fn is_small(&self) -> bool {
        self.has_turns && self.regions.is_none()
    }

    /// Begins a tick, in which so many boxes may be visited to compute fields.
    pub(crate) fn begin_tick(&mut self, work: usize) {
        self.now += 1;
        self.work_left = work;
    }

    /// Computes the field of a goal if it is unknown and there is work left for it.
    pub(crate) fn prepare(&mut self, graph: &AnchorGraph, goal: u32) {
        let index = self.index[goal as usize];
        if index != NONE {
            self.fields[index as usize].used = self.now;
            return;
        }
        if self.work_left == 0 {
            return;
        }
        let mut field = if self.fields.len() < self.capacity {
            let by_region = RegionField::default();
            GoalField { goal, used: self.now, steps: Vec::new(), by_region }
        } else {
            let Some(victim) = self.victim() else { return };
            let last = self.fields.len() - 1;
            let old = self.fields.swap_remove(victim);
            self.index[old.goal as usize] = NONE;
            if victim != last {
                self.index[self.fields[victim].goal as usize] = victim as u32;
            }
            old
        };
        field.goal = goal;
        field.used = self.now;
        let work = match &self.regions {
            Some(regions) => regions.search(graph, goal, &mut field.by_region),
            None => self.search(graph, goal, &mut field.steps),
        };
        self.work_left = self.work_left.saturating_sub(work);
        self.index[goal as usize] = self.fields.len() as u32;
        self.fields.push(field);
    }

    /// Returns the field that was not used for longest; none if all were used in this tick.
    fn victim(&self) -> Option<usize> {
        let oldest = (0..self.fields.len()).min_by_key(|&index| self.fields[index].used);
        oldest.filter(|&index| self.fields[index].used < self.now)
    }

    /// Computes the steps to a goal. Returns the number of nodes that it came to.
    fn search(&mut self, graph: &AnchorGraph, goal: u32, steps: &mut Vec<u16>) -> usize {
        steps.clear();
        self.queue.clear();
        if self.has_turns {
            steps.resize(graph.len() * 4, UNREACHABLE);
            self.search_with_turns(graph, goal, steps);
        } else {
            steps.resize(graph.len(), UNREACHABLE);
            self.search_boxes(graph, goal, steps);
        }
        self.queue.len()
    }

    fn search_with_turns(&mut self, graph: &AnchorGraph, goal: u32, steps: &mut [u16]) {
        for heading in 0..4 {
            steps[(goal * 4 + heading) as usize] = 0;
            self.queue.push(goal * 4 + heading);
        }
        let mut head = 0;
        while let Some(&node) = self.queue.get(head) {
            head += 1;
            let next = steps[node as usize].saturating_add(1).min(UNREACHABLE - 1);
            let mut reach = |node: u32| {
                if steps[node as usize] == UNREACHABLE {
                    steps[node as usize] = next;
                    self.queue.push(node);
                }
            };
            let anchor = node / 4;
            let heading = node % 4;
            reach(anchor * 4 + (heading + 1) % 4);
            reach(anchor * 4 + (heading + 3) % 4);
            // Forward leads here from the box behind.
            let back = ((heading + 2) % 4) as u8;
            if graph.exits(anchor) >> back & 1 == 1 {
                reach(graph.step(anchor, back) * 4 + heading);
            }
        }
    }

    /// Searches by buckets of equal steps (Dial 1969, "Algorithm 360: shortest-path forest with topological ordering").
    fn search_boxes(&mut self, graph: &AnchorGraph, goal: u32, steps: &mut [u16]) {
        steps[goal as usize] = 0;
        self.buckets[0].push(goal);
        let mut waiting = 1usize;
        let mut now = 0u16;
        while waiting > 0 {
            let slot = usize::from(now) % BUCKETS;
            while let Some(at) = self.buckets[slot].pop() {
                waiting -= 1;
                // One that was reached by fewer steps since.
                if steps[at as usize] != now {
                    continue;
                }
                self.queue.push(at);
                for (direction, from) in graph.neighbors(at) {
                    let weight = self.one_way.weight(from, at, (direction + 2) % 4);
                    let next = u32::from(now) + weight;
                    if next < u32::from(steps[from as usize]) {
                        steps[from as usize] = next as u16;
                        self.buckets[next as usize % BUCKETS].push(from);
                        waiting += 1;
                    }
                }
            }
            now = now.saturating_add(1);
            if now == UNREACHABLE {
                break;
            }
        }
        self.buckets.iter_mut().for_each(Vec::clear);
    }

    /// Returns the steps from a box, with a heading, to a goal.
    #[inline]
    pub(crate) fn steps(&self, graph: &AnchorGraph, goal: u32, at: u32, heading: u8) -> u32 {
        let Some(field) = self.field(goal) else { return straight_steps(graph, at, goal) };
        if let Some(regions) = &self.regions {
            return regions.steps(&field.by_region, at).unwrap_or(u32::from(UNREACHABLE));
        }
        let slot = if self.has_turns { at * 4 + u32::from(heading) } else { at };
        u32::from(field.steps[slot as usize])
    }
}

/// Returns the steps between two boxes if there were no walls.
pub(crate) fn straight_steps(graph: &AnchorGraph, from: u32, to: u32) -> u32 {
    let from = graph.position(from);
    let to = graph.position(to);
    from.0.abs_diff(to.0) + from.1.abs_diff(to.1)
}
