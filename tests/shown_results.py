"""One of each result that shows itself beside fits and flights; numbers of autopilots are typed in, only drawn here."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.signal import lfilter

import swashplate as sp
from swashplate.api.autopilot_gains import AutopilotGains
from swashplate.api.check_autopilot import AutopilotCheck
from swashplate.api.designed_maneuver import DesignedManeuver, Offer
from swashplate.control.analysis.cascade_gains import LoopWorth
from swashplate.control.analysis.rate_loop_steps import rate_loop_steps
from swashplate.flights.conditioning.reconstruction import reconstruct
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.planned import plan_maneuver
from swashplate.flights.maneuvers.series import parse as maneuver
from swashplate.identification.time.equation_error import equation_error


def shaken() -> Flight:
    """A gyro beside a rotor that turns at 25 Hz and shakes it twice a turn."""
    time = np.arange(4000) / 200.0
    p = 0.1 * np.sin(2.0 * np.pi * 50.0 * time) + 0.01 * np.random.default_rng(1).standard_normal(time.size)
    turning = np.full(time.size, 50.0 * np.pi) + 0.1 * np.sin(time)
    return Flight.from_arrays(time, {"p": p, "omega_rotor": turning}, source="shaken.csv")


def reconstruction() -> Any:
    """Of a gyro whose p has a bias of 0.02 rad/s."""
    time = np.arange(3000) / 100.0
    angles = {name: 0.3 * np.sin(rate * time) for name, rate in (("phi", 1.1), ("theta", 0.9), ("psi", 0.5))}
    phi, theta = angles["phi"], angles["theta"]
    dphi, dtheta, dpsi = (0.3 * rate * np.cos(rate * time) for rate in (1.1, 0.9, 0.5))
    rates = {
        "p": dphi - dpsi * np.sin(theta) + 0.02,
        "q": dtheta * np.cos(phi) + dpsi * np.cos(theta) * np.sin(phi),
        "r": -dtheta * np.sin(phi) + dpsi * np.cos(theta) * np.cos(phi),
    }
    noise = np.random.default_rng(4)
    noisy = {name: values + 0.003 * noise.standard_normal(time.size) for name, values in rates.items()}
    return reconstruct(Flight.from_arrays(time, {**angles, **noisy}, source="turned.csv"))


def sweep() -> Flight:
    """Two channels that answer two commands of noise."""
    rng = np.random.default_rng(3)
    u = rng.standard_normal((2, 3000))
    p = lfilter([0.1], [1, -0.9], u[0]) + 0.1 * rng.standard_normal(3000)
    q = lfilter([0.2], [1, -0.8], u[1]) + 0.1 * rng.standard_normal(3000)
    channels = {"servo_roll": u[0], "servo_pitch": u[1], "p": p, "q": q}
    return Flight.from_arrays(np.arange(3000) / 50.0, channels, source="sweep.csv")


def responses() -> Any:
    return sp.respond(sweep(), inputs=["servo_roll", "servo_pitch"], outputs=["p", "q"])


def equation() -> Any:
    rng = np.random.default_rng(2)
    x = rng.standard_normal((200, 2))
    return equation_error(x @ [2.0, -0.5] + 0.1 * rng.standard_normal(200), x, ["Lp", "Lv"])


def steps() -> Any:
    model = sp.fit_transfer_function(responses(), "0/1", input="servo_roll", outputs=["p"]).model
    return rate_loop_steps(model, {"P": 0.1, "FF": 0.2}, rate="p", command="servo_roll")


def designed() -> DesignedManeuver:
    names = ("tau_f_upper", "linkage_lower")
    pieces = tuple(maneuver(f"sweep:{axis},0.8-8Hz,5s,0.2") for axis in ("roll", "pitch"))
    peaks = {"attitude": 9.0, "rate": 80.0, "place": 0.9}
    bounds = {"tau_f_upper": 0.1, "linkage_lower": 0.001}
    limits = {"attitude": 20.0, "rate": 120.0, "place": 3.0, "seconds": 10.0}
    offer = Offer("sweep", pieces, 10.0, bounds, peaks)
    return DesignedManeuver(
        sp.vehicle("coax"), names, (offer,), ((10.0, bounds),), limits, "D", "average", 5, 0.3, 100.0
    )  # fmt: skip


def gains() -> AutopilotGains:
    loops = tuple(LoopWorth(name, 8.0, 50.0, 0.02, 9.0, 14.0, 3.0, 1.6) for name in ("roll rate", "pitch rate"))
    law = SimpleNamespace(rate=400.0, vehicle="coax")
    found = SimpleNamespace(law=law, loops=loops, stabilize=loops, problems=("too little.",))
    return AutopilotGains("ardupilot", "coax", found, {"P": 0.1}, ("P",), (), "5 ms")  # type: ignore[arg-type]


def autopilot() -> AutopilotCheck:
    return AutopilotCheck(
        "ardupilot", "tcp:1", (), {}, ("no GPS",), (), False, False, (1.0, 0.01), ("it refuses to arm.",)
    )


MAKE = {
    "spectrum": lambda: sp.spectrum(shaken(), "p"),
    "spectrogram": lambda: sp.spectrogram(shaken(), "p"),
    "harmonics": lambda: sp.harmonics(shaken(), "p"),
    "reconstruction": reconstruction,
    "equation error": equation,
    "planned maneuver": lambda: plan_maneuver("sweep:pitch,0.5-8Hz,20s,0.1"),
    "designed maneuver": designed,
    "autopilot's gains": gains,
    "steps of a rate loop": steps,
}
