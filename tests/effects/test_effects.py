"""The catalogue: what an effect promises, and that adding one is adding one file."""

import dataclasses
import math
from typing import ClassVar

import pytest

from gears3d.effects import WIDTH, Code, Effect, Gate, Param, Rig, Row, SensorEffect, catalogue, register
from gears3d.errors import InputError
from gears3d.laws import film

RIG = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.3, math.pi, 90, 90)
EXAMPLES = {
    "transmission_error": {"amplitude": 5e-6, "order": 3},
    "drag_viscous": {"coefficient": 1e-3},
    "restitution_speed": {"slope": -2.0},
    "oil_film": {"viscosity": 0.01, "contact_length": 0.02},
    "tooth_compliance": {"stiffness": 2.6e6, "damping": 10.0},
    "encoder_eccentricity": {"amplitude": 1e-4},
    "eccentricity": {"offset": 2e-5},
    "pitch_error": {"offset": 1e-5, "tooth": 7},
    "backlash_offset": {"offset": 2e-5},
    "backlash_variation": {"amplitude": 2e-5, "order": 2},
    "carried_inertia": {"inertia": 0.01, "stiffness": 100.0},
    "drag_coulomb": {"torque": -0.05},
    "drag_power": {"coefficient": 1e-3, "exponent": 1.5},
    "drag_differential": {"coefficient": 1e-3, "shaft_speed": 20.0},
    "drag_position": {"amplitude": 0.02},
    "drag_drift": {"relative_change": -0.2, "time_constant": 60.0},
    "drag_stick_slip": {"amplitude": 0.02, "angle": 0.5},
    "mesh_drag": {"coefficient": 1e-3},
    "mesh_friction": {"coefficient": 0.05},
    "restitution_offset": {"offset": 0.1},
    "restitution_asymmetry": {"asymmetry": -0.1},
    "restitution_scatter": {"standard_deviation": 0.05},
    "drive_motion": {"amplitude": 0.1, "order": 2.0},
    "encoder_skew": {"delay": 1e-5},
}


def test_every_kind_has_an_example_here():
    assert set(EXAMPLES) <= set(catalogue())
    built_in = {k for k, c in catalogue().items() if c.__module__.startswith("gears3d.")}
    assert built_in == set(EXAMPLES)


@pytest.mark.parametrize("kind", EXAMPLES)
def test_an_effect_keeps_its_promises(kind):
    cls = catalogue()[kind]
    effect = cls(**EXAMPLES[kind])
    assert isinstance(effect, Effect)
    families = {f"{name}_family": param.family for name, param in cls.params.items() if param.also}
    assert {f.name: f.default for f in dataclasses.fields(effect) if f.name not in cls.params} == families
    assert {f.name for f in dataclasses.fields(effect)} >= set(cls.params)
    for field in (f for f in dataclasses.fields(effect) if f.name in cls.params):
        default = cls.params[field.name].default
        assert (default is None) == (field.default is dataclasses.MISSING)
        assert default is None or default == field.default
    assert effect.unit_size(RIG) > 0
    for row in effect.rows(RIG):
        assert isinstance(row, Row)
        assert len(row.p) <= WIDTH
        assert all(math.isfinite(x) for x in row.p)
        place = {1: "torque", 2: "geometry", 3: "impact", 4: "gap_force", 5: "motion"}[row.code // 100]
        assert cls.place == place
    assert (cls.place == "sensor") == isinstance(effect, SensorEffect)
    with pytest.raises(dataclasses.FrozenInstanceError):
        effect.kind_ = 1


def test_transmission_error_moves_both_flanks_together_and_active_alone_changes_the_gap():
    cls = catalogue()["transmission_error"]
    both = cls(amplitude=1e-6).rows(RIG)
    assert [r.p[3] for r in both] == [1e-6, -1e-6]
    active = cls(amplitude=1e-6, flank="active", gear="loose").rows(RIG)
    assert [r.p for r in active] == [(1.0, 0.0, 1.0, 1e-6, 0.0)]


def test_unit_size_of_viscous_drag_doubles_the_drag():
    size = catalogue()["drag_viscous"](coefficient=1.0).unit_size(RIG)
    assert size * RIG.mean_speed == pytest.approx(RIG.drag_torque)


def test_a_kind_is_taken_once():
    @dataclasses.dataclass(frozen=True)
    class Impostor:
        kind = "drag_viscous"
        place = "torque"
        params: ClassVar = {"coefficient": Param("torque")}

    with pytest.raises(ValueError, match="drag_viscous"):
        register(Impostor)


def test_codes_name_their_place_and_gates_are_distinct():
    assert len({int(c) for c in Code}) == len(Code)
    assert sorted(int(g) for g in Gate) == [0, 1, 2, 3, 4]


def test_a_film_is_turned_into_the_transverse_line_of_action():
    """Along it h = gap·cos βb, F·cos βb: the wedge stays what it is, the squeeze takes √cos βb."""
    rig = dataclasses.replace(RIG, working_pressure_angle=0.39, base_helix_angle=0.45, face_width=0.016)
    effect = catalogue()["oil_film"](viscosity=0.02, minimum_thickness=2e-6)
    wedge, squeeze, drive, loose, minimum, _ = effect.rows(rig)[0].p
    length = film.contact_length(0.016, 1.0, 0.45)
    radius = film.equivalent_radius(0.148, 0.148, 0.39, 0.45)
    gap, rate, turn = 5e-6, -0.01, math.cos(0.45)
    speed = (drive + loose) * 3.0
    ours = wedge * speed / gap - squeeze * rate / gap**1.5
    theirs = film.film_force(gap * turn, rate * turn, speed, length, 0.02, radius) * turn
    assert ours == pytest.approx(theirs, rel=1e-12)
    assert minimum * turn == pytest.approx(2e-6)
    assert drive == loose == pytest.approx(film.rolling_radius(0.148, 0.39, 0.45))


def test_the_unit_of_viscosity_stops_a_fall_across_the_backlash():
    rig = dataclasses.replace(RIG, face_width=0.0075)
    cls = catalogue()["oil_film"]
    unit = cls(viscosity=1.0).unit_size(rig)
    mass = rig.inertia / rig.base_radius_loose**2
    fall = math.sqrt(2 * rig.drag_torque / rig.base_radius_loose / mass * rig.backlash)
    oil = (film.contact_length(0.0075, 1.0, 0.0), unit, film.equivalent_radius(0.148, 0.148, math.radians(20), 0.0))
    assert film.squeezed_speed(1e-6, 1e9, fall, mass, *oil) == pytest.approx(0.0, abs=1e-6 * fall)


def test_a_film_is_felt_up_to_a_quarter_of_the_backlash_and_nearer_the_thinner_the_oil():
    rig = dataclasses.replace(RIG, face_width=0.0075)
    cls = catalogue()["oil_film"]
    heights = [cls(viscosity=eta).felt(rig) for eta in (0.0, 1e-4, 1e-3, 1.0)]
    assert heights[0] == 0.0
    assert heights == sorted(heights)
    assert heights[-1] == 0.25 * rig.backlash
    assert cls(viscosity=1e-4).felt(dataclasses.replace(rig, drag_torque=0.0)) == 0.25 * rig.backlash


def test_a_film_needs_a_face_width():
    with pytest.raises(InputError, match=r"no face width.*gears\.face_width"):
        catalogue()["oil_film"](viscosity=0.01).rows(RIG)
