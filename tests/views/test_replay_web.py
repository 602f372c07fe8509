"""``gears3d replay RUN --web`` as a browser shows it: what is painted where, whom the page asks, and how it ends."""

import io
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import parse_qs, urlsplit
from urllib.request import Request, urlopen

import numpy as np
import psutil
import pytest
from PIL import Image

from gears3d.runs import RunFolder
from gears3d.scenario import load
from gears3d.views.replay import scene as colours
from gears3d.views.replay.scene import BACKGROUND
from tests.views.film import FREQUENCY, film

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 90.0
"""How long the page may take to load and to paint in software [s]."""
SIZE = {"width": 1280, "height": 720}
SCENE, SECTION, ZONE = np.s_[66:256, 2:404], np.s_[66:238, 450:690], np.s_[290:556, 2:700]
ABOUT, TOUCHING = np.s_[595:675, 2:700], np.s_[285:291, 970:1278]
CURVES = {"displacement": np.s_[66:202, 738:1278], "velocity": np.s_[322:425, 722:1278]}
CURVES |= {"speed": np.s_[473:549, 730:1278], "torque": np.s_[597:675, 736:1278]}
"""Where curves.layout puts the views in a window of this size: rows and columns of pixels."""
PAUSE, TIMELINE = (27, 706), (316, 1073, 706)
"""Where to press to pause, and where the line of time begins and ends."""
CURSOR, PIXELS_A_SECOND = 269, 815.0
"""The cursor's column in the field of displacements, and the scale of time there."""
AFTER = 0.05
"""When the pictures are taken after an impact, while its flank is touched [s]."""


