//! Recorded runs in other formats.

use crate::support::{Place, StopAt, WORLDS, names};
use sidestep_session::export::{Export, Film, Form, export};
use sidestep_session::{Error, Keep, Recorded, Unwatched, replay_all};
use std::path::{Path, PathBuf};

pub(crate) fn wanted(form: Form, out: &Path) -> Export<'_> {
    Export {
        form,
        out: Some(out),
        replace: false,
        from: None,
        until: None,
        every: None,
        workers: 1,
    }
}

#[test]
fn a_run_goes_out_in_every_form() {
    let place = Place::new();
    let (folder, _) = place.record("run");
    let recorded = Recorded::open(WORLDS, &folder).expect("recorded");
    let events = Some("events".to_string());
    let film = Film { fps: Some(10), width_px: Some(160) };
    let forms: [(&str, Form, &[u8]); 6] = [
        ("events.csv", Form::Csv(events.clone()), b"cycle,frog,event\n"),
        ("events.parquet", Form::Parquet(events), b"PAR1"),
        ("run.mcap", Form::Mcap, b"\x89MCAP0\r\n"),
        ("run.svg", Form::Svg, b"<svg"),
        ("run.png", Form::Png { width_px: Some(300) }, b"\x89PNG"),
        ("run.gif", Form::Gif(film), b"GIF89a"),
    ];
    for (name, form, begins) in forms {
        let is_computed = !matches!(form, Form::Csv(_) | Form::Parquet(_));
        let out = place.path(name);
        let every = Some(500);
        let written = export(&recorded, &Export { every, ..wanted(form, &out) }, &Unwatched);
        let written = written.unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(written.is_confirmed, is_computed, "{name}");
        assert!(std::fs::read(&out).expect("written").starts_with(begins), "{name}");
    }
    let frames = place.path("frames");
    let last = Export { from: Some(5000), ..wanted(Form::Frames(film), &frames) };
    let written = export(&recorded, &last, &Unwatched).expect("written");
    assert_eq!(written.film, Some((145, 10)));
    let tables = export(&recorded, &wanted(Form::Csv(None), &place.path("csv")), &Unwatched);
    let names = |path: &PathBuf| path.file_name().map(|name| name.display().to_string());
    let names: Vec<_> = tables.expect("written").paths.iter().filter_map(names).collect();
    assert_eq!(names, ["events.csv", "trajectories.csv"]);
}

#[test]
fn a_recording_for_viewers_is_replayed() {
    let place = Place::new();
    let file = place.path("live.mcap");
    let keep = Keep { mcap: Some((&file, 100)), ..Keep::default() };
    let summary = place.start(2, keep).expect("started").travel(&Unwatched).expect("no bug");
    assert_eq!(summary.mcap.as_ref(), Some(&file));
    let recorded = Recorded::open(WORLDS, &file).expect("recorded");
    let replayed = replay_all(&recorded, 1, &Unwatched).expect("the same digest");
    assert_eq!(replayed.run.digest().to_string(), summary.digest);
}

#[test]
fn a_recording_is_not_exported_onto_itself() {
    let place = Place::new();
    let file = place.path("live.mcap");
    let keep = Keep { mcap: Some((&file, 100)), ..Keep::default() };
    place.start(1, keep).expect("started").travel(&Unwatched).expect("no bug");
    let before = std::fs::read(&file).expect("there");
    let recorded = Recorded::open(WORLDS, &file).expect("recorded");
    let part =
        Export { replace: true, from: Some(10), until: Some(20), ..wanted(Form::Mcap, &file) };
    let other_name = place.path("./live.mcap");
    for out in [Some(&*file), Some(&*other_name), None] {
        let refused = export(&recorded, &Export { out, ..part.clone() }, &Unwatched);
        let told = refused.expect_err("itself").to_string();
        assert!(told.contains("the recording that is exported"), "{told}");
        assert!(std::fs::read(&file).expect("there") == before);
    }
    let out = place.path("part.mcap");
    export(&recorded, &Export { out: Some(&out), ..part }, &Unwatched).expect("beside it");
}

#[test]
fn a_folder_that_is_named_with_a_slash_at_its_end_is_replaced_by_the_new_export() {
    let place = Place::new();
    let recorded = Recorded::open(WORLDS, &place.record("run").0).expect("recorded");
    let out = place.path("out/");
    for replace in [false, true] {
        let wanted = Export { replace, ..wanted(Form::Csv(None), &out) };
        export(&recorded, &wanted, &Unwatched).expect("written");
        assert!(out.join("events.csv").is_file() && out.join("trajectories.csv").is_file());
        assert_eq!(names(&place), ["out", "pond.toml", "run"]);
    }
}

#[test]
fn an_export_that_is_stopped_leaves_nothing() {
    let place = Place::new();
    let (folder, _) = place.record("run");
    let recorded = Recorded::open(WORLDS, &folder).expect("recorded");
    let out = place.path("run.gif");
    let film = wanted(Form::Gif(Film::default()), &out);
    let stopped = export(&recorded, &film, &StopAt::new(1));
    assert!(matches!(stopped, Err(Error::Interrupted)));
    assert!(!out.exists());
}
