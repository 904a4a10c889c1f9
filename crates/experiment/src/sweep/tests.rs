//! Guarantees of a summary, on tables with a known answer.

use super::summary::MetricValues;
use super::*;
use proptest::prelude::*;
use sidestep_document::FigureKind;
use sidestep_kernel::Seed;
use sidestep_kernel::distr::normal;
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_statistics::Bootstrap;

fn column(name: &str, role: Role, values: ColumnValues) -> RunColumn {
    RunColumn { name: name.into(), role, values }
}

fn numbers(values: impl IntoIterator<Item = f64>) -> ColumnValues {
    ColumnValues::F64(values.into_iter().map(Some).collect())
}

/// A full grid: 2 regimes, counts 10, 20 and 40, 20 replicates. The delay is
/// `count / 10 + 3 (of "rush") + effect of the replicate + noise`; robots arrive less often in
/// a rush; the noise says nothing.
fn grid() -> RunTable {
    let mut rows = Vec::new();
    for regime in ["calm", "rush"] {
        for count in [10, 20, 40] {
            (0..20).for_each(|replicate| rows.push((regime, count, replicate)));
        }
    }
    let streams = Streams::new(Seed(9));
    let noise = |i: usize, purpose| normal(&mut streams.draws(i as u32, 0, Purpose(purpose)));
    let common = |replicate: i64| normal(&mut streams.draws(replicate as u32, 0, Purpose(1)));
    let rush = |regime: &str| f64::from(u8::from(regime == "rush"));
    let delay = |(i, (regime, count, replicate)): (usize, &(&str, i64, i64))| {
        *count as f64 / 10.0 + 3.0 * rush(regime) + 2.0 * common(*replicate) + 0.2 * noise(i, 2)
    };
    let arrived = |(i, row): (usize, &(&str, i64, i64))| Some(noise(i, 3) > rush(row.0));
    let int = |of: fn(&(&str, i64, i64)) -> i64| {
        ColumnValues::I64(rows.iter().map(|r| Some(of(r))).collect())
    };
    let text = |of: &dyn Fn(&(&str, i64, i64)) -> String| {
        ColumnValues::Text(rows.iter().map(|r| Some(of(r))).collect())
    };
    let delays = numbers(rows.iter().enumerate().map(delay));
    let floats = |purpose| numbers((0..rows.len()).map(|i| noise(i, purpose)));
    let metric = |name, values| column(name, Role::Metric, values);
    let columns = vec![
        column("cell", Role::Trial, ColumnValues::I64((0..rows.len() as i64).map(Some).collect())),
        column("variant", Role::Variant, text(&|r| format!("{} {}", r.0, r.1))),
        column("replicate", Role::Replicate, int(|r| r.2)),
        column("seed", Role::Seed, int(|r| r.2 + 100)),
        column("regime", Role::Parameter, text(&|r| r.0.into())),
        column("robots.count", Role::Parameter, int(|r| r.1)),
        column("format", Role::Parameter, int(|_| 1)),
        metric("noise_m", floats(4)),
        metric("mean_delay_percent", delays),
        metric("arrived", ColumnValues::Bool(rows.iter().enumerate().map(arrived).collect())),
        metric("lost", int(|_| 0)),
        metric("reason", text(&|_| "over".into())),
        column("digest", Role::Digest, text(&|_| "ab".into())),
    ];
    RunTable { columns }
}

fn summed(table: &RunTable) -> Summary {
    Summary::from_table(table, &SummaryOptions::default()).unwrap()
}

/// The summary in which all are compared with the first variant.
fn against_the_calmest(table: &RunTable) -> Summary {
    let against = Some(BaselineChoice::Variant("calm 10".into()));
    Summary::from_table(table, &SummaryOptions { against, ..Default::default() }).unwrap()
}

fn of<'a>(summary: &'a Summary, name: &str) -> &'a summary::MetricSummary {
    summary.metrics.iter().find(|m| m.name == name).unwrap()
}

