//! `cargo run -p sidestep --example first_run`: robots with sonars wander in an office.

use sidestep::Error;
use sidestep::worlds::robots::RobotsRun;

const OFFICE: &str = r#"format = 1
world = "robots"
map = { office = { corridors = 1, rooms_per_side = 3 } }
robots = { count = 5, size = 2, sensors = ["sonar-8"], effector = "nomad" }"#;

fn main() -> Result<(), Error> {
    let office = sidestep::parse(OFFICE).set("robots.count", 10)?.seed(7);
    for remark in office.check().expect("nothing is wrong with it") {
        println!("remark: {}", remark.words);
    }
    let mut run = office.keep_tables().start()?;
    run.advance(2_000)?;

    let metrics = run.downcast::<RobotsRun>().expect("robots").metrics();
    println!("{:.0} % of the floor seen, digest {}", 100.0 * metrics.coverage, run.digest());
    for table in run.tables()? {
        println!("table {}: {} rows", table.name(), table.columns[0].len());
    }
    Ok(())
}
