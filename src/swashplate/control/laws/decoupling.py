"""Decoupling of the cyclic axes: the inverse of the lower rotor's own equations (Fankhauser et al., eqs 19 to 22).

The rotor answers the servos turned by its phase lag D, and speed tilts its disc across the motion. The law turns the
commands back by an estimate of D and adds what cancels the tilt across, so that a pilot's (roll, pitch) leans the
aircraft to the right and forward and nowhere else. It inverts the model's form of eqs 13 and 14 ("rotation"); the
paper's (19), (20) invert them as printed ("as_printed"). A law of one form on a rotor of the other steers wrong.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.drive_train import steady_speed
from swashplate.physics.stabilizer_bar import phase_lag
from swashplate.simulation.trim import Trim

Lag = Literal["hover", "motor", "battery"]
LAGS: tuple[Lag, ...] = ("hover", "motor", "battery")
"""Where D comes from: the hover's rotor speed (constant), the motor command, the same with the battery (eqs 21, 22)."""

_SMALL = 1e-9
_FROM_SINGULAR = math.radians(5.0)
"""The printed pair cannot be inverted at a lag of 45 deg; this far from it its commands have grown six times."""


class Decoupler(NamedTuple):
    """Numbers of the law; which lag it uses is in them (`k_zeta` = 0: a constant).

    D = k_zeta (k_drive motor_lower + o_drive + k_voltage (U - voltage_nominal)) + o_zeta      (eqs 21, 22)

    Attributes:
        linkage: tilt of the disc per unit of servo [rad].
        mixing: +1 for a rotor that turns commands, -1 for the pair as printed.
        k_zeta, o_zeta: lag over rotor speed [s] and at zero speed [rad].
        k_drive, o_drive, k_voltage, voltage_nominal: the lower rotor's speed (eq. 22).
        across_u, across_v: roll tilt per u |u|, pitch tilt per v |v| [rad s^2/m^2].
        across_u_linear, across_v_linear: the same per speed [rad s/m].
        linkage_asymmetry, phase_asymmetry: how the servos differ [1, rad] (`physics.swashplate.swashplate_tilt`).
    """

    linkage: float
    mixing: float
    k_zeta: float
    o_zeta: float
    k_drive: float
    o_drive: float
    k_voltage: float
    voltage_nominal: float
    across_u: float
    across_v: float
    across_u_linear: float
    across_v_linear: float
    linkage_asymmetry: float = 0.0
    phase_asymmetry: float = 0.0


class ServoCommands(NamedTuple):
    """Servo commands, and the part 0 to 1 of the wanted command that fitted into their limits."""

    roll: Scalar
    pitch: Scalar
    kept: Scalar


def decoupler(
    vehicle: Vehicle,
    trim: Trim,
    *,
    lag: Lag | float = "battery",
    speed: bool = True,
    mixing: Literal["rotation", "as_printed"] | None = None,
) -> Decoupler:
    """The law for a coaxial helicopter's card, published or identified.

    Args:
        vehicle: whose lower rotor is to be inverted.
        trim: the hover; with lag "hover" its rotor speed gives D, payload and battery included.
        lag: one of `LAGS`, or a constant [rad].
        speed: False leaves out the terms in u and v, for an aircraft that does not know its speed.
        mixing: the form to invert, the vehicle's own where it is not given.

    Raises:
        SwashError: where the card lacks a number that the law needs, the lag is not known, or the printed pair is
            asked for within 5 deg of the lag of 45 deg where it has no inverse.
    """
    card = vehicle.card.values()
    wanted = ["linkage_lower", "k_zeta_lower", "o_zeta_lower", "k_drive_lower", "o_drive_lower", "k_drive_voltage"]
    wanted += ["voltage_nominal", "a_alpha_u", "a_beta_v", "a_alpha_u_linear", "a_beta_v_linear"]
    missing = [name for name in wanted if name not in card]
    if missing:
        raise SwashError(
            f"lacks {', '.join(missing)}, which the decoupling of a coaxial helicopter's lower rotor needs.",
            where=vehicle.card.path or vehicle.name,
            hint="For other helicopters decouple a linear model.",
        )
    if abs(card["linkage_lower"]) < _SMALL:
        raise SwashError("is zero: no servo moves the disc.", where=vehicle.card.path, channel="linkage_lower")
    form = mixing or vehicle.card.options.get("mixing", "rotation")
    k_zeta, k_voltage = card["k_zeta_lower"], card["k_drive_voltage"]
    hover = phase_lag(k_zeta, card["o_zeta_lower"], trim.states()["omega_lower"])
    o_zeta = card["o_zeta_lower"]
    if lag == "hover":
        k_zeta, o_zeta = 0.0, hover
    elif lag == "motor":
        k_voltage = 0.0
    elif not isinstance(lag, str):
        k_zeta, o_zeta = 0.0, float(lag)
        hover = o_zeta
    elif lag != "battery":
        raise SwashError(f"is '{lag}', expected {', '.join(LAGS)} or a number.", channel="lag")
    if form == "as_printed" and abs(abs(hover) - math.pi / 4.0) < _FROM_SINGULAR:
        raise SwashError(
            f"{math.degrees(hover):.1f} deg; the printed equations (13), (14) have no inverse at 45 deg.",
            where=vehicle.card.path,
            channel="lag",
            hint="Use mixing = 'rotation'.",
        )
    counted = 1.0 if speed else 0.0
    return Decoupler(
        linkage=card["linkage_lower"],
        mixing=-1.0 if form == "as_printed" else 1.0,
        k_zeta=k_zeta,
        o_zeta=float(o_zeta),
        k_drive=card["k_drive_lower"],
        o_drive=card["o_drive_lower"],
        k_voltage=k_voltage,
        voltage_nominal=card["voltage_nominal"],
        across_u=counted * card["a_alpha_u"],
        across_v=counted * card["a_beta_v"],
        across_u_linear=counted * card["a_alpha_u_linear"],
        across_v_linear=counted * card["a_beta_v_linear"],
        linkage_asymmetry=card.get("linkage_asymmetry_lower", 0.0),
        phase_asymmetry=card.get("phase_asymmetry_lower", 0.0),
    )


