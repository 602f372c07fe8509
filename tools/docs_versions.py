"""Adds a built documentation to a site of several versions: one folder each, the list of the switcher, a first page."""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

LATEST = "latest"
"""Name of the version of the branch main."""
RELEASE = re.compile(r"v(\d+)\.(\d+)\.(\d+)")
FIRST = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>gears3d</title>
<meta http-equiv="refresh" content="0; url={name}/index.html"></head>
<body><a href="{name}/index.html">Documentation of gears3d, {name}</a></body></html>
"""


def publish(html: Path, site: Path, name: str) -> list[str]:
    """Copy a documentation into a site and return the names of all versions, the newest release first, then latest.

    Args:
        html: the documentation, as tools/docs builds it.
        site: folder of the site; what other versions have stays.
        name: ``latest`` or a release, ``vX.Y.Z``.

    Raises:
        ValueError: the name is none of these.
    """
    if name != LATEST and not RELEASE.fullmatch(name):
        raise ValueError(f"{name}: expected {LATEST} or vX.Y.Z")
    shutil.rmtree(site / name, ignore_errors=True)
    shutil.copytree(html, site / name)
    releases = [one.name for one in site.iterdir() if RELEASE.fullmatch(one.name)]
    releases.sort(key=lambda one: [int(number) for number in RELEASE.fullmatch(one).groups()], reverse=True)
    names = releases + [LATEST] * (site / LATEST).exists()
    (site / "versions.json").write_text(json.dumps(names) + "\n", encoding="utf-8")
    (site / "index.html").write_text(FIRST.format(name=names[0]), encoding="utf-8")
    (site / ".nojekyll").touch()
    listed = (site / names[0] / "llms.txt").read_text(encoding="utf-8")
    (site / "llms.txt").write_text(listed.replace("](", f"]({names[0]}/"), encoding="utf-8")
    return names


if __name__ == "__main__":
    print(" ".join(publish(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])))
