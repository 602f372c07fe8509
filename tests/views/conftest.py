"""A headless Chromium for the pages that open without a network, and a diagnosis that its views share."""

import shutil

import pytest

from gears3d.challenge import hide, plan
from gears3d.diagnosis import diagnose
from gears3d.diagnosis.candidates import candidates
from gears3d.gate import admit
from gears3d.readers import files_of
from gears3d.scenario import load

ARGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


@pytest.fixture(scope="module")
def chromium():
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("no Chromium: apt-get install chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        pytest.skip("no playwright: pip install 'gears3d[browser]'")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=[*ARGS, "--disable-sync"])
        yield browser
        browser.close()


LOOKED_FOR = ("backlash_offset", "drag_coulomb", "drag_viscous", "restitution_offset")


def few(*about):
    return [one for one in candidates(*about) if one.kind in LOOKED_FOR]


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
        patch.setattr("gears3d.diagnosis.search.candidates", few)
        return diagnose(admitted, load(hidden / "rig.toml"))
