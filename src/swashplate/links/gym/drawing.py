"""What `render` of an environment shows: the vehicle, where it has been, and the place that the task asks for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.extras import library
from swashplate.links.gym.flying import Flying
from swashplate.links.live.drawn_scene import DrawnScene
from swashplate.links.live.picture import picture, pose_of

MODES = ("rgb_array",)
"""What an environment can be drawn as."""
SIZE = (640, 480)
"""Pixels."""


def checked_mode(mode: str | None) -> str | None:
    """A `render_mode`, None for no pictures.

    Raises:
        SwashError: for one that there is not.
    """
    if mode is not None and mode not in MODES:
        raise SwashError(f"is {mode!r}, expected {' or '.join(map(repr, MODES))} or None.", channel="render_mode")
    return mode


class EnvironmentPicture:
    """Pictures of one environment.

    Args:
        flown: the vehicle with its task.
    """

    def __init__(self, flown: Flying) -> None:
        library("matplotlib", what="render")
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        shape, targets = picture(flown.vehicle), flown.table[:, :3]
        self._flown, self._pose = flown, pose_of(flown.vehicle)
        figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100)
        canvas: Any = FigureCanvasAgg(figure)
        below = 0.0 if flown.rest is not None else float(targets[:, 2].max()) + flown.task.height_limit
        self._scene = DrawnScene(figure, (0.0, 0.0, 1.0, 1.0), shape, floor=below)
        self._words = self._scene.axes.text(0.02, 0.96, "", transform=self._scene.axes.transAxes, animated=True)
        canvas.draw()
        self._canvas: Any = canvas
        self._still: Any = canvas.copy_from_bbox(figure.bbox)

    def draw(self, x: Array, k: int, action: Array) -> NDArray[np.uint8]:
        """The state row at a step with the action that led there, shape (480, 640, 3)."""
        flown = self._flown
        inputs = np.array(flown.trim.inputs)
        inputs[list(flown.free)] += flown.reach * action
        self._canvas.restore_region(self._still)
        self._scene.look(x[:12], heading=float(x[8]))
        self._scene.track(flown.table[:, :3], kind="ghost")
        self._scene.helicopter(
            x[:12], self._pose(x.tolist(), inputs.tolist(), flown.trim.environment), time=k * flown.dt
        )
        away = float(np.linalg.norm(x[:3] - flown.table[min(k, flown.steps), :3]))
        self._words.set_text(f"{k * flown.dt:6.2f} s    {away:.2f} m off the target")
        self._scene.axes.draw_artist(self._words)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()
