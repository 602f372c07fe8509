"""Texts for users have no phrase of vocabulary.toml, whose replacements are terms of docs/glossary.md."""

import ast
import io
import re
import tokenize
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TABLE = tomllib.loads((Path(__file__).parent / "vocabulary.toml").read_text(encoding="utf-8"))
CHECKED = [
    "CONTRIBUTING.md",
    "docs/start",
    "docs/howto",
    "docs/theory",
    "docs/evidence",
    "docs/reference",
    "docs/dev",
    "docs/contracts.md",
    "docs/architecture.md",
    "docs/glossary.md",
    "README.md",
    "gears3d",
]
"""Files and folders that are checked."""
OPEN = [
    "gears3d/identify",
    "gears3d/measured",
]
"""Packages and modules that are not checked yet."""
READ = {".py", ".md", ".j2", ".js"}
CODE = re.compile(r"``[^`]*``|`[^`]*`|:\w+:`[^`]*`")


REPLACE = {phrase.strip(): right for left, right in TABLE.items() for phrase in left.split(",")}
PATTERN = re.compile(
    r"(?<![\w-])(" + "|".join(sorted(map(re.escape, REPLACE), key=len, reverse=True)) + r")(?![\w-])", re.IGNORECASE
)


def lines_of(text: str, first: int = 1) -> Iterator[tuple[int, str]]:
    yield from enumerate(text.splitlines(), first)


def python_prose(text: str) -> Iterator[tuple[int, str]]:
    """Yield comments and strings of two words or more, without examples and names of arguments: these are code."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            for number, line in lines_of(node.value, node.lineno):
                yield number, "" if line.lstrip().startswith((">>>", "...")) else re.sub(r"^\s*\w+:(?= )", "", line)
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def markdown_prose(text: str) -> Iterator[tuple[int, str]]:
    code = False
    for number, line in lines_of(text):
        code ^= line.lstrip().startswith("```")
        if not code:
            yield number, line


QUOTED = re.compile(r'"([^"\n]*)"|\'([^\'\n]*)\'|`([^`]*)`')


def quoted(text: str) -> str:
    return " ".join(word for found in QUOTED.findall(text) for word in found if " " in word)


def template_prose(text: str) -> Iterator[tuple[int, str]]:
    """Yield the text of a template; of its tags only quoted strings."""
    for number, line in lines_of(text):
        yield number, re.sub(r"\{[{%].*?[%}]\}", lambda tag: quoted(tag.group(0)), line)


def script_prose(text: str) -> Iterator[tuple[int, str]]:
    """Yield comments and quoted strings of two words or more; of template literals not what is computed."""
    for number, line in lines_of(text):
        comment = re.search(r"(?:^|\s)//(.*)", line)
        yield number, quoted(re.sub(r"\$\{[^}]*\}", "", line)) + " " + (comment.group(1) if comment else "")


PROSE = {".py": python_prose, ".md": markdown_prose, ".j2": template_prose, ".js": script_prose}


def findings(text: str, suffix: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, phrase and replacement."""
    for number, line in PROSE[suffix](text):
        for found in PATTERN.finditer(re.sub(r"\s+", " ", CODE.sub(" ", line) if suffix in (".py", ".md") else line)):
            yield number, found.group(0), REPLACE[found.group(0).lower()]


def files() -> Iterator[Path]:
    for name in CHECKED:
        top = ROOT / name
        for file in [top] if top.is_file() else sorted(top.rglob("*")):
            if file.suffix in READ and not any(file.is_relative_to(ROOT / one) for one in OPEN):
                yield file


@pytest.mark.parametrize("file", [one for one in files() if ".min." not in one.name], ids=lambda file: file.name)
def test_text_uses_the_terms_of_the_glossary(file):
    found = [
        f"{file.relative_to(ROOT)}:{number}: {phrase!r}: write {right}"
        for number, phrase, right in findings(file.read_text(encoding="utf-8"), file.suffix)
    ]
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("suffix", "text", "expected"),
    [
        (".py", '"""Return blows.\n\n``blows`` is a key.\n"""\nkey = "blows"\n', [(1, "blows")]),
        (".py", "x = f'{1} blows  # of {2}'  # a kink\n", [(1, "blows"), (1, "kink")]),
        (".md", "A rival.\n```\nrival\n```\n`rival` and\nit is none\n", [(1, "rival"), (6, "is none")]),
        (".j2", '{% if x is none %}<b>{{ y("the kink", struck) }}</b> anew\n', [(1, "kink"), (1, "anew")]),
        (".py", '"""Text.\n\nstruck: a flank.\n\n>>> struck(blow) is None\n"""\n', []),
        (".js", 'const struck = "struck"; say("gear struck") // a blow\n', [(1, "struck"), (1, "blow")]),
        (".js", "say(`gear ${struck} hits`)\n", [(1, "hits")]),
        (".md", "Housekeeping, backstroke, a well-worn roominess.\n", []),
    ],
)
def test_the_check_finds_prose_and_skips_code(suffix, text, expected):
    assert [(number, phrase) for number, phrase, _ in findings(text, suffix)] == expected


def test_every_phrase_has_one_replacement():
    phrases = [phrase.strip() for left in TABLE for phrase in left.split(",")]
    assert len(phrases) == len(set(phrases)) == len(REPLACE) > 100
