"""Tables behind the page of evidence: downloads, and the pages that list them."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from gears3d.files import write_text
from gears3d.verification.papers.findings import QUESTIONS, page, question, record_of, recorded

ROOT = Path(__file__).resolve().parents[1]
VALUES = ["published", "computed", "tolerance", "unit"]
ROWS = ["paper", "figure", "quantity", *VALUES, "basis", "model", "verdict", "note"]
CHECKS = ["chapter", "name", "value", "bound", "unit", "at_least", "holds"]


def evidence(folder: Path, run: bool) -> None:
    """Write the downloads and their pages.

    Args:
        folder: of the pages.
        run: evaluate published rows and checks; without it those two tables are left out.
    """
    made = [answers(folder, name) for name in QUESTIONS]
    if run:
        made = [published(folder), checks(folder), *made]
    write_text(folder / "open-questions.md", page([(question(name), recorded(name)) for name in QUESTIONS]))
    lines = ["# Tables", "Made when this site was built. CSV and JSON have the same columns.", "", *made, ""]
    if not run:
        lines += ["Published rows and checks are left out: the site was built with `--no-run`.", ""]
    write_text(folder / "tables.md", "\n".join(lines))


def published(folder: Path) -> str:
    """Evaluate all published rows and return the line of the list."""
    with tempfile.TemporaryDirectory() as scratch:
        printed("papers", "--json", "--out", scratch)
        rows = json.loads((Path(scratch) / "papers.json").read_text(encoding="utf-8"))
        figures = (Path(scratch) / "papers.html").read_text(encoding="utf-8")
    write_text(folder / "published-rows.html", figures)
    agree = sum(row["verdict"] == "agrees" for row in rows)
    differ = len(rows) - agree
    stated(
        f"{agree} of {len(rows)} agree", f"{agree} of {len(rows)} published values and trends agree, {differ} disagree"
    )
    counted = f"{len(rows)} rows: {agree} agree, {differ} disagree"
    more = ", {download}`page with figures <published-rows.html>`"
    return f"{saved(folder, 'published-rows', ROWS, rows, 'Published values', 'gears3d papers', counted)}{more}"


def checks(folder: Path) -> str:
    """Run the checks and return the line of the list."""
    rows = json.loads(printed("validate", "--json"))
    stated(f"{len(rows)} checks hold", f"{len(rows)} of {len(rows)} checks hold")
    counted = f"{len(rows)} checks: {sum(row['holds'] for row in rows)} hold"
    return saved(folder, "checks", CHECKS, rows, "Verification", "gears3d validate", counted)


def answers(folder: Path, paper: str) -> str:
    """Copy the answers on record to the open question of a paper and return the line of the list."""
    write_text(folder / f"{paper}.csv", record_of(paper).read_text(encoding="utf-8"))
    return f"- Open question of {paper}, `tools/findings`: {{download}}`CSV <{paper}.csv>`"


def saved(
    folder: Path, name: str, columns: list[str], rows: list[dict[str, Any]], title: str, made_by: str, counted: str
) -> str:
    """Write rows as CSV and JSON and return the line of the list."""
    text = io.StringIO(newline="")
    written = csv.DictWriter(text, columns, extrasaction="ignore", lineterminator="\n")
    written.writeheader()
    written.writerows(rows)
    write_text(folder / f"{name}.csv", text.getvalue())
    kept = [{key: row[key] for key in columns} for row in rows]
    write_text(folder / f"{name}.json", json.dumps(kept, indent=1, ensure_ascii=False) + "\n")
    files = f"{{download}}`CSV <{name}.csv>`, {{download}}`JSON <{name}.json>`"
    return f"- {title}, `{made_by}`, {counted}: {files}"


def printed(*words: str) -> str:
    """Return what a command prints.

    Raises:
        SystemExit: it failed.
    """
    print(f"evidence: gears3d {' '.join(words[:2])}", flush=True)
    done = subprocess.run([sys.executable, "-m", "gears3d", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"FAIL  gears3d {' '.join(words)} ended with {done.returncode}\n{done.stdout}{done.stderr}")
        raise SystemExit(1)
    return done.stdout


def stated(*sentences: str) -> None:
    """Compare counts with those that the page of evidence and the readme state.

    Raises:
        SystemExit: one of them states other counts.
    """
    for file in (ROOT / "docs" / "evidence" / "index.md", ROOT / "README.md"):
        text = file.read_text(encoding="utf-8")
        if not any(sentence in text for sentence in sentences):
            print(f"FAIL  {file.name} does not state: {' or '.join(sentences)}")
            raise SystemExit(1)
