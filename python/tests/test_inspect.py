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


def tracks(gap_s=900):
    """Rows of an airplane that flies east, with a gap in their middle."""
    rows = ["time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg"]
    for k in range(20):
        time_s = 1533114900 + 10 * k + (gap_s if k >= 10 else 0)
        lon_deg = 7.0 + 0.03 * k + (gap_s * 0.003 if k >= 10 else 0)
        rows.append(f"{time_s},aaaaa1,ABC1,47,{lon_deg:.3f},35000,440,90")
    return "\n".join(rows) + "\n"


def test_options_of_an_import_hold_for_reports_clean_files_and_scenarios(tmp_path):
    file = tmp_path / "day.csv"
    file.write_text(tracks())
    wide = {"max_gap_s": 3600}
    assert sidestep.inspect(file).kept["flights"] == 2
    assert sidestep.inspect(file, clean=tmp_path / "one.csv", import_options=wide).kept["flights"] == 1
    assert sidestep.Scenario(file).agents == 2
    scenario = sidestep.Scenario(file, import_options=wide)
    assert (scenario.agents, scenario.set(seed=3).agents) == (1, 1)
    assert sidestep.Scenario(file, import_options={"import.max_gap_s": 3600.0}).agents == 1


def test_a_wrong_option_of_an_import_says_what_is_right(tmp_path):
    file = tmp_path / "day.csv"
    file.write_text(tracks())
    for options, words in [
        ({"gap": 1}, "its options are max_gap_s"),
        ({"max_gap_s": -1}, "give seconds above 0"),
        ({"leave_out_suspicious": "maybe"}, "give true or false"),
    ]:
        with pytest.raises(sidestep.InputError) as raised:
            sidestep.Scenario(file, import_options=options)
        assert words in raised.value.remedy
    with pytest.raises(sidestep.InputError, match="none is given"):
        sidestep.Scenario({"world": "robots"}, import_options={"max_gap_s": 1})
    map_file = tmp_path / "a.map"
    map_file.write_text(MAP)
    with pytest.raises(sidestep.InputError, match="has no effect"):
        sidestep.inspect(map_file, import_options={"max_gap_s": 1})


def test_check_shows_what_became_of_the_file_of_another_program(tmp_path):
    file = tmp_path / "day.csv"
    file.write_text(tracks())
    found = sidestep.Scenario(file).check()
    assert any(line.startswith("guessed: gaps of more than 600 s") for line in found)
    assert found == sidestep.Scenario(file).set(seed=5).check()


def test_an_arm_shows_what_was_not_taken_as_it_stood(tmp_path):
    file = tmp_path / "a.urdf"
    file.write_text(
        "<robot name='r'><link name='a'/><link name='b'/>"
        "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><origin xyz='1 0 0'/><axis xyz='0 0 1'/>"
        "<limit lower='-1e16' upper='1e16' effort='1' velocity='-1'/></joint>"
        "<transmission name='t'/></robot>"
    )
    arm = sidestep.Arm(file)
    assert all(isinstance(finding, sidestep.Finding) for finding in arm.findings)
    assert [finding.rule for finding in arm.findings] == [finding.rule for finding in sidestep.inspect(file).findings]
    assert any("transmission" in finding.rule for finding in arm.findings)
