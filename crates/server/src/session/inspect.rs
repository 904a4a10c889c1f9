//! Percepts, decisions and deeds of a body, in the words of the protocol.

use crate::encode::{body, who};
use crate::protocol::{
    Fact, Inspection, Mark, MarkShape, Problem, Role, Section, Table, Value, Who,
};
use sidestep::kernel::Simulation;
use sidestep::kernel::view;

/// Returns the percepts, decisions and deeds of a body.
///
/// # Errors
/// When there is no such body, or there is nothing to show of it.
pub(super) fn inspection(run: &dyn Simulation, of: &Who) -> Result<Inspection, Problem> {
    let told = body(of).and_then(|body| run.inspect(body)).ok_or_else(|| {
        let part = of.part.map(|part| format!("/{part}")).unwrap_or_default();
        let place = format!("{}/{}{part}", of.kind, of.number);
        let remedy = format!("name a {} of this run", run.agent());
        Problem::new(place, "nothing is to tell of this body", remedy)
    })?;
    Ok(Inspection {
        who: who(&told.who),
        cycle: told.cycle as f64,
        title: told.title,
        sections: told.sections.into_iter().map(section).collect(),
        marks: told.marks.into_iter().map(mark).collect(),
    })
}

fn section(section: view::Section) -> Section {
    let fact = |fact: view::Fact| Fact { label: fact.label, value: value(fact.value) };
    Section {
        title: section.title,
        facts: section.facts.into_iter().map(fact).collect(),
        table: section.table.map(table),
    }
}

fn table(table: view::Table) -> Table {
    let row = |row: Vec<view::Value>| row.into_iter().map(value).collect();
    Table { columns: table.columns, rows: table.rows.into_iter().map(row).collect() }
}

fn value(value: view::Value) -> Value {
    match value {
        view::Value::Number { value, unit } => Value::Number { value, unit: unit.into() },
        view::Value::Share(share) => Value::Share(share),
        view::Value::Text(words) => Value::Text(words),
        view::Value::Who(of) => Value::Who(who(&of)),
        view::Value::Place(at_m) => Value::Place(at_m),
        view::Value::Yes(is_so) => Value::Yes(is_so),
        view::Value::None => Value::None,
    }
}

fn mark(mark: view::Mark) -> Mark {
    let view::Mark { role: part, label, weight, shape: form } = mark;
    Mark { role: role(part), label, weight, shape: shape(form) }
}

fn role(role: view::Role) -> Role {
    match role {
        view::Role::True => Role::True,
        view::Role::Reported => Role::Reported,
        view::Role::Wish => Role::Wish,
        view::Role::Done => Role::Done,
        view::Role::Refused => Role::Refused,
        view::Role::Claim => Role::Claim,
        view::Role::Group => Role::Group,
        view::Role::Predicted => Role::Predicted,
        view::Role::Chosen => Role::Chosen,
        view::Role::Known => Role::Known,
        view::Role::Orbit => Role::Orbit,
        view::Role::Target => Role::Target,
    }
}

fn shape(shape: view::MarkShape) -> MarkShape {
    match shape {
        view::MarkShape::Line { points_m } => MarkShape::Line { points_m },
        view::MarkShape::Area { corners_m } => MarkShape::Area { corners_m },
        view::MarkShape::Point { at_m } => MarkShape::Point { at_m },
        view::MarkShape::Circle { at_m, radius_m } => MarkShape::Circle { at_m, radius_m },
    }
}
