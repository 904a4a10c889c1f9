use std::f64::consts::FRAC_PI_2;

use super::*;
use proptest::prelude::*;
use sidestep_kernel::math::hypot;
use sidestep_testing::shared_data as shared;

/// Reads the first of some files in a folder of their own.
fn read(files: &[(&str, &str)]) -> Result<World, InputError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    }
    load(&folder.path().join(files[0].0))
}

fn error(text: &str) -> InputError {
    read(&[("a.world", text)]).expect_err(text)
}

/// What a report says, a line each.
fn said(world: &World) -> Vec<String> {
    world.report.findings.iter().map(ToString::to_string).collect()
}

/// Two columns of three rows; three pixels are dark, of which the right one is at the edge of what is solid.
const PGM: &str = "P2 2 3 255  0 200  255 255  0 127";

#[test]
fn a_floor_plan_is_stretched_to_its_size_and_place() {
    let world = "include \"inc/map.inc\" # defines floorplan\n\
        floorplan ( name \"cave\" size [4 9 0.8] pose [1 2 0 90] bitmap \"maps/cave.pgm\" )";
    let map = "define floorplan model ( boundary 1 color \"gray\" )";
    let files = [("a.world", world), ("inc/map.inc", map), ("maps/cave.pgm", PGM)];
    let world = read(&files).expect("a world");
    let [plan] = &world.floor_plans[..] else { panic!("{world:?}") };
    assert_eq!((plan.width, plan.height), (2, 3));
    assert_eq!(plan.solid, [true, true, false, false, true, false]);
    assert_eq!((plan.name.as_str(), plan.size_m, plan.has_boundary), ("cave", [4.0, 9.0], true));
    assert_eq!(plan.pose, Pose2 { x_m: 1.0, y_m: 2.0, yaw_rad: FRAC_PI_2 });
    assert_eq!(
        said(&world),
        ["not used: looks and windows of models, `color` at line 1 of map.inc"]
    );
    let facts: Vec<_> = world.report.facts.iter().map(|fact| fact.value.as_str()).collect();
    assert_eq!(
        facts,
        ["2", "lengths in m, angles in degrees", "x -3.50 to 5.50 m, y 0.00 to 4.00 m"]
    );
}

#[test]
fn the_solid_pixels_of_a_bitmap_fill_its_size_and_margins_do_not() {
    let world = "model ( size [4 4 1] bitmap \"a.pgm\" )";
    let margins = "P2 4 4 255  255 255 255 255  255 0 128 255  255 128 0 255  255 255 255 255";
    let world = read(&[("a.world", world), ("a.pgm", margins)]).expect("a world");
    let plan = &world.floor_plans[0];
    assert_eq!((plan.width, plan.height, plan.size_m), (2, 2, [4.0; 2]));
    assert_eq!(plan.solid, [false, true, true, false]);
    let [stretch] = &said(&world)[..] else { panic!("{world:?}") };
    assert!(stretch.starts_with("suspicious: the solid pixels of a bitmap"), "{stretch}");
}

#[test]
fn units_hold_for_the_whole_world_wherever_they_stand() {
    let text =
        "model ( size [100 200 1] pose [300 0 0 1.5] )\nunit_length \"cm\"\nunit_angle \"radians\"";
    let world = read(&[("a.world", text)]).expect("a world");
    assert_eq!(world.boxes[0].size_m, [1.0, 2.0]);
    assert_eq!(world.boxes[0].pose, Pose2 { x_m: 3.0, y_m: 0.0, yaw_rad: 1.5 });
    assert_eq!(said(&world), [""; 0]);
    let told = error("unit_length \"inch\"");
    assert!(told.remedy().contains("\"m\" or \"cm\" or \"mm\""), "{told}");
}

#[test]
fn a_name_stands_for_its_first_definition_where_it_is_used() {
    let text = "define small brick ( size [1 1 1] )\n\
        define brick model ( size [2 2 2] )\n\
        define brick position ( )\n\
        small( ) brick( )";
    let world = read(&[("a.world", text)]).expect("a world");
    let sizes: Vec<_> = world.boxes.iter().map(|body| body.size_m).collect();
    assert_eq!((sizes, world.robots.len()), (vec![[1.0; 2], [2.0; 2]], 0));
    let [second] = &said(&world)[..] else { panic!("{world:?}") };
    assert!(second.starts_with("dropped: a second definition of `brick`"), "{second}");
    assert!(second.contains("line 3"), "{second}");
    assert!(error("define a b ()\ndefine b a ()\na()").cause().contains("defined by itself"));
}

