//! Steps to many goals on floors so large that those from each box do not fit in memory for each goal.
//!
//! The floor is cut into blocks, and what is connected within a block is a *region*. Of a goal are kept the steps from each
//! region, and from each box of the regions around it; of the floor, once for all goals, the steps from each box into
//! each region beside its own. An agent goes by the lowest sum of the two. It only ever leaves a region for one that is
//! nearer to the goal, so it comes there, if not always by the shortest way.

use crate::graph::{AnchorGraph, NONE};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Side of a block in boxes: the steps from regions take about as much memory and time then as those from the boxes around
/// the goal.
const BLOCK: u32 = 32;
/// Bytes of a goal for the boxes around it: five blocks, two bytes a box.
const BYTES_AROUND: usize = 5 * 2 * (BLOCK * BLOCK) as usize;
/// No path leads from there.
const UNREACHABLE: u32 = u32::MAX;
/// A box that a search has not come to.
const UNSEEN: u16 = u16::MAX;

/// The regions of a floor.
#[derive(Debug, Clone, Default)]
pub(crate) struct Regions {
    /// The region of each box; none of walls.
    of: Vec<u32>,
    /// The number of each box within its region.
    slots: Vec<u16>,
    list: Vec<Region>,
}

#[derive(Debug, Clone, Default)]
struct Region {
    boxes: Vec<u32>,
    links: Vec<Link>,
}

/// The way from a region into one beside it.
#[derive(Debug, Clone)]
struct Link {
    to: u32,
    /// The steps from each box of the region into the other one.
    steps: Vec<u16>,
    /// The steps between the middle boxes of both.
    between: u32,
    /// The steps of these that are in the other one.
    beyond: u32,
}

/// The steps to a goal.
#[derive(Debug, Clone, Default)]
pub(crate) struct RegionField {
    /// From the middle box of each region.
    from_regions: Vec<u32>,
    /// The regions around the goal, each with the place of its first box in `steps`.
    around: Vec<(u32, u32)>,
    steps: Vec<u16>,
}

impl RegionField {
    /// Returns where the steps from the boxes of a region begin; none of regions farther away.
    fn first_of(&self, region: u32) -> Option<u32> {
        let found = self.around.iter().find(|(around, _)| *around == region);
        found.map(|&(_, first)| first)
    }
}

impl Regions {
    pub(crate) fn new(graph: &AnchorGraph) -> Self {
        let mut regions =
            Self { of: vec![NONE; graph.len()], slots: vec![0; graph.len()], list: Vec::new() };
        for start in 0..graph.len() as u32 {
            if graph.is_anchor(start) && regions.of[start as usize] == NONE {
                regions.fill(graph, start);
            }
        }
        for region in 0..regions.list.len() as u32 {
            regions.link(graph, region);
        }
        regions.measure_links();
        regions
    }

    /// Returns the bytes that a goal takes.
    pub(crate) fn field_bytes(&self) -> usize {
        self.list.len() * size_of::<u32>() + BYTES_AROUND
    }

    /// Makes a region of the boxes of a block that are connected with one.
    fn fill(&mut self, graph: &AnchorGraph, start: u32) {
        let number = self.list.len() as u32;
        let block = block_of(graph, start);
        self.of[start as usize] = number;
        let mut boxes = vec![start];
        let mut head = 0;
        while let Some(&at) = boxes.get(head) {
            self.slots[at as usize] = head as u16;
            head += 1;
            for (_, neighbor) in graph.neighbors(at) {
                if self.of[neighbor as usize] == NONE && block_of(graph, neighbor) == block {
                    self.of[neighbor as usize] = number;
                    boxes.push(neighbor);
                }
            }
        }
        self.list.push(Region { boxes, links: Vec::new() });
    }

    /// Computes the steps from the boxes of a region into each one beside it.
    fn link(&mut self, graph: &AnchorGraph, region: u32) {
        let boxes = &self.list[region as usize].boxes;
        let mut exits: Vec<(u32, u32)> = Vec::new();
        for &at in boxes {
            let others = graph.neighbors(at).map(|(_, neighbor)| self.of[neighbor as usize]);
            exits.extend(others.filter(|&other| other != region).map(|other| (other, at)));
        }
        exits.sort_unstable();
        let mut links = Vec::new();
        for exits in exits.chunk_by(|one, next| one.0 == next.0) {
            let steps = self.steps_within(graph, region, exits.iter().map(|&(_, at)| at));
            links.push(Link { to: exits[0].0, steps, between: 0, beyond: 0 });
        }
        self.list[region as usize].links = links;
    }

