"""Headless Chromiums, for pages that open without a network and for 3D, and a diagnosis that the views share."""

import shutil
from contextlib import contextmanager

import pytest

from gears3d.diagnosis import diagnose
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan
from tests.diagnosis import asked

ARGS = ["--headless", "--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-sync"]
IN_SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
"""What lets a page draw in WebGL where there is no graphics card."""


@contextmanager
def launched(*more):
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("no Chromium: apt-get install chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        pytest.skip("no playwright: pip install 'gears3d[browser]'")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=[*ARGS, *more])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def chromium():
    with launched("--disable-gpu") as browser:
        yield browser


@pytest.fixture(scope="module")
def chromium_3d():
    with launched(*IN_SOFTWARE) as browser:
        yield browser


LOOKED_FOR = ("backlash_offset", "drag_coulomb", "drag_viscous", "restitution_offset")


@pytest.fixture(scope="session")
def hidden(tmp_path_factory):
    """A folder with two records of a rig whose drag is hidden."""
    folder = tmp_path_factory.mktemp("diagnosed")
    hide(plan(1, ("drag_viscous",), size=0.3, records=2, duration=3.0), folder)
    return folder


@pytest.fixture(scope="session")
def admitted(hidden):
    rig = load(hidden / "rig.toml")
    return [admit(file, rig, chart) for file, chart in files_of([hidden / "record.toml"])]


@pytest.fixture(scope="session")
def found(hidden, admitted):
    """The diagnosis of these records."""
    with pytest.MonkeyPatch.context() as patch:  # a few candidates do for its views
        asked.only(patch, lambda one: one.kind in LOOKED_FOR)
        return diagnose(admitted, load(hidden / "rig.toml"))
