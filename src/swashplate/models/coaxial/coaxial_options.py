"""The switches of the coaxial helicopter's equations: those of a single rotor, and what two rotors need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import Card, no_option
from swashplate.models.conventional.helicopter_options import HelicopterOptions, helicopter_options
from swashplate.physics.coaxial_wake import FORMS


class CoaxialOptions(NamedTuple):
    """What a card's `[options]` may say.

    Attributes:
        upper: of the upper rotor, drive and ground, as of a single-rotor helicopter (`HelicopterOptions`). Its
            `rotation` is the upper rotor's sense; the lower one turns the other way.
        interference: what each rotor's flow does at the other's disc, one of `coaxial_wake.FORMS`. The usual one is
            nearest to measured power: 1.29 times that of two rotors alone, 1.16 measured (Leishman 2006, sec. 2.15).
        differential_cyclic: inputs B1d and A1d tilt the upper swashplate against the lower one (trims hold them at 0).
    """

    upper: HelicopterOptions
    interference: str = "contracted-wake"
    differential_cyclic: bool = False

    @property
    def lower(self) -> HelicopterOptions:
        """The same of the lower rotor."""
        return self.upper._replace(rotation="cw" if self.upper.rotation == "ccw" else "ccw")


_USUAL: Mapping[str, Any] = {
    "rotation": "ccw",
    "coning": True,
    "rotor_speed": "fixed",
    "servos": False,
    "delay": False,
    "engine_lag": False,
    "ground": False,
    "grip": False,
    "in_plane": "blade-element",
    "yaw_at_blades": True,
    "precession_torque": True,
    "stiff_blades": True,
    "tip_loss": True,
    "induced_factor": True,
    "ground_effect": "none",
}
"""Options of a single rotor that a coaxial helicopter has too, as they are where the card says nothing: what physics
says, because there is no older table to agree with. Its inflow is always Pitt and Peters' states."""
_OWN: Mapping[str, tuple[Any, ...]] = {"interference": FORMS, "differential_cyclic": (True, False)}


def coaxial_options(card: Card) -> CoaxialOptions:
    """A card's options.

    Raises:
        CardError: naming the option that is not known or has no such value.
    """
    for name, value in card.options.items():
        if name not in _USUAL and name not in _OWN:
            raise no_option(name, (*_USUAL, *_OWN), where=card.where)
        if name in _OWN and not any(
            value is choice or (isinstance(value, str) and value == choice) for choice in _OWN[name]
        ):
            expected = ", ".join(map(repr, _OWN[name]))
            raise CardError(f"is {value!r}, expected one of {expected}.", where=card.where, channel=name)
    single = {name: value for name, value in card.options.items() if name in _USUAL}
    upper = helicopter_options(replace(card, options={**_USUAL, **single, "inflow": "pitt-peters"}))
    return CoaxialOptions(upper, **{name: card.options[name] for name in _OWN if name in card.options})
