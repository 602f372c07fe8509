"""Tables of laws: as close as asked, and no more points than that needs."""

import numpy as np
import pytest

from gears3d.effects.tabulate import tabulate
from gears3d.errors import InputError

LAWS = [np.sin, lambda x: np.sqrt(np.abs(x)), lambda x: np.exp(-5 * x) + 0.1 * x**3, lambda x: 2.0, np.abs]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("accuracy", [1e-2, 1e-5])
def test_lines_follow_the_law_as_closely_as_asked(law, accuracy):
    points = tabulate(law, -1.0, 3.0, accuracy)
    x, y = np.array(points).T
    anywhere = np.random.default_rng(1).uniform(-1.0, 3.0, 200_000)
    assert np.abs(np.interp(anywhere, x, y) - law(anywhere)).max() <= 1.1 * accuracy
    assert x[0] == -1.0
    assert x[-1] == 3.0


def test_the_number_of_points_is_about_the_least():
    """A parabola c·x² over 2 needs sqrt(c/accuracy) lines of the same length."""
    found = len(tabulate(lambda x: x**2, -1.0, 1.0, 1e-5)) - 1
    assert 1e5**0.5 <= found <= 2 * 1e5**0.5


@pytest.mark.parametrize(
    ("law", "low", "high", "accuracy", "said"),
    [
        (np.sign, -1.0, 1.1, 1e-3, "jump"),
        (lambda x: 1 / x, -1.0, 1.0, 1e-3, "not finite"),
        (np.sin, 1.0, 0.0, 1e-3, "makes no sense"),
        (np.sin, 0.0, 1.0, 0.0, "makes no sense"),
        (np.sin, 0.0, np.inf, 0.1, "makes no sense"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_laws_without_a_table_are_refused(law, low, high, accuracy, said):
    with pytest.raises(InputError, match=said):
        tabulate(law, low, high, accuracy)


def test_a_jump_is_named_with_its_place_its_size_and_the_row_that_holds_it():
    with pytest.raises(InputError) as caught:
        tabulate(lambda w: 0.2 * np.sign(w - 0.3), -1.0, 1.1, 1e-3)
    (fault,) = caught.value.faults
    assert "the law jumps near 0.3 by 0.4" in fault.message
    assert "torque_constant" in fault.remedy
