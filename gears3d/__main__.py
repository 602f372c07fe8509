"""``gears3d`` and ``python -m gears3d``: the command line."""

import signal


def main() -> None:
    """Run the command line; Ctrl-C during imports ends the process without a traceback."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from gears3d.files import own_temporaries

    own_temporaries()
    from gears3d.cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
