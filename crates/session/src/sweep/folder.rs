//! The folder of a sweep, and the finished runs in it.

use crate::identity::Producer;
use sidestep_experiment::sweep::{Outcome, Plan, Role, RunTable, Shard};
use sidestep_kernel::InputError;
use sidestep_record::LoadedTable;
use sidestep_record::sweep::{Share, SweepFolder};
use sidestep_scenario::Worlds;

/// The folder of a sweep with our plan; the format of the folder itself does not depend on plans.
pub type Folder = SweepFolder<Plan>;

pub(super) fn to_run_table(file: LoadedTable<Role>) -> RunTable {
    RunTable { columns: file.columns }
}

/// Converts a share to the type that folders use.
pub(super) fn to_share(shard: Shard) -> Share {
    Share { index: shard.index, count: shard.count }
}

/// Refuses another build: results may change between builds, so a single one makes all runs.
pub(crate) fn check_build(worlds: &Worlds, folder: &Folder) -> Result<(), InputError> {
    let manifest = folder.manifest();
    let producer =
        Producer { version: manifest.program_version.clone(), build: manifest.build.clone() };
    producer.check(worlds.build(), folder.path(), "sweep", |wrote| {
        format!("continue with sidestep {wrote}, or sweep into a new folder")
    })
}

/// Refuses a folder that has more or fewer scenarios than its plan has variants: the runs of a variant would be taken for
/// those of another.
pub(super) fn check_variants(folder: &Folder) -> Result<(), InputError> {
    let planned = folder.plan().variants.len();
    let existing = folder.manifest().fingerprints.len();
    if planned == existing {
        return Ok(());
    }
    let cause = format!("its plan has {planned} variants, and there are {existing} scenarios");
    let remedy = "`sweep.json` was changed: put it back as it was, or sweep into a new folder";
    Err(InputError::new(folder.path().display(), cause, remedy))
}

/// Passes on all finished runs, except those of the share `but`.
pub(super) fn for_each_outcome(
    folder: &Folder,
    but: Option<Shard>,
    mut each: impl FnMut(Outcome),
) -> Result<(), InputError> {
    check_variants(folder)?;
    folder.parts(|part| to_run_table(part).for_each_outcome(&mut each))?;
    folder.journals(but.map(to_share), &mut each)
}
