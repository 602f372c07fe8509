"""Scenarios that would hang, grow or end in a traceback: each is refused within seconds, with file and key."""

import os

import pytest

from gears3d.errors import GearsError, InputError
from gears3d.scenario import load

BASE = """format = 1
[gears]
module = "3.5 mm"
drive = { teeth = 90 }
loose = { teeth = 90, inertia = "0.07 kg m^2" }
[mount]
backlash = "250 um"
[motion]
mean = "30 rpm"
harmonics = [ { amplitude = "20 rpm", frequency = "3 Hz" } ]
"""
TOP = "format = 1\n"
MEAN = 'mean = "30 rpm"'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (TOP, TOP + "#" + "x" * (1 << 18), "at most 262144 are read"),
        (TOP, TOP + "a = " + "[" * 5000 + "\n", "is not TOML"),
        (TOP, TOP + "a" + ".a" * 5000 + " = 1\n", "is not TOML"),
        (TOP, f"format = {'9' * 5000}\n", "is not TOML"),
        (TOP, TOP + f"run.seed = {10**400}\n", "run.seed: a number of more than 40 digits is not finite"),
        (TOP, TOP + "run.seed = 1e300\n", "run.seed: 1e+300 is beyond"),
        (TOP, TOP + 'extends = "a\\u0000b"\n', "extends: 'a\\x00b' is not a valid file name"),
        (TOP, TOP + f'extends = "{"a" * 300}"\n', "extends: there is no file"),
        (TOP, TOP + 'extends = "/dev/zero"\n', "/dev/zero: is a device, not a file"),
        (MEAN, 'record = "a\\u0000b"', "motion.record: 'a\\x00b' is not a valid file name"),
        (MEAN, f'record = "{"a" * 300}"', "motion.record: there is no file"),
        (MEAN, 'record = "/dev/zero"', "motion.record: '/dev/zero' is a device, not a file"),
        (MEAN, 'mean = "1 m^9^9^9"', "motion.mean: unit 'm^9^9^9' is not known"),
        (MEAN, 'mean = "1 rad/s^0"', "motion.mean: unit 'rad/s^0' is not known"),
    ],
    ids=range(14),
)
def test_a_hostile_value_is_one_fault(old, new, message):
    with pytest.raises(InputError) as caught:
        load(BASE.replace(old, new))
    assert message in str(caught.value)


@pytest.mark.parametrize("table", ["[[effect]]", "[a{}]", '[[effect]]\nkind = "drag_vicous"', "x{} = 1"])
def test_thousands_of_faults_are_told_in_seconds(table):
    tables = "\n".join(table.format(at) for at in range(4000))
    with pytest.raises(InputError) as caught:
        load(f"{tables}\n{BASE}" if table[0] == "x" else f"{BASE}\n{tables}")
    assert len(caught.value.faults) >= 4000


@pytest.mark.parametrize("name", ["/dev/zero", "a\0b", "a" * 300 + ".toml", "x.**", "/dev/null/x.toml"])
def test_what_is_no_file_is_refused(name):
    with pytest.raises(InputError):
        load(name)


def test_pipes_loops_and_chains_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    for at in range(100):
        (tmp_path / f"c{at}.toml").write_text(f'extends = "c{at + 1}.toml"\n')
    for name, message in (("pipe", "is a pipe"), ("loop", "symbolic links"), ("c0", "at most 30 files may extend")):
        with pytest.raises(InputError, match=message):
            load(tmp_path / f"{name}.toml")


def test_mappings_that_are_no_toml_are_refused():
    deep: dict = {}
    inner = deep
    for _ in range(2000):
        inner["a"] = inner = {}
    for mapping in ({"a": None}, {"a": 10**5000}, {1: 2}, {"a": object()}, deep):
        with pytest.raises(InputError, match="cannot be written as TOML"):
            load(mapping)


OVERRIDES = (
    "title[+]=1", "a[99999999999]=1", "motion.mean.x=1", "motion.mean[+]=1", "x=" + "[" * 2000, "x=" + "9" * 5000,
    "gears.drive[0]=3", "format[0]=1", "..=1", "run.seed=9007199254740993", "effect[+]=1",
)  # fmt: skip


@pytest.mark.parametrize("override", OVERRIDES, ids=range(len(OVERRIDES)))
def test_hostile_overrides_are_refused(override):
    with pytest.raises(GearsError):
        load(BASE, [override])
