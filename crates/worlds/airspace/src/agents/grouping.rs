//! Groups that airplanes find by themselves, from beacons.
//!
//! Airplanes that have to consider each other decide together. Their group can be announced by an observer that sees
//! all of them; here it is not. An airplane sees the others *near* it: so near that the two have to consider each
//! other. A group reaches farther, from one to the next, and no airplane sees all of it. So at the start of each cycle
//! the airplanes find their group in a conversation of its own:
//!
//! 1. Each sends its *beacon* to those near it: where all see it (place, heading, altitude, whether it is on its
//!    orbit, and the command of its method that is in force), the airplanes that it sees near it, and the
//!    non-cooperative ones near it. Its filed speed and its abilities are in the filed plan.
//! 2. When the beacons of all near have come, or those that are missing were requested so often that their senders
//!    can hardly be reached, it *reports* the airplanes that it has heard. It reports once, and so all information
//!    about it in a cycle is two items, each of which is known or not: there are no versions of an item, and an old
//!    one is never taken for a new one.
//! 3. An item is relayed to those near that lack it: that do not see its airplane, or report that they have not heard
//!    it. So each item goes from one to the next over all links that work.
//! 4. Two airplanes *hear each other* if both say so. The *group* of an airplane are all to which a chain of such
//!    pairs leads from it. It has all that it needs when it knows both items of every airplane in the chain, and of
//!    those that these have heard; all others of the chain find the same from the same items (`beacon_store.rs`).
//!
//! **Definition of a group.** Where all hear all that are near them, it is the group that the simulator would
//! announce, because both use the same nearness. A partition, or a radio range that is too short, cuts it into parts
//! that can communicate. Two near each other may be in it that do not hear each other, as long as others hear both: the
//! conversations that follow find that out as they do where groups are announced, and go on without the one for the
//! other. To leave out one of the two would be a simpler rule but would cost more: with four links of 56 that work one
//! way only, super-conflicts of 8 were delayed by 43 % instead of 5 %.
//!
//! **Conversations of a group.** All later conversations of the cycle carry the cycle and a digest of the members
//! ([`ConversationId`](super::packet::ConversationId)). Packets between airplanes of different beliefs are of
//! different conversations, and are dropped. So beliefs never mix: either the whole group in which an airplane
//! believes answers, or those of another belief do not, and are given up after some requests.
//!
//! **Why that loses no safety.** To the shield, an airplane that is near and not in the group is like one whose
//! radio is dead: seen, and not heard ([`exchange`](super::exchange)). The proof there is about two airplanes that
//! see each other, regardless of the messages heard, and all that have to consider each other do. It does not ask
//! whether the two believe in the same group: a plan counts as accepted only within one conversation, and an airplane
//! that counts as unheard never accepts. So an airplane may be wrong about its group in any way, by losses, by links
//! that work one way only, in a partition, or because another one lies, and the worst outcome is that it waits on its
//! orbit. Where the network loses nothing there are no reports, because all near hear each other; no airplane goes on
//! before it knows the whole group, and so all know the same one, as plans that are certain
//! ([`PlanCertainty::Sure`]) require.

mod beacon;
mod beacon_store;
#[cfg(test)]
mod tests;

use super::link::{self, MessageLimits};
use super::participant::InvalidMessage;
use crate::flight::{CommandLimits, Surface};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::shield::PlanCertainty;
pub use beacon::{Beacon, GroupingMessageItem, SurveillanceReport, TrackedState};
use beacon_store::BeaconStore;
use sidestep_kernel::EntityId;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Largest number of items of a message: enough for most groups in one message, and few enough that the bound on its
/// bytes, which must hold before a message is read, stays small.
const MAX_ITEMS: usize = 64;

/// The knowledge of an agent at its start.
#[derive(Debug, Clone)]
pub struct GroupingInput {
    /// Place of its airplane among those near it.
    pub me: usize,
    /// Those near it, itself among them, by rising id.
    pub near: Vec<SurveillanceReport>,
    /// Non-cooperative airplanes near it, by rising id.
    pub non_cooperative: Vec<NonCooperativeAircraft>,
    /// Whether each of those near was heard lately or is met for the first time.
    pub expected: Vec<bool>,
    /// Number of all airplanes.
    pub airplanes: usize,
    /// The commands that may be in force for each of them; empty where no method commands anything.
    pub command_limits: Arc<[CommandLimits]>,
    /// The surface that all fly over.
    pub surface: Surface,
    /// Distance in meters that messages reach.
    pub range_m: f64,
    /// Whether the network loses nothing.
    pub certainty: PlanCertainty,
}

/// The group that an airplane has found.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupingResult {
    /// The airplanes that decide together, its own among them, by rising id.
    pub members: Vec<SurveillanceReport>,
    /// The non-cooperative airplanes near any of them, by rising id.
    pub non_cooperative: Vec<NonCooperativeAircraft>,
}

