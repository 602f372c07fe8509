"""Units: families are told apart, and what is shown can be read back."""

import math
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.units import FAMILIES, add_family, parse, parse_any, show


@pytest.mark.parametrize(
    ("text", "family", "value"),
    [
        ("250 um", "length", 250e-6),
        ("250µm", "length", 250e-6),
        ("250 μm", "length", 250e-6),
        ("1 in", "length", 0.0254),
        (" -1.5e-3 m ", "length", -1.5e-3),
        ("20 deg", "angle", math.radians(20)),
        ("3 arcmin", "angle", math.radians(0.05)),
        ("30 rpm", "speed", math.pi),
        ("30 rev/min", "speed", math.pi),
        ("180 deg/s", "speed", math.pi),
        ("3 1/s", "frequency", 3.0),
        ("20 kHz", "frequency", 2e4),
        ("0.22 N m", "torque", 0.22),
        ("0.22 N·m", "torque", 0.22),
        ("0.22 N*m", "torque", 0.22),
        ("1 lbf ft", "torque", 1.3558179483314004),
        ("0.0695 kg m²", "inertia", 0.0695),
        ("695 kg cm^2", "inertia", 0.0695),
        ("2 km/h", "velocity", 2 / 3.6),
        ("1 N m s", "rotational_damping", 1.0),
        ("-4 s/m", "slowness", -4.0),
        ("50 degC", "temperature", 323.15),
        ("1 kg·m⁻³", "density", 1.0),
        ("3 N m/(rad/s)", "rotational_damping", 3.0),
        ("3 N*m*s*rad**-1", "rotational_damping", 3.0),
        ("5 %", "ratio", 0.05),
        (0.3, "ratio", 0.3),
        ("0.3", "ratio", 0.3),
        (90, "count", 90.0),
    ],
)
def test_quantities_become_si(text, family, value):
    assert parse(text, family) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "family", "message"),
    [
        ("180 rpm", "frequency", '180 rpm are 3 turns a second: if that is meant, write "3 Hz"'),
        ("10 rad/s", "frequency", "'10 rad/s' is a rotational speed, not a frequency"),
        ("3 cycle/s", "frequency", "is a rotational speed, not a frequency"),
        (
            "3 Hz",
            "speed",
            'is a frequency, not a rotational speed (3 Hz as turns a second would be "180 rpm")',
        ),
        ("3 1/s", "speed", "is a frequency, not a rotational speed"),
        ("2 J", "torque", "'2 J' is an energy, not a torque (a torque is written in N m"),
        ("2 W s", "torque", "is an energy, not a torque"),
        ("2 N m", "energy", "is a torque, not an energy"),
        ("1 mm/s", "speed", "is a velocity, not a rotational speed"),
        ("1 m/s^2", "acceleration", "is an acceleration along a line, not an angular acceleration"),
        ("1 1/s^2", "acceleration", "not an angular acceleration"),
        ("1 s", "slowness", "is a time, not a slowness"),
        ("5 min", "angle", "is a time, not an angle"),
        ("5 deg", "ratio", "is an angle, not a plain number"),
        ("5 %", "length", "is a plain number, not a length"),
        ("50 degC", "length", "is a temperature, not a length"),
        ("1 N m/rad", "torque", "is a rotational stiffness, not a torque"),
        ("9 A", "length", "is of dimension ampere^1, not a length"),
        ("5", "length", "'5' has no unit; a length is needed (e.g. \"250 um\")"),
        (5, "length", "5 has no unit"),
        ("5 rmp", "speed", "unit 'rmp' is not known (did you mean 'rpm'?)"),
        ("five mm", "length", "'five mm' is no quantity"),
        ("", "length", "'' is no quantity"),
        (True, "count", "True is no quantity"),
        (90.5, "count", "90.5 is not a whole number"),
        ("1e999 m", "length", "is not finite"),
        (math.nan, "ratio", "is not finite"),
        ([1], "torque", "[1] is no quantity"),
        ("1 __import__('os')", "length", "is not known"),
        ("1 m^9^9^9", "length", "unit 'm^9^9^9' is not known"),
        ("1 m**9**9", "length", "is not known"),
        ("1 m^99", "length", "is not known"),
        ("250 um!", "length", "unit 'um!' is not known"),
        ("1 {m}", "length", "unit '{m}' is not known"),
        ("1 m=1", "length", "unit 'm=1' is not known"),
        ("1 m/0", "length", "unit 'm/0' is not known"),
        ("1 m^0", "length", "unit 'm^0' is not known"),
        ("1 ()", "ratio", "unit '()' is not known"),
        ("1 (((((m)))))", "length", "is not known"),
        ("1 ❸釹", "length", "unit '❸釹' is not known"),
        ("1 m^", "length", "unit 'm^' is not known"),
        ("1 m)", "length", "unit 'm)' is not known"),
        ("1 (m", "length", "unit '(m' is not known"),
        ("1 m m m m m m m m m m", "length", "is not known"),
        ("١ m", "length", "is no quantity"),
        (10**400, "ratio", "a number of more than 40 digits is not finite"),
        (1e300, "count", "1e+300 is beyond 9007199254740991"),
        (2**53 + 1, "count", "9007199254740993 is beyond"),
        ("1e-400 m", "length", "is too small"),
        ("1e-320 nm", "length", "is too small"),
        ("1e308 km", "length", "is too large"),
    ],
)
def test_wrong_families_and_malformed_quantities_are_refused(text, family, message):
    with pytest.raises(InputError) as caught:
        parse(text, family)
    assert len(caught.value.faults) == 1
    assert message in str(caught.value)


