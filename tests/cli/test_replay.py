"""``gears3d replay`` on what cannot be shown: refused at once, with the remedy."""

import pytest

from gears3d import cli


@pytest.fixture
def refused(capsys):
    def run(*arguments, code=3):
        with pytest.raises(SystemExit) as stop:
            cli.main(["replay", *map(str, arguments)])
        assert stop.value.code == code
        return capsys.readouterr().err

    return run


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "fig5"
    arguments = ["run", "scenarios/rigaud-2020/fig5-20rpm.toml", "--model", "rigid", "--twin", "none", "--no-views"]
    with pytest.raises(SystemExit) as stop:
        cli.main([*arguments, "--set", "run.duration=1 s", "--set", "expect={}", "--out", str(out)])
    assert not stop.value.code
    return out


def test_a_file_that_is_no_recording(refused, tmp_path):
    fake = tmp_path / "fake.rrd"
    fake.write_text("not a recording")
    assert "is not a rerun recording\n       name a run folder or an rrd file" in refused(fake)
    text = tmp_path / "notes.txt"
    text.write_text("x")
    assert "Missing option '--rig'" in refused(text, code=2)
    assert "is not there" in refused(tmp_path / "nowhere")


@pytest.mark.parametrize("at", ["7.5", "-1"])
def test_a_time_outside_the_run(refused, finished, at):
    assert f"--at: is {at} s, outside the run\n       give 0 to 1 s" in refused(finished, "--no-open", "--at", at)
    assert not (finished / "replay.rrd").exists()
