"""The documentation is true: its commands exist, its links lead somewhere, its pictures are described, it builds."""

import html
import importlib
import importlib.util
import inspect
import json
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.main import get_command

import gears3d
from gears3d import cli, load
from gears3d.diagnosis import CHANNELS
from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.identify import read_campaign
from gears3d.scenario.document import names
from gears3d.verification.papers import papers
from gears3d.views.pages.diagnosed import RINGS, STRUCTURES
from gears3d.views.pages.engine import TERMS

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY", "CHANGELOG")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))
STARTERS = sorted((ROOT / "gears3d" / "scenario" / "starters").glob("*.toml"))
SCENARIOS = [ROOT / "scenarios" / f"{name}.toml" for name in names()]
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
TOOLS = ("reference", "effects", "laws", "layers", "python")
"""Those that make pages: tools/docs_reference.py and so on."""
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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere_and_pictures_are_described(page):
    for picture, words, target in LINK.findall(re.sub(r"<!--.*?-->", "", FENCED.sub("", page.read_text()))):
        assert not picture or len(words) > 20, f"{target} has no description"
        if own := re.fullmatch(r"https://github.com/gears3d/gears3d/(?:tree|blob)/main/(.*)", target):
            assert (ROOT / own[1]).exists(), target
        if "://" in target:
            continue
        file, _, anchor = target.partition("#")
        place = (page.parent / file).resolve() if file else page
        assert place.exists(), target
        assert not anchor or anchor in anchors(place), target


def test_the_documentation_is_short():
    """Words are what has a letter or a digit, outside code blocks; those of the readme count with code."""
    pages = [page for page in PAGES if page.is_relative_to(ROOT / "docs") or page.name == "README.md"]
    words = [word for page in pages for word in FENCED.sub("", page.read_text(encoding="utf-8")).split()]
    assert 10_000 < sum(bool(re.search(r"[^\W_]", word)) for word in words) <= 25_000
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 600


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "site").glob("*.md")), ids=lambda page: page.name)
def test_pages_of_the_site_describe_their_pictures(page):
    pictures = [one for one in LINK.findall(page.read_text()) if one[0]]
    assert pictures
    assert all(len(words) > 20 for _, words, _ in pictures)


def test_pages_that_code_and_reports_name_exist():
    named = [
        (file, found)
        for file in (ROOT / "gears3d").rglob("*.py")
        for found in re.findall(r"\bdocs/[\w/-]+\.md", file.read_text(encoding="utf-8"))
    ]
    assert len(named) > 5
    assert [(file.name, found) for file, found in named if not (ROOT / found).exists()] == []
    cited = [
        (file.name, page, number)
        for file in (ROOT / "gears3d").rglob("*.py")
        for page, found in re.findall(r"docs/(theory/\w+\.md), equations? ([^.]*)\.", file.read_text(encoding="utf-8"))
        for number in re.findall(r"\((\d+)\)", found)
    ]
    assert len(cited) > 25
    for name, page, number in cited:
        assert f"\\tag{{{number}}}" in (ROOT / "docs" / page).read_text(encoding="utf-8"), (name, page, number)
    for term, (_, target) in TERMS.items():
        page, _, anchor = target.partition("#")
        assert (ROOT / "docs" / page).exists(), term
        assert not anchor or anchor in anchors(ROOT / "docs" / page), term


def test_the_site_has_every_page():
    index = (ROOT / "docs" / "site" / "index.md").read_text()
    pages = [page.relative_to(ROOT).with_suffix("") for page in PAGES if page.is_relative_to(ROOT / "docs")]
    missing = [page for page in pages if page.parts[1] != "site" and f"{page.as_posix()}\n" not in index]
    assert missing == []


@pytest.fixture(scope="module")
def reference():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        return SimpleNamespace(**{name: importlib.import_module(f"docs_{name}") for name in TOOLS})


