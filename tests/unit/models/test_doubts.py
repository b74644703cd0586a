"""What no vehicle's equations say by themselves: the battery that they were measured at."""

from __future__ import annotations

import pytest

import swashplate as sp
from swashplate.api.verbs.simulate import Simulate
from swashplate.errors import TrimError
from swashplate.models.doubts import doubts, nominal_voltage


@pytest.mark.parametrize(("voltage", "doubted"), [(12.22, False), (10.5, False), (6.0, True)])
def test_a_battery_far_from_the_cards_is_doubted(voltage: float, doubted: bool) -> None:
    coax = sp.vehicle("coax")
    hover = sp.trim(coax, voltage=voltage)
    said = doubts(coax, hover.state, hover.inputs, hover.environment)
    assert any("holds about 12.22 V" in words for words in said) is doubted


def test_no_motor_turns_without_voltage() -> None:
    with pytest.raises(TrimError, match=r"voltage: is 0 V: no motor turns on that.*12\.22 V"):
        sp.trim(sp.vehicle("coax"), voltage=0.0)
    with pytest.raises(sp.SwashError, match="voltage: is -3, expected 0 to 1000 V"):
        sp.trim(sp.vehicle("coax"), voltage=-3.0)


def test_a_helicopter_with_an_engine_has_no_battery() -> None:
    raptor = sp.vehicle("raptor50")
    assert nominal_voltage(raptor) is None
    assert sp.trim(raptor, voltage=0.0).environment.voltage == 0.0


def test_a_flight_on_a_battery_far_from_the_cards_says_so() -> None:
    flown = Simulate("coax", "hover:0.2s", voltage=7.0).answer()
    assert any("the battery gives 7 V" in words for words in flown.remarks)
