"""The single-rotor helicopter's ready choices of what an identification may move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.models.card import Card
from swashplate.models.choices import Choice, Free, PhysicalEffect

_ROTOR = ("hub_stiffness", "blade_inertia", "wake_distortion")
_WHOLE = (
    *_ROTOR,
    "rotor_lift_slope",
    "rotor_drag",
    "tail_lift_slope",
    "fuselage_area_x",
    "fuselage_area_y",
    "fuselage_area_z",
)
_WITH_OPTION = {"bar": ("bar_gain", "bar_inertia"), "gyro": ("gyro_gain",), "servos": ("servo_time",)}


def helicopter_choices(card: Card) -> Mapping[str, Choice]:
    """The ready choices by name; priors are from the card.

    The prior of a parameter is the card's value with the card's sigma, or half the value where the card has none: a
    card of estimates with tolerances becomes one of measured values, as far as the flight can tell.
    """
    switched = [name for option, names in _WITH_OPTION.items() if card.options.get(option, False) for name in names]
    bar = [name for name in switched if name.startswith("bar_")]
    return {
        "rotor": Choice(
            "rotor",
            "what turns the rotor's answer to a stick: hub spring, blade inertia, wake distortion, stabilizer bar",
            tuple(Free(name, _tolerance(card, name)) for name in (*_ROTOR, *bar)),
        ),
        "full": Choice(
            "full",
            "the rotor, lift slopes and drag of rotor, tail rotor and fuselage, and what the card's options add",
            tuple(_with_tolerance(card, name) for name in (*_WHOLE, *switched)),
        ),
    }


def helicopter_effects(card: Card) -> Sequence[PhysicalEffect]:
    """What numbers can leave out: the hub's spring, the distorted wake, drag, and what options add."""
    drag = {f"fuselage_area_{axis}": 0.0 for axis in "xyz"}
    bar = (PhysicalEffect("stabilizer bar", {"bar_gain": 0.0}),) if card.options.get("bar", False) else ()
    gyro = (PhysicalEffect("yaw gyro", {"gyro_gain": 0.0}),) if card.options.get("gyro", False) else ()
    return (
        PhysicalEffect("spring of the hub", {"hub_stiffness": 0.0}),
        PhysicalEffect("wake distorted by pitch and roll rate", {"wake_distortion": 0.0}),
        PhysicalEffect("drag of the fuselage", drag),
        PhysicalEffect("profile drag that grows with thrust", {"rotor_drag_thrust": 0.0}),
        *bar,
        *gyro,
    )


def _tolerance(card: Card, name: str) -> float:
    entry = card.parameters[name]
    return entry.sigma or 0.5 * abs(entry.value) or 1.0


def _with_tolerance(card: Card, name: str) -> Free:
    entry, sigma = card.parameters[name], _tolerance(card, name)
    source = "the card with its sigma" if entry.sigma else "the card, half its value"
    return Free(name, sigma, entry.value, sigma, source=source)
