//! Body tables as few bytes: the bodies of many tables once, and for each table those that come and go.
//!
//! Where airplanes appear and arrive all day, each change begins another table, and most of its bodies are those of the
//! table before. Bodies of a frame are always in the same order, so a table is a selection of one list of all bodies.

use super::parts::Parts;
use crate::protocol::{Appearance, BodyTable, ReplayTables, ReplayTablesPart, Shape};
use serde::Serialize;
use sidestep_session::Error;
use std::collections::BTreeMap;

/// Largest number of tables of a part: the page applies as many changes to find one.
const MAX_TABLES: usize = 256;
/// Number of bodies from which a part is complete: a browser reads as many within a picture.
const MAX_BODIES: usize = 20_000;

/// Tables that are collected until they are a part.
#[derive(Default)]
pub(super) struct TableParts {
    /// The part that is not complete yet.
    open: TableList,
    parts: Vec<ReplayTables>,
}

impl TableParts {
    /// Adds the next table.
    ///
    /// # Errors
    /// When the file becomes too large.
    pub(super) fn push(&mut self, table: &BodyTable, parts: &mut Parts) -> Result<(), Error> {
        let is_full = self.open.changes.len() == MAX_TABLES || self.open.order.len() >= MAX_BODIES;
        if is_full || !self.open.add(table) {
            self.flush(parts)?;
            self.open.add(table);
        }
        Ok(())
    }

    /// Returns the parts, with all tables in them.
    ///
    /// # Errors
    /// When the file becomes too large.
    pub(super) fn finish(&mut self, parts: &mut Parts) -> Result<Vec<ReplayTables>, Error> {
        self.flush(parts)?;
        Ok(std::mem::take(&mut self.parts))
    }

    fn flush(&mut self, parts: &mut Parts) -> Result<(), Error> {
        let list = std::mem::take(&mut self.open);
        let tables = list.changes.len() as u32;
        if tables > 0 {
            let part = parts.push_json(&list.into_part())?;
            self.parts.push(ReplayTables { part, tables });
        }
        Ok(())
    }
}

/// A body as tables have it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct ListedBody {
    kind: u32,
    number: u32,
    part: i32,
    shape: u32,
    appearance: u32,
    name: Option<String>,
    is_agent: bool,
}

/// All bodies of some consecutive tables, in the order that all of them have.
#[derive(Default)]
struct TableList {
    kinds: Distinct<String>,
    shapes: Distinct<Shape>,
    appearances: Distinct<[Appearance; 5]>,
    bodies: Vec<ListedBody>,
    number_of: BTreeMap<ListedBody, usize>,
    /// Numbers of bodies, in the order of frames.
    order: Vec<usize>,
    /// Whether each body is in the last table.
    is_present: Vec<bool>,
    /// The bodies that come or go with each table.
    changes: Vec<Vec<usize>>,
}

impl TableList {
    /// Adds a table; returns false if its bodies are in another order than those of the tables before. Then nothing was
    /// added.
    fn add(&mut self, table: &BodyTable) -> bool {
        let listed = self.listed(table);
        let Some(places) = self.places_of(&listed) else { return false };
        let mut is_present = vec![false; self.bodies.len()];
        let mut next = 0;
        for (body, place) in listed.into_iter().zip(places) {
            let number = match place {
                Some(place) => {
                    next = place.max(next);
                    self.order[next]
                }
                None => {
                    let number = self.bodies.len();
                    self.order.insert(next, number);
                    self.number_of.insert(body.clone(), number);
                    self.bodies.push(body);
                    self.is_present.push(false);
                    is_present.push(false);
                    number
                }
            };
            next += 1;
            is_present[number] = true;
        }
        let changes = (0..self.bodies.len()).filter(|&k| is_present[k] != self.is_present[k]);
        self.changes.push(changes.collect());
        self.is_present = is_present;
        true
    }

    fn listed(&mut self, table: &BodyTable) -> Vec<ListedBody> {
        let kinds: Vec<u32> = table.kinds.iter().map(|kind| self.kinds.number(kind)).collect();
        let shapes: Vec<u32> = table.shapes.iter().map(|shape| self.shapes.number(shape)).collect();
        let appearances: Vec<u32> =
            table.appearances.iter().map(|one| self.appearances.number(one)).collect();
        let mut names: BTreeMap<u32, &String> = BTreeMap::new();
        names.extend(table.names.iter().map(|(index, name)| (*index, name)));
        let body = |k: usize| ListedBody {
            kind: kinds[usize::from(table.kind[k])],
            number: table.number[k],
            part: table.part[k],
            shape: shapes[table.shape[k] as usize],
            appearance: appearances[usize::from(table.appearance[k])],
            name: names.get(&(k as u32)).map(|name| (*name).clone()),
            is_agent: table.is_agent[k],
        };
        (0..table.kind.len()).map(body).collect()
    }

