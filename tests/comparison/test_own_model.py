"""A user's own lumped model: impacts and contacts are found in its angles, and the verdict names a hidden error."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gears3d as g3
from gears3d import cli
from gears3d.errors import InputError
from tests.comparison import own_models

SEED = 3


@pytest.fixture(scope="module")
def scenario():
    """Two thirds of the periods of the rigs of the slow test: for this one they tell as much."""
    rig = own_models.rig(SEED)
    return rig.with_({"run.duration": f"{rig.run.duration / 1.5} s"})


@pytest.fixture(scope="module")
def right(scenario):
    return own_models.simulate(scenario, own_models.own(scenario))


def verdict(scenario, time, place):
    return g3.validate_model(g3.Recording.from_displacement(time, place, scenario), scenario)


@pytest.mark.slow
@pytest.mark.parametrize("kind", own_models.KINDS)
def test_a_hidden_error_is_named_and_a_right_model_is_equal(scenario, kind):
    found = verdict(scenario, *own_models.simulate(scenario, own_models.wrong(kind, scenario, SEED)))
    assert found.causes == ((kind,) if kind else ())
    assert found.verdict == ("different" if kind else "equal")
    assert json.loads(json.dumps(found.to_dict()))["sentence"] == found.sentence
    sizes = {"restitution": "5 %", "drag": "5 %", "backlash": "2 %"}
    assert sizes.get(kind, "") in found.sentence
    assert "sign" in found.sentence or kind != "sign"


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", own_models.KINDS)
def test_verdicts_are_right_on_nineteen_rigs_of_twenty(kind):
    named = []
    for seed in range(200, 220):
        scenario = own_models.rig(seed)
        named.append(verdict(scenario, *own_models.simulate(scenario, own_models.wrong(kind, scenario, seed))).causes)
    assert named.count((kind,) if kind else ()) >= 19, named


def test_impacts_and_contacts_are_those_of_the_model():
    scenario = own_models.rig(SEED)
    time, place = own_models.simulate(scenario, own_models.own(scenario))
    made = g3.Recording.from_displacement(time, place, scenario)
    known = g3.simulate(scenario, "rigid")
    assert made.meta["backlash_m"] == pytest.approx(scenario.rig().backlash, rel=1e-6)
    hard = np.flatnonzero(np.abs(known.impacts["velocity_m_s"]) > 5e-3)
    apart = np.abs(made.impacts["time_s"][None, :] - known.impacts["time_s"][hard, None])
    nearest = apart.argmin(axis=1)
    found = apart.min(axis=1) < 1e-6
    assert np.mean(found) > 0.9
    speeds = known.impacts["velocity_m_s"][hard[found]]
    assert made.impacts["velocity_m_s"][nearest[found]] == pytest.approx(speeds, rel=1e-3)
    assert {int(flank) for flank, *_ in made.meta["contacts"]} == {0, 1}


@pytest.mark.slow
def test_a_datum_is_no_way_beyond_the_flanks():
    sizes = {"stiffness": "1e6 N/m", "damping": "100 N s/m"}
    rig = own_models.rig(SEED)
    made = g3.simulate(rig.with_({"effect": [{"kind": "tooth_compliance", **sizes}]}), "rigid")
    drive, loose = (made.signals[f"theta_{gear}_rad"] for gear in ("drive", "loose"))
    found = [
        g3.validate_model(g3.Recording.from_angles(made.time, drive, loose + offset, rig), rig) for offset in (0.0, 0.3)
    ]
    assert [one.causes for one in found] == [("step",), ("step",)]
    ways = [next(each.model for each in one.findings if "beyond" in each.quantity) for one in found]
    assert ways[1] == pytest.approx(ways[0], rel=0.1)
    assert "constant offset of 0.3 rad" in found[1].sentence
    assert "offset" not in found[0].sentence


@pytest.mark.slow
def test_angles_with_another_datum_give_the_same_verdict(scenario, right):
    time, place = right
    drive, known = own_models.drive(scenario, time)[0], scenario.rig()
    loose = (place + known.base_radius_drive * drive) / known.base_radius_loose
    found = g3.validate_model(g3.Recording.from_angles(time, drive, loose + 0.3, scenario), scenario)
    assert found.verdict == "equal"
    late = g3.Recording.from_angles(time, own_models.drive(scenario, time - 5e-3)[0], loose, scenario)
    assert g3.validate_model(late, scenario).causes == ("time",)
    fast = g3.Recording.from_angles(time, 1.1 * drive, 1.1 * loose, scenario)
    assert g3.validate_model(fast, scenario).causes == ("drive",)


def test_two_errors_are_both_named_with_their_sizes(scenario):
    mine = own_models.own(scenario)
    both = replace(mine, e=1.1 * mine.e, backlash=0.96 * mine.backlash)
    found = verdict(scenario, *own_models.simulate(scenario, both))
    assert set(found.causes) == {"restitution", "backlash"}
    assert "+10 %" in found.sentence
    assert "-4 %" in found.sentence


@pytest.mark.slow
def test_a_displacement_of_the_opposite_sign_is_a_sign_error(scenario, right):
    assert verdict(scenario, right[0], -right[1]).causes == ("sign",)


@pytest.mark.slow
def test_flanks_of_springs_are_told_from_rigid_ones(scenario):
    known = scenario.rig()
    mass, stiffness = known.inertia / known.base_radius_loose**2, 2e6

    def slope(t, y):
        push = -stiffness * min(y[0], 0.0) - stiffness * max(y[0] - known.backlash, 0.0)
        pull = known.drag_torque / known.base_radius_loose
        return y[1], (push - pull) / mass - known.base_radius_drive * own_models.drive(scenario, t)[1]

    time = np.arange(int(6.0 / scenario.motion.harmonics[0].frequency * 1e4)) / 1e4
    found = solve_ivp(slope, (0.0, time[-1]), (0.0, 0.0), "DOP853", t_eval=time, max_step=1e-4, rtol=1e-8, atol=1e-12)
    named = verdict(scenario, time, found.y[0])
    assert named.verdict == "different"
    assert named.causes[0] in ("step", "flanks")


def test_a_model_in_steady_contact_is_equal_or_undecided_never_different(scenario):
    calm = scenario.with_({"motion.harmonics": []})
    time = np.arange(20_000) / 10_000.0
    assert verdict(calm, time, np.zeros(len(time))).verdict == "undecided"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, s: (np.sort(np.random.default_rng(1).uniform(0, 2, len(t))), s), "sample the solution evenly"),
        (lambda t, s: (t, s[:-1]), "has .* values, time_s has"),
        (lambda t, s: (t, np.where(t > 1.0, np.nan, s)), "is not finite"),
        (lambda t, s: (t - 1.0, s), "begins at -1 s"),
        (lambda t, s: (t[:20], s[:20]), "give 100 or more"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_with_a_remedy(scenario, right, change, words):
    with pytest.raises(InputError, match=words):
        g3.Recording.from_displacement(*change(*right), scenario)


@pytest.mark.slow
def test_the_command_gives_the_verdict_a_folder_and_an_exit_code(scenario, right, tmp_path, capsys):
    (tmp_path / "rig.toml").write_text(scenario.document, encoding="utf-8")
    table = np.stack([right[0], right[1]], axis=1)
    np.savetxt(tmp_path / "mine.csv", table, delimiter=",", header="time_s,displacement_m", comments="", fmt="%.15g")

    def run(*words):
        with pytest.raises(SystemExit) as stop:
            cli.main([*map(str, words)])
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return stop.value.code or 0, said.out, said.err

    mine, rig = tmp_path / "mine.csv", tmp_path / "rig.toml"
    code, out, err = run("compare", mine, rig, "--out", tmp_path / "kept", "--plot", tmp_path / "p.png")
    assert code == 0, err
    assert "equal to the rigid model within the error budget of the engine (0.5 %)" in " ".join(out.split())
    assert {"report.html", "verdict.json", "verdict.png", "scenario.toml"} <= {
        f.name for f in (tmp_path / "kept").iterdir()
    }
    code, out, _ = run("compare", mine, rig, "--set", "impact.restitution=0.5", "--json")
    assert code == 1
    assert json.loads(out)["causes"] == ["restitution"]
    assert run("compare", mine, rig, "--mode", "trajectory")[0] == 2
    assert run("compare", mine, mine, "--set", "drag.torque=1 N m")[0] == 2
    np.savetxt(tmp_path / "om.csv", table, delimiter=",", header='"time","gap.s_rel"', comments="", fmt="%.15g")
    names = ["--column", "time_s=time", "--column", "displacement_m=gap.s_rel"]
    assert run("compare", tmp_path / "om.csv", rig, *names)[0] == 0
    code, _, err = run("compare", tmp_path / "om.csv", rig, "--column", "time_s=tim")
    assert code == 3
    assert "did you mean 'time'?" in err
    (tmp_path / "bad.csv").write_text("t,x\n0,0\n1,1\n")
    code, _, err = run("compare", tmp_path / "bad.csv", rig)
    assert code == 3
    assert "time_s" in err
    (tmp_path / "half.csv").write_text("time_s,theta_drive_rad\n0,0\n1,1\n")
    code, _, err = run("compare", tmp_path / "half.csv", rig)
    assert code == 3
    assert "with theta_drive_rad and theta_loose_rad, or with displacement_m" in err
