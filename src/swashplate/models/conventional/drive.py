"""What moves blades and shaft of a helicopter with collective pitch: delays and servos, governor and engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from swashplate.physics import actuators, engine
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.engine import EngineLag, RotorSpeed


def delayed_commands(states: Named, commands: Named, delay: Scalar) -> tuple[Any, Any]:
    """Rates of the delays' states, and what comes out of them.

    Args:
        states: a named tuple, the places of all commands and then their rates (`actuators.delayed`).
        commands: a named tuple of as many as there are places.
        delay: [s].
    """
    count = len(commands)
    places, moving = states[:count], states[count:]
    rates = [actuators.delay_rates(*each, delay=delay) for each in zip(places, moving, commands, strict=True)]
    out = type(commands)(*(actuators.delayed(*each, delay=delay) for each in zip(places, moving, strict=True)))
    return type(states)(*(rate for rate, _ in rates), *(change for _, change in rates)), out


def servo_rates(
    positions: Named, commands: Named, stops: Sequence[tuple[Scalar, Scalar]], par: Named, xp: Backend
) -> Any:
    """Rates of servos [rad/s] towards their commands, within the card's speed and each one's stops."""
    return type(positions)(
        *(
            actuators.servo_rate(
                at, to, time_constant=par.servo_time, fastest=par.servo_speed, low=low, high=high, xp=xp
            )
            for at, to, (low, high) in zip(positions, commands, stops, strict=True)
        )
    )


def shaft_rates(
    rotor: RotorSpeed, lag: EngineLag | None, load: Scalar, throttle: Scalar, par: Named, xp: Backend
) -> tuple[RotorSpeed, EngineLag | None]:
    """Rates of rotor speed, governor and the engine's lag (None without one) under a load at the shaft [N m]."""
    share = throttle * engine.wanted_share(rotor, wanted=par.rotor_speed, gain=par.governor_gain, xp=xp)
    following = None
    if lag is not None:
        following = EngineLag((share - lag.share) / par.engine_time)
        share = lag.share
    torque = engine.engine_torque(rotor, share, wanted=par.rotor_speed, power=par.engine_power, xp=xp)
    turning = engine.rotor_speed_rates(
        rotor,
        torque,
        load,
        throttle,
        wanted=par.rotor_speed,
        inertia=par.rotor_inertia,
        gain=par.governor_gain,
        integral_gain=par.governor_integral,
        xp=xp,
    )
    return turning, following
