"""Ready choices of what an identification may move, for each kind of vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from swashplate.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class Free:
    """One parameter that an identification may move.

    Attributes:
        name: its name on the card.
        scale: a change of the order that matters, in the parameter's unit.
        mean, sigma: prior (None: the data alone decides), in the parameter's unit.
        start: first guess (None: the card's value).
        source: where the prior comes from.
    """

    name: str
    scale: float
    mean: float | None = None
    sigma: float | None = None
    start: float | None = None
    source: str = ""


@dataclass(frozen=True)
class Choice:
    """A ready set of free parameters and ties.

    Attributes:
        name: what the user calls it.
        description: what it is for.
        free: the parameters to move.
        ties: "name = expression" each.
        fixed: values that the choice sets for the equations' switches.
    """

    name: str
    description: str
    free: tuple[Free, ...]
    ties: tuple[str, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()


_PAPER_TIES = ("a_beta_u = a_alpha_v", "a_beta_v = a_alpha_u", "a_beta_q = a_alpha_p")
_LINEAR_TIES = (
    "a_beta_u_linear = a_alpha_v_linear",
    "a_beta_v_linear = a_alpha_u_linear",
    "a_beta_q_linear = a_alpha_p_linear",
)
_CARD = "the published card, half its value"
_LAG = "the published card, 0.3 rad"

CHOICES: dict[str, Choice] = {
    "flight": Choice(
        "flight",
        "the six parameters that the paper identifies in flight (Fankhauser et al., sec. IV-B)",
        (
            Free("a_alpha_v", 0.0125),
            Free("a_alpha_u", 0.0125),
            Free("a_alpha_p", 0.012),
            Free("tau_f_upper", 1.0),
            Free("o_zeta_upper", 0.1),
            Free("o_zeta_lower", 0.1),
        ),
        _PAPER_TIES,
    ),
    "full": Choice(
        "full",
        "what a slow flight can tell: servo and bar effectiveness, lags, linear flap-back, rotor and heave damping",
        (
            Free("linkage_lower", 0.0678, 0.1355, 0.0678, source=_CARD),
            Free("tau_f_lower", 0.04, 0.08, 0.04, source=_CARD),
            Free("o_zeta_lower", 0.3, -0.0094, 0.3, source=_LAG),
            Free("o_zeta_upper", 0.3, -0.1789, 0.3, source=_LAG),
            Free("tau_f_upper", 0.8, 1.6, 0.8, source=_CARD),
            Free("hub_stiffness_upper", 0.0542, 0.1084, 0.0542, source=_CARD),
            Free("a_alpha_p_linear", 0.02, 0.021, 0.021, 0.021, "16 / (gamma Omega), gamma about 3.2"),
            Free("a_alpha_v_linear", 0.02, 0.021, 0.021, 0.021, "flap-back of both rotors, 2 x 0.0103 rad s/m"),
            Free("a_alpha_u_linear", 0.02, 0.0, 0.021, source="at most the flap-back"),
            Free("gyroscopic", 0.5, 0.5, 0.5, 0.5, "between none and that of rigid rotors"),
            Free("damping_r", 8.8e-4, 8.8e-4, 8.8e-4, 8.8e-4, "2 (k_Q Omega) of both rotors"),
            Free("damping_w", 0.3, 0.3, 0.3, 0.3, "momentum theory in hover"),
            Free("inertia_zz", 1.4e-4, 2.7786e-4, 1.4e-4, source=_CARD),
            Free("tau_drive_upper", 0.09, 0.185, 0.09, source=_CARD),
            Free("tau_drive_lower", 0.06, 0.115, 0.06, source=_CARD),
        ),
        (*_PAPER_TIES, *_LINEAR_TIES),
        (("bar_heading_transport", 1.0),),
    ),
}
"""The coaxial helicopter's ready choices, by name."""


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


def choices_for(vehicle: Vehicle) -> Mapping[str, Choice]:
    """A vehicle's ready choices by name; a single-rotor helicopter's take their priors from its card.

    The prior of a parameter is the card's value with the card's sigma, or half the value where the card has none: a
    card of estimates with tolerances becomes one of measured values, as far as the flight can tell.
    """
    if vehicle.name == "coax":
        return CHOICES
    if vehicle.name != "conventional":
        return {}
    switched = [
        name for option, names in _WITH_OPTION.items() if vehicle.card.options.get(option, False) for name in names
    ]
    bar = [name for name in switched if name.startswith("bar_")]
    return {
        "rotor": Choice(
            "rotor",
            "what turns the rotor's answer to a stick: hub spring, blade inertia, wake distortion, stabilizer bar",
            tuple(Free(name, _tolerance(vehicle, name)) for name in (*_ROTOR, *bar)),
        ),
        "full": Choice(
            "full",
            "the rotor, lift slopes and drag of rotor, tail rotor and fuselage, and what the card's options add",
            tuple(_with_tolerance(vehicle, name) for name in (*_WHOLE, *switched)),
        ),
    }


def _tolerance(vehicle: Vehicle, name: str) -> float:
    entry = vehicle.card.parameters[name]
    return entry.sigma or 0.5 * abs(entry.value) or 1.0


def _with_tolerance(vehicle: Vehicle, name: str) -> Free:
    entry, sigma = vehicle.card.parameters[name], _tolerance(vehicle, name)
    source = "the card with its sigma" if entry.sigma else "the card, half its value"
    return Free(name, sigma, entry.value, sigma, source=source)
