//! Tables of runs <-> columns of a file.

use sidestep::experiment::sweep::{Plan, Role, RunColumn, RunTable, RunValues, Shard};
use sidestep_record::nullable::{NullableColumn, NullableTable, NullableValues};
use sidestep_record::sweep::Share;

/// Roles by the names that files have for them.
const ROLES: [(Role, &str); 8] = [
    (Role::Cell, "cell"),
    (Role::Variant, "variant"),
    (Role::Replicate, "replicate"),
    (Role::Seed, "seed"),
    (Role::Parameter, "parameter"),
    (Role::Metric, "metric"),
    (Role::Digest, "digest"),
    (Role::Cost, "cost"),
];

/// As the columns of a file.
pub(super) fn to_file(table: RunTable) -> Vec<NullableColumn> {
    let name = |role: Role| ROLES.iter().find(|(r, _)| *r == role).map_or("metric", |(_, n)| n);
    let column = |c: RunColumn| NullableColumn {
        role: name(c.role).into(),
        name: c.name,
        values: match c.values {
            RunValues::Int(v) => NullableValues::Int(v),
            RunValues::Float(v) => NullableValues::Float(v),
            RunValues::Bool(v) => NullableValues::Bool(v),
            RunValues::Text(v) => NullableValues::Text(v),
        },
    };
    table.columns.into_iter().map(column).collect()
}

/// The columns of a file; those of a role that this version does not know are left out.
pub(super) fn from_file(table: NullableTable) -> RunTable {
    let column = |c: NullableColumn| {
        let role = ROLES.iter().find(|(_, name)| *name == c.role)?.0;
        let values = match c.values {
            NullableValues::Int(v) => RunValues::Int(v),
            NullableValues::Float(v) => RunValues::Float(v),
            NullableValues::Bool(v) => RunValues::Bool(v),
            NullableValues::Text(v) => RunValues::Text(v),
        };
        Some(RunColumn { name: c.name, role, values })
    };
    RunTable { columns: table.columns.into_iter().filter_map(column).collect() }
}

/// The table of all cells of a plan: one row a run to come.
pub(super) fn cells(plan: &Plan) -> Vec<NullableColumn> {
    to_file(sidestep::experiment::sweep::rows::cells(plan))
}

/// The same share, as folders name it.
pub(super) fn share(shard: Shard) -> Share {
    Share { index: shard.index, count: shard.count }
}
