"""Picture of a diagnosis for the README: the first cause of a report, as headless Chromium paints it."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SEED = 7
PLACE = "docs/pictures"
WIDTH = 1000
LARGEST = 300_000


def main(place: str = PLACE) -> int:
    """Hide the effect of the README's challenge, diagnose it and take the picture.

    Args:
        place: folder of the picture.
    """
    from playwright.sync_api import sync_playwright

    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        print("no Chromium: apt-get install chromium", file=sys.stderr)
        return 4
    with tempfile.TemporaryDirectory() as scratch:
        blind, found = Path(scratch) / "blind", Path(scratch) / "found"
        said = [sys.executable, "-m", "gears3d"]
        subprocess.run([*said, "challenge", "--seed", str(SEED), "--out", str(blind)], check=True)
        records, rig = str(blind / "record.toml"), str(blind / "rig.toml")
        subprocess.run([*said, "diagnose", records, "--rig", rig, "--out", str(found), "--no-replay"], check=True)
        with sync_playwright() as playwright:
            window = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox", "--disable-gpu"])
            page = window.new_page(viewport={"width": WIDTH, "height": 900}, device_scale_factor=1.5)
            page.goto((found / "report.html").as_uri())
            picture = Path(place) / "diagnosis.png"
            picture.parent.mkdir(parents=True, exist_ok=True)
            page.locator(".cause").first.screenshot(path=str(picture))
            window.close()
    size = picture.stat().st_size
    print(f"{picture}  {size / 1e3:.0f} kB")
    return 0 if size <= LARGEST else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