@pytest.mark.parametrize("piece", [" ", "1", "m ", "^9", "(", "1e"])
def test_a_long_text_is_no_quantity(piece):
    with pytest.raises(InputError, match="characters\\) is no quantity"):
        parse("1" + piece * 100_000 + "m", "length")


@pytest.mark.parametrize(("text", "value"), [("9 mm", 0.009), ("250 um", 0.00025), ("0.1 nm", 1e-10), ("7 m", 7.0)])
def test_decimal_units_are_rounded_once(text, value):
    assert parse(text, "length") == value


def test_one_of_several_families():
    assert parse_any("30 rpm", ("speed", "angle", "acceleration")) == (pytest.approx(math.pi), "speed")
    assert parse_any("180 deg", ("speed", "angle", "acceleration")) == (pytest.approx(math.pi), "angle")
    with pytest.raises(InputError, match="a length, not a rotational speed or an angle"):
        parse_any("3 mm", ("speed", "angle"))


SHOWN = [name for name in FAMILIES if name not in ("count", "temperature")]


@given(st.sampled_from(SHOWN), st.floats(-1e12, 1e12, allow_subnormal=False))
def test_what_is_shown_reads_back(family, value):
    assert parse(show(value, family, digits=17), family) == pytest.approx(value, rel=1e-14, abs=1e-300)


@given(st.sampled_from(SHOWN), st.sampled_from(SHOWN), st.floats(0.1, 10))
def test_no_family_passes_for_another(family, other, value):
    text = show(value, family, digits=17)
    if family == other:
        assert parse(text, other) == pytest.approx(value, rel=1e-14)
    else:
        with pytest.raises(InputError):
            parse(text, other)


@pytest.fixture(scope="module")
def registry():
    import pint

    return pint.UnitRegistry()


@pytest.mark.parametrize(
    ("unit", "family"), [(unit, family) for family in FAMILIES.values() for unit in family.units if unit]
)
def test_the_table_agrees_with_pint(unit, family, registry):
    spelled = unit.replace("mNm", "mN m").replace("Nm", "N m") if family.name == "torque" else unit
    if family.name != "temperature":
        si = registry.Quantity(1.0, spelled).to(registry.parse_units(family.si)).magnitude
        assert family.units[unit] == pytest.approx(si, rel=1e-14)


@pytest.mark.parametrize(
    ("value", "family", "text"),
    [
        (250e-6, "length", "250 um"),
        (0.0035, "length", "3.5 mm"),
        (1e-3, "length", "1 mm"),
        (0.0, "length", "0 m"),
        (-0.001, "length", "-1 mm"),
        (2e4, "frequency", "20 kHz"),
        (2 * math.pi / 3, "speed", "20 rpm"),
        (math.inf, "length", "inf m"),
    ],
)
def test_quantities_are_shown_as_people_write_them(value, family, text):
    assert show(value, family) == text


def test_the_families_of_all_effect_parameters_are_known():
    families = {param.family for kind in catalogue().values() for param in kind.params.values()}
    assert families - {"choice"} <= set(FAMILIES)


def test_another_package_can_add_a_family():
    try:
        add_family("test_flow", "a volume flow", "m^3/s", "2 l/min")
        assert parse("6 l/min", "test_flow") == pytest.approx(1e-4, rel=1e-14)
        with pytest.raises(InputError, match="is a volume flow, not a length"):
            parse("6 l/min", "length")
    finally:
        del FAMILIES["test_flow"]
        add_family("volume", "a volume", "m^3", "2 l", {"l": 1e-3})


def test_common_units_need_no_pint():
    code = "import sys\nfrom gears3d.units import parse\nparse('30 rpm', 'speed')\nprint('pint' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("text", "family", "message", "remedy"),
    [
        ("20 k", "frequency", "has the prefix 'k' without a unit; a frequency is needed", 'e.g. "20 kHz"'),
        ("20 k", "speed", "has the prefix 'k' without a unit", 'e.g. "30 rpm"'),
        ("20k rpm", "speed", "has the prefix 'k' without a unit", 'e.g. "30 rpm"'),
        ("250 µ", "length", "has the prefix 'µ' without a unit", 'e.g. "250 µm"'),
        ("0,5", "ratio", "has a comma in its number", 'e.g. "0.5"'),
        ("0,22 N m", "torque", "has a comma in its number", 'e.g. "0.22 N m"'),
        ("1,000.5 um", "length", "has a comma in its number", "e.g. '250 um'"),
        ("1.000.000 um", "length", "has a mark in its number", "nothing parts thousands"),
        ("20 HZ", "frequency", "unit 'HZ' is not known", "did you mean 'Hz'?"),
    ],
)
def test_slips_of_the_pen_are_named(text, family, message, remedy):
    with pytest.raises(InputError) as caught:
        parse(text, family)
    assert message in caught.value.faults[0].message
    assert remedy in caught.value.faults[0].remedy


@pytest.mark.parametrize("text", ["0{", "1 (m", "2 m'''", '3 m"', "4 m["])
def test_what_no_parser_reads_is_told(text):
    with pytest.raises(InputError):
        parse(text, "torque")