    /// Returns the place of each body in the order, as far as it has one; none if the bodies have another order.
    fn places_of(&self, listed: &[ListedBody]) -> Option<Vec<Option<usize>>> {
        let mut place_of = vec![0; self.bodies.len()];
        for (place, &number) in self.order.iter().enumerate() {
            place_of[number] = place;
        }
        let mut places = Vec::with_capacity(listed.len());
        // Bodies that are new move those behind them.
        let mut moved_by = 0;
        let mut before = None;
        for body in listed {
            let known = self.number_of.get(body).map(|&number| place_of[number]);
            match known {
                Some(place) if before.is_some_and(|before| place <= before) => return None,
                Some(place) => {
                    before = Some(place);
                    places.push(Some(place + moved_by));
                }
                None => {
                    moved_by += 1;
                    places.push(None);
                }
            }
        }
        Some(places)
    }

    fn into_part(self) -> ReplayTablesPart {
        let mut place_of = vec![0; self.bodies.len()];
        for (place, &number) in self.order.iter().enumerate() {
            place_of[number] = place as u32;
        }
        let changes = self.changes.into_iter().map(|change| {
            let mut places: Vec<u32> = change.into_iter().map(|number| place_of[number]).collect();
            places.sort_unstable();
            places
        });
        let bodies: Vec<&ListedBody> =
            self.order.iter().map(|&number| &self.bodies[number]).collect();
        let named = (0..).zip(&bodies);
        let names = named.filter_map(|(place, body)| Some((place, body.name.clone()?)));
        let all = BodyTable {
            session: 0,
            id: 0,
            kind: bodies.iter().map(|body| body.kind as u8).collect(),
            number: bodies.iter().map(|body| body.number).collect(),
            part: bodies.iter().map(|body| body.part).collect(),
            shape: bodies.iter().map(|body| body.shape).collect(),
            appearance: bodies.iter().map(|body| body.appearance as u16).collect(),
            names: names.collect(),
            is_agent: bodies.iter().map(|body| body.is_agent).collect(),
            kinds: self.kinds.items,
            shapes: self.shapes.items,
            appearances: self.appearances.items,
        };
        ReplayTablesPart { all, changes: changes.collect() }
    }
}

/// Different things, each with a number. They are told apart by their text, because floats have no order.
struct Distinct<T> {
    items: Vec<T>,
    number_of: BTreeMap<String, u32>,
}

impl<T> Default for Distinct<T> {
    fn default() -> Self {
        Self { items: Vec::new(), number_of: BTreeMap::new() }
    }
}

impl<T: Serialize + Clone> Distinct<T> {
    fn number(&mut self, item: &T) -> u32 {
        // Plain data: serializing cannot fail.
        let text = serde_json::to_string(item).unwrap_or_default();
        *self.number_of.entry(text).or_insert_with(|| {
            self.items.push(item.clone());
            self.items.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(id: u32, numbers: &[u32]) -> BodyTable {
        let shape = Shape::Sphere { radius_m: 1.5 };
        let appearance = Appearance { color: [1, 2, 3], opacity: 1.0, layer: 0 };
        let n = numbers.len();
        BodyTable {
            session: 0,
            id,
            kinds: vec!["airplane".into()],
            kind: vec![0; n],
            number: numbers.to_vec(),
            part: vec![-1; n],
            shapes: vec![shape],
            shape: vec![0; n],
            appearances: vec![std::array::from_fn(|_| appearance.clone())],
            appearance: vec![0; n],
            names: (0..).zip(numbers).map(|(k, number)| (k, format!("AP{number}"))).collect(),
            is_agent: vec![true; n],
        }
    }

    /// The numbers and names of the bodies of each table, as a page reads them.
    fn read(part: &ReplayTablesPart) -> Vec<Vec<(u32, String)>> {
        let ReplayTablesPart { all, changes } = part;
        let mut is_present = vec![false; all.kind.len()];
        let mut tables = Vec::new();
        for change in changes {
            change.iter().for_each(|&k| is_present[k as usize] = !is_present[k as usize]);
            let present = (0..all.kind.len()).filter(|&k| is_present[k]);
            let named = present.map(|k| (all.number[k], all.names[k].1.clone()));
            tables.push(named.collect());
        }
        tables
    }

    #[test]
    fn tables_are_read_back_and_each_body_stands_there_once() {
        let tables: [&[u32]; 6] = [&[3, 7], &[3, 5, 7], &[5, 7, 9], &[], &[1, 7, 9, 11], &[3, 11]];
        let mut list = TableList::default();
        for (k, numbers) in (1..).zip(tables) {
            assert!(list.add(&table(k, numbers)), "{numbers:?}");
        }
        let part = list.into_part();
        assert_eq!(part.all.number.len(), 6, "{:?}", part.all.number);
        let found = read(&part);
        let expected = tables
            .map(|numbers| numbers.iter().map(|n| (*n, format!("AP{n}"))).collect::<Vec<_>>());
        assert_eq!(found, expected);
        assert_eq!(part.changes[1].len(), 1, "one airplane came");
    }

    #[test]
    fn another_order_or_too_many_tables_begin_another_part() {
        let mut tables = TableParts::default();
        let mut parts = Parts::default();
        let mut push = |numbers: &[u32]| tables.push(&table(0, numbers), &mut parts).expect("room");
        push(&[1, 2]);
        push(&[2, 1]);
        (0..MAX_TABLES as u32).for_each(|n| push(&[2, 1, 3 + n % 2]));
        let found: Vec<u32> =
            tables.finish(&mut parts).expect("room").iter().map(|part| part.tables).collect();
        assert_eq!(found, [1, MAX_TABLES as u32, 1]);
    }
}
