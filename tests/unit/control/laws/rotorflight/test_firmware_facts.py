"""Rotorflight's own arithmetic, recorded: what its functions gave when they were compiled and called outside of here.

Sources of 4.6 (master, 2026): pidController in mode 3, mixerUpdate, govDataUpdate with govPIDControl, in single
precision at 1000 Hz, fed with the signals of these tests. Rotors spooled up, in the air.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sin

import numpy as np
import pytest

from swashplate.control.laws.rotorflight.mixers import (
    GOVERNOR,
    SATURATED,
    SWASHPLATES,
    commands_of,
    governed,
    limited,
)
from swashplate.control.laws.rotorflight.parameters import known
from swashplate.control.laws.rotorflight.pid import MEMORY, Deflections, pid_step

MORE = {
    "roll_d_gain": 30.0,
    "roll_b_gain": 20.0,
    "pitch_b_gain": 15.0,
    "yaw_b_gain": 25.0,
    "yaw_f_gain": 40.0,
    "cyclic_cross_coupling_ratio": 60.0,
    "pitch_collective_ff_gain": 30.0,
    "yaw_inertia_precomp_gain": 80.0,
}
GIVEN = {
    "defaults": ({}, -1.0),
    "every term": (MORE, -1.0),
    "counter-clockwise, no offset in pitch": ({**MORE, "error_decay_time_yaw": 30.0, "pitch_o_gain": 0.0}, 1.0),
}
"""Parameters, and the sense of the main rotor."""
FIRMWARE = {
    "defaults": {
        0: (-0.003277575, -0.02222232, 0.09188693, 0, -0.004011354, 0.00782911, 0.008887674, -0.01667273),
        399: (0.03163611, -0.07403001, -0.4881238, -0.1696648, 0, -3.584115, 6.280382, -7.250553),
        999: (0.4991395, 0.01132922, -0.2529875, 3.831707, 0, -3.385668, 7.434431, 0.2034008),
        1150: (0.4305019, -0.03849558, -0.06043267, 3.792191, 0, -0.5819979, 10.36392, -1.838077),
        1199: (0.3912923, -0.04625501, 0.03041464, 3.481786, -0.001580317, 0.1858178, 10.90399, -2.175497),
        1460: (0.3463492, -0.1894408, 0.04510579, 3.537425, -2.916857, 1.808989, 11.59651, -6.104889),
        1999: (0.4425573, -0.3491594, -0.4115047, 9.238005, -7.763557, -6.053566, 3.413359, -0.9976537),
    },
    "every term": {
        0: (-0.002834764, 0.003725434, 0.09219388, 0, -0.004011354, 0.00782911, 0.008887674, -0.01667273),
        399: (0.03169776, -0.02529267, -0.4984874, -0.1696648, 0, -3.584115, 6.280382, -7.250553),
        999: (0.4980969, 0.0421745, -0.2539317, 3.831707, 0, -3.385668, 7.434431, 0.2034008),
        1150: (0.4309932, -0.00350951, -0.04540046, 3.792191, 0, -0.5819979, 10.36392, -1.838077),
        1199: (0.3909533, -0.01288839, 0.05029887, 3.481786, -0.001580317, 0.1858178, 10.90399, -2.175497),
        1460: (0.3460863, -0.1747618, 0.0763579, 3.537425, -2.916857, 1.808989, 11.59651, -6.104889),
        1999: (0.4424487, -0.338139, -0.4414089, 9.238005, -7.763557, -6.053566, 3.413359, -0.9976537),
    },
    "counter-clockwise, no offset in pitch": {
        0: (0.004892909, 0.003753489, 0.2609851, 0, -0.006361119, 0.007826501, 0.008887674, -0.006229332),
        399: (0.02852379, -0.007137515, -0.04828766, -0.2458241, -1.404009, -3.340575, 6.671659, -2.337236),
        999: (0.5032489, 0.07399656, 0.1373852, 3.656944, 0.8198914, -2.171571, 7.888305, -0.5284626),
        1150: (0.4355786, 0.0004615039, 0.2473657, 3.586498, -0.004360473, 0.6698737, 10.76956, -0.3571249),
        1199: (0.3944806, -0.009719321, 0.3097993, 3.277053, -0.001852765, 1.420926, 11.27834, -0.1695487),
        1460: (0.3754768, -0.1610555, 0.1962759, 3.318618, -3.249396, 2.819665, 12.11071, -2.688946),
        1999: (0.4412891, -0.3433422, -0.3263812, 8.973328, -7.671487, -4.883742, 4.886499, -0.7376249),
    },
}
"""By step: commands of roll, pitch and yaw, accumulated errors of the three [deg], offsets of roll and pitch [deg]."""
MIXED = {
    "120": (-0.07498124, 0.453913, 0.08981824),
    "135": (-0.07498124, 0.5976914, 0.177271),
    "140": (-0.07498124, 0.5695286, 0.2054339),
    "90L": (0.2312312, 0.2102102),
    "90V": (0.3121462, 0.01486412),
    "thru": (0.2312312, 0.2102102, 0.3125),
}
"""Servos that the commands 1, 1.1 and -2 with a collective of 1.4 move at the mixer's rates of 250."""
GOVERNED = {
    0: (0.40204677, 0.0019843893, 6.2383566e-05),
    249: (0.1, 0.042749058, 0.057151821),
    999: (0.1, 0.042749058, 0.013460224),
    1499: (0.14353089, 0.055767987, 0.0309803),
    1749: (0.22364229, 0.077707432, 0.06458617),
    1999: (0.24424702, 0.10400515, 0.057251059),
}
"""By step: throttle, integral, feed-forward."""