/// The agent of one airplane that looks for its group.
#[derive(Debug)]
pub struct GroupingAgent {
    input: GroupingInput,
    roster: BeaconStore,
    /// The airplanes near it that have sent their beacons themselves.
    heard: BTreeSet<EntityId>,
    /// Whether nothing more will come from each of those near.
    is_gone: Vec<bool>,
    /// Items that have not been relayed: airplane, and whether it is the report.
    unsent: BTreeSet<(EntityId, bool)>,
    has_reported: bool,
    /// Whether anything has come since its last step that may let it go on.
    has_news: bool,
    result: Option<GroupingResult>,
}

impl GroupingAgent {
    /// Returns an agent that has not sent anything yet.
    pub fn new(input: GroupingInput) -> Self {
        let own = input.near[input.me];
        let beacon = Beacon {
            own,
            near: input.near.iter().map(|one| one.id).filter(|&id| id != own.id).collect(),
            non_cooperative: input.non_cooperative.clone(),
        };
        let is_sure = input.certainty == PlanCertainty::Sure;
        let is_gone = input
            .near
            .iter()
            .map(|other| input.surface.distance_m(own.pose.at, other.pose.at) > input.range_m)
            .collect();
        Self {
            is_gone,
            roster: BeaconStore::new(beacon, is_sure),
            input,
            heard: BTreeSet::new(),
            unsent: BTreeSet::new(),
            has_reported: is_sure,
            has_news: true,
            result: None,
        }
    }

    fn id(&self) -> EntityId {
        self.input.near[self.input.me].id
    }

    /// Returns the others near it, with their places.
    fn nearby_others(&self) -> impl Iterator<Item = (usize, EntityId)> {
        let me = self.input.me;
        self.input.near.iter().map(|one| one.id).enumerate().filter(move |(place, _)| *place != me)
    }

    /// Takes an item. Returns whether others may lack it now that did not before.
    fn receive_item(&mut self, from: EntityId, item: GroupingMessageItem) -> bool {
        let id = item.subject_id();
        if id == self.id() {
            return false;
        }
        match item {
            GroupingMessageItem::Beacon(beacon) => {
                let is_own = id == from;
                let is_new = self.roster.add_beacon(beacon, is_own);
                if is_new {
                    self.unsent.insert((id, false));
                }
                if is_own {
                    self.heard.insert(id);
                }
                self.has_news |= is_new | is_own;
                false
            }
            GroupingMessageItem::Report { heard, .. } => {
                let is_new = self.roster.add_report(id, heard);
                if is_new {
                    self.unsent.insert((id, true));
                }
                self.has_news |= is_new;
                is_new && self.nearby_others().any(|(_, other)| other == id)
            }
        }
    }

    /// Returns whether another one near lacks the known items about an airplane.
    fn is_relay_needed(&self, about: EntityId) -> bool {
        self.nearby_others().any(|(_, id)| id != about && self.roster.is_missing(id, about))
    }

    /// Takes out the items that have to be relayed, of those `about` these airplanes.
    fn take_relay_items(&mut self, about: &BTreeSet<EntityId>) -> Vec<Vec<GroupingMessageItem>> {
        let mut items = Vec::new();
        for &id in about {
            let keys =
                [(id, false), (id, true)].map(|key| self.unsent.contains(&key).then_some(key));
            // Most incoming items have come before, and are no longer kept. This is much cheaper to find out than
            // whether another one lacks them.
            if keys == [None, None] || !self.roster.has_beacon(id) || !self.is_relay_needed(id) {
                continue;
            }
            for key in keys.into_iter().flatten() {
                self.unsent.remove(&key);
                items.extend(self.roster.surveillance_item(key.0, key.1));
            }
        }
        items.chunks(MAX_ITEMS).map(<[GroupingMessageItem]>::to_vec).collect()
    }

    /// Returns whether all near have been heard, or never will be.
    fn has_heard_all(&self) -> bool {
        self.nearby_others().all(|(place, id)| self.is_gone[place] || self.heard.contains(&id))
    }

    /// Returns whether it has all on which its group depends, or as much as it ever will.
    fn has_all(&mut self) -> bool {
        let present = self.responsive_others();
        self.places_with_missing_items(&present).is_empty()
            && (present.is_empty() || self.roster.advance_group_search())
    }

    /// Returns the others near it from which something may come, with their places.
    fn responsive_others(&self) -> Vec<(usize, EntityId)> {
        self.nearby_others().filter(|&(place, _)| !self.is_gone[place]).collect()
    }

    /// Returns the places of those from which an item is missing.
    fn places_with_missing_items(&self, present: &[(usize, EntityId)]) -> Vec<usize> {
        // Where nothing is lost, an item may have come by way of any airplane.
        let is_sure = self.input.certainty == PlanCertainty::Sure;
        present
            .iter()
            .filter(|(_, id)| {
                let is_heard = is_sure || self.heard.contains(id);
                !is_heard || !self.roster.is_fully_known(*id)
            })
            .map(|(place, _)| *place)
            .collect()
    }

