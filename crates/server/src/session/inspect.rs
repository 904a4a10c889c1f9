//! Percepts, decisions and deeds of a body, in the words of the protocol.

use crate::encode::{body, body_id};
use crate::protocol::{
    BodyId, Fact, Inspection, Mark, MarkShape, Problem, Role, Section, Table, Value,
};
use sidestep_kernel::Simulation;
use sidestep_kernel::view;

/// Returns the percepts, decisions and deeds of a body.
///
/// # Errors
/// When there is no such body, or there is nothing to show of it.
pub(super) fn inspection(run: &dyn Simulation, of: &BodyId) -> Result<Inspection, Problem> {
    let told = body(of).and_then(|body| run.inspect(body)).ok_or_else(|| {
        let part = of.part.map(|part| format!("/{part}")).unwrap_or_default();
        let place = format!("{}/{}{part}", of.kind, of.number);
        let remedy = format!("choose a {} of this run", run.agent());
        Problem::new(place, "no information about this body", remedy)
    })?;
    Ok(Inspection {
        body: body_id(&told.who),
        cycle: told.cycle as f64,
        title: told.title,
        sections: told.sections.into_iter().map(section).collect(),
        marks: told.marks.into_iter().map(mark).collect(),
    })
}

fn section(section: view::FactSection) -> Section {
    let fact = |fact: view::Fact| Fact { label: fact.label, value: value(fact.value) };
    Section {
        title: section.title,
        facts: section.facts.into_iter().map(fact).collect(),
        table: section.table.map(table),
    }
}

fn table(table: view::FactTable) -> Table {
    let row = |row: Vec<view::FactValue>| row.into_iter().map(value).collect();
    Table { columns: table.columns, rows: table.rows.into_iter().map(row).collect() }
}

fn value(value: view::FactValue) -> Value {
    match value {
        view::FactValue::Number { value, unit } => Value::Number { value, unit: unit.into() },
        view::FactValue::Share(share) => Value::Share(share),
        view::FactValue::Text(words) => Value::Text(words),
        view::FactValue::Who(of) => Value::Body(body_id(&of)),
        view::FactValue::Place(at_m) => Value::Place(at_m),
        view::FactValue::Yes(is_so) => Value::Flag(is_so),
        view::FactValue::None => Value::None,
    }
}

fn mark(mark: view::Mark) -> Mark {
    let view::Mark { role: part, label, weight, shape: form } = mark;
    Mark { role: role(part), label, weight, shape: shape(form) }
}

fn role(role: view::MarkRole) -> Role {
    match role {
        view::MarkRole::True => Role::True,
        view::MarkRole::Reported => Role::Reported,
        view::MarkRole::Wish => Role::Wish,
        view::MarkRole::Done => Role::Done,
        view::MarkRole::Refused => Role::Refused,
        view::MarkRole::Claim => Role::Claim,
        view::MarkRole::Group => Role::Group,
        view::MarkRole::Predicted => Role::Predicted,
        view::MarkRole::Chosen => Role::Chosen,
        view::MarkRole::Known => Role::Known,
        view::MarkRole::Orbit => Role::Orbit,
        view::MarkRole::Target => Role::Target,
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
