//! Lists of starts and tasks: comments, the number of items, then one item in each line.

use crate::char_map::{Line, SourceText};
use sidestep_kernel::InputError;
use sidestep_map::{Cell, Components, GridMap, UnknownPolicy};

/// What the lists refer to.
pub(super) struct Lists<'a> {
    map: &'a GridMap,
    components: Components,
}

impl<'a> Lists<'a> {
    pub(super) fn new(map: &'a GridMap) -> Self {
        Self { map, components: map.components(UnknownPolicy::Keep) }
    }

    pub(super) fn parse_starts(
        &self,
        place: &str,
        text: &str,
    ) -> Result<Vec<(u32, u32)>, InputError> {
        let source = SourceText { place, text };
        let mut starts = Vec::new();
        let mut is_taken = vec![false; self.map.cells().len()];
        for line in items(source)? {
            let start = self.location(source, line.text)?;
            let index = start.1 as usize * self.map.width() as usize + start.0 as usize;
            if std::mem::replace(&mut is_taken[index], true) {
                let cause = format!("a second robot starts at {}", line.text.trim());
                return Err(source.error(line.offset, cause, "give each robot a start of its own"));
            }
            starts.push(start);
        }
        Ok(starts)
    }

    pub(super) fn parse_tasks(
        &self,
        place: &str,
        text: &str,
        starts: &[(u32, u32)],
    ) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
        let mut has_robot = vec![false; self.components.sizes().len()];
        for &(col, row) in starts {
            if let Some(label) = self.components.label_at(col, row) {
                has_robot[label as usize] = true;
            }
        }
        self.parse_reachable_tasks(SourceText { place, text }, &has_robot)
    }

    /// As [`Self::parse_tasks`], where robots may start anywhere.
    pub(super) fn parse_tasks_from_anywhere(
        &self,
        place: &str,
        text: &str,
    ) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
        let has_robot = vec![true; self.components.sizes().len()];
        self.parse_reachable_tasks(SourceText { place, text }, &has_robot)
    }

    fn parse_reachable_tasks(
        &self,
        source: SourceText<'_>,
        has_robot: &[bool],
    ) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
        let mut tasks = Vec::new();
        for line in items(source)? {
            tasks.push(self.errands(source, line, has_robot)?);
        }
        Ok(tasks)
    }

    /// Reads the places of one task, which the same robot has to reach one after the other.
    fn errands(
        &self,
        source: SourceText<'_>,
        line: Line<'_>,
        has_robot: &[bool],
    ) -> Result<Vec<(u32, u32)>, InputError> {
        let mut errands = Vec::new();
        let mut first_label = None;
        for word in line.text.trim().trim_end_matches(',').split(',') {
            let (col, row) = self.location(source, word)?;
            let label = self.components.label_at(col, row);
            let is_reachable = label.is_some_and(|label| has_robot[label as usize]);
            if !is_reachable || *first_label.get_or_insert(label) != label {
                let cause = if is_reachable {
                    format!("there is no path to {} from the place before", word.trim())
                } else {
                    format!("no robot can come to {}", word.trim())
                };
                let remedy = "give places that free boxes connect with each other and with a start";
                return Err(source.error(source.offset_of(word), cause, remedy));
            }
            errands.push((col, row));
        }
        Ok(errands)
    }

    /// Reads a location, row * width + column, as column and row from the south.
    fn location(&self, source: SourceText<'_>, word: &str) -> Result<(u32, u32), InputError> {
        let offset = source.offset_of(word.trim_start());
        let [width, height] = [self.map.width(), self.map.height()];
        let boxes = u64::from(width) * u64::from(height);
        let number = word.trim().parse::<u64>().ok().filter(|&number| number < boxes);
        let Some(number) = number else {
            let cause = format!("`{}` is no location on the map", word.trim().escape_debug());
            let remedy = format!(
                "write row * {width} + column, counted from 0 at the top left: 0 to {}",
                boxes - 1
            );
            return Err(source.error(offset, cause, remedy));
        };
        let col = (number % u64::from(width)) as u32;
        let row = height - 1 - (number / u64::from(width)) as u32;
        if self.map.cell(col, row) != Cell::Free {
            let from_top = height - 1 - row;
            let cause = format!("location {number}, row {from_top} and column {col}, is a wall");
            return Err(source.error(offset, cause, "give a free box of the map"));
        }
        Ok((col, row))
    }
}

/// Returns the lines of the items of a list. Their number comes first.
fn items<'a>(source: SourceText<'a>) -> Result<Vec<Line<'a>>, InputError> {
    let is_content = |line: &Line<'_>| {
        let text = line.text.trim();
        !text.is_empty() && !text.starts_with('#')
    };
    let mut lines = source.lines_of(source.text).filter(is_content);
    let Some(first) = lines.next() else {
        let remedy = "begin with the number of items, then write one in each line";
        return Err(source.error(source.text.len(), "the list is empty", remedy));
    };
    let count: usize = first.text.trim().trim_end_matches(',').parse().map_err(|_| {
        let cause = format!("`{}` is no number of items", first.text.trim().escape_debug());
        source.error(first.offset, cause, "begin with the number of items that follow")
    })?;
    let items: Vec<Line<'a>> = lines.collect();
    if items.len() == count {
        return Ok(items);
    }
    if items.len() < count {
        let cause = format!("the list ends after {} of {count} items", items.len());
        let remedy = format!("copy the whole file, or write {} as its number", items.len());
        return Err(source.error(source.text.len(), cause, remedy));
    }
    let cause = format!("the list has {} items, not {count}", items.len());
    let remedy = format!("write {} as its number, or remove the others", items.len());
    Err(source.error(items[count].offset, cause, remedy))
}
