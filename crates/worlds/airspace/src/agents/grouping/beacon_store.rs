//! The knowledge of which airplanes see and hear each other, and the groups that follow from it.

use super::beacon::{Beacon, GroupingMessageItem};
use sidestep_kernel::EntityId;
use std::collections::{BTreeMap, BTreeSet};

/// The items that one airplane knows, its own among them.
#[derive(Debug)]
pub(super) struct BeaconStore {
    beacons: BTreeMap<EntityId, Beacon>,
    reports: BTreeMap<EntityId, Vec<EntityId>>,
    /// Whether all hear all that are near them, without a report.
    is_sure: bool,
    chain_search: ConnectedGroupSearch,
}

/// The chain from the own airplane, as far as all is known that it depends on.
#[derive(Debug)]
struct ConnectedGroupSearch {
    from: EntityId,
    chain: BTreeSet<EntityId>,
    /// Those in it for which some that they have heard are not fully known yet, each with the number of those
    /// visited.
    due: Vec<(EntityId, usize)>,
}

impl ConnectedGroupSearch {
    fn new(from: EntityId) -> Self {
        Self { from, chain: BTreeSet::from([from]), due: vec![(from, 0)] }
    }
}

impl BeaconStore {
    /// Returns the roster of an airplane that has heard nothing yet.
    pub(super) fn new(own: Beacon, is_sure: bool) -> Self {
        let chain_search = ConnectedGroupSearch::new(own.own.id);
        let beacons = BTreeMap::from([(own.own.id, own)]);
        Self { beacons, reports: BTreeMap::new(), is_sure, chain_search }
    }

    /// Records a beacon. Returns whether there was none of the airplane; a beacon from the airplane itself counts for
    /// more than one that others pass on.
    pub(super) fn add_beacon(&mut self, beacon: Beacon, is_own: bool) -> bool {
        let id = beacon.own.id;
        if !is_own && self.beacons.contains_key(&id) {
            return false;
        }
        if self.beacons.get(&id).is_some_and(|known| known.near != beacon.near) {
            // Another airplane has lied about it, and all conclusions from that are void.
            self.chain_search = ConnectedGroupSearch::new(self.chain_search.from);
        }
        self.beacons.insert(id, beacon).is_none()
    }

    /// Records the airplanes that another one has heard. Returns whether that is new: the first report counts.
    pub(super) fn add_report(&mut self, id: EntityId, heard: Vec<EntityId>) -> bool {
        let is_new = !self.reports.contains_key(&id);
        self.reports.entry(id).or_insert(heard);
        is_new
    }

    pub(super) fn beacon(&self, id: EntityId) -> Option<&Beacon> {
        self.beacons.get(&id)
    }

    pub(super) fn has_beacon(&self, id: EntityId) -> bool {
        self.beacons.contains_key(&id)
    }

    /// Returns whether everything that there is to know of an airplane is known.
    pub(super) fn is_fully_known(&self, id: EntityId) -> bool {
        self.has_beacon(id) && self.aircraft_heard_by(id).is_some()
    }

    /// Returns the report of an airplane or its beacon, if that is known.
    pub(super) fn surveillance_item(
        &self,
        about: EntityId,
        is_report: bool,
    ) -> Option<GroupingMessageItem> {
        if is_report {
            let heard = self.reports.get(&about)?.clone();
            return Some(GroupingMessageItem::Report { about, heard });
        }
        self.beacons.get(&about).cloned().map(GroupingMessageItem::Beacon)
    }

    /// Returns whether one airplane does not hear another one's items from itself, as far as is known.
    pub(super) fn is_missing(&self, id: EntityId, about: EntityId) -> bool {
        let report = self.reports.get(&id);
        !self.can_see(about, id) || report.is_some_and(|heard| heard.binary_search(&about).is_err())
    }

    /// Returns those near an airplane that it has heard, if that is known.
    fn aircraft_heard_by(&self, id: EntityId) -> Option<&[EntityId]> {
        if self.is_sure {
            self.beacons.get(&id).map(|beacon| &beacon.near[..])
        } else {
            self.reports.get(&id).map(Vec::as_slice)
        }
    }

    fn can_see(&self, id: EntityId, other: EntityId) -> bool {
        self.beacons.get(&id).is_some_and(|beacon| beacon.near.binary_search(&other).is_ok())
    }

    fn can_hear(&self, id: EntityId, other: EntityId) -> bool {
        self.aircraft_heard_by(id).is_some_and(|heard| heard.binary_search(&other).is_ok())
    }

    /// Returns whether two airplanes hear each other.
    fn is_linked(&self, a: EntityId, b: EntityId) -> bool {
        self.has_beacon(a) && self.has_beacon(b) && self.can_hear(a, b) && self.can_hear(b, a)
    }

    /// Returns all to which a chain of airplanes that hear each other leads from one, itself among them, and whether
    /// everything is known that this depends on.
    fn connected_aircraft(&self, from: EntityId) -> (BTreeSet<EntityId>, bool) {
        let mut chain = BTreeSet::from([from]);
        let mut due = vec![from];
        let mut is_complete = true;
        while let Some(id) = due.pop() {
            is_complete &= self.is_fully_known(id);
            for &other in self.aircraft_heard_by(id).unwrap_or_default() {
                is_complete &= self.is_fully_known(other);
                if self.is_linked(id, other) && chain.insert(other) {
                    due.push(other);
                }
            }
        }
        (chain, is_complete)
    }

    /// Returns the same as [`Self::is_complete`] for the own airplane, and continues where it stopped before: each
    /// link is visited once, however often incomplete knowledge arrives.
    pub(super) fn advance_group_search(&mut self) -> bool {
        let mut search = std::mem::replace(&mut self.chain_search, ConnectedGroupSearch::new(0));
        let is_complete = self.continue_group_search(&mut search);
        self.chain_search = search;
        is_complete
    }

    fn continue_group_search(
        &self,
        ConnectedGroupSearch { chain, due, .. }: &mut ConnectedGroupSearch,
    ) -> bool {
        while let Some(&(id, visited)) = due.last() {
            let heard = self.aircraft_heard_by(id).filter(|_| self.has_beacon(id));
            let Some(heard) = heard else { return false };
            let Some(&other) = heard.get(visited) else {
                due.pop();
                continue;
            };
            if !self.is_fully_known(other) {
                return false;
            }
            // The items of two airplanes no longer change, nor does whether they hear each other.
            due.last_mut().expect("it is there").1 += 1;
            if self.is_linked(id, other) && chain.insert(other) {
                due.push((other, 0));
            }
        }
        true
    }

    /// Returns whether all is known on which the group of an airplane depends.
    pub(super) fn is_complete(&self, id: EntityId) -> bool {
        self.connected_aircraft(id).1
    }

    /// Returns the group of an airplane, itself among it, by rising id.
    pub(super) fn group(&self, id: EntityId) -> Vec<EntityId> {
        self.connected_aircraft(id).0.into_iter().collect()
    }
}
