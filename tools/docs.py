"""Builds the documentation site; called by tools/docs."""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from docs_blocks import FENCE, Block, command, missing
from docs_effects import draw_effects, effects
from docs_evidence import evidence
from docs_laws import laws
from docs_python import python
from docs_reference import commands, record_map, scenario

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "build" / "docs" / "source"
HTML = ROOT / "build" / "docs" / "html"
RUN = {
    "docs/start/install.md": ("sh",),
    "docs/start/first-rattle.md": ("sh", "python"),
    "docs/start/first-diagnosis.md": ("sh",),
    "docs/howto/own-gear-pair.md": ("sh", "python"),
    "docs/howto/own-records.md": ("sh", "python"),
    "docs/howto/sensor-faults.md": ("sh", "python"),
    "docs/howto/coast-down.md": ("sh",),
    "docs/howto/lumped-model.md": ("sh", "python"),
    "docs/howto/blind-test.md": ("sh",),
    "docs/howto/share-a-result.md": ("sh", "python"),
    "docs/howto/sweep-on-a-cluster.md": ("sh",),
    "docs/howto/export.md": ("sh", "python"),
    "docs/howto/write-an-effect.md": ("sh", "python"),
    "docs/howto/write-a-reader.md": ("sh", "python"),
    "docs/howto/without-pybullet.md": ("sh",),
    "docs/theory/rattle.md": ("sh",),
    "gallery.md": ("sh",),
}
"""Pages whose blocks are run, in order, in a folder of their own."""
NOTEBOOK = "docs/notebook.ipynb"
"""The notebook, run in a folder of its own, too."""
PICTURE = re.compile(r"!\[[^]]*\]\(made/[^)]*\)")
"""A picture that a block makes."""
HIDDEN = re.compile(rf"<!-- ({PICTURE.pattern}) -->")
LINES = 40
"""Of what a block prints, shown below it."""
COLUMNS = 3
"""Of the table of thumbnails."""


