"""Roll and pitch sweeps of a helicopter with what a model of its rotor lacks: lags, coupling, jitter, lasting gusts.

Every flight is drawn: actuators of second order at 80 to 140 rad/s, gyro filters at 40 to 80 Hz, cross controls of
up to 3 %, commands that are held and arrive 2 ms early or late. Integrated exactly at 1 kHz; half a millisecond of a
careless step would be ten standard deviations of a delay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.flights.provenance import Provenance

INPUTS = ("mixer_roll", "mixer_pitch")
TRUTH = {
    "Lb": 900.0, "Ma": 350.0, "tau_f": 0.06, "Ba": 0.0, "Ab": 0.0, "Blat": 0.2, "Blon": 0.0, "Alat": 0.0, "Alon": 0.18,
    "tau_roll": 0.02, "tau_pitch": 0.025,
}  # fmt: skip
GUST = {"p": 1.5, "q": 0.8}
"""Angular acceleration by the air's speed [rad/(s m)]; the air wanders for 1.5 s."""
FADE, DAMPING, NOISE, LOOP, SIZE = 1.5, 0.7, 0.01, 0.03, 0.15
"""Gust's time [s], actuators' damping, gyro noise [rad/s], feedback of the rates [s/rad], amplitude of a sweep."""
STEP, EVERY = 0.001, 10
JITTER = 2


def flights(seeds: Sequence[int], axis: str, *, gust: float, lacking: bool, seconds: float = 24.0) -> list[Flight]:
    """A sweep in a weak loop of rates, for each seed.

    Args:
        seeds: of what is drawn. axis: the swept input. gust: of the air [m/s]. seconds: length.
        lacking: with lags, coupling and jitter, and held commands; otherwise straight lines between samples.
    """
    n, own = len(seeds), INPUTS.index(axis)
    random = [np.random.default_rng([seed, own]) for seed in seeds]
    phi, first, change = map(np.array, zip(*(_discrete(_world(seed), lacking) for seed in seeds), strict=True))
    count = round(seconds / STEP / EVERY)
    time = np.arange(count) * STEP * EVERY
    sweep = Maneuver("sweep", (axis,), seconds - 6.0, SIZE, (0.2, 6.0)).signals(time - 3.0)[axis]
    mixing = np.array([0.15 * r.standard_normal() for r in random])
    noise = NOISE * np.stack([r.standard_normal((count, 2)) for r in random], axis=1)
    late = np.rint(np.array([TRUTH["tau_roll"], TRUTH["tau_pitch"]]) / STEP).astype(int)
    jitter = np.stack([r.integers(-JITTER, JITTER, (count, 2), endpoint=True) for r in random], axis=1) * lacking
    keep = np.exp(-STEP / FADE)
    x, air, before = np.zeros((n, phi.shape[1])), np.zeros((n, 2)), np.zeros((n, 2))
    history, columns = np.zeros((400, n, 2)), (np.arange(n)[:, None], np.arange(2)[None])
    commands, rates = np.zeros((count, n, 2)), np.zeros((count, n, 2))
    for i in range(count):
        rates[i] = x[:, 8:] + noise[i] if lacking else x[:, :2] + noise[i]
        commands[i] = -LOOP * rates[i]
        commands[i, :, own] += sweep[i]
        commands[i, :, 1 - own] += mixing * sweep[i]
        if lacking:
            history[(i * EVERY + np.arange(EVERY)) % 400] = commands[i]
        else:
            for j in range(1, EVERY + 1):
                history[((i - 1) * EVERY + j) % 400] = before + (commands[i] - before) * j / EVERY
        before = commands[i]
        kicks = gust * np.sqrt(1.0 - keep**2) * np.stack([r.standard_normal((EVERY, 2)) for r in random], axis=1)
        for j in range(EVERY):
            at = i * EVERY + j - late - jitter[i]
            now = history[(at % 400, *columns)]
            after = now if lacking else history[((at + 1) % 400, *columns)]
            blown = keep * air + kicks[j]
            acting, next_ = np.hstack([now, air]), np.hstack([after, blown])
            x = np.einsum("nij,nj->ni", phi, x) + np.einsum("nij,nj->ni", first, acting)
            x = x + np.einsum("nij,nj->ni", change, next_ - acting)
            air = blown
    made = []
    for f, seed in enumerate(seeds):
        table = {"p": rates[:, f, 0], "q": rates[:, f, 1], "sweep": sweep}
        table |= {name: commands[:, f, j] for j, name in enumerate(INPUTS)}
        source = Provenance(source=f"{axis} {seed}", simulated=True)
        made.append(Flight({"uniform": stream(time, table, dict.fromkeys((*INPUTS, "sweep"), "1"))}, source))
    return made


def truth(seed: int, *, lacking: bool) -> dict[str, float]:
    """What a model without lags has to find: its delays hold those of the actuator, the gyro and half a hold."""
    world = _world(seed)
    late = 2.0 * DAMPING / world["actuator"] + 1.0 / world["gyro"] + 0.5 * STEP * EVERY if lacking else 0.0
    return TRUTH | {"tau_roll": TRUTH["tau_roll"] + late, "tau_pitch": TRUTH["tau_pitch"] + late}


def _world(seed: int) -> Mapping[str, float]:
    random = np.random.default_rng([seed, 5])
    return {
        "actuator": random.uniform(80.0, 140.0),
        "gyro": 2.0 * np.pi * random.uniform(40.0, 80.0),
        "cross": random.uniform(-0.03, 0.03),
    }


def _discrete(world: Mapping[str, float], lacking: bool) -> tuple[Array, Array, Array]:
    """Transition, and what inputs and their change add; p q b a, two actuators, two gyros; two controls, air."""
    size = 10 if lacking else 4
    a, b = np.zeros((size, size)), np.zeros((size, 4))
    a[0, 2], a[1, 3], b[0, 2], b[1, 3] = TRUTH["Lb"], TRUTH["Ma"], GUST["p"], GUST["q"]
    a[2, [0, 2]], a[3, [1, 3]] = (-1.0, -1.0 / TRUTH["tau_f"]), (-1.0, -1.0 / TRUTH["tau_f"])
    push = np.diag([TRUTH["Blat"], TRUTH["Alon"]]) / TRUTH["tau_f"]
    if lacking:
        fast, cross, slow = world["actuator"], world["cross"], world["gyro"]
        a[2:4, [4, 6]] = push @ np.array([[1.0, cross], [cross, 1.0]])
        for j in (0, 1):
            place, speed = 4 + 2 * j, 5 + 2 * j
            a[place, speed], a[speed, place], a[speed, speed] = 1.0, -(fast**2), -2.0 * DAMPING * fast
            b[speed, j], a[8 + j, j], a[8 + j, 8 + j] = fast**2, slow, -slow
    else:
        b[2:4, :2] = push
    block = np.zeros((size + 8, size + 8))
    block[:size, :size], block[:size, size : size + 4], block[size : size + 4, size + 4 :] = a, b, np.eye(4) / STEP
    step = expm(block * STEP)
    return step[:size, :size], step[:size, size : size + 4], step[:size, size + 4 :]
