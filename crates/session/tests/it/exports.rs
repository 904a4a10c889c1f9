//! Recorded runs in other formats.

use crate::support::{StopAt, TestFolder, WORLDS, names};
use sidestep_session::export::{AnimationOptions, ExportRequest, ExportScope, Format, export};
use sidestep_session::{Error, NoWatcher, OutputPaths, PictureLook, RecordedRun, replay_all};
use std::path::{Path, PathBuf};

pub(crate) fn wanted(form: Format, out: &Path) -> ExportRequest<'_> {
    let scope = ExportScope {
        out: Some(out),
        replace: false,
        from: None,
        until: None,
        every: None,
        workers: 1,
    };
    ExportRequest { form, look: PictureLook::default(), scope }
}

#[test]
fn a_run_goes_out_in_every_form() {
    let place = TestFolder::new();
    let (folder, _) = place.record("run");
    let recorded = RecordedRun::open(&WORLDS, &folder).expect("recorded");
    let events = Some("events".to_string());
    let film = AnimationOptions { fps: Some(10), width_px: Some(160) };
    let forms: [(&str, Format, &[u8]); 6] = [
        ("events.csv", Format::Csv(events.clone()), b"cycle,frog,event\n"),
        ("events.parquet", Format::Parquet(events), b"PAR1"),
        ("run.mcap", Format::Mcap, b"\x89MCAP0\r\n"),
        ("run.svg", Format::Svg, b"<svg"),
        ("run.png", Format::Png { width_px: Some(300) }, b"\x89PNG"),
        ("run.gif", Format::Gif(film), b"GIF89a"),
    ];
    for (name, form, begins) in forms {
        let is_computed = !matches!(form, Format::Csv(_) | Format::Parquet(_));
        let out = place.path(name);
        let mut request = wanted(form, &out);
        request.scope.every = Some(500);
        let written = export(&recorded, &request, &NoWatcher);
        let written = written.unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(written.is_confirmed, is_computed, "{name}");
        assert!(std::fs::read(&out).expect("written").starts_with(begins), "{name}");
    }
    let frames = place.path("frames");
    let mut last = wanted(Format::Frames(film), &frames);
    last.scope.from = Some(5000);
    let written = export(&recorded, &last, &NoWatcher).expect("written");
    assert_eq!(written.film, Some((145, 10)));
    let tables = export(&recorded, &wanted(Format::Csv(None), &place.path("csv")), &NoWatcher);
    let names = |path: &PathBuf| path.file_name().map(|name| name.display().to_string());
    let names: Vec<_> = tables.expect("written").paths.iter().filter_map(names).collect();
    assert_eq!(names, ["events.csv", "series.csv", "trajectories.csv"]);
}

#[test]
fn a_recording_for_viewers_is_replayed() {
    let place = TestFolder::new();
    let file = place.path("live.mcap");
    let keep = OutputPaths { mcap: Some((&file, 100)), ..OutputPaths::default() };
    let summary = place.start(2, keep).expect("started").run_to_end(&NoWatcher).expect("no bug");
    assert_eq!(summary.mcap.as_ref(), Some(&file));
    let recorded = RecordedRun::open(&WORLDS, &file).expect("recorded");
    let replayed = replay_all(&recorded, 1, &NoWatcher).expect("the same digest");
    assert_eq!(replayed.run.digest().to_string(), summary.digest);
}

#[test]
fn a_recording_is_not_exported_onto_itself() {
    let place = TestFolder::new();
    let file = place.path("live.mcap");
    let keep = OutputPaths { mcap: Some((&file, 100)), ..OutputPaths::default() };
    place.start(1, keep).expect("started").run_to_end(&NoWatcher).expect("no bug");
    let before = std::fs::read(&file).expect("there");
    let recorded = RecordedRun::open(&WORLDS, &file).expect("recorded");
    let mut part = wanted(Format::Mcap, &file);
    part.scope = ExportScope { replace: true, from: Some(10), until: Some(20), ..part.scope };
    let other_name = place.path("./live.mcap");
    for out in [Some(&*file), Some(&*other_name), None] {
        part.scope.out = out;
        let refused = export(&recorded, &part, &NoWatcher);
        let told = refused.expect_err("itself").to_string();
        assert!(told.contains("the recording that is exported"), "{told}");
        assert!(std::fs::read(&file).expect("there") == before);
    }
    let out = place.path("part.mcap");
    part.scope.out = Some(&out);
    export(&recorded, &part, &NoWatcher).expect("beside it");
}

#[test]
fn a_folder_that_is_named_with_a_slash_at_its_end_is_replaced_by_the_new_export() {
    let place = TestFolder::new();
    let recorded = RecordedRun::open(&WORLDS, &place.record("run").0).expect("recorded");
    let out = place.path("out/");
    for replace in [false, true] {
        let mut wanted = wanted(Format::Csv(None), &out);
        wanted.scope.replace = replace;
        export(&recorded, &wanted, &NoWatcher).expect("written");
        assert!(out.join("events.csv").is_file() && out.join("trajectories.csv").is_file());
        assert_eq!(names(&place), ["out", "pond.toml", "run"]);
    }
}

#[test]
fn an_export_that_is_stopped_leaves_nothing() {
    let place = TestFolder::new();
    let (folder, _) = place.record("run");
    let recorded = RecordedRun::open(&WORLDS, &folder).expect("recorded");
    let out = place.path("run.gif");
    let film = wanted(Format::Gif(AnimationOptions::default()), &out);
    let stopped = export(&recorded, &film, &StopAt::new(1));
    assert!(matches!(stopped, Err(Error::Interrupted)));
    assert!(!out.exists());
}
