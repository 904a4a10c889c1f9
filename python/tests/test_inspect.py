"""What a file is, and what becomes of it when it is read."""

import pytest

import sidestep

MAP = "type octile\nheight 2\nwidth 3\nmap\n.@S\n...\n"


def test_a_report_has_the_format_the_counts_and_the_findings_of_a_file(tmp_path):
    file = tmp_path / "a.map"
    file.write_text(MAP)
    report = sidestep.inspect(file)
    assert (report.file, report.format) == (str(file), "map in characters (MovingAI)")
    assert report.kept["free boxes"] == 5
    assert [(finding.treatment, finding.count, finding.places) for finding in report.findings] == [
        ("not-used", 1, ["line 5"])
    ]
    assert report.dropped == 0
    assert sidestep.inspect(file, strict=True) == report


def test_what_was_kept_is_written_and_reads_as_the_same(tmp_path):
    file = tmp_path / "a.map"
    file.write_text(MAP)
    sidestep.inspect(file, clean=tmp_path / "b.yaml")
    clean = sidestep.inspect(tmp_path / "b.yaml")
    assert clean.kept == {"free pixels": 5, "occupied pixels": 1, "unknown pixels": 0}


def test_a_file_of_no_known_kind_is_an_error_with_its_place(tmp_path):
    file = tmp_path / "notes.md"
    file.write_text("# Notes\n")
    with pytest.raises(sidestep.InputError) as raised:
        sidestep.inspect(file)
    assert raised.value.place == str(file)
