"""``tools/fuzz``: every part for its share of the time; exit code 1 when a promise is broken."""

import argparse
import importlib
import signal
import sys
import time

PARTS = ("scenarios", "records", "kills", "sockets", "environments", "repeats")
"""Modules of this folder; each has ``run(seed)``, which yields its tally after every batch, without end."""

SHOW_S = 10.0
"""Time between two lines of progress [s]."""


def main() -> int:
    """Run the parts; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/fuzz", description=__doc__, epilog="example: tools/fuzz --minutes 2 --seed 7 scenarios records"
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--minutes", type=float, default=10.0, help="for all parts together (default 10)")
    parser.add_argument("--count", type=int, default=None, help="tries of each part, in place of a time")
    parser.add_argument("--seed", type=int, default=None, help="default: drawn from the clock and printed")
    asked = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also in the background, where shells ignore it
    if unknown := set(asked.parts) - set(PARTS):
        parser.error(f"no part {', '.join(sorted(unknown))}; known: {', '.join(PARTS)}")
    parts = asked.parts or [*PARTS]
    seed = time.time_ns() % 2**31 if asked.seed is None else asked.seed
    sys.stdout.write(f"seed {seed}\n")
    sys.stdout.flush()
    broken = 0
    for part in parts:
        begin = shown = time.monotonic()
        for tally in importlib.import_module(f"tests.fuzz.{part}").run(seed):
            spent = time.monotonic() - begin
            if time.monotonic() - shown > SHOW_S:
                shown = time.monotonic()
                broken_here = f"{len(tally.faults)} broken promises"
                sys.stderr.write(f"{part}: {tally.tried} tried, {broken_here}, {spent:.0f} s\n")
            if tally.tried >= asked.count if asked.count is not None else spent > 60 * asked.minutes / len(parts):
                break
        sys.stdout.write(f"{tally}\n  {spent:.0f} s\n")
        sys.stdout.flush()
        broken += len(tally.faults)
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
