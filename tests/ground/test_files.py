"""A file is there as a whole or as it was before."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

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


HELD = """
import sys, time
from gears3d.files import exchange, temporary
from pathlib import Path
place = Path(sys.argv[1])
with temporary(place.parent) as folder:
    (folder / "half").write_text("x" * 1000)
    if len(sys.argv) > 2:
        (folder / place.name).write_text("new")
        (folder.parent / "before").mkdir()
        place.rename(folder.parent / "before" / place.name)
    print("ready", flush=True)
    time.sleep(600)
"""
WRITE = "import sys; from gears3d.files import write_text; write_text(sys.argv[1], 'new')"


def python(code, *words):
    return subprocess.run([sys.executable, "-c", code, *map(str, words)], check=True)


@contextmanager
def holding(*words):
    """A process that has a temporary folder; killed at the end."""
    command = [sys.executable, "-c", HELD, *map(str, words)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        yield
        process.kill()


def test_what_a_killed_process_left_is_taken_away_by_the_next_one(tmp_path):
    with holding(tmp_path / "a"):
        (left,) = tmp_path.iterdir()
    assert (left / "new" / "half").exists()
    python(WRITE, tmp_path / "b")
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def test_what_a_live_process_holds_stays(tmp_path):
    with holding(tmp_path / "a"):
        python(WRITE, tmp_path / "b")
        assert len(list(tmp_path.iterdir())) == 2


def test_what_was_moved_aside_and_not_replaced_comes_back(tmp_path):
    write_text(tmp_path / "a", "before")
    with holding(tmp_path / "a", "exchange"):
        assert not (tmp_path / "a").exists()
    python(WRITE, tmp_path / "b")
    assert (tmp_path / "a").read_text() == "before"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]


def test_folders_that_only_look_like_ours_stay(tmp_path):
    (tmp_path / ".gears3d-of-a-user").mkdir()
    (tmp_path / ".gears3d-of-a-user" / "thesis.tex").write_text("years of work")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "lock").write_text("")
    (tmp_path / ".gears3d-link").symlink_to("elsewhere")
    before = sorted(tmp_path.rglob("*"))
    python(WRITE, tmp_path / "b")
    assert sorted(tmp_path.rglob("*")) == sorted([*before, tmp_path / "b"])


def test_an_interrupt_during_the_removal_leaves_nothing_for_the_next_process(tmp_path):
    code = """
import sys
from pathlib import Path
from gears3d.files import temporary

steps = int(sys.argv[2])

def interrupt(event, _):
    global steps
    if event in ("os.remove", "os.rmdir"):
        steps -= 1
        if steps < 0:
            raise KeyboardInterrupt

with temporary(sys.argv[1]) as new:
    (new / "deep").mkdir()
    (new / "deep" / "part.txt").write_text("part")
    sys.addaudithook(interrupt)
"""
    left = []
    for steps in range(6):
        subprocess.run([sys.executable, "-c", code, str(tmp_path), str(steps)], check=False, capture_output=True)
        left.append(len(list(tmp_path.iterdir())))
        python(WRITE, tmp_path / "b")
        assert [path.name for path in tmp_path.iterdir()] == ["b"]
        (tmp_path / "b").unlink()
    assert left == [1, 1, 1, 1, 1, 0]


def test_an_interrupt_between_the_two_moves_restores_what_was_there(tmp_path):
    write_text(tmp_path / "a", "before")
    code = """
import sys
from pathlib import Path
from gears3d.files import exchange, temporary

moves = []

def interrupt(event, arguments):
    if event == "os.rename":
        moves.append(arguments)
        if len(moves) == 2:
            raise KeyboardInterrupt

place = Path(sys.argv[1])
with temporary(place.parent) as folder:
    (folder / "a").write_text("new")
    sys.addaudithook(interrupt)
    exchange(folder / "a", place, folder)
"""
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "a")], check=False, capture_output=True)
    assert (tmp_path / "a").read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_many_processes_at_one_place_do_not_disturb_each_other(tmp_path):
    code = WRITE + "\nfor k in range(50): write_text(sys.argv[1] + str(k), 'new')"
    running = [subprocess.Popen([sys.executable, "-c", code, str(tmp_path / name)]) for name in "abcd"]
    assert [process.wait() for process in running] == [0] * 4
    assert len(list(tmp_path.iterdir())) == 4 * 51


def test_a_link_stays_one_and_its_target_is_replaced(tmp_path):
    (tmp_path / "link").symlink_to("target")
    write_text(tmp_path / "target", "before")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "new"


def test_a_device_gets_the_content_and_stays_one():
    code = "from gears3d.files import write_text; write_text('/dev/stdout', 'new'); write_text('/dev/null', 'lost')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "new"
    assert Path("/dev/null").is_char_device()


@pytest.mark.parametrize(
    ("name", "why"), [("a\0b", "null"), ("x" * 300, "too long"), ("loop/a", "Symlink loop|levels")]
)
def test_a_name_that_no_file_can_have_is_refused(tmp_path, name, why):
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(InputError, match=why):
        write_text(tmp_path / name, "content")
    assert [path.name for path in tmp_path.iterdir()] == ["loop"]


def test_the_processes_temporary_files_go_with_it(tmp_path):
    code = """
import os, signal, sys, tempfile, subprocess
from pathlib import Path
from gears3d.files import outside_environment, own_temporaries
own_temporaries()
import multiprocessing.util  # takes its folder away when the process ends
multiprocessing.util.get_temp_dir()
Path(tempfile.mkdtemp(), "of-a-library").write_text("x")
subprocess.run(["mktemp"], check=True, stdout=subprocess.DEVNULL)
assert outside_environment()["TMPDIR"] == sys.argv[1]
assert tempfile.gettempdir() != sys.argv[1]
if len(sys.argv) > 2:
    os.kill(os.getpid(), signal.SIGKILL)
"""
    asked = {"env": {**os.environ, "TMPDIR": str(tmp_path)}, "check": False, "stderr": subprocess.PIPE}
    command = [sys.executable, "-c", code, str(tmp_path)]
    done = subprocess.run(command, **asked)
    assert (done.returncode, done.stderr) == (0, b"")
    assert list(tmp_path.iterdir()) == []
    assert subprocess.run([*command, "killed"], **asked).returncode == -signal.SIGKILL
    assert list(tmp_path.iterdir()) != []
    assert subprocess.run(command, **asked).returncode == 0
    assert list(tmp_path.iterdir()) == []
