"""The documentation is true: its commands exist, its links lead somewhere, its pictures are described, it builds."""

import importlib.util
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from gears3d import cli
from gears3d.effects import catalogue

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
STARTERS = sorted((ROOT / "gears3d" / "scenario" / "starters").glob("*.toml"))
SCENARIOS = sorted((ROOT / "scenarios").rglob("*.toml"))
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def typed():
    """Every command line that a page, a starter or a scenario tells somebody to type."""
    for page in PAGES:
        for block in re.findall(r"^```sh\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL):
            yield from ((page, line) for line in block.replace("\\\n", " ").splitlines() if "gears3d " in line)
    for file in (*STARTERS, *SCENARIOS):
        found = re.findall(r"^#   (gears3d .*)$", file.read_text(), re.MULTILINE)
        yield from ((file, line.split("   ")[0]) for line in found)


TYPED = [(page.name, line) for page, line in typed()]


@pytest.mark.parametrize(("page", "line"), TYPED, ids=lambda text: text[:60])
def test_a_command_in_the_documentation_is_one(page, line):
    words = shlex.split(line, comments=True)
    words = words[next(k for k, word in enumerate(words) if word.endswith("gears3d")) + 1 :]
    command, words = get_command(cli.app), ["gears3d", *words]
    while hasattr(command, "list_commands") and not words[1].startswith("-"):
        words, inner = words[1:], command.make_context(words[0], ["--help"], resilient_parsing=True)
        assert words[0] in command.list_commands(inner)
        command = command.get_command(inner, words[0])
    known = {name for one in command.params for name in (*one.opts, *one.secondary_opts)}
    assert [word for word in words[1:] if word.startswith("--") and word.split("=")[0] not in known] == []


def test_there_are_commands_enough():
    assert len(TYPED) > 60


def anchors(page):
    text = FENCED.sub("", page.read_text())
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", [page for page in PAGES if "site" not in page.parts], ids=lambda page: page.name)
def test_links_lead_somewhere_and_pictures_are_described(page):
    for picture, words, target in LINK.findall(FENCED.sub("", page.read_text())):
        assert not picture or len(words) > 20, f"{target} has no description"
        if "://" in target:
            continue
        file, _, anchor = target.partition("#")
        place = (page.parent / file).resolve() if file else page
        assert place.exists(), target
        assert not anchor or anchor in anchors(place), target


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "site").glob("*.md")), ids=lambda page: page.name)
def test_pages_of_the_site_describe_their_pictures(page):
    pictures = [one for one in LINK.findall(page.read_text()) if one[0]]
    assert pictures
    assert all(len(words) > 20 for _, words, _ in pictures)


def test_the_site_has_every_page():
    index = (ROOT / "docs" / "site" / "index.md").read_text()
    missing = [page.stem for page in (ROOT / "docs").glob("*.md") if f"docs/{page.stem}\n" not in index]
    assert missing == []


@pytest.fixture(scope="module")
def reference():
    spec = importlib.util.spec_from_file_location("docs_reference", ROOT / "tools" / "docs_reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_has_every_verb_every_effect_every_table(reference):
    verbs, kinds, keys = reference.commands(), reference.effects(), reference.scenario()
    assert [verb for verb in cli.VERBS if f"\n## gears3d {verb}\n" not in verbs] == []
    assert [kind for kind in catalogue() if f"\n### {kind}\n" not in kinds] == []
    assert "### gears3d identify restitution" in verbs
    for place, key in (
        ("gears.drive.eccentricity", "offset"),
        ("motion.harmonics[]", "amplitude"),
        ("expect", "regime"),
    ):
        table = keys.split(f"\n## {place}\n")[1].split("\n## ")[0]
        assert f"| `{key}` |" in table


def test_no_markup_of_docstrings_shows_in_the_reference(reference):
    for made in (reference.commands(), reference.scenario(), reference.effects()):
        assert not re.search(r":(meth|func|class|data|mod):", made)


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_nb")
    command = [sys.executable, "tools/docs.py", "--no-run", "--out", str(tmp_path / "html")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stderr
    assert "camera" in (tmp_path / "html" / "reference" / "commands.html").read_text()
