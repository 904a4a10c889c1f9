//! Scenario files in other encodings, arguments that called files have no use for, and conflicts beyond a pole.

use super::*;
use crate::report::Treatment;

const TWO: &str = "00:00:00>CRE AAA1,A320,52.0,4.0,090,FL300,270\n\
                   00:00:00>CRE BBB2,A320,52.0,5.5,270,FL300,270\n";

fn read_bytes_of(bytes: &[u8]) -> ScnFile {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("f.scn");
    std::fs::write(&path, bytes).expect("a file");
    read(&path).expect("a scenario")
}

#[test]
fn a_file_in_another_encoding_is_read_and_its_lines_are_named() {
    let latin = [b"# caf\xe9\n".as_slice(), TWO.as_bytes()].concat();
    let file = read_bytes_of(&latin);
    assert_eq!(file.traffic.aircraft.len(), 2);
    let found = file.report.findings.iter().find(|f| f.rule.contains("not UTF-8")).expect("named");
    assert_eq!(
        (found.treatment, found.places.as_slice()),
        (Treatment::Repaired, &["line 1".to_owned()][..])
    );
    let mut utf16 = vec![0xff, 0xfe];
    utf16.extend(TWO.encode_utf16().flat_map(u16::to_le_bytes));
    assert_eq!(read_bytes_of(&utf16).traffic, read_bytes_of(TWO.as_bytes()).traffic);
}

#[test]
fn arguments_for_which_a_called_file_has_no_place_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("sub.scn"), "00:00:01>CRE %0,A320,%1,4,90,FL300,270\n")
        .expect("a file");
    let path = folder.path().join("f.scn");
    for (call, is_named) in [("PCALL sub AAA1 52", false), ("PCALL sub AAA1 52 more", true)] {
        std::fs::write(&path, format!("00:00:00>{call}\n")).expect("a file");
        let file = read(&path).expect("a scenario");
        assert_eq!(file.traffic.aircraft.len(), 1, "{call}");
        let named =
            file.report.findings.iter().any(|f| f.rule.contains("further arguments of PCALL"));
        assert_eq!(named, is_named, "{call}");
    }
}

#[test]
fn zones_that_bluesky_forgets_are_kept_and_named() {
    for (settings, is_named) in [
        ("ZONER 3\nCDMETHOD STATEBASED", true),
        ("DTLOOK 60\nASAS ON", true),
        ("CDMETHOD STATEBASED\nZONER 3\nCDMETHOD STATEBASED", false),
        ("ZONER 3", false),
        ("ASAS ON\nASAS OFF\nZONER 3\nASAS ON", true),
    ] {
        let text: String = settings.lines().map(|line| format!("00:00:00>{line}\n")).collect();
        let file = parse(&"f.scn", &format!("{TWO}{text}"));
        let rule = |found: &crate::report::Finding| found.rule.contains("BlueSky 1.1.1 forgets");
        assert_eq!(file.report.findings.iter().any(rule), is_named, "{settings}");
    }
}

#[test]
fn a_conflict_that_would_begin_beyond_a_pole_is_refused_and_the_rest_flies() {
    let text = "00:00:00>CRE AAA1,A320,89.9,4.0,090,FL300,270\n\
                00:00:00>CRECONFS C1,A320,AAA1,90,0,600\n";
    let file = parse(&"f.scn", text);
    assert_eq!(file.traffic.aircraft.len(), 1);
    assert!(file.refused[0].cause().contains("beyond a pole"), "{:?}", file.refused);
}