def main() -> int:
    """Copy the pages, make the reference, run the blocks, build."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument(
        "--no-run",
        action="store_true",
        help="do not run blocks, checks and published rows; leaves their pictures and tables out",
    )
    options.add_argument("--external", action="store_true", help="follow links to other sites, too")
    options.add_argument("--out", type=Path, default=HTML, help="folder of the site")
    chosen = options.parse_args()
    gather(run=not chosen.no_run)
    if chosen.no_run:
        for page in RUN:
            text = PICTURE.sub(
                "*A picture is made when the site is built without `--no-run`.*", (SOURCE / page).read_text()
            )
            (SOURCE / page).write_text(text)
    else:
        for page, languages in RUN.items():
            execute(SOURCE / page, languages)
        thumbnails(SOURCE / "gallery.md")
        notebook(SOURCE / NOTEBOOK)
    code = build("html", chosen.out)
    if code == 0:
        (chosen.out / "llms.txt").write_text(overview(), encoding="utf-8")
    if code == 0 and chosen.external:
        code = build("linkcheck", ROOT / "build" / "docs" / "links")
    if code == 0:
        print(f"documentation: {chosen.out / 'index.html'}")
    return code


def gather(run: bool) -> None:
    """Copy what is written and write what comes from the code.

    Args:
        run: evaluate published rows and checks, too.
    """
    shutil.rmtree(SOURCE, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        (SOURCE / name).write_text(text.replace("](docs/site/", "]("), encoding="utf-8")
    shutil.copytree(ROOT / "docs", SOURCE / "docs", ignore=shutil.ignore_patterns("site"))
    shutil.copy(ROOT / "docs" / "site" / "conf.py", SOURCE)
    shutil.copytree(ROOT / "docs" / "site" / "theme", SOURCE / "theme")
    for file in (ROOT / "docs" / "site").glob("*.md"):
        text = shown(file.read_text(encoding="utf-8")).replace("](../", "](docs/")  # those pages go to the top
        (SOURCE / file.name).write_text(text, encoding="utf-8")
    reference = SOURCE / "reference"
    reference.mkdir()
    print("reference: commands, scenario keys, record map, laws, effects, Python", flush=True)
    pages = {
        "commands": commands(),
        "scenario": scenario(),
        "record-map": record_map(),
        "laws": laws(reference),
        "effects": effects(),
        **python(),
    }
    for name, made in pages.items():
        (reference / f"{name}.md").write_text(made, encoding="utf-8")
    draw_effects(reference)
    evidence(SOURCE / "evidence", run)


def shown(text: str) -> str:
    """Return a page with the pictures that its blocks make: comments elsewhere, where nothing makes them."""
    return HIDDEN.sub(r"\1", text)


def overview() -> str:
    """Return the list of all pages for programs that read the site: ``llms.txt``, one line a page.

    Its form is that of https://llmstxt.org: a title, a summary, and sections of links.
    """
    index = (SOURCE / "index.md").read_text(encoding="utf-8")
    head = re.search(r"^# (.*)\n+(.+)$", index, re.MULTILINE)
    assert head, "index.md has no title with a sentence below"
    lines = [f"# {head[1]}", "", f"> {head[2]}", ""]
    for tree in re.findall(r"^```\{toctree\}\n(.*?)^```$", index, re.MULTILINE | re.DOTALL):
        options, _, listed = tree.partition("\n\n")
        lines += [f"## {options.split(':caption: ')[1].splitlines()[0]}", ""]
        for entry in listed.split("\n"):
            name = (re.search(r"<(.+)>", entry) or re.search(r"(.*)", entry))[1].strip()
            if name:
                title, sentence = headline(SOURCE / name)
                lines.append(f"- [{title}]({name}.html): {sentence}" if sentence else f"- [{title}]({name}.html)")
        lines.append("")
    return "\n".join(lines)


def headline(page: Path) -> tuple[str, str]:
    """Return title and first sentence of a page, given without its ending."""
    if not page.with_suffix(".md").exists():
        cells = json.loads(page.with_suffix(".ipynb").read_text(encoding="utf-8"))["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    else:
        text = page.with_suffix(".md").read_text(encoding="utf-8")
    head = re.search(r"^# (.*)$", text, re.MULTILINE)
    assert head, page
    paragraphs = re.split(r"\n\s*\n|\n(?=[#`|])", re.sub(r"^```.*?^```$", "", text[head.end() :], flags=re.M | re.S))
    first = next((one for one in map(str.strip, paragraphs) if re.match(r"[\w*`\[]", one)), "")
    plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(first.replace("*", "").split()))
    sentence = re.match(r".*?\.(?=\s|$)", plain)
    return head[1].replace("`", ""), (sentence[0] if sentence else plain)


def notebook(page: Path) -> None:
    """Run a notebook in an empty folder, and put what comes out into it.

    Raises:
        SystemExit: a cell failed.
    """
    import nbformat
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError

    print(f"{page.name}: all cells", flush=True)
    cells = nbformat.read(page, as_version=4)
    with empty() as here:
        os.environ |= own()
        try:
            NotebookClient(cells, timeout=300, resources={"metadata": {"path": str(here)}}).execute()
        except CellExecutionError as error:
            print(f"FAIL  {page.name}: {error}")
            raise SystemExit(1) from None
    nbformat.write(cells, page)


def thumbnails(page: Path) -> None:
    """Put a table of small pictures, each a link to its section, below the first paragraph of a page."""
    text = page.read_text(encoding="utf-8")
    head, *sections = re.split(r"^## ", text, flags=re.MULTILINE)
    cells = []
    for section in sections:
        title, picture = section.splitlines()[0], re.search(r"!\[([^]]*)\]\((made/[^)]*)\)", section)
        if picture:
            anchor = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
            cells.append((f"[{title}](#{anchor})", f"[![{picture[1]}]({picture[2]}){{width=180px}}](#{anchor})"))
    rows = [cells[k : k + COLUMNS] for k in range(0, len(cells), COLUMNS)]
    table = [[one for _, one in row] + [""] * (COLUMNS - len(row)) for row in rows]
    names = [[one for one, _ in row] + [""] * (COLUMNS - len(row)) for row in rows]
    lines = [" | ".join(line) for pair in zip(names, table, strict=True) for line in pair]
    lines.insert(1, "|".join(["---"] * COLUMNS))
    grid = "\n".join(f"| {line} |" for line in lines)
    page.write_text("## ".join([f"{head}{grid}\n\n", *sections]), encoding="utf-8")


@contextmanager
def empty() -> Iterator[Path]:
    """Give an empty folder to work in."""
    with tempfile.TemporaryDirectory() as scratch:
        yield Path(scratch)


def own() -> dict[str, str]:
    """Return what blocks find in their environment: this checkout and its commands, no colours."""
    found = {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "COLUMNS": "110", "NO_COLOR": "1"}
    return found | {"PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"}


def execute(page: Path, languages: tuple[str, ...]) -> None:
    """Run a page's blocks in order in an empty folder, and show below each what it printed.

    Raises:
        SystemExit: a block failed.
    """
    with empty() as here:
        (here / "made").mkdir()

        def run(found: re.Match[str]) -> str:
            block = Block(found[1], found[2], found[3] or "")
            if block.language not in languages:
                return found.group()
            printed = ran(page.name, block, here)
            if block.shown or not printed:
                return found.group()
            return f"{found.group()}\n\n```text\n{shortened(printed)}\n```"

        page.write_text(FENCE.sub(run, page.read_text(encoding="utf-8")), encoding="utf-8")
        if any((here / "made").iterdir()):
            shutil.copytree(here / "made", page.parent / "made", dirs_exist_ok=True)


def ran(page: str, block: Block, here: Path) -> str:
    """Run one block and return what it printed.

    Raises:
        SystemExit: it failed, or did not print what the page shows.
    """
    print(f"{page}: {block.code.strip().splitlines()[0]}", flush=True)
    words = command(block, sys.executable)
    done = subprocess.run(words, cwd=here, env=os.environ | own(), capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"FAIL  {page}: ended with {done.returncode}\n{block.code}\n{done.stdout}{done.stderr}")
        raise SystemExit(1)
    if absent := missing(block.shown, done.stdout):
        print(f"FAIL  {page}: not printed by\n{block.code}\n{absent[0]}\nbut\n{done.stdout}")
        raise SystemExit(1)
    return "\n".join(line.rstrip() for line in done.stdout.replace(str(here), ".").splitlines()).strip()


def shortened(printed: str) -> str:
    """Return the first lines of an output."""
    lines = printed.splitlines()
    return "\n".join(lines[:LINES] + (["..."] if len(lines) > LINES else []))


def build(kind: str, out: Path) -> int:
    """Build with sphinx; every warning fails.

    Returns:
        The exit code.
    """
    command = [sys.executable, "-m", "sphinx", "-b", kind, "-n", "-W", "--keep-going", "-q", str(SOURCE), str(out)]
    return subprocess.run(command, env=os.environ | own(), check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
