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


# Place of the terms in a page, which are those that it links to.
_TERMS = "<!-- terms -->"
# Terms of a page that links to none.
ALWAYS = ("drive gear", "loose gear", "active flank", "reverse flank", "backlash", "free flight", "impact")


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


DOCS = "https://github.com/gears3d/gears3d/blob/main/docs/"
_GEARS, _CONTACT, _RECORDS, _CAUSES = (
    f"glossary.md#{part}" for part in ("gears-and-motion", "contact", "measurement", "inference")
)
# Meaning and page by term.
TERMS: dict[str, tuple[str, str]] = {
    "drive gear": ("Driving gear: its motion is imposed.", _GEARS),
    "loose gear": ("Idle (unloaded) gear: it is moved through the mesh and resisted by drag only.", _GEARS),
    "active flank": ("Working flank, on which the drive gear accelerates the loose gear.", _GEARS),
    "reverse flank": ("Non-working flank, on which the drive gear decelerates the loose gear.", _GEARS),
    "displacement": (
        "Position of the loose gear relative to the drive gear along the transverse line of action: 0 where the active "
        "flanks touch, equal to the backlash where the reverse flanks touch.",
        _GEARS,
    ),
    "backlash": (
        "Range of the displacement without contact, along the transverse line of action.",
        "theory/geometry.md",
    ),
    "excitation": (
        "Λ: inertia torque of the fluctuation over the drag torque; with rigid teeth contact is lost above 1.",
        _GEARS,
    ),
    "drag": ("Torque that resists the rotation of the loose gear: bearings, seals, oil.", "theory/identification.md"),
    "regime": (
        "Contact, single-sided impacts (on one flank) or double-sided impacts (on both flanks: rattle).",
        _GEARS,
    ),
    "periodicity": ("1T: the motion repeats every period of the drive's fluctuation; 2T: every second one.", _GEARS),
    "Poincaré section": (
        "Impact velocity over the phase of the fluctuation: few points if periodic, a cloud if chaotic.",
        _GEARS,
    ),
    "Lyapunov exponent": ("Rate at which neighbouring motions separate; positive for a chaotic motion.", _GEARS),
    "impact": ("Short contact that reverses the relative velocity.", _CONTACT),
    "restitution": ("Coefficient of restitution: rebound speed over approach speed.", _CONTACT),
    "free flight": ("Motion between two contacts; only drag acts on the loose gear.", _CONTACT),
    "transmission error": ("Deviation of the displacement in contact from that of perfect involutes.", _CONTACT),
    "order": ("Number of periods per revolution of a gear.", _CONTACT),
    "rigid model": (
        "Independent model with one degree of freedom: the loose gear between two walls.",
        "architecture.md",
    ),
    "error budget": ("Largest errors of the gap by their causes, along the line of action.", "architecture.md"),
    "noise": ("Standard deviation of one reading, as displacement along the line of action.", _RECORDS),
    "goodness-of-fit test": (
        "χ² test of the readings of a flight against free flight; flights with p < 0.1 % are not used.",
        "theory/segmentation.md",
    ),
    "sensor gate": (
        "Checks of rows, clock, units, signs, ratios and counts before any analysis.",
        "howto/sensor-faults.md",
    ),
    "held-out": ("Data that were excluded from the fit and then predicted.", _CAUSES),
    "residual": ("Measurement minus prediction.", _CAUSES),
    "95 %": ("Interval that contains the true value in 95 of 100 repetitions.", _CAUSES),
    "nominal model": ("Scenario of the test rig before any correction.", _CAUSES),
    "extended model": ("Nominal model with the reported causes.", _CAUSES),
    "channel": ("Kind of data that is predicted: flight, contact, impact, loss of contact, drive.", _CAUSES),
    "cause": (
        "Effect of the catalogue whose addition reduces the residuals significantly (Δχ² > 30).",
        "theory/diagnosis.md",
    ),
    "competing hypothesis": ("Another cause that could explain the same data.", "theory/diagnosis.md"),
    "minimum detectable effect": ("Smallest size at which a cause would be reported.", "theory/diagnosis.md"),
}
