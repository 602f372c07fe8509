"""The plastic model gives the rigid model's recording, to rounding, or says which assumption fails."""

import itertools

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.lumped import plastic, rigid
from gears3d.simulation import simulate
from gears3d.verification.validation import fig5


def case(rpm=20, hertz=3, backlash=250, phase="0 deg", start="active", **more):
    harmonics = [{"amplitude": f"{rpm} rpm", "frequency": f"{hertz} Hz", "phase": phase}]
    return fig5().with_(
        {
            "impact.restitution": 0.0, "mount.backlash": f"{backlash} um", "motion.harmonics": harmonics,
            "run.duration": f"{4.3 / hertz} s", "run.output_rate": f"{200 * hertz} Hz", "start.state": start, **more,
        }
    )  # fmt: skip


def difference(scenario):
    """Largest difference of any number of the two recordings."""
    ours, theirs = plastic.simulate(scenario), rigid.simulate(scenario)
    assert ours.signals.keys() == theirs.signals.keys()
    assert ours.impacts.keys() == theirs.impacts.keys()
    assert ours.meta["lyapunov_1_s"] == theirs.meta["lyapunov_1_s"]
    assert ours.meta.keys() == theirs.meta.keys()
    pairs = [(ours.signals[name], theirs.signals[name]) for name in ours.signals]
    pairs += [(ours.impacts[name], theirs.impacts[name]) for name in ours.impacts]
    pairs.append((np.array(ours.meta["contacts"]), np.array(theirs.meta["contacts"])))
    assert [a.shape for a, _ in pairs] == [b.shape for _, b in pairs]
    return max(float(np.abs(a - b).max()) for a, b in pairs if a.size)


@pytest.mark.parametrize(
    ("rpm", "hertz", "backlash", "phase", "start"),
    [
        *itertools.product((1.6, 5, 20), (1, 3, 10), (250, 1000), ("0 deg",), ("active",)),
        *itertools.product((5,), (3,), (250,), ("100 deg", "250 deg"), ("active", "reverse", "free")),
    ],
)
def test_every_number_of_the_rigid_models_recording(rpm, hertz, backlash, phase, start):
    scenario = case(rpm, hertz, backlash, phase, start)
    if (rpm, hertz, backlash) == (1.6, 10, 1000):
        with pytest.raises(InputError, match="contact does not last"):
            plastic.simulate(scenario)
    else:
        assert difference(scenario) < 1e-11


def test_gears_of_different_size_and_a_drag_of_two_parts():
    other = {"gears.drive.teeth": 60, "gears.loose.inertia": "0.05 kg m^2", "motion.mean": "60 rpm"}
    assert difference(case(**other)) < 1e-11


def test_no_drag_at_all():
    scenario = case(**{"drag.torque": "0 N m"})
    assert difference(scenario) < 1e-11
    speeds = plastic.simulate(scenario).impacts["velocity_m_s"][:2]
    assert speeds.sum() == pytest.approx(0.0, abs=1e-12)  # without drag both flanks are alike


def test_published_figures_to_six_digits():
    """Single-sided: lost at 2.865716 rad, 79.96 µm high, back at 3.974947 rad with -4.23930 mm/s; Rb = 0.148 m."""
    radius = fig5().rig().base_radius_loose
    scenario = case(5, 1, **{"drag.torque": f"{0.22 * 0.148 / radius!r} N m"})
    scenario = scenario.with_({"motion.harmonics[0].amplitude": f"{5 * 0.148 / radius!r} rpm"})
    recording = plastic.simulate(scenario)
    assert recording.impacts["phase_rad"] == pytest.approx(3.974947, abs=6e-7)
    assert recording.impacts["velocity_m_s"] * 1e3 == pytest.approx(-4.23930, abs=6e-6)
    assert recording.impacts["flight_height_m"] * 1e6 == pytest.approx(79.96, abs=6e-3)
    lost = 2 * np.pi * recording.meta["contacts"][0][2]
    assert lost == pytest.approx(2.865716, abs=6e-7)


@pytest.mark.parametrize(
    ("changes", "key", "text"),
    [
        ({"impact.restitution": 0.3}, "impact.restitution", "no rebounds"),
        ({"effect": [{"kind": "drag_viscous", "coefficient": "1e-3 N m s/rad"}]}, "effect[0]", "drag_viscous"),
        ({"motion.harmonics[+]": {"amplitude": "1 rpm", "frequency": "9 Hz"}}, "motion.harmonics[1]", "second"),
        ({"motion.mean": "10 rpm"}, "motion.mean", "stop"),
        ({"mount.backlash": "50 um", "motion.harmonics[0].amplitude": "5 rpm", "motion.harmonics[0].frequency": "1 Hz"},
         "motion.harmonics[0]", "contact does not last"),
    ],
)  # fmt: skip
def test_an_assumption_that_fails_is_named(changes, key, text):
    scenario = case().with_(changes)
    with pytest.raises(InputError) as caught:
        simulate(scenario, "plastic")
    (fault,) = caught.value.faults
    assert fault.key == key
    assert text in fault.message
    assert "--model" in fault.remedy
    assert "rigid" in fault.remedy
    rigid.simulate(scenario)  # the remedy works


def test_every_fault_at_once():
    scenario = case().with_(
        {"impact.restitution": 0.3, "motion.harmonics[+]": {"amplitude": "1 rpm", "frequency": "9 Hz"}}
    )
    with pytest.raises(InputError) as caught:
        plastic.simulate(scenario)
    assert [fault.key for fault in caught.value.faults] == ["impact.restitution", "motion.harmonics[1]"]


def test_what_does_nothing_is_allowed():
    sensor = {"kind": "encoder_eccentricity", "amplitude": "0.01 deg"}
    scenario = case().with_({"motion.harmonics[+]": {"amplitude": "0 rpm", "frequency": "9 Hz"}, "effect": [sensor]})
    assert np.array_equal(plastic.simulate(scenario).impacts["time_s"], plastic.simulate(case()).impacts["time_s"])


def test_reliefs_are_refused_where_they_cost_contact():
    """A short one leaves flanks as they are all along; a long one lets the loose gear fall behind once a pitch."""
    short, long = (case().with_({"gears.tip_relief": {"amount": "20 um", "length": f"{n} mm"}}) for n in (3, 6))
    assert difference(short) < 1e-12
    with pytest.raises(InputError, match=r"gears.drive.tip_relief: is not in the plastic model yet"):
        simulate(long, "plastic")
