"""A scene drawn by matplotlib: ground, helicopters and tracks as lines, for films and pictures without a browser."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.links.live.wireframe import Camera, ground, helicopter

_LOOKS: dict[str, tuple[str, float]] = {
    "grid": ("#9db09a", 0.6),
    "body": ("#333a40", 1.8),
    "disc": ("#009E73", 1.2),
    "blade": ("#333a40", 1.4),
    "bar": ("#E69F00", 2.5),
    "thrust": ("#D55E00", 2.0),
    "tail": ("#CC79A7", 1.2),
    "ghost": ("#56B4E9", 1.3),
    "trail": ("#D55E00", 1.0),
}
_SKY = "#dbe8f2"
_AWAY = 9.0  # sizes of the vehicle between it and the camera


class DrawnScene:
    """Axes that show a scene.

    Args:
        figure: of matplotlib.
        box: left, bottom, width and height of the axes as shares of the figure.
        picture: the vehicle's shapes, of `picture`.
        floor: how far down the ground is [m].
    """

    def __init__(
        self, figure: Any, box: tuple[float, float, float, float], picture: dict[str, Any], *, floor: float
    ) -> None:
        self.axes: Any = figure.add_axes(box, facecolor=_SKY)
        wide, high = figure.get_size_inches()
        aspect = box[2] * wide / (box[3] * high)
        self.axes.set(xlim=(-aspect, aspect), ylim=(-1.0, 1.0), xticks=[], yticks=[])
        self._picture, self._floor = picture, floor
        self._cell = 1.0 if picture["size"] < 0.4 else 5.0 if picture["size"] < 2.0 else 50.0
        self._camera = Camera(np.zeros(3), heading=0.0, distance=1.0)

    def look(self, x: Array, *, heading: float) -> None:
        """Put the camera behind a body state row, and draw the ground and the plumb line."""
        self._camera = Camera(x[:3], heading=heading, distance=_AWAY * self._picture["size"])
        for kind, points in ground(x[:3], self._cell, floor=self._floor):
            self._draw(kind, points)
        self._draw("grid", np.array([[x[0], x[1], x[2]], [x[0], x[1], self._floor]]))

    def track(self, places: Array, *, kind: str = "trail") -> None:
        """Draw a line through places [m, NED], shape (n, 3)."""
        self._draw(kind, places)

    def helicopter(self, x: Array, parts: dict[str, Any], *, time: float, ghost: bool = False) -> None:
        """Draw the vehicle at a body state row with its parts' pose; `time` [s] turns the blades."""
        for kind, points in helicopter(self._picture, x, parts, time=time):
            self._draw("ghost" if ghost else kind, points)

    def _draw(self, kind: str, points: Array) -> None:
        from matplotlib.lines import Line2D

        color, width = _LOOKS[kind]
        seen = self._camera.project(points)
        line = Line2D(seen[:, 0], seen[:, 1], color=color, lw=width)
        line.set_transform(self.axes.transData)
        line.set_clip_path(self.axes.patch)
        line.set_figure(self.axes.figure)
        self.axes.draw_artist(line)