/// Runs of two variants, `lone` and `circle`; a metric has the values of one after those of the other.
fn two_variants(replicates: i64, metrics: Vec<RunColumn>) -> RunTable {
    let names = ["lone", "circle"].iter().flat_map(|name| (0..replicates).map(move |_| name));
    let names = ColumnValues::Text(names.map(|name| Some(name.to_string())).collect());
    let numbers = (0..2).flat_map(|_| 0..replicates).map(Some).collect();
    let mut columns = vec![
        column("variant", Role::Variant, names),
        column("replicate", Role::Replicate, ColumnValues::I64(numbers)),
    ];
    columns.extend(metrics);
    RunTable { columns }
}

/// Five seeds turn a circle of eight, in which all pairs meet at its center: rounding alone differs.
#[test]
fn seeds_that_only_turn_the_picture_count_as_one_run_and_prove_nothing() {
    let losses = [0, 0, 0, 0, 0, 28, 28, 28, 28, 28].map(Some).into_iter().collect();
    let lost_s = [14.285714348, 14.285714349, 14.285725194, 14.285720597, 14.285759231];
    let lost_s = [0.0; 5].into_iter().chain(lost_s);
    let near_m = [3.1e-12, 9.2e-13, 3.2e-13, 1.2e-13, 2.5e-12].map(Some);
    let near_m = [None; 5].into_iter().chain(near_m).collect();
    let metric = |name, values| column(name, Role::Metric, values);
    let metrics = vec![
        metric("losses", ColumnValues::I64(losses)),
        metric("lost_s", numbers(lost_s)),
        metric("min_separation_m", ColumnValues::F64(near_m)),
    ];
    let summary = summed(&two_variants(5, metrics));
    assert!(summary.notes[0].starts_with("Seeds change nothing that a metric shows: "));
    for metric in &summary.metrics {
        for variant in &metric.variants {
            let MetricValues::Numbers(numbers) = &variant.values else { panic!("a share") };
            assert_eq!((numbers.interval, numbers.bootstrap), (None, None), "{}", metric.name);
            assert!(variant.n <= 1 && variant.seedless, "{}", metric.name);
        }
        for comparison in &metric.comparisons {
            assert!(comparison.pairs <= 1 && comparison.seedless);
            assert_eq!((comparison.interval, comparison.p, comparison.p_sign), (None, None, None));
        }
    }
    let shown: Vec<String> = summary
        .brief()
        .iter()
        .flat_map(|table| table.rows.iter().flat_map(|row| table.cells(row).map(String::from)))
        .collect();
    assert!(shown.contains(&"28".to_string()), "{shown:?}");
    assert!(!shown.iter().any(|cell| cell.contains("28, 28")), "{shown:?}");
}

#[test]
fn counts_that_are_equal_in_a_few_runs_do_not_say_that_seeds_change_nothing() {
    let losses = [Some(3); 10].into_iter().collect();
    let metrics = vec![column("losses", Role::Metric, ColumnValues::I64(losses))];
    let mut table = two_variants(5, metrics);
    let arrived = (0..10).map(|run| Some(run != 3)).collect();
    table.columns.push(column("arrived", Role::Metric, ColumnValues::Bool(arrived)));
    let summary = summed(&table);
    assert!(!summary.notes.iter().any(|note| note.contains("Seeds")), "{:?}", summary.notes);
}

#[test]
fn counts_that_are_equal_in_all_runs_have_no_interval_without_width() {
    let groups = [2, 2, 2, 2, 2, 3, 3, 3, 3, 3].map(Some).into_iter().collect();
    let delays = [1.0, 2.5, 1.5, 2.0, 1.8, 4.0, 5.0, 4.1, 5.3, 4.4];
    let metrics = vec![
        column("largest_group", Role::Metric, ColumnValues::I64(groups)),
        column("delay_s", Role::Metric, numbers(delays)),
    ];
    let summary = summed(&two_variants(5, metrics));
    let groups = of(&summary, "largest_group");
    for variant in &groups.variants {
        let MetricValues::Numbers(numbers) = &variant.values else { panic!("a share") };
        assert_eq!((variant.n, numbers.interval, numbers.bootstrap), (5, None, None));
    }
    let comparison = &groups.comparisons[0];
    assert_eq!((comparison.pairs, comparison.interval, comparison.p), (5, None, None));
    assert!(of(&summary, "delay_s").comparisons[0].interval.is_some());
}

