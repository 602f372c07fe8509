"""Who uses gears3d learns whom to cite: every work that a law names is among the references."""

import json
import re
from pathlib import Path

import pytest

from gears3d import __version__
from gears3d.cli import main
from gears3d.verification.papers import papers
from gears3d.verification.papers.references import references

ROOT = Path(__file__).resolve().parents[3]
SOURCE = re.compile(r"Source:(.*?)(?:\n\s*\n|\"\"\"|$)", re.DOTALL)
NAMED = re.compile(r"([A-Z][\w-]+)(?:(?:, [A-Z][\w-]+)*,? & (?:De )?[A-Z][\w-]+| et al\.)?,? ((?:19|20)\d\d)\b")
CITATION = (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def named():
    for package in ("laws", "effects", "stiffness", "signals"):
        for file in sorted((ROOT / "gears3d" / package).glob("*.py")):
            for text in SOURCE.findall(file.read_text(encoding="utf-8")):
                yield from NAMED.findall(" ".join(text.split()))


def test_every_work_that_a_law_names_is_a_reference():
    known = {(author.split()[-1], str(one.year)) for one in references() for author in one.authors}
    found = set(named())
    assert ("Kadmiri", "2012") in found
    assert ("Sainsot", "2004") in found
    assert found - known == set()
    assert len({one.key for one in references()}) == len(references())


def test_papers_whose_figures_are_drawn_again_are_references():
    keys = {one.key for one in references()}
    assert {one.name for one in papers() if one.citation[0] != "N"} <= keys


@pytest.mark.parametrize("option", [(), ("--json",)])
def test_cite_prints_the_version_and_every_reference(option, capsys):
    with pytest.raises(SystemExit) as end:
        main(["cite", *option])
    assert not end.value.code
    out = capsys.readouterr().out
    if option:
        told = json.loads(out)
        assert told["software"]["version"] == __version__
        assert [one["key"] for one in told["references"]] == [one.key for one in references()]
    else:
        assert all(str(one) in out for one in references())
        assert f"version = {{{__version__}}}" in out


def test_the_citation_file_has_the_version_and_the_papers_of_the_base_model():
    assert f"\nversion: {__version__}\n" in CITATION
    for one in references()[:3]:
        assert f'title: "{one.title}"' in CITATION
        assert f"year: {one.year}" in CITATION
