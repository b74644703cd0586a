"""Commands that reach the vehicle late and trimmed."""

from __future__ import annotations

import numpy as np

from swashplate.filtering.nuisance import Nuisance, commands_moved
from swashplate.models.catalogue import vehicle

COAX = vehicle("coax")
DT = 0.01


INPUTS = np.random.default_rng(5).standard_normal((40, 4))


def _commands(nuisance: Nuisance, inputs: np.ndarray = INPUTS) -> np.ndarray:
    return commands_moved(COAX, DT, inputs, nuisance)[0]


def test_commands_on_time_are_the_logged_ones() -> None:
    np.testing.assert_allclose(_commands(Nuisance()), INPUTS, atol=1e-14)


def test_whole_samples_of_delay_shift_servos_and_motors_each_by_their_own() -> None:
    late = _commands(Nuisance(delay_servo=3 * DT, delay_motor=5 * DT))
    np.testing.assert_allclose(late[5:, :2], INPUTS[:-5, :2], atol=1e-12)
    np.testing.assert_allclose(late[3:, 2:], INPUTS[:-3, 2:], atol=1e-12)
    np.testing.assert_allclose(late[:5, :2], np.tile(INPUTS[0, :2], (5, 1)), atol=1e-12)  # before the log: its first


def test_a_delay_between_samples_follows_a_smooth_command() -> None:
    time = DT * np.arange(40)
    smooth = np.sin(2 * np.pi * 3.0 * time)[:, None] * np.ones(4)
    late = _commands(Nuisance(delay_servo=0.0234), smooth)
    np.testing.assert_allclose(late[5:-3, 2], np.sin(2 * np.pi * 3.0 * (time - 0.0234))[5:-3], atol=2e-3)


def test_the_cost_of_a_delay_has_no_kink() -> None:
    """The slope of a late command by its delay is continuous across a whole sample."""

    before, after = (
        commands_moved(COAX, DT, INPUTS, Nuisance(delay_servo=2 * DT + side))[1][:, 2] for side in (-1e-9, 1e-9)
    )
    np.testing.assert_allclose(before[3:], after[3:], atol=1e-3)
    assert np.abs(before).max() > 100.0


def test_trims_are_added_to_their_own_command() -> None:
    names = COAX.input_names
    for i, name in enumerate(names):
        trimmed = _commands(Nuisance(**{f"trim_{name}": 0.03}))
        np.testing.assert_allclose(trimmed - INPUTS, np.tile(0.03 * np.eye(4)[i], (40, 1)), atol=1e-15)


def test_slopes_by_a_delay_are_those_of_the_commands() -> None:
    late, step = Nuisance(delay_servo=0.034, delay_motor=0.0617, trim_servo_roll=0.01), 1e-6
    _, slope = commands_moved(COAX, DT, INPUTS, late)
    sides = [
        _commands(late._replace(delay_servo=late.delay_servo + side, delay_motor=late.delay_motor + side))
        for side in (step, -step)
    ]
    np.testing.assert_allclose(slope, (sides[0] - sides[1]) / (2.0 * step), rtol=1e-6, atol=1e-5)
