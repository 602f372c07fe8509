"""Pages of the documentation that come from the code: commands and scenario keys; what docstrings say."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any


def commands() -> str:
    """Return the page of all verbs with their options, as their help has them."""
    from typer.main import get_command

    from gears3d import cli

    group = get_command(cli.app)
    context = group.make_context("gears3d", ["--help"], resilient_parsing=True)
    page = ["# Commands", "Made from the help of every verb. All understand `--json` and `--help`."]
    for name in group.list_commands(context):
        page += verb(("gears3d", name), group.get_command(context, name))
    return "\n\n".join(page) + "\n"


def verb(path: tuple[str, ...], command: Any) -> Iterator[str]:
    """Yield the paragraphs of one verb, and of its kinds where it has some."""
    yield f"{'#' * len(path)} {' '.join(path)}"
    text = inspect.cleandoc(command.help or "").replace("\\[", "[")
    for paragraph in re.split(r"\n\s*\n", text):
        before, example, line = paragraph.partition("Example: ")
        yield " ".join((before if example else paragraph).split())
        if example:
            yield f"```sh\n{' '.join(line.split())}\n```"
    if hasattr(command, "list_commands"):
        inner = command.make_context(path[-1], ["--help"], resilient_parsing=True)
        for name in command.list_commands(inner):
            yield from verb((*path, name), command.get_command(inner, name))
        return
    rows = []
    for one in command.params:
        if one.name in ("help", "as_json"):
            continue
        told = (getattr(one, "help", "") or "").replace("\\[", "[")
        default = one.default if isinstance(one.default, str | int | float) and not callable(one.default) else ""
        default = "" if isinstance(default, bool) else str(default)
        names = ", ".join(f"`{name}`" for name in (*one.opts, *one.secondary_opts))
        if one.param_type_name == "argument":
            names = f"`{one.metavar or one.name.upper()}`"
        rows.append(f"| {names} | {cell(told)} | {f'`{default}`' if default else ''} |")
    if rows:
        yield "| option | what it does | default |\n|---|---|---|\n" + "\n".join(rows)


def scenario() -> str:
    """Return the page of all keys of a scenario, from its JSON Schema."""
    from gears3d.scenario import schema

    page = [
        "# Scenario keys",
        "Made from `gears3d schema`; [contracts](../docs/contracts.md) says how they work together. Quantities are "
        "texts with units. `[]` stands for the place in a list.",
    ]
    tables: dict[str, list[str]] = {}
    for path, key in keys(schema(), ()):
        if path[0] == "effect":
            continue
        place = ".".join(path[:-1])
        default = key.get("default")
        shown = f"`{default}`" if default not in (None, "") else ""
        tables.setdefault(place, []).append(f"| `{path[-1]}` | {cell(key.get('description', ''))} | {shown} |")
    for place, rows in tables.items():
        page.append(f"## {place or 'top level'}")
        page.append("| key | what it is | default |\n|---|---|---|\n" + "\n".join(rows))
    page.append("## effect[]\nThe kinds and their parameters are on [a page of their own](effects.md).")
    return "\n\n".join(page) + "\n"


def record_map() -> str:
    """Return the page of all keys of a record map, from its JSON Schema."""
    from gears3d.measured.readers.maps import RecordMap

    schema = RecordMap.model_json_schema(by_alias=True)
    page = [
        "# Record map",
        "Keys of `record.toml`, format 1, made from `gears3d.measured.readers.maps`. "
        "[Contracts](../docs/contracts.md#measured-record) state how they work together. "
        "`[[record]]` has a file and every key above, over the common ones.",
        f"## top level\n\n{map_table(schema, schema)}",
    ]
    titles = {"TimeMap": "[time]", "GearMap": "[drive], [loose]", "IndexMap": "index", "ExtraMap": "[extra.NAME]"}
    for name, node in schema["$defs"].items():
        title = titles.get(name, f"decode, kind = {name.lower()}")
        page.append(f"## {title}\n\n{prose(node.get('description', ''))}\n\n{map_table(node, schema)}")
    return "\n\n".join(page) + "\n"


def map_table(node: dict[str, Any], schema: dict[str, Any]) -> str:
    """Return the keys of one table of a map with what they may hold."""
    rows = ["| key | value | default |", "|---|---|---|"]
    for name, one in node["properties"].items():
        kinds = [kind_of(part) for part in one.get("anyOf", [one]) if part.get("type") != "null"]
        default = one.get("default")
        needed = "needed" if name in node.get("required", ()) else ""
        shown = f"`{default}`" if isinstance(default, str | int | float) and default != "" else needed
        rows.append(f"| `{name}` | {cell(', '.join(kinds))} | {shown} |")
    return "\n".join(rows)


def kind_of(node: dict[str, Any]) -> str:
    """Return what a value of the schema may be, in words."""
    if "$ref" in node or "oneOf" in node or node.get("type") == "object":
        return "table"
    for key in ("enum", "const"):
        if key in node:
            return ", ".join(f"`{word}`" for word in (node[key] if key == "enum" else [node[key]]))
    return {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false"}[node["type"]]


def keys(node: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    """Yield every key below a node of the schema with its path; tables and lists are gone into."""
    for name, one in node.get("properties", {}).items():
        place = (*path, name)
        inner = next((part for part in (one, *one.get("anyOf", ())) if is_table(part)), None)
        item = one.get("items")
        if inner is not None:
            if one.get("description"):
                yield place, one
            yield from keys(inner, place)
        elif isinstance(item, dict) and "properties" in item:
            yield from keys(item, (*path, f"{name}[]"))
        elif isinstance(item, dict) and name == "effect":
            continue
        else:
            yield place, one


def is_table(node: dict[str, Any]) -> bool:
    """Whether a node is a table of its own keys, no quantity with its uncertainty."""
    inner = node.get("properties", {})
    return bool(inner) and "uncertainty" not in inner


def arguments(text: str) -> dict[str, str]:
    """Return what a docstring says of its arguments."""
    part = re.search(r"\nArgs:\n(.*?)(?:\n\n|\Z)", text, re.DOTALL)
    found = re.findall(r"^ {4}(\w+): (.*?)(?=^ {4}\w|\Z)", part.group(1) if part else "", re.MULTILINE | re.DOTALL)
    return {name: " ".join(words.split()).replace("``", "`") for name, words in found}


def returned(text: str) -> str:
    """Return what a docstring says of what comes back, "" where nothing."""
    part = re.search(r"\nReturns:\n(.*?)(?:\n\n|\Z)", text, re.DOTALL)
    return " ".join(part.group(1).split()) if part else ""


def prose(text: str) -> str:
    """Return the words of a docstring before its arguments, with code in single backticks and its source apart."""
    words = re.split(r"\n(?:Args|Returns|Raises):\n|\n>>> ", text)[0]
    words = re.sub(r"\s*\bSource: [^\n]*(?:\n[^\n]+)*", "", _plain(words))
    paragraphs = [" ".join(part.split()) for part in re.split(r"\n\s*\n", words)]
    if origin := source(text):
        paragraphs.append(f"*Source:* {origin}")
    return "\n\n".join(part for part in paragraphs if part).replace("<", "&lt;")


def source(text: str) -> str:
    """Return where a docstring says that its equation comes from, "" where it does not."""
    found = re.search(r"\bSource: ([^\n]*(?:\n[^\n]+)*)", text)
    origin = " ".join(_plain(found.group(1)).split()) if found else ""
    return re.sub(r"docs/theory/(\w+)\.md", r"[\1](../docs/theory/\1.md)", origin)


def cell(text: str) -> str:
    """Return a text that may stand in a cell of a table."""
    return " ".join(_plain(text).split()).replace("|", "\\|").replace("<", "&lt;")


def _plain(text: str) -> str:
    """Return a text of a docstring with code in single backticks, and names without the roles that link them."""
    return re.sub(r":[a-z]+:`~?([^`]+)`", r"`\1`", text).replace("``", "`")
