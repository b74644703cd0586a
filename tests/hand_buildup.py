"""Stability and control derivatives of a single-rotor helicopter from closed forms, contributor by contributor.

The build-up of Bhandari et al. (2005), sec. IV: each derivative from geometry, aerodynamics and mass, without numerical
or automatic differentiation. Their eq. 8, X_u = -rho A_b (Omega R)^2 d(C_H/sigma)/da1 da1/du, is one product of many
here: all couplings, the wake's gradient and distortion and the profile drag are kept, in hover and in forward flight.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from hand_buildup_airframe import (
    Wake,
    fin_slopes,
    fuselage_slopes,
    tail_rotor_slopes,
    tailplane_slopes,
)
from hand_buildup_main_rotor import main_rotor_slopes
from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import DerivativeTable
from swashplate.models.conventional.helicopter import HelicopterState
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import local_to_body

_XP = FloatBackend()


def build_up(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> DerivativeTable:
    """All derivatives of forces and moments about a steady flight.

    Args:
        vehicle: a conventional helicopter with inflow "glauert" or "uniform" and no aerodynamic phase lag.
        x, u: state and input rows of a trim; bar, servos, gyro and rotor speed stay as they are there.
        environment: wind and air.

    Raises:
        SwashError: for another vehicle or other options.
    """
    options = (
        getattr(vehicle.derivatives, "keywords", {}).get("options")
        if isinstance(vehicle.derivatives, partial)
        else None
    )
    if not isinstance(options, HelicopterOptions):
        raise SwashError(
            "has no build-up of its derivatives.", where=vehicle.name, hint="It needs a single-rotor card."
        )
    if options.inflow not in ("glauert", "uniform") or options.phase_lag:
        raise SwashError(
            f"inflow '{options.inflow}' or a phase lag has no closed-form build-up.",
            where=vehicle.name,
            hint="Use inflow 'glauert' or 'uniform', or automatic differentiation.",
        )
    without = {
        "delta3 or stabilator": options.delta3 or options.stabilator,
        "tip_loss, induced_factor or ground_effect": options.tip_loss
        or options.induced_factor
        or options.ground_effect != "none",
        "tail rotors in the main rotor's wake": options.tail_in_wake,
        "fuselages in cross flow": options.cross_flow,
    }
    for words, chosen in without.items():
        if chosen:
            raise SwashError(
                f"{words} have no closed-form build-up.",
                where=vehicle.name,
                hint="Leave these options out, or use automatic differentiation.",
            )
    state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
    par, density = vehicle.values(), float(environment.air_density)
    body = state.body
    air = body.velocity + local_to_body(environment.wind, body.attitude, _XP).scaled(-1.0)
    omega = par.rotor_speed if state.rotor is None else state.rotor.omega
    sticks = state.servos if state.servos is not None else tuple(float(value) for value in u[:4])
    theta0, B1, A1, theta0T = sticks
    if state.bar is not None:
        A1, B1 = A1 + par.bar_gain * state.bar.d, B1 - par.bar_gain * state.bar.c
    if state.gyro is not None:
        theta0T = theta0T + options.sense * par.gyro_gain * state.gyro.r_gyro
    rotor, tilt, main, main_change = main_rotor_slopes(
        air, body.rates, state.disc, (theta0, A1, B1), omega, par, density, options
    )
    tail, tail_induced, tail_change = tail_rotor_slopes(air, body.rates, theta0T, omega, par, density, options)
    wake = Wake(main, main_change, tail_induced, tail_change)
    parts = {
        "main_rotor": rotor,
        "tail_rotor": tail,
        "tailplane": tailplane_slopes(air, body.rates, wake, par, density),
        "fin": fin_slopes(air, body.rates, wake, par, density, options),
        "fuselage": fuselage_slopes(air, wake, par, density),
    }
    scale = np.array([par.mass] * 3 + [par.inertia_xx, par.inertia_yy, par.inertia_zz])[:, None]
    return DerivativeTable({name: part / scale for name, part in parts.items()}, tilt, "build-up")
