//! `cargo run -p sidestep --example sweep`: two methods of avoidance beside each other, on the same seeds.

use sidestep::Error;
use sidestep::experiment::sweep::{BaselineSpec, Factor, Setting, Sweep, SweepOverrides};
use sidestep::kernel::workers::available_workers;
use sidestep::scenario::Source;
use sidestep::session::NoWatcher;
use sidestep::session::sweep::{SweepEnd, run_in_memory};
use sidestep::worlds::WORLDS;

const SCENARIO: &str = r#"format = 1
world = "airspace"
airspace = { generator = { kind = "superconflict", n = 6 } }"#;

fn main() -> Result<(), Error> {
    let sweep = Sweep::from_source(Source::new("airplanes.toml", SCENARIO, ""));
    let sweep = sweep.with_overrides(SweepOverrides {
        factors: vec![Factor::parse("airspace.method=orca,mvp")?],
        baseline: Some(BaselineSpec {
            settings: vec![Setting::parse("airspace.method=mvp")?],
            ..BaselineSpec::default()
        }),
        metrics: vec!["mean_delay_percent".into()],
        replicates: Some(10),
        ..SweepOverrides::default()
    })?;
    let (plan, end) = run_in_memory(&WORLDS, &sweep, available_workers(), &NoWatcher)?;
    if let SweepEnd::Done(result) = end {
        for table in plan.summary(&WORLDS, &result.table)?.brief() {
            println!("{}\n{}", table.title, table.columns.join(", "));
            for row in &table.rows {
                println!("{}", table.cells(row).collect::<Vec<_>>().join(", "));
            }
        }
    }
    Ok(())
}
