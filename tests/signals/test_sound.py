"""The sound of impacts: bursts of known shape at the exact moment, in a file that any player reads."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.signal  # noqa: F401  (here, so that no single example has to wait for it)
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.io import wavfile

from gears3d import load, simulate
from gears3d.cli import main
from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording, levels, write_wav
from gears3d.signals import MODES, Mode, normalised, ring

RATE = 48_000


def burst(late, modes=MODES):
    """The closed form of one impact's sound, ``late`` seconds after it."""
    parts = [m.weight * np.exp(-late / m.decay) * np.sin(2 * np.pi * m.frequency * late) for m in modes]
    return np.where(late >= 0, sum(parts), 0.0)


@given(st.lists(st.tuples(st.floats(0.0, 0.1), st.floats(0.0, 3.0)), min_size=1, max_size=6), st.floats(0.1, 4.0))
def test_the_sound_is_the_sum_of_bursts_at_the_exact_moments(hits, slow):
    times, sizes = np.array(hits).T
    sound = ring(times, sizes, 0.1, RATE, slow=slow)
    at = np.arange(len(sound)) / RATE
    truth = sum(size * burst(at - slow * time) for time, size in hits)
    np.testing.assert_allclose(sound, truth, atol=1e-7)
    assert len(sound) >= (0.1 * slow + 0.08) * RATE


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50))
@example([2.225073858507e-311])
def test_normalised_is_nine_tenths_of_full_scale_by_a_stated_factor(values):
    sound = np.array(values)
    whole, factor = normalised(sound)
    assert np.abs(whole.astype(float)).max() == pytest.approx(0.9 * 32767, abs=0.51) or factor == 0.0
    if factor:
        np.testing.assert_allclose(whole / 32767 / factor, sound, atol=0.6 / 32767 / factor)


@pytest.fixture(scope="module")
def recording():
    return simulate(load("scenarios/rigaud-2020/fig5-20rpm.toml").with_({"run.duration": "2 s"}), "rigid")


def test_a_player_reads_the_file_and_hears_each_flank_on_its_side(recording, tmp_path):
    done = write_wav(recording, tmp_path / "a.wav", stereo=True)
    rate, sound = wavfile.read(tmp_path / "a.wav")
    assert (rate, sound.dtype, sound.shape) == (48_000, np.int16, (round(done["duration_s"] * rate), 2))
    hits = recording.impacts
    for side in (0, 1):
        mine = hits["flank"] == side
        truth = ring(hits["time_s"][mine], np.abs(hits["impulse_N_s"][mine]), 2.0)[: len(sound)]
        np.testing.assert_allclose(sound[:, side] / 32767, truth * done["full_scale_per_unit"], atol=2e-5)
    assert [p.name for p in tmp_path.iterdir()] == ["a.wav"]


@pytest.mark.parametrize("by", ["impulse", "energy", "velocity"])
def test_a_burst_is_scaled_by_what_is_asked_for(recording, tmp_path, by):
    write_wav(recording, tmp_path / "a.wav", by=by, rate=44_100, modes=(Mode(4000.0, 0.001, 1.0),))
    _, sound = wavfile.read(tmp_path / "a.wav")
    hits = recording.impacts
    first, second = (np.abs(sound[int(t * 44_100) :][:60].astype(float)).max() for t in hits["time_s"][:2])
    v, r = hits["velocity_m_s"][:2], hits["rebound_m_s"][:2]
    asked = {"impulse": np.abs(r - v), "energy": np.sqrt(v**2 - r**2), "velocity": np.abs(v)}[by]
    assert second / first == pytest.approx(asked[1] / asked[0], rel=0.02)


def test_levels_follow_the_energies(recording):
    found = levels(recording, constant=1e4)
    assert found["energy_level_dB"] == pytest.approx(10 * np.log10(found["energy_J_s"] / 1e-12))
    assert found["rattle_drive_rad3_s3"] == pytest.approx(744.1507, rel=1e-5)
    assert found["rattle_level_dB"] == pytest.approx(40 + 28.7166, abs=1e-3)
    assert found["total_level_dB"] == pytest.approx(10 * np.log10(10**7.8 + 10**6.87166), abs=1e-3)
    assert levels(recording)["rattle_level_dB"] is None


def test_refusals_name_the_remedy(recording, tmp_path):
    silent = Recording(recording.signals, {}, recording.meta)
    with pytest.raises(InputError, match="nothing to hear"):
        write_wav(silent, tmp_path / "a.wav")
    bare = Recording(recording.signals, {k: recording.impacts[k] for k in ("time_s", "flank", "velocity_m_s")})
    assert write_wav(bare, tmp_path / "b.wav")["by"] == "velocity"
    for changes, says in (
        ({"by": "impulse"}, "scale the bursts by velocity"),
        ({"by": "impuls"}, "did you mean 'impulse'"),
        ({"slow": 0.0}, "above 0"),
        ({"slow": 1e6}, "slow it less"),
        ({"rate": 8000}, "44100 or 48000"),
        ({"modes": (Mode(3e4, 0.01, 1.0),)}, "cannot be heard"),
        ({"modes": (Mode(1e3, 0.0, 1.0),)}, "decays in 0 s"),
    ):
        with pytest.raises((InputError, UsageError), match=says):
            write_wav(bare, tmp_path / "c.wav", **changes)
    assert not (tmp_path / "c.wav").exists()


def test_the_verb_writes_the_file_and_prints_its_numbers(recording, tmp_path, capsys):
    recording.write(tmp_path / "run")
    out = tmp_path / "rattle.wav"
    with pytest.raises(SystemExit) as end:
        main(["sound", str(tmp_path / "run"), "--out", str(out), "--slow", "4", "--mode", "900,20,1", "--json"])
    assert end.value.code == 0
    said = json.loads(capsys.readouterr().out)
    assert Path(said["file"]) == out
    assert said["modes"] == [{"frequency_Hz": 900.0, "decay_s": 0.02, "weight": 1.0}]
    assert said["duration_s"] == pytest.approx(4 * 2.0 + 0.14, abs=1e-3)
    assert said["levels"]["impacts_per_second"] == pytest.approx(24.0, abs=3.0)
    with pytest.raises(SystemExit) as end:
        main(["sound", str(tmp_path / "run"), "--out", str(out), "--mode", "900"])
    assert end.value.code == 2
    assert "Hz, ms and weight" in capsys.readouterr().err