#[test]
fn quantiles_of_equal_runs_have_no_interval_without_width() {
    let equal = (0..20).map(|run| Some(if run < 10 { 3 } else { 4 })).collect();
    let delays = (0..20_u8).map(|k| f64::from(k) + 0.5);
    let metrics = vec![
        column("largest_group", Role::Metric, ColumnValues::I64(equal)),
        column("delay_s", Role::Metric, ColumnValues::F64(delays.map(Some).collect())),
    ];
    let summary = summed(&two_variants(10, metrics));
    let intervals = |name| {
        let MetricValues::Numbers(numbers) = &of(&summary, name).variants[0].values else {
            panic!("a share")
        };
        numbers.quantiles.iter().filter(|quantile| quantile.interval.is_some()).count()
    };
    assert_eq!(intervals("largest_group"), 0);
    assert!(intervals("delay_s") > 0);
}

#[test]
fn a_few_pairs_have_an_interval_and_no_p_value_and_a_note_says_so() {
    let values = [1.0, 2.5, 1.5, 2.0, 4.0, 5.0, 4.1, 5.3];
    let metrics = vec![column("delay_s", Role::Metric, numbers(values))];
    let summary = summed(&two_variants(4, metrics));
    let comparison = &of(&summary, "delay_s").comparisons[0];
    assert!(comparison.interval.is_some() && comparison.pairs == 4);
    assert_eq!((comparison.p, comparison.p_holm, comparison.p_sign), (None, None, None));
    let note = "Fewer than 5 pairs have an interval, and no p.";
    assert!(summary.notes.iter().any(|one| one == note), "{:?}", summary.notes);
}

#[test]
fn holm_runs_over_all_comparisons_that_a_reader_sees() {
    let summary = against_the_calmest(&grid());
    let all: Vec<_> = summary.metrics.iter().flat_map(|metric| &metric.comparisons).collect();
    let expected = sidestep_statistics::holm(&all.iter().map(|c| c.p).collect::<Vec<_>>());
    let adjusted: Vec<_> = all.iter().map(|c| c.p_holm).collect();
    assert_eq!(adjusted, expected);
    assert!(all.len() > summary.metrics[0].comparisons.len());
    let note = format!("p is adjusted by Holm over the {} tests of all metrics shown.", all.len());
    assert!(summary.notes.contains(&note), "{:?}", summary.notes);
}

#[test]
fn what_parameters_move_comes_first_and_what_is_left_out_is_told() {
    let summary = summed(&grid());
    let names: Vec<&str> = summary.metrics.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["mean_delay_percent", "arrived", "noise_m"]);
    let left_out: Vec<_> =
        summary.left_out.iter().map(|l| (l.metric.as_str(), l.reason.as_str())).collect();
    assert_eq!(left_out, [("lost", "0 in all runs (n = 120)"), ("reason", "words, not numbers")]);
    let one =
        Summary::from_table(&grid(), &SummaryOptions { max_metrics: 1, ..Default::default() })
            .unwrap();
    assert_eq!((one.metrics.len(), one.left_out.len()), (1, 4));
    let notes = ["Nothing is compared: several keys", "2 more metrics vary and are not shown."];
    assert!(one.notes.iter().zip(notes).all(|(note, begin)| note.starts_with(begin)), "{one:?}");
    let metrics = Some(vec!["lost".to_string(), "arrived".into()]);
    let named =
        Summary::from_table(&grid(), &SummaryOptions { metrics, ..Default::default() }).unwrap();
    assert_eq!(
        named.metrics.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(),
        ["lost", "arrived"]
    );
}

#[test]
fn metrics_that_a_world_is_about_come_first_where_variants_differ_in_them() {
    let central_metrics = &["noise_m", "arrived"];
    let options = SummaryOptions { central_metrics, ..Default::default() };
    let summary = Summary::from_table(&grid(), &options).unwrap();
    let names: Vec<&str> = summary.metrics.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["arrived", "mean_delay_percent", "noise_m"], "variants differ in no noise");
}