def test_the_reference_has_every_verb_every_effect_every_table(reference):
    verbs, kinds, keys = reference.reference.commands(), reference.effects.effects(), reference.reference.scenario()
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


def test_the_reference_has_every_public_name_and_every_key_of_a_map(reference):
    pages = reference.python.python()
    for package in reference.python.PACKAGES:
        page = pages[reference.python.page_of(package)]
        assert [name for name, _ in reference.python.names(package) if name not in page] == [], package
    names = [name for name, _ in reference.python.names("gears3d")]
    assert set(gears3d.__all__) - set(names) <= {"__version__", "gears", "segment", "measure"}
    assert "\n## diagnose\n" in pages["python-gears3d"]
    made = reference.reference.record_map()
    for key in ("counts_per_revolution", "sample_rate", "hysteresis", "from"):
        assert f"| `{key}` | " in made


def test_no_markup_of_docstrings_shows_in_the_reference(reference):
    for made in (reference.reference.commands(), reference.reference.scenario(), reference.effects.effects()):
        assert not re.search(r":(meth|func|class|data|mod):", made)


def test_every_law_has_a_source_and_a_curve_that_is_told_in_numbers(reference):
    laws = reference.laws
    known = {f"{name}.{law.__name__}": law for name, module in laws.modules() for law in laws.functions(module)}
    assert len(known) > 60
    assert set(laws.PLOTS) == set(known)
    for name, law in known.items():
        assert reference.reference.source(inspect.getdoc(law)), name
        lines = laws.PLOTS[name]().lines
        assert lines, name
        for x, y in lines.values():
            x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
            told = np.isfinite(y)
            assert told.mean() > 0.9, name
            assert np.ptp(x[told]) > 0, name
        spread = max(np.ptp(np.asarray(y)[np.isfinite(y)]) for _, y in lines.values())
        assert spread > 0 or name == "orbit.plastic", name


def test_every_effect_has_a_source_an_example_and_a_picture(reference):
    tool, page = reference.effects, reference.effects.effects()
    assert set(tool.EXAMPLES) == set(catalogue())
    base = load(tool.BASE, tool.MILD)
    for kind, effect in catalogue().items():
        assert reference.reference.source(inspect.getdoc(effect)), kind
        assert [one.kind for one in base.with_({"effect": tomllib.loads(tool.toml(kind))["effect"]}).effects] == [kind]
        part = page.split(f"\n### {kind}\n")[1].split("\n### ")[0]
        assert tool.toml(kind) in part
        assert f"]({tool.picture(kind)})" in part


def test_the_picture_of_the_layers_is_that_of_the_contract(reference):
    found = [
        html.unescape(words) for words in re.findall(r"<text[^>]*>([^<]*)</text>", reference.layers.PICTURE.read_text())
    ]
    packages = [package for layer in reference.layers.layers() for package in layer]
    assert [words for words in found if words in packages] == packages
    said = " ".join(found)
    shown = re.sub(r"\W", "", said)
    assert [package for package in packages if re.sub(r"\W", "", reference.layers.purpose(package)) not in shown] == []


