"""A drive that fluctuates fast and little throws its gear off: such a record is no slow turn."""

import numpy as np
import pytest

from gears3d.identify import read_contacts, roll
from gears3d.identify.transmission import transmission_error
from gears3d.measured.checks import Admitted
from gears3d.measured.readers import Channels
from gears3d.verification.challenge.space import draw
from gears3d.verification.challenge.taking import take


@pytest.mark.parametrize("index", [10, pytest.param(31, marks=pytest.mark.slow)])
def test_flights_lower_than_half_the_backlash_make_no_orders(index):
    taken = take(draw(index + 1, 1)[index], dirt=False, samples=120_000)
    assert np.quantile(taken.truth.impacts["flight_height_m"], 0.99) < 0.5 * taken.truth.backlash
    record = Admitted(Channels(taken.record.signals), taken.scenario, (), "")
    contacts = read_contacts([record])
    assert contacts.source == "rattle"
    assert not transmission_error(roll(contacts)).parameters
