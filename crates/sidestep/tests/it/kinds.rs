//! The kinds of bodies that worlds declare.

use sidestep::kernel::view::{BodyKind, Kinds};
use sidestep::worlds::WORLDS;

#[test]
fn the_kinds_of_all_worlds_have_the_order_of_recorded_files() {
    let names = [
        "robot",
        "person",
        "door",
        "connector",
        "rods",
        "airplane",
        "zone",
        "obstacle",
        "goal",
        "start",
        "area",
    ];
    assert_eq!(WORLDS.kinds().names(), names);
}

#[test]
fn a_kind_is_the_same_in_all_worlds_that_declare_it() {
    let all: Vec<BodyKind> =
        WORLDS.iter().flat_map(|world| world.kinds().iter().copied()).collect();
    let distinct = Kinds::new(all.iter().copied());
    for kind in all {
        let first = distinct.find(kind.name()).expect("it is one of them");
        assert_eq!(first, kind, "its rank is another one");
        assert_eq!(format!("{:?}", first.spec()), format!("{:?}", kind.spec()));
    }
}
