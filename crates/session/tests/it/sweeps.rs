//! Many runs of one scenario.

use crate::support::{Place, WORLDS};
use sidestep::experiment::sweep::{RunTable, Shard, Sweep};
use sidestep_session::Unwatched;
use sidestep_session::report::document;
use sidestep_session::sweep::{Ended, Folder, collect, go_on, in_memory, planned, share};

const SWEEP: &str = "format = 1\nscenario = \"pond.toml\"\nreplicates = 3\n\
                     [set]\n\"cycles\" = 700\n[vary]\n\"pond.frogs\" = [4, 20]\n";

/// The sweep of two variants with three seeds each.
pub(crate) fn sweep(place: &Place) -> Sweep {
    let file = place.path("sweep.toml");
    std::fs::write(&file, SWEEP).expect("written");
    Sweep::read(&file).expect("valid")
}

fn done(ended: Ended) -> RunTable {
    match ended {
        Ended::Done(done) => {
            RunTable { columns: done.table.results().into_iter().cloned().collect() }
        }
        Ended::Interrupted(runs) => panic!("interrupted after {runs} runs"),
    }
}

#[test]
fn two_variants_with_three_seeds_come_to_one_table_however_they_are_run() {
    let place = Place::new();
    let sweep = sweep(&place);
    let (plan, ended) = in_memory(WORLDS, &sweep, 2, &Unwatched).expect("run");
    let table = done(ended);
    assert_eq!((plan.world.as_str(), plan.variants.len(), table.runs()), ("pond", 2, 6));
    assert!(table.column("hops_per_frog").is_some());

    let folder = planned(WORLDS, &sweep, &place.path("one"), &Unwatched).expect("planned");
    let one = go_on(WORLDS, &folder, 3, &Unwatched).expect("run");
    assert_eq!(done(one), table);

    let folder = planned(WORLDS, &sweep, &place.path("shares"), &Unwatched).expect("planned");
    for shard in ["1/2", "0/2"] {
        let shard: Shard = shard.parse().expect("a share");
        let ended = share(WORLDS, &folder, shard, 1, &Unwatched).expect("run");
        assert_eq!(done(ended).runs(), 3);
    }
    assert_eq!(done(collect(&folder, &Unwatched).expect("collected")), table);
}

#[test]
fn runs_of_a_sweep_are_recorded_and_reported() {
    let place = Place::new();
    let sweep = Sweep { record: true, ..sweep(&place) };
    let path = place.path("sweep");
    let folder = planned(WORLDS, &sweep, &path, &Unwatched).expect("planned");
    go_on(WORLDS, &folder, 2, &Unwatched).expect("run");
    let folder = Folder::open(&path).expect("a sweep");
    assert!(folder.run_folder(5).join("trajectories.svg").is_file());
    let document = document(WORLDS, &path, &Unwatched).expect("a document");
    let pages = sidestep_report::render(&document, "pictures").expect("pages");
    for words in ["6 runs of 2 variants", "Hops per frog"] {
        assert!(
            pages.markdown.replace('\u{a0}', " ").contains(words),
            "no {words} in {}",
            pages.markdown
        );
    }
}