#[test]
fn pairs_cancel_what_replicates_have_in_common() {
    let summary = against_the_calmest(&grid());
    assert_eq!(summary.baseline.as_deref(), Some("calm 10"));
    let delay = of(&summary, "mean_delay_percent");
    let MetricValues::Numbers(alone) = &delay.variants[0].values else { panic!("numbers") };
    let rush = delay.comparisons.iter().find(|c| c.variant == "rush 10").unwrap();
    let interval = rush.interval.unwrap();
    assert!(interval.contains(3.0) && interval.half_width() < 0.25);
    assert!(alone.interval.unwrap().half_width() > 0.6, "not in pairs it is far wider");
    assert_eq!((rush.pairs, rush.incomplete, rush.lower, rush.higher), (20, 0, 0, 20));
    assert!(rush.p_holm.unwrap() < 1e-6 && rush.p_holm >= rush.p);
    assert!(rush.bootstrap.unwrap().contains(rush.difference.unwrap()));
    let noise = &of(&summary, "noise_m").comparisons;
    assert!(noise.iter().all(|c| c.p_holm.unwrap() > 0.05 && c.ratio.is_none()));
}

#[test]
fn main_effects_are_means_over_the_other_parameters() {
    let summary = summed(&grid());
    let effects = &of(&summary, "mean_delay_percent").effects;
    let names: Vec<&str> = effects.iter().map(|e| e.parameter.as_str()).collect();
    assert_eq!(names, ["regime", "robots.count"], "`format` never differs");
    let mean = |e: usize, l: usize| effects[e].levels[l].estimate.mean.unwrap();
    assert!((mean(0, 1) - mean(0, 0) - 3.0).abs() < 0.1);
    assert!((mean(1, 2) - mean(1, 0) - 3.0).abs() < 0.1);
    assert!(effects.iter().flat_map(|e| &e.levels).all(|l| l.estimate.n == 20));
    // Replicates are the independent units: their spread of 2 stays, for any number of variants.
    assert!(effects[0].levels[0].estimate.interval.unwrap().half_width() > 0.6);
}

#[test]
fn a_column_of_yes_and_no_is_a_share_with_wilsons_interval() {
    let summary = against_the_calmest(&grid());
    let arrived = of(&summary, "arrived");
    assert!(arrived.is_share);
    let MetricValues::Share(share) = &arrived.variants[0].values else { panic!("a share") };
    assert_eq!(share.interval, Some(sidestep_statistics::wilson(share.yes as f64, 20.0)));
    let comparison = &arrived.comparisons[0];
    assert_eq!(comparison.p, comparison.p_sign, "McNemar's test");
}

#[test]
fn figures_are_lines_over_numbers_dots_over_words_and_points_where_nothing_is_on_a_line() {
    let figures = summed(&grid()).figures();
    assert_eq!(figures.len(), 6, "three metrics over two parameters");
    let [dots, lines, ..] = figures.as_slice() else { panic!("two figures") };
    assert_eq!(dots.kind, FigureKind::Dots { categories: vec!["calm".into(), "rush".into()] });
    assert_eq!(lines.kind, FigureKind::Lines);
    let names: Vec<&str> = lines.series.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["regime = calm", "regime = rush"]);
    let x: Vec<f64> = lines.series[0].points.iter().map(|p| p.x).collect();
    assert_eq!(x, [10.0, 20.0, 40.0]);
    assert!(
        figures
            .iter()
            .flat_map(|f| &f.series)
            .flat_map(|s| &s.points)
            .all(|p| p.interval.is_some())
    );
    assert_eq!(lines.y_label, "mean delay (%)");
    assert_eq!(lines.title, "Mean delay (%) over robots.count");
    assert_eq!(lines.note, "Means with 95 % intervals, 20 runs a variant.");

    let scattered = summed(&hypercube(30, 2));
    assert!(scattered.baseline.is_none() && scattered.metrics[0].effects.is_empty());
    assert!(scattered.notes[0].starts_with("The variants are no full grid"));
    let figures = scattered.figures();
    assert!(figures.iter().all(|f| f.kind == FigureKind::Points));
    let points = figures.iter().map(|f| f.series.iter().map(|s| s.points.len()).collect());
    let points: Vec<Vec<usize>> = points.collect();
    assert_eq!(points, [vec![10, 10, 10], vec![30], vec![30]], "the box in thirds, and both sides");
    assert_eq!(scattered.overview().columns, ["metric", "goes with", "rank correlation", "n"]);
    let lag = scattered.trends.iter().find(|t| t.parameter == "speed_m_s").unwrap();
    assert!(lag.rank_correlation.unwrap().value > 0.99 && lag.n == 30);
}

