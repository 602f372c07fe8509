"""Progress in a log: a line a stage after some seconds, on the error stream alone."""

import pytest

from gears3d.cli import progress


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    return now


def test_a_log_gets_one_line_a_stage_with_its_seconds(clock, capsys):
    with progress.bars() as track:
        tick = track("diagnose", 2.0)
        for seconds, done, doing in (
            (3.0, 0.1, "measuring a.csv"),  # a quick verb prints nothing
            (11.0, 0.2, "measuring a.csv"),
            (12.0, 0.3, "measuring a.csv"),
            (14.0, 0.5, "measuring b.csv"),
            (50.0, 0.7, "measuring b.csv"),  # a stage that lasts
            (51.0, 2.0, "done"),
        ):
            clock[0] = 100.0 + seconds
            tick(done, doing)
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.splitlines() == [
        "diagnose: measuring a.csv, 10 %, 11 s",
        "diagnose: measuring b.csv, 25 %, 14 s",
        "diagnose: measuring b.csv, 35 %, 50 s",
        "diagnose: done, 100 %, 51 s",
    ]


def test_a_work_without_stages_is_one_line_every_half_minute(clock, capsys):
    with progress.bars() as track:
        tick = track("points", 100.0)
        for seconds in range(1, 76):
            clock[0] = 100.0 + seconds
            tick(float(seconds))
    assert capsys.readouterr().err.splitlines() == ["points, 10 %, 10 s", "points, 40 %, 40 s", "points, 70 %, 70 s"]