def estimated_lag(law: Named, motor_lower: Scalar, voltage: Scalar) -> Scalar:
    """The phase lag that the law believes in [rad] (eqs 21, 22)."""
    omega = steady_speed(
        motor_lower, voltage, k=law.k_drive, o=law.o_drive, k_voltage=law.k_voltage, nominal=law.voltage_nominal
    )
    return phase_lag(law.k_zeta, law.o_zeta, omega)


def decouple(
    law: Named, roll: Scalar, pitch: Scalar, *, u: Scalar, v: Scalar, motor_lower: Scalar, voltage: Scalar, xp: Backend
) -> tuple[Scalar, Scalar]:
    """Servo commands without limits for wanted (roll, pitch), each -1 to 1 (eqs 19, 20, solved).

    Args:
        law: a `Decoupler`.
        roll, pitch: the transformed inputs, right and nose down positive.
        u, v: body velocity through the air, measured or estimated [m/s].
        motor_lower: the lower motor's command [0 to 1].
        voltage: the battery's [V].
        xp: the operations.

    The disc's steady tilt across the motion is -(across u) in alpha and (across v) in beta (eqs 13, 14). The disc is
    asked for alpha = linkage roll + across u and beta = -linkage pitch + across v; then the mixing is inverted:
    alpha = linkage (s1 c1 + m s2 s2'), beta = linkage (s1 s1' - s2 c2) with c1, s1' of the roll servo's lag and c2, s2'
    of the pitch servo's, which are the same without asymmetry; the determinant is -linkage^2 (c1 c2 + m s1' s2').
    """
    lag = estimated_lag(law, motor_lower, voltage)
    of_roll, of_pitch = lag + law.phase_asymmetry, lag - law.phase_asymmetry
    c1, s1, c2, s2 = xp.cos(of_roll), xp.sin(of_roll), xp.cos(of_pitch), xp.sin(of_pitch)
    alpha = roll + (law.across_u * u * xp.abs(u) + law.across_u_linear * u) / law.linkage
    beta = -pitch + (law.across_v * v * xp.abs(v) + law.across_v_linear * v) / law.linkage
    scale = c1 * c2 + law.mixing * s1 * s2
    return (
        (c2 * alpha + law.mixing * s2 * beta) / (scale * (1.0 + law.linkage_asymmetry)),
        (s1 * alpha - c1 * beta) / (scale * (1.0 - law.linkage_asymmetry)),
    )


def fit_into_limits(
    wanted: tuple[Scalar, Scalar],
    held: tuple[Scalar, Scalar],
    *,
    lower: tuple[Scalar, Scalar],
    upper: tuple[Scalar, Scalar],
    xp: Backend,
) -> ServoCommands:
    """A command that keeps its direction when it does not fit.

    Args:
        wanted: the servo commands.
        held: their part that no pilot asked for (trim, cancellation of speed); kept first, and shortened on its own
            only where it alone does not fit.
        lower, upper: limits of (roll, pitch).
        xp: the operations.

    Clipping each servo by itself would turn the command and couple the axes again.
    """
    origin = tuple(0.5 * (low + high) for low, high in zip(lower, upper, strict=True))
    share = _share(origin, tuple(h - o for h, o in zip(held, origin, strict=True)), lower, upper, xp)
    base = tuple(o + share * (h - o) for h, o in zip(held, origin, strict=True))
    added = tuple(w - h for w, h in zip(wanted, held, strict=True))
    kept = _share(base, added, lower, upper, xp)
    return ServoCommands(base[0] + kept * added[0], base[1] + kept * added[1], kept)


def _share(base: Any, added: Any, lower: Any, upper: Any, xp: Backend) -> Scalar:
    """The largest share 0 to 1 of `added` that fits on top of `base`."""
    share: Scalar = 1.0
    for b, a, low, high in zip(base, added, lower, upper, strict=True):
        room = xp.maximum(xp.where(a > 0.0, high - b, b - low), 0.0)
        share = xp.minimum(share, room / xp.maximum(xp.abs(a), _SMALL))
    return share
