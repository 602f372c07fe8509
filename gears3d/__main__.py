"""``gears3d`` and ``python -m gears3d``: the command line."""

import os
import signal


def _open_standard_streams() -> None:
    """Open closed standard streams on the null device: the next file opened would receive what is printed."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


def main() -> None:
    """Run the command line; Ctrl-C during imports ends the process without a traceback."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    _open_standard_streams()
    from gears3d.files import own_temporaries

    own_temporaries()
    from gears3d.cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