    /// Continues as far as the messages heard allow.
    fn advance(&mut self) -> Vec<Vec<GroupingMessageItem>> {
        let mut outgoing = Vec::new();
        // To look at all items anew for each message that says nothing new would take most of the time.
        if !std::mem::take(&mut self.has_news) {
            return outgoing;
        }
        if !self.has_reported && self.has_heard_all() {
            self.has_reported = true;
            let about = self.id();
            let heard: Vec<EntityId> = self.heard.iter().copied().collect();
            self.roster.add_report(about, heard.clone());
            // An agent that has heard no other one reports too, because those that hear it wait for the report.
            outgoing.push(vec![GroupingMessageItem::Report { about, heard }]);
        }
        if self.result.is_none() && self.has_reported && self.has_all() {
            self.find_group();
        }
        outgoing
    }

    /// Finds its group from the known items.
    fn find_group(&mut self) {
        let members = self.roster.group(self.id());
        let mut non_cooperative = self.input.non_cooperative.clone();
        for beacon in members.iter().filter_map(|&id| self.roster.beacon(id)) {
            non_cooperative.extend(beacon.non_cooperative.iter().cloned());
        }
        // A stable sort: where several airplanes report the same intruder, its own observation comes first.
        non_cooperative.sort_by_key(|one| one.slot);
        non_cooperative.dedup_by_key(|one| one.slot);
        let members = members
            .iter()
            .filter_map(|&id| self.roster.beacon(id).map(|beacon| beacon.own))
            .collect();
        self.result = Some(GroupingResult { members, non_cooperative });
    }
}

impl link::ProtocolAgent for GroupingAgent {
    type Message = Vec<GroupingMessageItem>;
    type Outcome = GroupingResult;

    fn start(&mut self) -> Vec<Vec<GroupingMessageItem>> {
        let own = self.roster.surveillance_item(self.id(), false);
        let mut outgoing: Vec<Vec<GroupingMessageItem>> =
            own.map(|item| vec![item]).into_iter().collect();
        outgoing.extend(self.advance());
        outgoing
    }

    fn check_message(
        &self,
        _: usize,
        items: &Vec<GroupingMessageItem>,
    ) -> Result<(), InvalidMessage> {
        InvalidMessage::Length.ensure((1..=MAX_ITEMS).contains(&items.len()))?;
        items.iter().try_for_each(|item| {
            item.check(self.input.airplanes, &self.input.command_limits)?;
            let near = &self.input.near;
            let place = near.binary_search_by_key(&item.subject_id(), |one| one.id);
            if let (GroupingMessageItem::Beacon(beacon), Ok(k)) = (item, place) {
                // A beacon must say where all see its airplane; only of those farther away is it believed.
                InvalidMessage::Plan.ensure(beacon.own == near[k])?;
            }
            Ok(())
        })
    }

    fn message_limits(&self) -> MessageLimits {
        let n = self.input.airplanes;
        // Two items of each airplane, and each comes only once from one sender.
        MessageLimits { bytes: MAX_ITEMS * beacon::max_item_bytes(n), messages: 2 * n as u32 + 2 }
    }

    fn on_message(
        &mut self,
        from: usize,
        items: Vec<GroupingMessageItem>,
    ) -> Vec<Vec<GroupingMessageItem>> {
        let from = self.input.near[from].id;
        let mut about: BTreeSet<EntityId> =
            items.iter().map(GroupingMessageItem::subject_id).collect();
        let mut may_lack_more = false;
        for item in items {
            may_lack_more |= self.receive_item(from, item);
        }
        if may_lack_more {
            about.extend(self.unsent.iter().map(|(id, _)| *id));
        }
        let mut outgoing = self.take_relay_items(&about);
        outgoing.extend(self.advance());
        outgoing
    }

    fn awaited_members(&self) -> Vec<usize> {
        if self.result.is_some() {
            return Vec::new();
        }
        let present = self.responsive_others();
        let missing = self.places_with_missing_items(&present);
        if !missing.is_empty() || self.roster.is_complete(self.id()) {
            return missing;
        }
        // Missing items of those farther away come by way of one near.
        present.into_iter().map(|(place, _)| place).collect()
    }

    fn is_expected(&self, other: usize) -> bool {
        self.input.expected[other]
    }

    fn wait_fraction(&self) -> f64 {
        // Half of the time for beacons, the rest for reports, with some left to take out what is known.
        if self.has_reported { 0.95 } else { 0.5 }
    }

    fn on_peer_gone(&mut self, other: usize, _: bool) -> Vec<Vec<GroupingMessageItem>> {
        self.is_gone[other] = true;
        self.has_news = true;
        self.advance()
    }

    fn on_deadline(&mut self) {
        if self.result.is_none() {
            self.find_group();
        }
    }

    fn is_done(&self) -> bool {
        self.result.is_some()
    }

    fn outcome(&self) -> Option<GroupingResult> {
        self.result.clone()
    }
}