def test_the_architecture_names_what_there_is():
    text = FENCED.sub("", (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8"))
    packages = {path.stem for path in (ROOT / "gears3d").iterdir()}
    named = sorted({name for name in re.findall(r"`([a-z_]\w*(?:\.\w+)+)`", text) if name.split(".")[0] in packages})
    assert len(named) > 40
    for name in named:
        home, _, last = f"gears3d.{name}".rpartition(".")
        found = importlib.import_module(home)
        assert hasattr(found, last) or importlib.util.find_spec(f"{home}.{last}"), name
    steps = re.findall(r"^\d+\. (.*)$", text, re.MULTILINE)
    assert len(steps) == 9
    for name in re.findall(r"`(\w+)`", " ".join(steps)):
        assert importlib.util.find_spec(f"gears3d.diagnosis.{name}"), name


def test_the_page_of_result_files_names_what_a_run_writes():
    text = (ROOT / "docs" / "reference" / "results.md").read_text(encoding="utf-8")
    words = set(re.findall(r"`([\w.]+)`", text))
    endings = tuple(word[3:] for word in words if word.startswith("..."))
    run = gears3d.simulate(load("rigaud-2020/fig5-20rpm", {"run.duration": "2 s"}), model="rigid")
    names = [*run.signals, *run.impacts, *gears3d.describe(run)]
    assert len(names) > 50
    plain = [name.replace("reverse_", "active_") for name in names if name != "reverse_share"]
    assert [name for name in plain if name not in words and not name.endswith(endings)] == []


def test_the_examples_of_the_contracts_are_valid(tmp_path):
    text = (ROOT / "docs" / "contracts.md").read_text(encoding="utf-8")
    scenario, campaign = re.findall(r"^```toml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert load(scenario).effects[0].kind == "transmission_error"
    file = tmp_path / "campaign.toml"
    file.write_text(campaign, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_campaign(file)
    assert all("is not there" in fault.message for fault in refused.value.faults)  # its records


def test_the_page_of_evidence_counts_the_published_rows():
    text = (ROOT / "docs" / "evidence" / "index.md").read_text(encoding="utf-8")
    verdicts = [[claim.recorded for claim in paper.claims] for paper in papers()]
    for each in verdicts:
        agree = each.count("agrees")
        assert re.search(rf"^\| [^|]+ \| {len(each)} \| {agree} \| {len(each) - agree}: ", text, re.MULTILINE)
    every = [verdict for each in verdicts for verdict in each]
    agree = every.count("agrees")
    assert f"{agree} of {len(every)} published values and trends agree, {len(every) - agree} disagree" in text


def test_the_page_of_errors_has_every_note_of_a_diagnosis():
    text = (ROOT / "docs" / "reference" / "errors.md").read_text(encoding="utf-8")
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "gears3d" / "diagnosis").glob("*.py"))
    kinds = set(re.findall(r"\bNote\(\s*\"([a-z-]+)\"", sources))
    assert len(kinds) > 15
    assert [kind for kind in sorted(kinds) if f"`{kind}`" not in text] == []


def test_the_page_of_errors_explains_every_residual_pattern_in_the_words_of_the_report():
    text = (ROOT / "docs" / "reference" / "errors.md").read_text(encoding="utf-8")
    text = text[text.index("## Residual patterns") :]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("| `")
    ]
    assert [row for row in rows if len(row) != 4 or not all(row)] == []
    words = {row[0].strip("`"): row[1] for row in rows if "," not in row[0]}
    assert words == STRUCTURES
    assert RINGS in [row[1] for row in rows]
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "gears3d" / "diagnosis").glob("*.py"))
    names = set(re.findall(r"\"((?:sensor|flight|impact|contact|loss|drive|path)\.[a-z_{}]+)\"", sources))
    names = names - {"impact.restitution"} | {f"{channel}.all" for channel in CHANNELS}  # a key of scenarios
    made = {name.replace("{gear}", gear).replace("{peak.gear}", gear) for name in names for gear in ("drive", "loose")}
    made |= {f"contact.tooth_{gear}" for gear in ("drive", "loose")}
    assert made == set(STRUCTURES)


