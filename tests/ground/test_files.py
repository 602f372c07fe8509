"""A file is there as a whole or as it was before."""

import pytest

from gears3d.errors import InputError
from gears3d.files import replacing, write_text


def broken(path):
    with replacing(path) as unfinished:
        unfinished.write_text("half")
        raise KeyboardInterrupt


def test_what_was_there_stays_when_writing_fails(tmp_path):
    path = write_text(tmp_path / "a.txt", "before")
    with pytest.raises(KeyboardInterrupt):
        broken(path)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_folders_on_the_way_are_made_and_nothing_else_is_left(tmp_path):
    path = write_text(tmp_path / "x" / "y" / "a.txt", "content")
    assert path.read_text() == "content"
    assert list(path.parent.iterdir()) == [path]


def test_a_place_that_cannot_be_is_named(tmp_path):
    blocker = write_text(tmp_path / "file", "")
    with pytest.raises(InputError, match=r"file/a\.txt: cannot be written"):
        write_text(blocker / "a.txt", "content")
    with pytest.raises(InputError, match="Is a directory"):
        write_text(tmp_path, "content")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