#[test]
fn the_first_page_has_the_comparison_against_zero_and_at_most_six_figures() {
    let summary = against_the_calmest(&grid());
    let lead = summary.lead_figures();
    assert!((2..=6).contains(&lead.len()), "{} figures", lead.len());
    let FigureKind::Forest { rows, texts, .. } = &lead[0].kind else { panic!("a forest first") };
    let compared = lead[0].series.len();
    assert!(texts.len() == compared && texts.iter().all(|texts| texts.len() == rows.len()));
    assert!(lead[0].x_label.starts_with("difference from "), "{}", lead[0].x_label);
    assert!(lead[1..].iter().any(|figure| figure.kind == FigureKind::Lines));
}

#[test]
fn a_front_that_is_asked_for_follows_the_comparison_and_knows_its_metrics() {
    let aim = |metric: &str| Aim { metric: metric.into(), better: Better::Low };
    let better = vec![aim("mean_delay_percent"), aim("noise_m")];
    let options = SummaryOptions { better, ..Default::default() };
    let summary = Summary::from_table(&grid(), &options).unwrap();
    let figure = &summary.lead_figures()[1];
    let FigureKind::Front { corners } = &figure.kind else { panic!("a front") };
    assert!(!corners.is_empty() && figure.note.contains("lower mean delay"), "{}", figure.note);
    let options = SummaryOptions { better: vec![aim("mean_delay"), aim("noise_m")], ..options };
    let error = Summary::from_table(&grid(), &options).unwrap_err().to_string();
    assert!(error.contains("mean_delay_percent"), "{error}");
}

#[test]
fn two_variants_are_shown_seed_by_seed() {
    let values =
        (0..24).map(|k| f64::from(k % 12) + 0.1 * f64::from(k * k % 7) + f64::from(k / 12));
    let metrics = vec![column("lag_m", Role::Metric, numbers(values))];
    let summary = summed(&two_variants(12, metrics));
    let kinds: Vec<&FigureKind> = summary.lead_figures().iter().map(|f| &f.kind).collect();
    assert!(matches!(kinds[0], FigureKind::Forest { .. }));
    assert!(matches!(kinds[1], FigureKind::Runs { is_joined: true, .. }));
    assert!(matches!(kinds[2], FigureKind::Runs { has_zero_line: true, .. }));
    assert!(kinds.contains(&&FigureKind::Steps));
}

/// A hypercube of which one side is a whole number: some variants share it, and still none is a baseline.
#[test]
fn samples_of_whole_numbers_are_samples_too() {
    let mut table = hypercube(30, 1);
    let speed = table.columns.iter_mut().find(|c| c.name == "speed_m_s").unwrap();
    speed.values = ColumnValues::I64((0..30).map(|k| Some(k % 4)).collect());
    let summary = summed(&table);
    assert_eq!((summary.baseline.clone(), summary.figures().len()), (None, 3));
}