@pytest.fixture(scope="module")
def recording():
    return film(load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml"))


@pytest.fixture(scope="module")
def run(recording, tmp_path_factory):
    with RunFolder(tmp_path_factory.mktemp("web") / "run") as folder:
        folder.write_scenario(load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml"), "made by a test")
        folder.write_recording(recording)
        folder.write_recording(recording, "twin")
        folder.write_summary({"status": "complete"})
        return folder.commit()


@contextmanager
def served(run, folder):
    """The verb in a process of its own with a browser that only writes down what it is to open; gives what it says."""
    browser, opened, said = folder / "browser", folder / "opened", folder / "said"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {opened}\n')
    browser.chmod(0o755)
    (folder / "home").mkdir(exist_ok=True)
    own = {"PYTHONPATH": str(ROOT), "BROWSER": str(browser), "HOME": str(folder / "home")}
    environment = {name: value for name, value in os.environ.items() if name != "CI"} | own
    command = [sys.executable, "-m", "gears3d", "replay", str(run), "--web"]
    with said.open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, env=environment)
    try:
        until(lambda: (opened.exists() and opened.read_text()) or process.poll() is not None)
        found = re.findall(r"http://\S+", said.read_text())
        assert len(found) == 1, said.read_text()
        assert opened.read_text() == found[0]
        yield process, found[0]
    finally:
        process.terminate()
        process.wait(20.0)


def until(happens):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if outcome := happens():
            return outcome
        time.sleep(0.05)
    return pytest.fail(f"not within {PATIENCE:g} s: {happens}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("served")


@pytest.fixture(scope="module")
def home(folder):
    return folder / "home"


@pytest.fixture(scope="module")
def address(run, folder):
    with served(run, folder) as (_, address):
        yield address


@contextmanager
def opened(browser, address):
    """A page that has the replay, and the hosts that it asked."""
    page = browser.new_page(viewport=SIZE)
    page.hosts = set()
    page.add_init_script("console.debug = () => {}")  # the viewer tells of every shader, which takes most of the time
    page.route("**", lambda route: (page.hosts.add(urlsplit(route.request.url).hostname), route.continue_()))
    page.goto(address)
    yield page
    page.close()


def shown(page, wanted, *, settled=False):
    """The first picture that is as wanted, and if settled the same as the one before."""
    from playwright.sync_api import Error

    taken = []

    def matching():
        try:
            taken.append(page.screenshot(timeout=1e3 * PATIENCE))
        except Error as error:
            if "Unable to capture" in str(error):  # while the page starts to draw
                return False
            raise
        return wanted(pixels(taken[-1])) and (not settled or taken[-2:-1] == taken[-1:])

    until(matching)
    return pixels(taken[-1])


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def share(picture, colour, tolerance=24):
    return np.mean(np.abs(picture - np.array(colour)).max(axis=-1) <= tolerance)


def flanks(picture, tolerance=24):
    return [share(picture, colour, tolerance) for colour in colours.FLANKS]


def gears(picture):
    """The lesser share of a gear in its half of the scene."""
    left, right = np.split(picture[SCENE], [190], axis=1)
    return min(share(left, colours.DRIVE, 40), share(right[:, 20:], colours.LOOSE, 40))


def curves(picture):
    return {name: share(picture[place], colours.LINE, 30) for name, place in CURVES.items()}


def loaded(picture):
    return gears(picture) > 0.2 and min(curves(picture).values()) > 1e-3


def at(page, recording, instant, code):
    """The picture while a flank is touched; the cursor is put there as a person does it."""
    begin, end, height = TIMELINE
    page.mouse.click(begin + (end - begin) * instant / recording.time[-1], height)
    return shown(page, lambda picture: flanks(picture[SCENE])[code] > 1e-4, settled=True)


@pytest.fixture(scope="module")
def pictures(chromium_3d, address, recording):
    hit = recording.impacts["time_s"]
    with opened(chromium_3d, address) as page:
        shown(page, loaded)
        page.mouse.click(*PAUSE)
        names = {"reverse": (hit[0] + AFTER, 1), "active": (hit[1] + AFTER, 0)}
        return {name: at(page, recording, *place) for name, place in names.items()} | {"hosts": page.hosts}


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("name", ["active", "reverse"])
def test_gears_and_zone_are_seen_where_they_belong(pictures, name):
    picture = pictures[name]
    left, right = np.split(picture[SCENE], [190], axis=1)
    assert share(left, colours.DRIVE, 40) > 0.4
    assert share(right[:, 20:], colours.LOOSE, 40) > 0.4
    assert share(left, colours.LOOSE) < 0.01
    assert share(right[:, 20:], colours.DRIVE) < 0.01
    zone = picture[ZONE]
    assert share(zone[:, 150:300], colours.DRIVE, 40) > 0.95
    assert share(zone[:, -300:-150], colours.LOOSE, 40) > 0.95
    assert min(flanks(zone[:, 300:400])) > 0.02
    assert max(flanks(np.delete(zone, np.s_[300:400], axis=1))) == 0.0
    assert share(picture[ABOUT], (0xE0, 0xE0, 0xE0), 40) > 0.03


@pytest.mark.slow
@pytest.mark.browser
def test_marks_have_the_colour_of_the_flank_that_is_touched(pictures):
    for code, name in enumerate(("active", "reverse")):
        scene, section = (flanks(pictures[name][place]) for place in (SCENE, SECTION))
        assert scene[code] > 2e-4
        assert scene[1 - code] == 0.0
        assert section[code] > 1e-4  # the impact before is a point of the section
    assert flanks(pictures["reverse"][SECTION])[0] == 0.0  # the active flank was not hit yet


@pytest.mark.slow
@pytest.mark.browser
def test_curves_are_seen_at_their_time(pictures, recording):
    for name, hit in zip(("reverse", "active"), recording.impacts["time_s"][:2], strict=True):
        picture = pictures[name]
        assert min(curves(picture).values()) > 5e-3
        assert min(flanks(picture[CURVES["displacement"]])) > 2e-3
        assert min(flanks(picture[CURVES["velocity"]])) > 3e-4
        assert min(flanks(picture[TOUCHING], 50)) > 0.1
        field = picture[CURVES["displacement"]]
        place = CURSOR + round(((0.5 / FREQUENCY) - (hit + AFTER)) * PIXELS_A_SECOND)  # halfway from flank to flank
        rows = np.nonzero(np.abs(field[:, place - 2 : place + 3] - np.array(colours.LINE)).max(axis=-1) <= 30)[0]
        assert len(rows) > 5
        assert rows.mean() / len(field) == pytest.approx(0.5, abs=0.12)
        assert np.ptp(rows) < 0.3 * len(field)
    before = pictures["reverse"][CURVES["displacement"]][:, :120]  # nothing was recorded before the beginning
    assert share(before, BACKGROUND, 16) > 0.98


@pytest.mark.slow
@pytest.mark.browser
def test_only_this_machine_is_needed(pictures):
    assert {host for host in pictures["hosts"] if host} == {"127.0.0.1"}


@pytest.mark.slow
@pytest.mark.browser
def test_white_curves_are_seen_in_a_light_viewer(chromium_3d, address):
    assert "theme=dark" in address
    with opened(chromium_3d, address.replace("theme=dark", "theme=light")) as page:
        picture = shown(page, loaded)
    assert share(picture[:30], (255, 255, 255), 8) > 0.5  # the bar at the top
    for name, place in CURVES.items():
        assert share(picture[place], BACKGROUND) > 0.8, name


@pytest.mark.slow
def test_the_file_is_for_this_page_only(address, run):
    page = urlsplit(address)
    file = parse_qs(page.query)["url"][0]
    with urlopen(file) as answer:
        assert "Access-Control-Allow-Origin" not in answer.headers  # the page is of the same origin
        assert answer.read() == (run / "replay.rrd").read_bytes()
    with pytest.raises(HTTPError, match="404") as refused:
        urlopen(file.replace("replay.rrd", "summary.json"))
    refused.value.close()
    assert {page.netloc, urlsplit(file).netloc} == {page.netloc}
    assert page.hostname == "127.0.0.1"
    with pytest.raises(HTTPError, match="403") as refused:  # a page of a name that somebody lets lead here
        urlopen(Request(file, headers={"Host": "elsewhere.example"}))
    refused.value.close()


def test_rerun_collects_no_data_about_its_use(address, home):
    with urlopen(address) as answer:
        assert "connect-src" not in answer.headers["Content-Security-Policy"]
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'self' ")
    assert not [path for path in home.rglob("*") if "analytics" in path.name]


def alive(process):
    return process.is_running() and process.status() != psutil.STATUS_ZOMBIE


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_answers_once_it_is_ended(run, tmp_path, number):
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("started in the background, where this signal is ignored")
    with served(run, tmp_path) as (process, address):
        urlopen(address).close()
        viewers = psutil.Process(process.pid).children(recursive=True)
        assert any("--serve-web" in one.cmdline() for one in viewers)
        process.send_signal(number)
        assert process.wait(20.0) == {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}[number]
        with pytest.raises(OSError, match="refused"):
            urlopen(address)
        until(lambda: not any(alive(one) for one in viewers))
