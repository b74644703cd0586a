"""`HelicopterEnv`: one vehicle with one task as a Gymnasium environment."""

from __future__ import annotations

from typing import Any, Unpack, cast

import gymnasium
import numpy as np
from numpy.typing import NDArray

from swashplate.links.gym.drawing import MODES, EnvironmentPicture, checked_mode
from swashplate.links.gym.flying import Flying, FlyingOptions, flying
from swashplate.links.gym.tasks import Task, task_of
from swashplate.models.usual import USUAL
from swashplate.models.vehicle import Vehicle

Observation = NDArray[np.float32]


def spaces(flown: Flying) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.Box]:
    """Observations and actions of one vehicle."""
    edges = flown.edges.astype(np.float32)
    return gymnasium.spaces.Box(-edges, edges), gymnasium.spaces.Box(-1.0, 1.0, (len(flown.free),), np.float32)


class HelicopterEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A vehicle that hovers, follows a path or tracks an attitude sweep.

    Observation: `flying.OBSERVED` (12), with `inner=True` the states of rotors, bar and inflow behind them, less the
    trim's; names in `flying.observed`. Every info holds the whole state row as "state", in the order of `state_names`.
    Action: -1 to 1 for each input, added to the trim's; 0 is the trim. Reward at each step: exp(-sum of (error /
    scale)^2) - 0.01 mean(action^2), at most 1; -10 where the episode ends by leaving the task's limits (distance,
    height, lean, or the finite numbers). It is truncated after `duration`.

    Args:
        vehicle: a vehicle, its name or a file.
        task: "hover", "trajectory", "sweep" or a `Task`.
        task_options: for the task by name, e.g. {"duration": 5.0}.
        render_mode: "rgb_array" for pictures by `render` (needs matplotlib), or None.
        options: of the flight, see `flying.FlyingOptions`.
    """

    metadata: dict[str, Any] = {"render_modes": list(MODES), "render_fps": 50}  # noqa: RUF012  (Gymnasium's own)

    def __init__(
        self,
        vehicle: Vehicle | str = USUAL,
        task: str | Task = "hover",
        *,
        task_options: dict[str, Any] | None = None,
        render_mode: str | None = None,
        **options: Unpack[FlyingOptions],
    ) -> None:
        self.render_mode = checked_mode(render_mode)
        self.flying = flying(vehicle, task_of(task, task_options or {}), **options)
        seen, moved = spaces(self.flying)
        self.observation_space, self.action_space = cast(Any, seen), cast(Any, moved)
        self._k = np.zeros(1, dtype=np.int64)
        self._x = np.array(self.flying.trim.state)[None]
        self._p = self.flying.parameters[None]
        self._action: NDArray[Any] = np.zeros(len(self.flying.free))
        self._picture: EnvironmentPicture | None = None

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (480, 640, 3) with `render_mode="rgb_array"`; None without a mode."""
        if self.render_mode is None:
            return None
        self._picture = self._picture or EnvironmentPicture(self.flying)
        return self._picture.draw(self._x[0], int(self._k[0]), self._action)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of `info["state"]`."""
        return self.flying.vehicle.state_names

    @property
    def state(self) -> dict[str, float]:
        """The whole state by name, hidden ones too."""
        return dict(zip(self.state_names, self._x[0].tolist(), strict=True))

    def _info(self) -> dict[str, Any]:
        return {"state": self._x[0].copy()}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """A new episode near the trim."""
        super().reset(seed=seed)
        x, p = self.flying.start(self.np_random)
        self._x, self._p, self._k = x[None], p[None], np.zeros(1, dtype=np.int64)
        self._action = np.zeros(len(self.flying.free))
        return self.flying.observe(self._x, self._k)[0], self._info()

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One action later."""
        self._action = np.asarray(action)
        states, observations, rewards, lost = self.flying.advance(self._x, self._k, self._action[None], self._p)
        self._x, self._k = states, self._k + 1
        ended = bool(self._k[0] >= self.flying.steps) and not bool(lost[0])
        return observations[0], float(rewards[0]), bool(lost[0]), ended, self._info()
