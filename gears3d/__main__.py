"""``python -m gears3d``: the command line."""

from gears3d.cli import main

if __name__ == "__main__":
    main()
