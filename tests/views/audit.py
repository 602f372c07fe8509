"""What a browser finds in a page: accessibility, messages of the console, text that covers text, width, requests."""

import os
import sys
from pathlib import Path

AXE = (
    os.environ.get("GEARS3D_AXE", ""),
    f"{sys.prefix}/node_modules/axe-core/axe.min.js",
)
"""Where axe-core may lie (MPL 2.0; tools/test installs it, the package does not have it)."""
LOOK = (Path(__file__).parent / "audit.js").read_text(encoding="utf-8")


def axe() -> str:
    """Return the path of axe-core; empty where it is missing."""
    return next((place for place in AXE if place and Path(place).is_file()), "")


def opened(browser, page: Path, width: int, scheme: str):
    """Return a tab with a page; ``said`` has the console's messages, ``asked`` the addresses that were requested."""
    tab = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme, bypass_csp=True)
    tab.said, tab.asked = [], []
    tab.on("console", lambda message: tab.said.append(message.text))
    tab.on("pageerror", lambda error: tab.said.append(str(error)))
    tab.on("request", lambda sent: tab.asked.append(sent.url))
    tab.add_init_script(LOOK)
    tab.goto(page.as_uri())
    return tab


def faults(tab, width: int) -> list[str]:
    """Return what is wrong with the page in a tab."""
    found = [f"console: {text}" for text in tab.said]
    found += [f"requests {url}" for url in tab.asked if not url.startswith(("file:", "data:"))]
    found += [f"covered: {text}" for text in tab.evaluate("covered()")]
    found += [f"cut off: {text}" for text in tab.evaluate("cutOff()")]
    wide = tab.evaluate("document.documentElement.scrollWidth")
    return found + ([f"is {wide} px wide in a window of {width} px"] if wide > width else [])


def violations(tab) -> list[str]:
    """Return the violations of accessibility rules, worst first: impact, rule, count, first place."""
    tab.add_script_tag(path=axe())
    order = ("critical", "serious", "moderate", "minor")
    return sorted(tab.evaluate("violations()"), key=lambda text: order.index(text.split()[0]))
