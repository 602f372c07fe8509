"""A run folder is there as a whole or not at all, and never takes the place of something else."""

import os
from pathlib import Path

import pytest

from gears3d.errors import InputError
from gears3d.runs import RunFolder, read_run


def test_leaving_without_commit_leaves_nothing(tmp_path):
    place = tmp_path / "run"
    with RunFolder(place) as folder:
        folder.write_summary({"status": "complete"})
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_run_stays_until_the_new_one_is_whole(tmp_path):
    place = tmp_path / "run"
    with RunFolder(place) as folder:
        folder.write_summary({"status": "complete", "run": 1})
        folder.commit()
    with RunFolder(place) as folder:
        folder.write_summary({"run": 2})
    assert '"run": 1' in (place / "summary.json").read_text()
    with RunFolder(place) as folder:
        folder.write_summary({"run": 3})
        folder.commit()
    assert '"run": 3' in (place / "summary.json").read_text()
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_foreign_folder_is_refused_and_untouched(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="not a run folder"), RunFolder(tmp_path):
        pass
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_a_file_is_refused(tmp_path):
    place = tmp_path / "run"
    place.write_text("")
    with pytest.raises(InputError, match="is a file"), RunFolder(place):
        pass


def written(place):
    with RunFolder(place) as folder:
        folder.write_summary({"status": "complete"})
        return folder.commit()


def test_a_link_to_a_run_stays_a_link_and_the_run_is_replaced(tmp_path):
    written(tmp_path / "run")
    (tmp_path / "run" / "old").touch()
    (tmp_path / "link").symlink_to("run")
    assert written(tmp_path / "link") == tmp_path / "link"
    assert (tmp_path / "link").is_symlink()
    assert not (tmp_path / "run" / "old").exists()


def test_a_link_to_nothing_is_refused(tmp_path):
    (tmp_path / "link").symlink_to("nothing")
    with pytest.raises(InputError, match="is a link to nothing, which does not exist"):
        written(tmp_path / "link")
    assert [path.name for path in tmp_path.iterdir()] == ["link"]


def test_the_current_folder_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="is the current folder or one above it"):
        written(Path())


def test_an_unwritable_place_is_named(tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(InputError, match=r"--out: .*cannot be written"), RunFolder(blocker / "run"):
        pass


def test_a_summary_cannot_hold_a_nan(tmp_path):
    with RunFolder(tmp_path / "run") as folder, pytest.raises(ValueError, match="not JSON compliant"):
        folder.write_summary({"x": float("nan")})


@pytest.mark.parametrize(("name", "text"), [("nowhere", "is not there"), ("empty", "no summary.json")])
def test_reading_what_is_no_run_says_how_to_make_one(tmp_path, name, text):
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=text) as caught:
        read_run(tmp_path / name)
    assert "gears3d run" in str(caught.value)
    assert os.fspath(tmp_path / name) in str(caught.value)


@pytest.mark.parametrize("name", ["lock", "before", "new"])
def test_a_run_may_have_any_name(tmp_path, name):
    for number in (1, 2):
        with RunFolder(tmp_path / name) as folder:
            folder.write_summary({"run": number})
            folder.commit()
    assert [path.name for path in (tmp_path / name).iterdir()] == ["summary.json"]
    assert '"run": 2' in (tmp_path / name / "summary.json").read_text()
    assert [path.name for path in tmp_path.iterdir()] == [name]
