"""Code blocks of documentation pages, and the output that a page shows below them."""

from __future__ import annotations

import re
from typing import NamedTuple

FENCE = re.compile(r"^```(\w+)\n(.*?)^```$(?:\s+^```text\n(.*?)^```$)?", re.MULTILINE | re.DOTALL)
"""A block: language, content, and the block of language ``text`` that follows it directly, if any."""
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
TOLERANCE = 1e-3
"""Relative difference of a number from the shown one: other processors round differently."""
ANY = "..."
"""A line that stands for any number of lines; at the end of a line, for the rest of it."""


class Block(NamedTuple):
    """A code block of a page.

    Args:
        language: word behind the fence.
        code: content.
        shown: output that the page shows, or an empty string.
    """

    language: str
    code: str
    shown: str


def blocks(text: str, languages: tuple[str, ...] = ("sh", "python")) -> list[Block]:
    """Return the blocks of a page that are run, in order.

    Args:
        text: the page, Markdown.
        languages: those of blocks that are run.
    """
    found = (Block(one[1], one[2], one[3] or "") for one in FENCE.finditer(text))
    return [block for block in found if block.language in languages]


def command(block: Block, python: str = "python") -> list[str]:
    """Return the words of the command that runs a block.

    Args:
        block: of language sh, bash, python or py; pages have bash and py for what needs more than the wheel.
        python: interpreter of Python blocks.
    """
    shell = block.language in ("sh", "bash")
    return ["bash", "-euo", "pipefail", "-c", block.code] if shell else [python, "-c", block.code]


def same(shown: str, printed: str) -> bool:
    """Return whether two lines have equal words, and numbers equal within the tolerance.

    >>> same("speed  12.34 mm/s", "speed 12.33 mm/s"), same("speed 12 mm/s", "speed 13 mm/s")
    (True, False)
    >>> same("explained  The 5 records ...", "explained  The 5 records deviate")
    True
    """
    if shown.split()[-1:] == [ANY]:
        kept = shown.split()[:-1]
        shown, printed = " ".join(kept), " ".join(printed.split()[: len(kept)])
    words = [re.sub(r"\s+", " ", NUMBER.sub("#", line)).strip() for line in (shown, printed)]
    values = [[float(number) for number in NUMBER.findall(line)] for line in (shown, printed)]
    return words[0] == words[1] and all(
        abs(a - b) <= TOLERANCE * max(abs(a), abs(b)) for a, b in zip(*values, strict=True)
    )


def missing(shown: str, printed: str) -> list[str]:
    """Return the lines that a page shows and its command did not print, in this order.

    Args:
        shown: output on the page; ``...`` stands for any lines.
        printed: output of the command.

    >>> missing("one\\n...\\nthree\\n", "one\\ntwo\\nthree\\n"), missing("four", "one")
    ([], ['four'])
    """
    rest = iter(printed.splitlines())
    lines = [line for line in shown.splitlines() if line.strip() not in ("", ANY)]
    return [line for line in lines if not any(same(line, one) for one in rest)]
