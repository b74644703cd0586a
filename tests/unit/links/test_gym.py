"""Gymnasium environments: accepted by Gymnasium's checker, reproducible to the bit, one and many alike, flyable."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import SwashError

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'rl' is not installed")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from swashplate.links.gym.environment import HelicopterEnv  # noqa: E402
from swashplate.links.gym.flying import CRASH, LIMITS, OBSERVED  # noqa: E402
from swashplate.links.gym.tasks import TARGET, hover, sweep, trajectory  # noqa: E402
from swashplate.links.gym.vector import HelicopterVectorEnv  # noqa: E402

TASKS = ("Hover", "Trajectory", "Sweep")


def pd_policy(seen: np.ndarray) -> np.ndarray:
    """Lean towards the place, damp the rates: what a student tries first, for the CoaX."""
    ahead, right, below, du, dv, dw, roll, pitch, heading, p, q, r = seen
    climb, turn = -0.6 * below - 0.6 * dw, 0.3 * heading - 0.2 * r
    nose_up = 1.5 * (pitch - np.clip(0.15 * ahead + 0.25 * du, -0.3, 0.3)) - 0.15 * q
    to_right = 1.5 * (roll + np.clip(0.15 * right + 0.25 * dv, -0.3, 0.3)) - 0.15 * p
    return np.clip([climb - turn, climb + turn, to_right, -nose_up], -1.0, 1.0).astype(np.float32)


def flown(env: Any, policy: Any, *, seed: int) -> tuple[list[np.ndarray], list[float], bool]:
    """Observations, rewards and whether the episode was cut short."""
    seen, _ = env.reset(seed=seed)
    observations, rewards = [seen], []
    while True:
        seen, reward, lost, ended, _ = env.step(policy(seen))
        observations.append(seen)
        rewards.append(reward)
        if lost or ended:
            return observations, rewards, lost


@pytest.mark.parametrize("name", TASKS)
def test_gymnasium_accepts_it(name: str) -> None:
    env = gymnasium.make(f"swashplate/{name}-v0", vehicle="coax")
    check_env(env.unwrapped)
    assert env.observation_space.shape == (len(OBSERVED),)
    assert env.action_space.shape == (4,)


@pytest.mark.proof
def test_a_single_rotor_helicopter_too_and_its_governed_throttle_is_no_action() -> None:
    env = HelicopterEnv(sp.vehicle("raptor50", rotor_speed="throttle"), "hover", task_options={"duration": 0.2})
    check_env(env, skip_render_check=True)
    assert env.action_space.shape == (4,)
    assert "omega" in env.state


@pytest.mark.parametrize(("name", "least"), [("Hover", 0.9), ("Trajectory", 0.2), ("Sweep", 0.4)])
def test_a_pd_policy_flies_each_task_and_doing_nothing_does_not(name: str, least: float) -> None:
    env = gymnasium.make(f"swashplate/{name}-v0", vehicle="coax")
    _, rewards, lost = flown(env, pd_policy, seed=0)
    assert not lost
    assert len(rewards) == env.unwrapped.flying.steps
    assert np.mean(rewards) > least
    _, idle, _ = flown(env, lambda seen: np.zeros(4, np.float32), seed=0)
    assert np.mean(idle) < 0.5 * np.mean(rewards)
    assert np.max(np.r_[rewards, idle]) <= 1.0


def test_it_is_drawn_alone_and_as_many() -> None:
    """Without a mode nothing is drawn; with one the picture shows what has moved."""
    env = gymnasium.make("swashplate/Hover-v0", vehicle="coax", render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    env.step(np.array([0.5, -0.5, 0.3, 0.0], np.float32))
    second = env.render()
    assert first.shape == second.shape == (480, 640, 3)
    assert np.any(first != second)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20, "sky, ground, body, rotors"
    assert HelicopterEnv("coax").render() is None
    envs = HelicopterVectorEnv(2, "coax", render_mode="rgb_array")
    envs.reset(seed=0)
    one, other = envs.render()
    np.testing.assert_array_equal(one, first)
    assert np.any(one != other)
    with pytest.raises(SwashError, match="render_mode: is 'human', expected 'rgb_array' or None"):
        HelicopterEnv("coax", render_mode="human")


def test_inner_states_are_told_in_info_and_observed_where_asked_for() -> None:
    env = gymnasium.make("swashplate.links.gym:swashplate/Hover-v0", vehicle="coax", inner=True).unwrapped
    check_env(env, skip_render_check=True)
    vehicle, trim = env.flying.vehicle, env.flying.trim
    assert env.flying.observed[12:] == vehicle.state_names[12:]
    seen, info = env.reset(seed=3)
    np.testing.assert_array_equal(seen[12:], 0.0)
    plain = HelicopterEnv("coax")
    assert plain.reset(seed=3)[0].tolist() == seen[:12].tolist()
    push = np.array([0.5, -0.5, 0.3, 0.0], np.float32)
    for _ in range(5):
        seen, _, _, _, info = env.step(push)
        alone, _, _, _, told = plain.step(push)
    assert info["state"].tolist() == list(env.state.values()) == told["state"].tolist()
    np.testing.assert_array_equal(seen, [*alone, *np.float32(info["state"] - trim.state)[12:]])
    assert np.abs(seen[12:]).max() > 0.01
    envs = gymnasium.make_vec(
        "swashplate.links.gym:swashplate/Hover-v0", 2, "vector_entry_point", vehicle="coax", inner=True
    )
    many, info = envs.reset(seed=3)
    assert many.shape == (2, len(vehicle.state_names))
    assert info["state"].shape == many.shape


def test_the_same_seed_gives_the_same_bits() -> None:
    def run(seed: int) -> tuple[np.ndarray, list[float]]:
        env = HelicopterEnv("coax", randomize={"mass": 0.05}, task_options={"duration": 1.0})
        observations, rewards, _ = flown(env, pd_policy, seed=seed)
        return np.stack(observations), rewards

    first, again, other = run(7), run(7), run(8)
    np.testing.assert_array_equal(first[0], again[0])
    assert first[1] == again[1]
    assert not np.array_equal(first[0], other[0])


def test_many_are_as_many_single_ones_and_start_anew_by_themselves() -> None:
    common: dict[str, Any] = {"task_options": {"duration": 0.3}, "randomize": {"mass": 0.02}}
    envs = gymnasium.make_vec(
        "swashplate/Hover-v0", 3, vectorization_mode="vector_entry_point", vehicle="coax", **common
    )
    assert isinstance(envs.unwrapped, HelicopterVectorEnv)
    singles = [HelicopterEnv("coax", **common) for _ in range(3)]
    seen, _ = envs.reset(seed=5)
    expected = np.stack([env.reset(seed=5 + i)[0] for i, env in enumerate(singles)])
    np.testing.assert_allclose(seen, expected, atol=1e-7)
    random = np.random.default_rng(0)
    for step in range(15):
        actions = random.uniform(-0.2, 0.2, (3, 4)).astype(np.float32)
        seen, rewards, lost, ended, _ = envs.step(actions)
        alone = [env.step(action) for env, action in zip(singles, actions, strict=True)]
        states = np.array([list(env.state.values()) for env in singles])
        np.testing.assert_allclose(envs.unwrapped._x, states, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(rewards, [row[1] for row in alone], atol=1e-9)
        assert lost.tolist() == [row[2] for row in alone]
        assert ended.tolist() == [row[3] for row in alone] == [step == 14] * 3
    seen, rewards, lost, ended, _ = envs.step(actions)  # the first step of the next episode ignores the action
    assert rewards.tolist() == [0.0] * 3
    assert not (lost | ended).any()
    again = np.stack([env.reset()[0] for env in singles])
    np.testing.assert_allclose(seen, again, atol=1e-7)


def test_leaving_the_limits_ends_an_episode_and_observations_stay_in_their_space() -> None:
    env = HelicopterEnv("coax", authority=1.0)
    up = np.array([1.0, 1.0, 0.0, 0.0], np.float32)
    observations, rewards, lost = flown(env, lambda seen: up, seed=0)
    assert lost
    assert rewards[-1] == CRASH
    assert all(np.all(np.abs(seen) <= LIMITS.astype(np.float32)) for seen in observations)
    assert observations[-1][2] > 4.9  # the target is five metres below


def test_targets_of_the_tasks() -> None:
    time = np.arange(2001) / 100.0
    assert np.all(hover().targets(time) == 0.0)
    path = trajectory(size=3.0, period=10.0).targets(time)
    slope = np.gradient(path[:, :3], time, axis=0)
    np.testing.assert_allclose(path[1:-1, 3:6], slope[1:-1], atol=1e-2)
    assert np.max(np.abs(path[:, 0])) == pytest.approx(3.0, rel=1e-3)
    np.testing.assert_allclose(path[0], 0.0, atol=1e-12)
    asked = sweep(duration=20.0, axis="roll", amplitude=0.1).targets(time)
    assert 0.09 < np.max(np.abs(asked[:, TARGET.index("roll")])) <= 0.1
    assert np.all(np.delete(asked, TARGET.index("roll"), axis=1) == 0.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"task": "race"}, "'race' is no task"),
        ({"task": "hover", "task_options": {"size": 3.0}}, "unexpected keyword argument 'size'"),
        ({"task": "sweep", "task_options": {"axis": "yaw"}}, "expected roll or pitch"),
        ({"task": "trajectory", "task_options": {"size": float("nan")}}, "expected a positive number"),
        ({"authority": 2.0}, "authority at most 1"),
        ({"randomize": {"weight": 0.1}}, "is no parameter"),
        ({"vehicle": "raptor51"}, "neither a vehicle's name nor a file"),
    ],
)
def test_what_is_refused(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(SwashError, match=said):
        HelicopterEnv(**arguments)


def test_an_episode_ends_before_roll_pitch_and_yaw_lose_the_attitude() -> None:
    with pytest.raises(SwashError, match=r"hover: lean_limit: is 85 degrees, expected at most 80"):
        dataclasses.replace(hover(), lean_limit=np.radians(85.0))