def _flown(n: int) -> tuple[np.ndarray, np.ndarray, Deflections, float]:
    """Demands, gyro, mixer and head speed of a step: steps, saturation, and sines that no two axes share."""
    t = 1e-3 * n
    demand = [
        30.0 * sin(2.0 * pi * 1.3 * t),
        -20.0 * sin(2.0 * pi * 0.9 * t + 0.4),
        25.0 * sin(2.0 * pi * 0.7 * t + 1.0),
    ]
    gyro = [
        25.0 * sin(2.0 * pi * 1.3 * t - 0.5) + 3.0 * sin(2.0 * pi * 11.0 * t),
        -18.0 * sin(2.0 * pi * 0.9 * t) + 2.0 * sin(2.0 * pi * 9.0 * t),
        40.0 * sin(2.0 * pi * 0.7 * t + 0.6) + 4.0 * sin(2.0 * pi * 14.0 * t),
    ]
    demand[0] += 120.0 * (n > 900)
    demand[1] -= 90.0 * (n > 1400)
    gyro[0] += 110.0 * (n > 950)
    gyro[1] -= 80.0 * (n > 1450)
    cut = np.array([1.0 * (1100 < n < 1200), 1.0 * (1100 < n < 1200), 1.0 * (300 < n < 400)])
    mixed = Deflections(0.45 + 0.35 * sin(2.0 * pi * 0.4 * t), 0.1 + 0.05 * sin(2.0 * pi * 1.1 * t), cut)
    return np.array(demand), np.array(gyro), mixed, 1500.0 + 40.0 * sin(2.0 * pi * 0.5 * t)


def _ours(parameters: dict[str, float], sense: float) -> Iterator[tuple[int, np.ndarray]]:
    """By step: commands, accumulated errors, offsets."""
    k, memory = known(parameters), {name: np.zeros(size) for name, size in MEMORY.items()}
    for n in range(2000):
        demand, gyro, mixed, headspeed = _flown(n)
        commands, memory = pid_step(memory, gyro, demand, mixed, headspeed, k, sense, 1e-3, np)
        yield n, np.concatenate([commands, memory["error"], memory["offset"]])


@pytest.mark.parametrize("case", GIVEN)
def test_two_seconds_of_the_rate_controller_are_the_firmwares(case: str) -> None:
    found = dict(_ours(*GIVEN[case]))
    for step, recorded in FIRMWARE[case].items():
        np.testing.assert_allclose(found[step][:3], recorded[:3], atol=4e-6, err_msg=f"{case}, commands at {step}")
        np.testing.assert_allclose(found[step][3:], recorded[3:], atol=4e-5, err_msg=f"{case}, kept at {step}")


