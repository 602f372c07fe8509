"""One page of every kind, as the command line writes them."""

from pathlib import Path
from string import Formatter

import pytest

from gears3d import cli

NAME = "rigaud-2020/fig5-20rpm"
SHORT = ("--set", "run.duration=2 s")
RIG = ("--rig", NAME)
QUIET = ("--set", "motion.harmonics=[]", "--set", "run.settle=0 s")
FEW = ("--records", "2", "--duration", "3 s")
OWN_MODEL = ("compare", "{run}", NAME, "--set", "run.duration=2 s", "--set", "impact.restitution=0.35")
PAGES: dict[str, tuple[str, ...]] = {
    "run": ("run", NAME, "--model", "rigid", "--twin", "rigid", *SHORT),
    "run-bodies": ("run", NAME, *SHORT),
    "run-contact": ("run", NAME, "--model", "rigid", *SHORT, *QUIET),
    "run-lubricated": ("run", "dct-helical-lubricated/fig13", "--model", "lubricated", "--set", "run.duration=1 s",
                       "--set", "run.settle=0.2 s"),
    "report": ("report", "{run}"),
    "compare": ("compare", "{run}", "{run}"),
    "compare-own-model": OWN_MODEL,
    "camera": ("camera", "{run}"),
    "show": ("show", NAME),
    "show-helical": ("show", "dct-helical-lubricated/fig13"),
    "excitation": ("excitation", NAME),
    "sweep": ("sweep", NAME, "--vary", "drag.torque=0.1..1.5 N m lin 12", *SHORT, "--workers", "0"),
    "sweep-grid": ("sweep", NAME, "--vary", "drag.torque=0.1..1.5 N m lin 5",
                   "--vary", "impact.restitution=0,0.2,0.4", *SHORT, "--workers", "0"),
    "inspect": ("inspect", "{rattle}", *RIG),
    "segment": ("segment", "{rattle}", *RIG),
    "segment-quiet": ("segment", "{quiet}", *RIG, *QUIET),
    "restitution": ("identify", "restitution", "{rattle}", *RIG),
    "coastdown": ("identify", "coastdown", "{free}", "--inertia", "0.0695 kg m^2"),
    "transmission-error": ("identify", "transmission-error", "{slow}", "--rig", "rigaud-2020/fig2"),
    "backlash": ("identify", "backlash", "{slow}", "--rig", "rigaud-2020/fig2"),
    "diagnose": ("diagnose", "{blind}/record.toml", "--rig", "{blind}/rig.toml", "--no-3d", "--no-replay"),
    "diagnose-nothing": ("diagnose", "{none}/record.toml", "--rig", "{none}/rig.toml", "--no-3d", "--no-replay"),
    "plan": ("plan", NAME, "--causes", "drag_coulomb,restitution_offset", "--speeds", "30 rpm",
             "--amplitudes", "20 rpm", "--lengths", "4 s", "--most", "2"),
    "reveal": ("reveal", "{blind}", "{diagnose}"),
    "papers": ("papers", "--only", "ottewill-2010"),
}  # fmt: skip
"""Arguments of the verb that writes each page, without ``--out``; ``{...}`` names what was made before."""
RECORDS: dict[str, tuple[str, ...]] = {
    "rattle": ("synthesize", NAME, "--test", "rattle", *SHORT),
    "quiet": ("synthesize", NAME, "--test", "rattle", *SHORT, *QUIET),
    "free": ("synthesize", NAME, "--test", "coastdown"),
    "slow": ("synthesize", "rigaud-2020/fig2", "--test", "transmission-error"),
    "blind": ("challenge", "--seed", "1", "--effect", "drag_viscous", "--size", "0.3", *FEW),
    "none": ("challenge", "--seed", "2", "--none", *FEW),
}  # fmt: skip
"""Arguments of the verbs that write the records."""


def written(words: tuple[str, ...], out: Path, made: dict[str, Path]) -> None:
    """Run a verb with ``--out``."""
    with pytest.raises(SystemExit) as stop:
        cli.main([*(word.format(**made) for word in words), "--out", str(out)])
    assert stop.value.code in (0, None, 1), (words, stop.value.code)


def make(folder: Path, wanted: str) -> Path:
    """Return a page; it is written, and what it is made from, unless it is there."""
    if wanted in RECORDS:
        place = folder / (wanted if RECORDS[wanted][0] == "challenge" else f"{wanted}.parquet")
        words, done = RECORDS[wanted], place.exists()
    else:
        place, words = folder / wanted, PAGES[wanted]
        done = (place / "report.html").exists()
    if not done:
        needed = {name for word in words for _, name, *_ in Formatter().parse(word) if name}
        made = {name: folder / name if name in PAGES else make(folder, name) for name in needed}
        for name in needed & PAGES.keys():
            make(folder, name)
        written(words, place, made)
    return place if wanted in RECORDS else place / "report.html"