    /// Returns the steps from each box of a region until one of its exits is left.
    fn steps_within(
        &self,
        graph: &AnchorGraph,
        region: u32,
        exits: impl Iterator<Item = u32>,
    ) -> Vec<u16> {
        let mut steps = vec![UNSEEN; self.list[region as usize].boxes.len()];
        let mut queue: Vec<u32> = exits.collect();
        for &at in &queue {
            steps[usize::from(self.slots[at as usize])] = 1;
        }
        let mut head = 0;
        while let Some(&at) = queue.get(head) {
            head += 1;
            let next = steps[usize::from(self.slots[at as usize])] + 1;
            for (_, neighbor) in graph.neighbors(at) {
                let slot = usize::from(self.slots[neighbor as usize]);
                if self.of[neighbor as usize] == region && steps[slot] == UNSEEN {
                    steps[slot] = next;
                    queue.push(neighbor);
                }
            }
        }
        steps
    }

    /// Computes the steps between the middle boxes of regions beside each other.
    fn measure_links(&mut self) {
        for region in 0..self.list.len() {
            for link in 0..self.list[region].links.len() {
                let Link { to, steps, .. } = &self.list[region].links[link];
                let back = self.list[*to as usize].links.iter();
                let back = back.filter(|back| back.to as usize == region);
                // The last step of the way out is the first one inside.
                let beyond = back.map(|back| u32::from(middle(&back.steps)) - 1).sum();
                let between = u32::from(middle(steps)) + beyond;
                let link = &mut self.list[region].links[link];
                link.beyond = beyond;
                link.between = between;
            }
        }
    }

    /// Computes the steps to a goal. Returns the number of regions and boxes that it came to.
    pub(crate) fn search(&self, graph: &AnchorGraph, goal: u32, field: &mut RegionField) -> usize {
        let home = self.of[goal as usize];
        field.from_regions.clear();
        field.from_regions.resize(self.list.len(), UNREACHABLE);
        field.around.clear();
        field.steps.clear();
        if home == NONE {
            return 0;
        }
        self.search_around(graph, goal, field);
        let first = field.first_of(home).unwrap_or(0);
        field.from_regions[home as usize] =
            u32::from(middle(&field.steps[first as usize..][..self.boxes_of(home)]));
        self.search_regions(home, &mut field.from_regions) + field.steps.len()
    }

    fn boxes_of(&self, region: u32) -> usize {
        self.list[region as usize].boxes.len()
    }

    fn search_around(&self, graph: &AnchorGraph, goal: u32, field: &mut RegionField) {
        let home = self.of[goal as usize];
        let beside = self.list[home as usize].links.iter().map(|link| link.to);
        let mut boxes = 0;
        for region in [home].into_iter().chain(beside) {
            field.around.push((region, boxes as u32));
            boxes += self.boxes_of(region);
        }
        field.steps.resize(boxes, UNSEEN);
        let mut queue = vec![goal];
        let place = |field: &RegionField, at: u32| {
            let first = field.first_of(self.of[at as usize])?;
            Some(first as usize + usize::from(self.slots[at as usize]))
        };
        field.steps[usize::from(self.slots[goal as usize])] = 0;
        let mut head = 0;
        while let Some(&at) = queue.get(head) {
            head += 1;
            let next = place(field, at).map_or(0, |place| field.steps[place] + 1);
            for (_, neighbor) in graph.neighbors(at) {
                let Some(place) = place(field, neighbor) else { continue };
                if field.steps[place] == UNSEEN {
                    field.steps[place] = next;
                    queue.push(neighbor);
                }
            }
        }
    }

    /// Searches from region to region (Dijkstra 1959, "A note on two problems in connexion with graphs").
    fn search_regions(&self, home: u32, from_regions: &mut [u32]) -> usize {
        let mut queue = BinaryHeap::from([Reverse((from_regions[home as usize], home))]);
        let mut visits = 0;
        while let Some(Reverse((steps, region))) = queue.pop() {
            // One that was reached by fewer steps since.
            if steps > from_regions[region as usize] {
                continue;
            }
            visits += 1;
            for link in &self.list[region as usize].links {
                let next = steps + link.between;
                let known = &mut from_regions[link.to as usize];
                if next < *known {
                    *known = next;
                    queue.push(Reverse((next, link.to)));
                }
            }
        }
        visits
    }

    /// Returns the steps from a box to a goal; none without a path.
    pub(crate) fn steps(&self, field: &RegionField, at: u32) -> Option<u32> {
        let region = self.of[at as usize];
        let slot = usize::from(self.slots[at as usize]);
        if let Some(first) = field.first_of(region) {
            return Some(u32::from(field.steps[first as usize + slot]));
        }
        let nearer = self.links_nearer(field, region);
        nearer.map(|(link, rest)| u32::from(link.steps[slot]) + rest).min()
    }