def test_thumbnails_lead_to_the_sections_of_the_gallery(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    page = tmp_path / "gallery.md"
    docs = importlib.import_module("docs")
    text = docs.shown((ROOT / "docs" / "site" / "gallery.md").read_text(encoding="utf-8"))
    assert "<!--" not in text
    page.write_text(text, encoding="utf-8")
    docs.thumbnails(page)
    head, *sections = page.read_text(encoding="utf-8").split("\n## ")
    targets = re.findall(r"\[!\[[^]]{20,}\]\(made/\w+\.png\)\{width=180px\}\]\(#([\w-]+)\)", head)
    assert targets == re.findall(r"\[[\w ]+\]\(#([\w-]+)\)", head)
    assert len(targets) == len(sections) > 5
    assert set(targets) <= anchors(page)
    assert page.read_text(encoding="utf-8").count("](made/") > len(sections)


def git(*words, folder=ROOT):
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_versions_are_published_next_to_each_other(tmp_path, monkeypatch):
    for name in ("GIT_AUTHOR", "GIT_COMMITTER"):
        monkeypatch.setenv(f"{name}_NAME", "test")
        monkeypatch.setenv(f"{name}_EMAIL", "test@example.org")
    origin, clone = tmp_path / "origin", tmp_path / "clone"
    git("init", "--quiet", "--bare", str(origin))
    git("clone", "--quiet", str(origin), str(clone))
    (clone / "tools").mkdir()
    for tool in ("docs_versions.py", "docs_publish"):
        shutil.copy(ROOT / "tools" / tool, clone / "tools")
    git("add", ".", folder=clone)
    git("commit", "--quiet", "--message", "Begin", folder=clone)
    html = clone / "build" / "docs" / "html"
    html.mkdir(parents=True)
    for version in ("v0.9.0", "latest", "v0.10.0", "latest"):
        (html / "index.html").write_text(f"as of {version}")
        (html / "llms.txt").write_text("- [Install](docs/start/install.html)\n")
        subprocess.run(["tools/docs_publish", version], cwd=clone, check=True, capture_output=True)
    files = git("ls-tree", "-r", "--name-only", "site", folder=origin)
    assert "latest/index.html" in files
    assert not [file for file in files if file.startswith("tools/")]
    assert len(git("rev-list", "site", folder=origin)) == 1
    site = clone / "build" / "site"
    assert json.loads((site / "versions.json").read_text()) == ["v0.10.0", "v0.9.0", "latest"]
    assert (site / "v0.9.0" / "index.html").read_text() == "as of v0.9.0"
    assert "url=v0.10.0/index.html" in (site / "index.html").read_text()
    assert "(v0.10.0/docs/start/install.html)" in (site / "llms.txt").read_text()
    refused = subprocess.run(["tools/docs_publish", "main"], cwd=clone, check=False, capture_output=True, text=True)
    assert "expected latest or vX.Y.Z" in refused.stderr


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_nb")
    pytest.importorskip("sphinx-mathjax-offline")
    command = [sys.executable, "tools/docs.py", "--no-run", "--out", str(tmp_path / "html")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stderr
    scripts = re.findall(r'<script[^>]* src="([^"]*)"', (tmp_path / "html/docs/theory/rattle.html").read_text())
    assert any("mathjax/tex-chtml.js" in script for script in scripts)
    assert [one for one in scripts if not (tmp_path / "html/docs/theory" / one.partition("?")[0]).exists()] == []
    listed = (tmp_path / "html" / "llms.txt").read_text(encoding="utf-8")
    pages = re.findall(r"^- \[[^]]+\]\(([^)]+)\)", listed, re.MULTILINE)
    assert len(pages) > 25
    assert [page for page in pages if not (tmp_path / "html" / page).exists()] == []
    for page in ("index.html", "docs/start/install.html"):
        text = (tmp_path / "html" / page).read_text(encoding="utf-8")
        assert gears3d.__version__ in text
        assert 'aria-label="Version of the documentation"' in text
    reference = tmp_path / "html" / "reference"
    assert "camera" in (reference / "commands.html").read_text()
    for page, count in (("laws", 60), ("effects", 20)):
        pictures = re.findall(r'<img[^>]*alt="([^"]{20,})"[^>]*src="([^"]*)"', (reference / f"{page}.html").read_text())
        assert len(pictures) > count
        assert [place for _, place in pictures if (reference / place).stat().st_size < 5000] == []
