"""What a maneuver may be for: slopes of responses and margins by the unknowns, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.maneuver_aims import aim_of
from swashplate.control.analysis.sampled_loop import sampled_loop
from swashplate.control.analysis.stability import margins_of
from swashplate.errors import ManeuverError

UNKNOWN = ("inertia_yy", "tau_f_upper")


def test_slopes_of_a_response_are_those_of_the_linear_model() -> None:
    coax = sp.vehicle("coax")
    aim = aim_of("q/servo_pitch@2", [coax], UNKNOWN, sp.hover_hold)
    assert aim.slopes.shape == (1, 2, 2)
    place = coax.input_names.index("servo_pitch")

    def answer(share: float) -> complex:
        moved = coax.with_values({"inertia_yy": share * coax.card.parameters["inertia_yy"].value})
        return complex(sp.linearize(moved).response(np.array([4.0 * np.pi]))[0, coax.index("q"), place])

    change = np.log(answer(1.01) / answer(0.99)) / 0.02
    np.testing.assert_allclose(aim.slopes[0, :, 0], [change.real, change.imag], rtol=0.01, atol=1e-3)
    np.testing.assert_allclose(aim.units, [20.0 / np.log(10.0), 180.0 / np.pi])


def test_a_margin_is_that_of_the_controller_that_flies() -> None:
    coax = sp.vehicle("coax")
    aim = aim_of("margin", [coax], ("linkage_lower",), lambda v, at: sp.autopilot(v, at, mode="place"))
    assert aim.names == ("disc margin",)
    law = sp.autopilot(coax, sp.trim(coax), mode="place")
    value = coax.card.parameters["linkage_lower"].value
    found = [
        margins_of(sampled_loop(changed, law, sp.trim(changed), delays=0.0), points=6000)
        for changed in (coax.with_values({"linkage_lower": s * value}) for s in (0.99, 1.01))
    ]
    low, high = (one.together.alpha for one in found)
    assert aim.slopes[0, 0, 0] == pytest.approx((high - low) / 0.02, rel=0.1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("q", "has no frequencies"),
        ("q/pitch@fast", "has no frequencies"),
        ("q/pitch@3-1", "expected frequencies above zero that rise"),
        ("b/pitch@1", "aim b: is no state"),
        ("q/rudder@1", "aim rudder: is no axis and no input"),
        ("psi/pitch@2", "psi does not answer pitch"),
    ],
)
def test_what_is_no_aim_is_refused(text: str, words: str) -> None:
    with pytest.raises(ManeuverError, match=words):
        aim_of(text, [sp.vehicle("coax")], UNKNOWN, sp.hover_hold)


def test_what_the_unknowns_do_not_move_is_refused() -> None:
    with pytest.raises(ManeuverError, match="does not depend on drag_x"):
        aim_of("q/pitch@2", [sp.vehicle("coax")], ("drag_x",), sp.hover_hold)