#[test]
fn parameters_that_always_change_together_share_an_axis() {
    let rows = || (0..12_i64).map(|k| k / 4);
    let text =
        |words: [&str; 3]| ColumnValues::Text(rows().map(|k| Some(words[k as usize])).collect());
    let columns = vec![
        column("variant", Role::Variant, ColumnValues::I64(rows().map(Some).collect())),
        column(
            "replicate",
            Role::Replicate,
            ColumnValues::I64((0..12).map(|k| Some(k % 4)).collect()),
        ),
        column("method", Role::Parameter, text(["none", "mvp", "pc"])),
        column("shield", Role::Parameter, text(["off", "on", "auto"])),
        column("lag_m", Role::Metric, numbers((0..12).map(f64::from))),
    ];
    let summary = summed(&RunTable { columns });
    let names: Vec<&str> = summary.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["method, shield"]);
    let [figure] = &summary.figures()[..] else { panic!("one figure") };
    let names: Vec<&str> = figure.series.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["none, off", "mvp, on", "pc, auto"]);
    assert!(matches!(figure.kind, FigureKind::Runs { .. }));
}

#[test]
fn one_table_has_every_mean_with_its_difference_p_and_n() {
    let overview = against_the_calmest(&grid()).overview();
    let columns = ["metric", "variant", "mean", "difference", "p (Holm)", "n"];
    assert_eq!((&overview.columns[..], overview.rows.len()), (&columns.map(String::from)[..], 18));
    assert_eq!(overview.rows[0][0], "Mean delay (%)");
    assert_eq!(overview.rows[0][3..5], ["", ""], "the baseline differs from nothing");
    assert!(overview.rows[3][3].ends_with(']') && overview.rows[3][5] == "20");
}

/// Two numeric parameters that no two variants share, 2 replicates.
fn hypercube(variants: i64, replicates: i64) -> RunTable {
    let rows: Vec<(i64, i64)> =
        (0..variants).flat_map(|v| (0..replicates).map(move |r| (v, r))).collect();
    let int =
        |of: fn(&(i64, i64)) -> i64| ColumnValues::I64(rows.iter().map(|r| Some(of(r))).collect());
    let columns = vec![
        column("variant", Role::Variant, int(|r| r.0)),
        column("replicate", Role::Replicate, int(|r| r.1)),
        column("gap_m", Role::Parameter, int(|r| r.0 * 7 % 101)),
        column("speed_m_s", Role::Parameter, int(|r| r.0 * 3)),
        column("lag_m", Role::Metric, int(|r| r.0 * r.0 + r.1 * r.0 % 5)),
    ];
    RunTable { columns }
}

#[test]
fn one_variant_is_shown_as_its_distribution() {
    let mut table = grid();
    table.columns.retain(|c| matches!(c.role, Role::Metric));
    let summary = summed(&table);
    assert_eq!((summary.variants.len(), summary.variants[0].name.as_str()), (1, "all runs"));
    assert!(summary.baseline.is_none() && summary.metrics[0].comparisons.is_empty());
    let figures = summary.figures();
    assert_eq!(figures.len(), 2, "a share has no distribution");
    assert_eq!(figures[0].series[0].points.last().unwrap().y, 1.0);
}

#[test]
fn no_number_in_a_table_is_without_interval_and_n() {
    let summary = summed(&grid());
    let tables = summary.tables();
    for table in &tables {
        assert!(table.rows.iter().all(|row| row.len() == table.columns.len()), "{}", table.title);
    }
    let delay = &tables[0];
    assert_eq!((delay.title.as_str(), delay.rows.len()), ("Mean delay (%): all numbers", 6));
    assert_eq!(delay.columns[1], "n");
    assert!(delay.rows.iter().all(|row| row[2].ends_with(']') && row[3].ends_with(']')));
    assert!(delay.rows[0][8].ends_with("[-]"), "20 runs do not bound a 5th percentile");
    assert_eq!(tables.last().unwrap().title, "Metrics not shown");
}

#[test]
fn missing_and_infinite_values_are_counted_and_told() {
    let mut table = grid();
    let delay = table.columns.iter_mut().find(|c| c.name == "mean_delay_percent").unwrap();
    let ColumnValues::F64(values) = &mut delay.values else { panic!("numbers") };
    let mut cells: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
    (cells[0], cells[1], cells[25]) = (None, Some(f64::NAN), Some(f64::INFINITY));
    *values = cells.into_iter().collect();
    let summary = against_the_calmest(&table);
    let delay = of(&summary, "mean_delay_percent");
    let first = &delay.variants[0];
    assert_eq!((first.n, first.missing, first.not_finite), (18, 2, 1));
    assert_eq!((delay.comparisons[0].pairs, delay.comparisons[0].incomplete), (17, 3));
    assert_eq!(delay.effects[0].levels[0].estimate.n, 17, "replicates that all variants have");
    let note = "2 values are infinite or no number and count as missing.";
    assert!(summary.notes.iter().any(|one| one == note), "{:?}", summary.notes);
}

