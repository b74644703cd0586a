"""`HelicopterVectorEnv`: many vehicles in one compiled step, natively vectorised by `vmap`."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from swashplate.errors import SwashError
from swashplate.links.gym.drawing import MODES, EnvironmentPicture, checked_mode
from swashplate.links.gym.environment import spaces
from swashplate.links.gym.flying import FlyingOptions, flying
from swashplate.links.gym.tasks import Task, task_of
from swashplate.models.usual import USUAL
from swashplate.models.vehicle import Vehicle

Observations = NDArray[np.float32]


class HelicopterVectorEnv(VectorEnv[Observations, NDArray[np.float32], NDArray[Any]]):
    """`num_envs` copies of `HelicopterEnv`, the same numbers to 1e-9; an ended one is reset by the next step.

    Every info holds the state rows as "state", (num_envs, states). `reset(seed=s)` seeds copy i with s + i, as
    Gymnasium's own vector environments do. Arguments as `HelicopterEnv`.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  (Gymnasium's own declaration)
        "render_modes": list(MODES),
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        vehicle: Vehicle | str = USUAL,
        task: str | Task = "hover",
        *,
        task_options: dict[str, Any] | None = None,
        render_mode: str | None = None,
        **options: Unpack[FlyingOptions],
    ) -> None:
        if num_envs < 1:
            raise SwashError(f"is {num_envs}, expected at least 1.", channel="num_envs")
        self.num_envs, self.render_mode = num_envs, checked_mode(render_mode)
        self.flying = flying(vehicle, task_of(task, task_options or {}), **options)
        self.single_observation_space, self.single_action_space = spaces(self.flying)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._randoms = [np.random.default_rng() for _ in range(num_envs)]
        self._x = np.tile(self.flying.trim.state, (num_envs, 1))
        self._p = np.tile(self.flying.parameters, (num_envs, 1))
        self._k = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._actions: NDArray[Any] = np.zeros((num_envs, len(self.flying.free)))
        self._picture: EnvironmentPicture | None = None

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """One picture (480, 640, 3) an environment with `render_mode="rgb_array"`; None without a mode."""
        if self.render_mode is None:
            return None
        drawn = self._picture = self._picture or EnvironmentPicture(self.flying)
        rows = zip(self._x, self._k.tolist(), self._actions, strict=True)
        return tuple(drawn.draw(x, k, action) for x, k, action in rows)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """New episodes for all of them."""
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        if seeds is not None:
            if len(seeds) != self.num_envs:
                raise SwashError(f"has {len(seeds)} seeds for {self.num_envs} environments.", channel="seed")
            for i, own in enumerate(seeds):
                if own is not None:
                    self._randoms[i] = np.random.default_rng(own)
        self._begin(np.ones(self.num_envs, dtype=np.bool_))
        return self.flying.observe(self._x, self._k), self._info()

    def _info(self) -> dict[str, Any]:
        """States, and (as Gymnasium's own vector environments say it) for which environments there are any: all."""
        return {"state": self._x.copy(), "_state": np.ones(self.num_envs, dtype=np.bool_)}

    def _begin(self, which: NDArray[np.bool_]) -> None:
        """New episodes for some of them."""
        for i in np.flatnonzero(which):
            self._x[i], self._p[i] = self.flying.start(self._randoms[i])
        self._k[which], self._ended[which], self._actions[which] = 0, False, 0.0

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observations, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One action later; for those that had ended, the start of a new episode with a reward of 0."""
        fresh = self._ended.copy()
        self._actions = np.array(actions)
        states, observations, rewards, lost = self.flying.advance(self._x, self._k, actions, self._p)
        self._x, self._k = states.copy(), self._k + 1
        if fresh.any():
            self._begin(fresh)
            observations = np.where(fresh[:, None], self.flying.observe(self._x, self._k), observations)
            rewards, lost = np.where(fresh, 0.0, rewards), lost & ~fresh
        truncated = (self._k >= self.flying.steps) & ~lost & ~fresh
        self._ended = lost | truncated
        return observations, rewards, lost, truncated, self._info()