#[test]
fn paths_start_at_the_world_and_may_start_at_the_file_that_names_them() {
    let inc = "define brick model ( bitmap \"a.pgm\" )\ninclude \"more.inc\"";
    let both = [
        ("a.world", "include \"inc/a.inc\"\nbrick( )"),
        ("inc/a.inc", inc),
        ("inc/more.inc", ""),
        ("a.pgm", "P2 1 1 255 0"),
        ("inc/a.pgm", "P2 2 1 255 0 0"),
    ];
    let world = read(&both).expect("a world");
    assert_eq!(world.floor_plans[0].width, 1, "the world's folder comes first");
    let [repaired] = &said(&world)[..] else { panic!("{world:?}") };
    assert!(repaired.starts_with("repaired: paths that are relative"), "{repaired}");
    assert!(repaired.contains("line 2 of a.inc"), "{repaired}");
}

#[test]
fn paths_stay_in_the_package_of_the_world() {
    let beside =
        [("worlds/a.world", "model ( bitmap \"../maps/a.pgm\" )"), ("maps/a.pgm", "P2 1 1 255 0")];
    assert!(read(&beside).is_ok());
    let secret = tempfile::NamedTempFile::new().expect("a file");
    for name in [secret.path().display().to_string(), "../../a.inc".to_owned()] {
        let world = format!("include \"{name}\"");
        let far = [("b/worlds/a.world", world.as_str()), ("a.inc", "")];
        let told = read(&far).expect_err("outside");
        assert!(told.cause().contains("outside of the world's folder"), "{told}");
    }
}

#[test]
fn what_does_not_end_as_a_world_is_not_read_as_one_but_may_be_included() {
    for (name, is_world) in [("a.inc", true), ("A.WORLD.gz", true), ("a.toml", false), ("a", false)]
    {
        assert_eq!(read(&[(name, "speedup 3")]).is_ok(), is_world, "{name}");
    }
    let told = read(&[("a.toml", "include \"b.world\"")]).expect_err("a scenario");
    assert!(told.remedy().contains(".world or .inc"), "{told}");
    assert!(read(&[("a.world", "include \"robots.def\""), ("robots.def", "speedup 3")]).is_ok());
}