#[test]
fn the_order_of_rows_is_no_part_of_a_summary() {
    let table = grid();
    let mut turned = table.clone();
    let backwards: Vec<usize> = (0..table.runs()).rev().collect();
    for column in &mut turned.columns {
        column.values = column.values.gather_rows(&backwards);
    }
    assert_eq!(summed(&turned), summed(&table));
}

#[test]
fn wrong_names_and_tables_are_refused_with_a_remedy() {
    let refused = |options: SummaryOptions| Summary::from_table(&grid(), &options).unwrap_err();
    let against = Some(BaselineChoice::Variant("calm 11".into()));
    let error = refused(SummaryOptions { against, ..Default::default() });
    assert_eq!(error.cause(), "there is no variant `calm 11`");
    let metrics = Some(vec!["noise".to_string()]);
    let error = refused(SummaryOptions { metrics, ..Default::default() });
    assert_eq!(error.cause(), "there is no metric `noise`");
    let mut twice = grid();
    let replicate = twice.columns.iter_mut().find(|c| c.role == Role::Replicate).unwrap();
    replicate.values = ColumnValues::I64(vec![4; 120].into());
    let error = Summary::from_table(&twice, &SummaryOptions::default()).unwrap_err();
    assert_eq!(error.cause(), "variant `calm 10` has two runs of replicate 4");
    let empty = Summary::from_table(&RunTable::default(), &SummaryOptions::default()).unwrap();
    assert!(empty.tables().is_empty() && empty.figures().is_empty());
}

#[test]
fn a_summary_is_written_as_plain_data() {
    let written = serde_json::to_value(summed(&grid())).unwrap();
    let delay = &written["metrics"][0];
    assert_eq!(delay["label"]["unit"], "%");
    assert_eq!(written["variants"][5]["levels"], serde_json::json!(["rush", 40.0]));
    assert_eq!(written["parameters"][1]["levels"], serde_json::json!([10.0, 20.0, 40.0]));
    assert!(delay["variants"][0]["values"]["numbers"]["interval"][0].is_number());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn no_table_makes_a_summary_panic(
        rows in prop::collection::vec(
            (0_i64..4, 0_i64..3, prop::option::of(prop::num::f64::ANY), prop::option::of(prop::bool::ANY)),
            0..24,
        ),
        trial: bool, variant: bool, replicate: bool,
    ) {
        let mut columns = vec![
            column("p", Role::Parameter, ColumnValues::I64(rows.iter().map(|r| Some(r.0)).collect())),
            column("q", Role::Parameter, ColumnValues::F64(rows.iter().map(|r| r.2).collect())),
            column("x_s", Role::Metric, ColumnValues::F64(rows.iter().map(|r| r.2).collect())),
            column("ok", Role::Metric, ColumnValues::Bool(rows.iter().map(|r| r.3).collect())),
        ];
        let int = |numbers: Vec<i64>| ColumnValues::I64(numbers.into_iter().map(Some).collect());
        let (first, second) = (rows.iter().map(|r| r.0), rows.iter().map(|r| r.1));
        if trial { columns.push(column("cell", Role::Trial, int(second.clone().collect()))); }
        if variant { columns.push(column("variant", Role::Variant, int(first.collect()))); }
        if replicate { columns.push(column("replicate", Role::Replicate, int(second.collect()))); }
        let bootstrap = Bootstrap { resamples: 60, ..Bootstrap::default() };
        let options = SummaryOptions { bootstrap, ..Default::default() };
        if let Ok(summary) = Summary::from_table(&RunTable { columns }, &options) {
            let _ = (summary.tables(), summary.figures());
        }
    }
}
