"""A map proposed from what a file shows, with the reason for every choice."""

from gears3d.measured.readers.guess.propose import propose as propose
