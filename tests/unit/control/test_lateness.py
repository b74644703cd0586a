"""How late commands are said to be: what was given, what was identified, what the equations themselves hold."""

from __future__ import annotations

import swashplate as sp
from swashplate.control.lateness import lateness


def test_a_delay_in_the_equations_is_named() -> None:
    late = sp.vehicle("raptor50", delay=True)
    own = f"commands {1e3 * late.card.values()['servo_delay']:.3g} ms (servo_delay, in the model's equations)"
    assert lateness(late, None, given=None) == own
    assert lateness(late, None, given=0.03).startswith(f"{own}; further: theta0 30 ms")
    assert lateness(sp.vehicle("raptor50"), None, given=None).startswith("nothing: no delay of this model is known")