#[test]
fn robots_and_boxes_have_what_they_inherit() {
    let text = "
        speedup 3
        define base position ( size [0.4 0.3 0.2] drive \"diff\" ranger ( fov 180 ) )
        define bot base ( origin [-0.1 0 0 0] )
        define brick model ( size [1 2 1] )
        define ghost model ( obstacle_return 0 ranger_return -1 )
        bot ( pose [5 6 0 180] name \"r0\" )
        base( size [0.6 0.8] )
        brick( pose [10 0 0 90] origin [1 0 0] brick( name \"inner\" pose [2 0 0 0] ) )
        ghost()
        window( size [ 600 400 ] )";
    let world = read(&[("a.world", text)]).expect("a world");
    let [first, second] = &world.robots[..] else { panic!("{world:?}") };
    assert_eq!((first.name.as_str(), first.kind.as_str()), ("r0", "bot"));
    assert_eq!((first.pose.x_m, first.pose.y_m), (5.0, 6.0));
    assert!((first.radius_m - hypot(0.3, 0.15)).abs() < 1e-12);
    assert!((second.radius_m - 0.5).abs() < 1e-12);
    let places: Vec<_> = world.boxes.iter().map(|b| (b.pose.x_m, b.pose.y_m)).collect();
    for ((x, y), (expected_x, expected_y)) in places.into_iter().zip([(10.0, 1.0), (10.0, 2.0)]) {
        assert!((x - expected_x).abs() < 1e-12 && (y - expected_y).abs() < 1e-12, "{x} {y}");
    }
    assert_eq!((world.boxes.len(), world.boxes[1].name.as_str()), (2, "inner"));
    assert_eq!(
        said(&world),
        [
            "not used: settings of Stage itself, `speedup` at line 2",
            "not used: the property `drive` of models (2 times), line 3",
            "not used: models of the kind `ranger` on robots (2 times), line 3",
            "not used: models that neither robots touch nor rangers see (`obstacle_return 0`, \
             `ranger_return` below 0), line 10",
            "not used: models of the kind `window`, line 11",
        ]
    );
}

#[test]
fn what_carries_meaning_is_acted_on_or_named() {
    let text = "model ( obstacle_return 0 )\n\
        model ( noblocks 1 )\n\
        model ( block ( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [0 1] ) )\n\
        model ( pose [0 0 2 0] gripper_return 1 fiducial_return 0 )\n\
        helper ( )\n\
        hall ( bitmap \"a.pgm\" )\n\
        model ( name \"a\" model ( name \"b\" ) model ( name \"/c\" ) )";
    let world = read(&[("a.world", text), ("a.pgm", "P2 1 1 255 0")]).expect("a world");
    assert_eq!((world.boxes.len(), world.floor_plans.len()), (6, 1));
    let names: Vec<_> = world.boxes[3..].iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["a", "a.b", "c"]);
    let expected = [
        "guessed: models that rangers see and robots pass (`obstacle_return 0`) are obstacles, line 1",
        "not used: models without a body (`noblocks 1`), line 2",
        "not used: shapes (`block`), for which the box of `size` stands, line 3",
        "not used: the heights (z) of obstacles, which all stand on the ground, line 4",
        "not used: the property `gripper_return` of models, line 4",
        "dropped: models of the kind `helper`, which nothing defines, line 5",
        "guessed: `hall`, which nothing defines, is an obstacle because it has a bitmap, line 6",
    ];
    let lines = said(&world);
    assert_eq!(lines.len(), expected.len(), "{lines:?}");
    for (line, expected) in lines.iter().zip(expected) {
        assert!(line.starts_with(expected), "{line}");
    }
}

#[test]
fn wrong_syntax_and_values_are_pointed_at() {
    for (text, position) in [
        ("a ( b", (1, 6)),
        ("a ( size [1 2 )", (1, 15)),
        ("x 1\n  )", (2, 3)),
        ("define a (", (1, 10)),
        ("name \"open", (1, 11)),
        ("model (\n pose [1 2] )", (2, 7)),
        ("model ( pose [1 2 0 x] )", (1, 14)),
        ("model ( size [0 1 1] )", (1, 14)),
        ("include \"none.inc\"", (1, 9)),
        ("model ( include \"none.inc\" )", (1, 17)),
    ] {
        let error = error(text);
        assert_eq!(error.line_and_column(), Some(position), "{error}");
    }
    assert!(read(&[("a.world", "model ( bitmap \"none.png\" )")]).is_err());
}

#[test]
fn a_world_of_gazebo_is_told_from_one_of_stage() {
    let told = error("\n<?xml version=\"1.0\"?><sdf version=\"1.6\"/>");
    assert!(told.cause().contains("worlds of Gazebo"), "{told}");
}

#[test]
fn files_that_include_themselves_are_refused() {
    let loop_of_two = [("a.world", "include \"b.inc\""), ("b.inc", "\ninclude \"a.world\"")];
    let error = read(&loop_of_two).expect_err("a loop");
    assert_eq!(error.line_and_column(), Some((2, 9)), "{error}");
    assert!(error.place().ends_with("b.inc"), "{error}");
}

#[test]
fn models_that_multiply_are_refused() {
    let doubling = (1..60).map(|k| format!("define m{k} model ( m{0}() m{0}() )\n", k - 1));
    let text: String = doubling.collect();
    error(&format!("define m0 model ()\n{text}m59()"));
    error("define a model ( a() )\na()\ndefine b a ()\nb( a() ) define a model ( a() ) a()");
    error(&"m(".repeat(100_000));
}

proptest! {
    #[test]
    fn no_text_panics(text in "(define|model|include|[a-c(\\[\"#\\])0-9. \n]|size|pose){0,30}") {
        let _ = read(&[("a.world", text.as_str())]);
    }
}

#[test]
fn real_worlds_hold_what_they_say() {
    let read = |name: &str| Some(load(&shared(name)?).expect(name));
    let Some(cave) = read("worlds/stage/simple.world") else { return };
    let plan = &cave.floor_plans[0];
    assert_eq!((plan.width, plan.height, plan.size_m), (500, 500, [16.0; 2]));
    assert_eq!((cave.robots.len(), cave.boxes.len()), (2, 0));
    assert!((cave.robots[0].pose.yaw_rad - 0.5 * FRAC_PI_2).abs() < 1e-12);
    let sfu = read("worlds/stage/SFU.world").expect("there");
    let plan = &sfu.floor_plans[0];
    assert_eq!((plan.width, plan.height, plan.size_m), (1196, 609, [1200.0, 600.0]));
    assert_eq!((plan.pose.y_m, sfu.robots.len()), (-40.0, 94));
    let willow = read("worlds/willow/willow-erratic.world").expect("there");
    let plan = &willow.floor_plans[0];
    assert_eq!((plan.width, plan.height, plan.size_m), (532, 571, [54.0, 58.7]));
    assert_eq!((willow.robots.len(), willow.boxes.len()), (1, 1));
    assert_eq!(willow.boxes[0].size_m, [0.5; 2]);
    for (name, world) in [("cave", &cave), ("SFU", &sfu), ("willow", &willow)] {
        let solid = world.floor_plans[0].solid.iter().filter(|&&s| s).count();
        println!("{name}: {solid} solid pixels; {:#?}", said(world));
    }
}