    /// Returns the steps from a box to a goal by way of a neighbor, as far as they compare with [`Self::steps`] from the
    /// box itself; none without a path.
    pub(crate) fn steps_by(&self, field: &RegionField, at: u32, neighbor: u32) -> Option<u32> {
        let from = self.of[at as usize];
        let to = self.of[neighbor as usize];
        let is_around = |region| field.first_of(region).is_some();
        if from == to || is_around(from) && is_around(to) {
            return self.steps(field, neighbor).map(|steps| steps + 1);
        }
        let mut nearer = self.links_nearer(field, from).filter(|(link, _)| link.to == to);
        if let Some((_, rest)) = nearer.next().filter(|_| !is_around(from)) {
            return Some(1 + rest);
        }
        // It would have to come back.
        self.steps(field, at).map(|steps| steps + 2)
    }

    /// Returns the links from a region to those nearer to a goal, each with the steps from the border on.
    fn links_nearer<'a>(
        &'a self,
        field: &'a RegionField,
        region: u32,
    ) -> impl Iterator<Item = (&'a Link, u32)> {
        let own = field.from_regions[region as usize];
        let links = self.list[region as usize].links.iter();
        let with_rest = links.map(|link| (link, field.from_regions[link.to as usize]));
        with_rest
            .filter(move |&(_, steps)| steps < own)
            .map(|(link, steps)| (link, steps + link.beyond))
    }
}

/// Returns the column and row of a box's block.
fn block_of(graph: &AnchorGraph, at: u32) -> (u32, u32) {
    let (col, row) = graph.position(at);
    (col / BLOCK, row / BLOCK)
}

/// Returns the steps from the box in the middle of the list of a region, which a search from its first box made: so it is
/// about half as far away as the last one.
fn middle(steps: &[u16]) -> u16 {
    steps[steps.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::GoalDistances;
    use crate::pose::ActionModel;
    use proptest::prelude::*;
    use sidestep_map::planning::FreeSpace;

    /// A floor of several blocks, with walls across it that have gaps.
    fn floor(gaps: &[u32], posts: u32) -> FreeSpace {
        let gaps = gaps.to_vec();
        FreeSpace::new(100, 80, move |col, row| {
            let wall = (col / 9) as usize;
            let is_wall = col % 9 == 4 && row / 4 != gaps[wall % gaps.len()] % 20;
            let is_post = (col * 31 + row * 17) % 97 < posts % 20;
            !is_wall && !is_post
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn who_goes_by_the_lowest_steps_comes_to_the_goal_from_each_box_with_a_path(
            gaps in proptest::collection::vec(0u32..20, 1..12), posts in 0u32..20, goal in 0u32..8000,
            starts in proptest::collection::vec(0u32..8000, 20),
        ) {
            let graph = AnchorGraph::new(&floor(&gaps, posts), 1);
            prop_assume!(graph.is_anchor(goal));
            let regions = Regions::new(&graph);
            let mut field = RegionField::default();
            regions.search(&graph, goal, &mut field);
            let distances = GoalDistances::new(&graph, ActionModel::Classical, goal);
            for start in starts.into_iter().filter(|&start| graph.is_anchor(start)) {
                let shortest = distances.steps(start * 4);
                let is_reachable = shortest != GoalDistances::UNREACHABLE;
                prop_assert_eq!(regions.steps(&field, start).is_some(), is_reachable);
                if !is_reachable {
                    continue;
                }
                let mut at = start;
                let mut steps = 0;
                while at != goal {
                    let neighbors = graph.neighbors(at).map(|(_, neighbor)| neighbor);
                    let best = neighbors.min_by_key(|&next| regions.steps_by(&field, at, next));
                    let best = best.expect("a path leads on");
                    prop_assert!(regions.steps_by(&field, at, best) <= regions.steps(&field, at));
                    at = best;
                    steps += 1;
                    prop_assert!(steps <= 8000, "it goes in circles");
                }
                // Of a way of several blocks, each costs at most a detour within it.
                prop_assert!(steps <= 3 * shortest + 200, "{steps} for {shortest}");
            }
        }
    }

    #[test]
    fn around_the_goal_the_steps_are_those_of_the_shortest_way_through_the_regions_there() {
        let graph = AnchorGraph::new(&FreeSpace::new(96, 96, |_, _| true), 1);
        let regions = Regions::new(&graph);
        let mut field = RegionField::default();
        let index = |position| graph.anchor(position).expect("free");
        regions.search(&graph, index((50, 40)), &mut field);
        assert_eq!(regions.steps(&field, index((50, 40))), Some(0));
        assert_eq!(regions.steps(&field, index((30, 45))), Some(25));
        assert_eq!(regions.steps_by(&field, index((30, 45)), index((31, 45))), Some(25));
        assert_eq!(regions.steps_by(&field, index((30, 45)), index((29, 45))), Some(27));
    }
}
