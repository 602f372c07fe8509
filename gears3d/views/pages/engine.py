"""The page engine: header with question and answer, key numbers, figures, terms, how to repeat, data."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.resources import files
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup, escape

from gears3d.views.pages.terms import DOCS, TERMS
from gears3d.views.plots.numbers import Figure

ROOM = files("gears3d.views.pages")


class Picture(NamedTuple):
    """A picture to be put into the page.

    Args:
        data: its file, SVG text or PNG bytes.
        words: description for screen readers.
        caption: below it.
    """

    data: str | bytes
    words: str
    caption: str = ""

    @property
    def source(self) -> str:
        """The file as an address that needs no network."""
        kind, data = ("svg+xml", self.data.encode()) if isinstance(self.data, str) else ("png", self.data)
        return f"data:image/{kind};base64," + b64encode(data).decode("ascii")


class Key(NamedTuple):
    """A key number of the header.

    Args:
        name: in words; a term of :data:`TERMS` in it is explained.
        figure: the number.
        interval: its uncertainty or scatter in words; empty if it has none.
        key: name in the JSON of the result.
        tone: ``active`` or ``reverse``: the flank that it belongs to.
    """

    name: str
    figure: Figure
    interval: str = ""
    key: str = ""
    tone: str = ""


class Claim(NamedTuple):
    """One line of a table: a name, a number, and what it means.

    Args:
        key: name in the JSON of the result.
        name: in words.
        figure: the number as shown.
        meaning: explanation of the number.
    """

    key: str
    name: str
    figure: Figure
    meaning: str


class Head(NamedTuple):
    """What every page begins with.

    Args:
        what: kind of the result, in two words.
        title: of the page.
        question: that the page answers, a sentence.
        answer: verdict, size and confidence, in a sentence or two.
        keys: numbers of the answer.
        tone: ``good``, ``open`` or ``bad``: colour of the answer's edge.
        verdict: in a word or two, where it has a name.
        source: of the scenario.
        notes: what weakens the answer, a sentence each.
    """

    what: str
    title: str
    question: str
    answer: str
    keys: Sequence[Key] = ()
    tone: str = ""
    verdict: str = ""
    source: str = ""
    notes: Sequence[str] = ()


def render(
    template: str,
    head: Head,
    made: Mapping[str, Any],
    files: Sequence[str] = (),
    blocks: Mapping[str, Any] | None = None,
    charts: Mapping[str, Any] | None = None,
    **content: Any,
) -> str:
    """Return a page as HTML that opens without a network.

    Args:
        template: its own part, a file in ``templates``.
        head: of the page.
        made: provenance: ``version``, ``command`` and ``inputs``.
        files: names of files in the same folder.
        blocks: data of plots that the template's own script draws, by name.
        charts: data of the other charts, by the name that the template places them under.
        content: of the template.
    """
    data = {**(blocks or {}), "charts": charts or {}}
    page = environment().get_template(template).render(
        head=head, made={"version": "", "command": "", "inputs": [], **made}, files=files, asset=asset,
        blocks={name: as_json(block) for name, block in data.items()}, drawn=bool(blocks or charts),
        own=bool(blocks), charts=charts or {}, terms=Markup(_TERMS), **content,
    )  # fmt: skip
    return page.replace(_TERMS, _meanings(page))


def as_json(block: Any) -> Markup:
    r"""Return JSON that is safe inside a script element.

    >>> as_json(["</script>"])
    Markup('["\\u003c/script>"]')
    """
    text = json.dumps(block, separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c"))


def explained(name: str) -> Markup:
    """Return a name in which the first known term has its meaning as a tooltip and links to the list of terms."""
    for term in sorted(TERMS, key=len, reverse=True):
        if found := re.search(rf"\b{re.escape(term)}(?:s|es)?\b", name, re.IGNORECASE):
            begin, end = found.span()
            link = f'<a class="term" href="#{anchor(term)}" data-tip="{escape(TERMS[term][0])}">'
            return Markup(f"{escape(name[:begin])}{link}{escape(name[begin:end])}</a>{escape(name[end:])}")
    return escape(name)


def anchor(term: str) -> str:
    """Return the place of a term on a page.

    >>> anchor("excitation Λ")
    'term-excitation-Λ'
    """
    return "term-" + re.sub(r"\W+", "-", term)


_TERMS = "<!-- terms -->"
"""Place of the terms in a page, which are those that it links to."""
ALWAYS = ("drive gear", "loose gear", "active flank", "reverse flank", "backlash", "free flight", "impact")
"""Terms of a page that links to none."""


def _meanings(page: str) -> str:
    used = set(re.findall(r'href="#(term-[^"]+)"', page)) or {anchor(name) for name in ALWAYS}
    return "".join(
        f'<div><dt id="{anchor(name)}">{escape(name)}</dt><dd>{escape(told)} '
        f'<a href="{DOCS}{where}" aria-label="Theory: {escape(name)}">Theory</a></dd></div>'
        for name, (told, where) in TERMS.items()
        if anchor(name) in used
    )


@lru_cache
def environment() -> jinja2.Environment:
    """Return the templates, with escaping on and undefined names refused."""
    made = jinja2.Environment(
        loader=jinja2.PackageLoader("gears3d.views.pages"), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    made.filters["explained"] = explained
    return made


@lru_cache
def asset(name: str) -> Markup:
    """Return a vendored or own script or style sheet, to be put into the page as it is."""
    return Markup((ROOM / "assets" / name).read_text(encoding="utf-8"))