@pytest.mark.parametrize(
    "changed",
    [
        {"roll_p_gain": 51.0},
        {"pitch_i_gain": 101.0},
        {"pitch_d_gain": 41.0},
        {"roll_f_gain": 101.0},
        {"roll_o_gain": 51.0},
        {"yaw_cw_stop_gain": 121.0},
        {"cyclic_cross_coupling_gain": 60.0},
        {"yaw_collective_ff_gain": 61.0},
        {"roll_gyro_cutoff": 52.0},
        {"iterm_relax_level_roll": 42.0},
        {"offset_flood_relax_level": 10.0, "offset_flood_relax_cutoff": 1.0},
        {"error_decay_time_cyclic": 200.0},
    ],
)
def test_any_other_number_is_seen(changed: dict[str, float]) -> None:
    """The comparison is as fine as it says: one part in fifty of any term is more than it allows."""
    recorded = FIRMWARE["defaults"]
    steps = (np.abs(found[:3] - recorded[n][:3]).max() for n, found in _ours(changed, -1.0) if n in recorded)
    assert any(apart > 4e-6 for apart in steps)


@pytest.mark.parametrize("kind", MIXED)
def test_servos_of_a_swashplate(kind: str) -> None:
    commands, collective, cut = limited(np.array([1.0, 1.1, -2.0]), 1.4, 100.0, np)
    np.testing.assert_allclose(commands, (0.8408409, 0.924925, -1.25), rtol=1e-6)
    assert collective == 1.25
    np.testing.assert_array_equal(cut, 1.0)
    servos = SWASHPLATES[kind] @ (0.25 * np.array([*commands[:2], collective]))
    np.testing.assert_allclose(servos, MIXED[kind], atol=3e-7)
    back = commands_of(kind, servos) / 0.25
    moved = 3 if SWASHPLATES[kind].any(axis=0)[2] else 2
    np.testing.assert_allclose(back[:moved], [*commands[:2], collective][:moved], atol=1e-6)


@pytest.mark.parametrize(
    ("commands", "ring", "expected", "cut"),
    [
        ((0.3, -0.2, 0.4), 100.0, (0.3, -0.2, 0.4), (0.0, 0.0, 0.0)),
        ((1.0, 1.1, 0.2), 40.0, (1.0, 1.1, 0.2), (0.0, 0.0, 0.0)),
        ((-1.6, 0.2, 0.1), 0.0, (-1.25, 0.2, 0.1), (1.0, 0.0, 0.0)),
    ],
)
def test_limits_and_the_ring_of_the_cyclic(
    commands: tuple[float, ...], ring: float, expected: tuple[float, ...], cut: tuple[float, ...]
) -> None:
    found, _, which = limited(np.array(commands), 0.3, ring, np)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_array_equal(which, cut)
    assert SATURATED == 5.0


def test_the_governor() -> None:
    k = known({"gov_headspeed": 1500.0, "gov_d_gain": 20.0, "gov_f_gain": 60.0})
    memory = {name: np.zeros(size) for name, size in GOVERNOR.items()}
    for n in range(2000):
        t, after = 1e-3 * n, {}
        throttle = governed(
            memory,
            after,
            1480.0 + 60.0 * sin(2.0 * pi * 0.4 * t),
            np.array([0.0, 0.0, -0.3 + 0.1 * sin(2.0 * pi * 0.9 * t)]),
            0.4 + 0.3 * sin(2.0 * pi * 0.7 * t),
            0.1 + 0.05 * sin(2.0 * pi * t),
            k,
            1e-3,
            np,
        )
        memory = after
        if n in GOVERNED:
            told = (throttle, memory["rpm_sum"][0], memory["load"][0])
            np.testing.assert_allclose(told, GOVERNED[n], rtol=2e-5, atol=1e-6, err_msg=str(n))
