"""What a file may ask for before it is read."""

import os

import pytest

from gears3d import inputs
from gears3d.errors import InputError, UsageError


def test_the_limit_is_half_of_the_machine_or_as_told(monkeypatch):
    monkeypatch.delenv(inputs.VARIABLE, raising=False)
    room = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    assert 0 < inputs.most_bytes() <= room / 2
    monkeypatch.setenv(inputs.VARIABLE, "2e9")
    assert inputs.most_bytes() == 2_000_000_000
    inputs.refuse_beyond(2e9, "a.h5", "its channels", "name fewer")
    with pytest.raises(InputError, match=r"a.h5: k: its channels require 1.86 GiB .* 1.86 GiB are permitted"):
        inputs.refuse_beyond(2e9 + 1, "a.h5", "its channels", "name fewer", "k")


@pytest.mark.parametrize("told", ["0", "-1", "much", "nan", "inf"])
def test_a_limit_that_is_none_is_refused(told, monkeypatch):
    monkeypatch.setenv(inputs.VARIABLE, told)
    with pytest.raises(UsageError, match="give a positive number of bytes"):
        inputs.most_bytes()


def test_a_long_text_is_not_read(tmp_path):
    file = tmp_path / "a.toml"
    file.write_bytes(b"x" * 11)
    assert inputs.read_text(file, 11) == "x" * 11
    with pytest.raises(InputError, match="has 11 bytes, at most 10 are read"):
        inputs.read_text(file, 10)


def test_pipes_and_devices_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, message in (
        (tmp_path / "pipe", "is a pipe"),
        ("/dev/zero", "is a device"),
        ("a\0", "not a valid file name"),
    ):
        with pytest.raises(InputError, match=message):
            inputs.refuse_special(path)
    inputs.refuse_special(tmp_path)
    inputs.refuse_special(tmp_path / "missing")
