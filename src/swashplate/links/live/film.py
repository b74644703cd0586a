"""A replay as a film or as numbered pictures, drawn by matplotlib: scene to the left, strip charts to the right."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.atomic import make_folder, replaced_when_complete, write_bytes
from swashplate.errors import SwashError
from swashplate.extras import library
from swashplate.flights.schema import channel
from swashplate.links.live.drawn_scene import DrawnScene
from swashplate.links.live.picture import inputs_of, picture, pose_of
from swashplate.links.live.replay import Replay, floor, gaps
from swashplate.models.surroundings import environment_of

Tell = Callable[[int, int], None]

SIZE = (1280, 720)
"""Pixels."""
_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")


@dataclass(frozen=True)
class Film:
    """A film, or a folder of numbered pictures: where it is, how many pictures, and how long it plays [s]."""

    path: Path
    pictures: int
    seconds: float

    def __str__(self) -> str:
        return f"{self.path} ({self.pictures} pictures, {self.seconds:.1f} s)"


def film_replay(
    shown: Replay,
    path: str | os.PathLike[str],
    *,
    pictures: bool = False,
    rate: float = 25.0,
    tell: Tell | None = None,
) -> Film:
    """Film a replay as a file (.mp4, .mkv or .mov), or draw it as numbered pictures for a paper.

    Args:
        shown: what `sp.replay` made.
        path: of the film, or the folder for pictures, which is made if missing.
        pictures: numbered pictures instead of a film.
        rate: pictures per second of flight [Hz].
        tell: called with the pictures done and their number.

    Raises:
        SwashError: for another suffix, a place that cannot be written to, a rate that makes no sense, or where
            imageio-ffmpeg is missing.
    """
    place = Path(path)
    count = (write_pictures if pictures else write_film)(shown, place, rate=rate, tell=tell)
    return Film(place, count, count / rate)


def write_film(shown: Replay, path: Path, *, rate: float = 25.0, tell: Tell | None = None) -> int:
    """An H.264 film; it appears when it is complete.

    Args:
        shown: what is filmed.
        path: `.mp4` or another suffix that ffmpeg knows.
        rate: pictures per second of flight [Hz].
        tell: called with the pictures done and their number.

    Returns:
        The number of pictures.

    Raises:
        SwashError: where the suffix is not one of a film, or imageio-ffmpeg is missing.
    """
    if path.suffix.lower() not in (".mp4", ".mkv", ".mov"):
        raise SwashError(f"ends in '{path.suffix}', expected .mp4, .mkv or .mov.", where=path, channel="--video")
    get_ffmpeg_exe = library("imageio_ffmpeg", what="a film").get_ffmpeg_exe
    count = 0
    with replaced_when_complete(path) as temporary:
        raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{SIZE[0]}x{SIZE[1]}", "-r", f"{rate:g}", "-i", "-"]
        made = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart"]
        command = [get_ffmpeg_exe(), "-y", "-loglevel", "error", *raw, *made, str(temporary)]
        # Not by imageio-ffmpeg's own writer: it forks with a hook, which JAX's threads do not survive for certain.
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as encoder:
            assert encoder.stdin is not None
            assert encoder.stderr is not None
            try:
                for picture_ in pictures(shown, rate=rate, tell=tell):
                    encoder.stdin.write(picture_.tobytes())
                    count += 1
            except BrokenPipeError:
                pass  # the encoder gave up; what it said follows
            finally:
                with contextlib.suppress(BrokenPipeError):
                    encoder.stdin.close()
                said = encoder.stderr.read().decode("utf-8", "replace").strip()
        if encoder.returncode:
            raise SwashError(f"ffmpeg could not write it: {said[-200:]}", where=path, channel="--video")
    return count


def write_pictures(shown: Replay, folder: Path, *, rate: float = 25.0, tell: Tell | None = None) -> int:
    """`frame-00001.png` and so on in a folder, which is made if missing; returns their number."""
    from matplotlib.image import imsave

    make_folder(folder)
    count = 0
    for count, picture_ in enumerate(pictures(shown, rate=rate, tell=tell), start=1):
        drawn = io.BytesIO()
        imsave(drawn, picture_, format="png")
        write_bytes(folder / f"frame-{count:05d}.png", drawn.getbuffer())
    return count


def pictures(shown: Replay, *, rate: float, tell: Tell | None = None) -> Iterator[NDArray[np.uint8]]:
    """Pictures of shape (720, 1280, 3), one every 1/rate seconds of flight."""
    if not 1.0 <= rate <= 100.0:
        raise SwashError(f"is {rate:g}, expected 1 to 100 pictures per second.", channel="--frame-rate")
    times = np.arange(shown.time[0], shown.time[-1], 1.0 / rate)
    page = _Page(shown)
    for number, k in enumerate(np.clip(np.searchsorted(shown.time, times), 0, shown.time.size - 1), start=1):
        yield page.draw(int(k))
        if tell is not None:
            tell(number, times.size)


class _Page:
    """One figure; what stands still is drawn once."""

    def __init__(self, shown: Replay) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._shown = shown
        self._pose, self._around = pose_of(shown.vehicle), environment_of(shown.vehicle)
        dpi = 100
        figure = Figure(figsize=(SIZE[0] / dpi, SIZE[1] / dpi), dpi=dpi, facecolor="white")
        canvas: Any = FigureCanvasAgg(figure)
        self._canvas: Any = canvas
        self._drawn = DrawnScene(figure, (0.0, 0.0, 0.64, 1.0), picture(shown.vehicle), floor=floor(shown))
        self._scene: Any = self._drawn.axes
        self._clock = self._scene.text(0.02, 0.965, "", transform=self._scene.transAxes, va="top", animated=True)
        words = ("SIMULATED  " if shown.simulated else "") + shown.title
        self._scene.text(0.02, 0.025, words, transform=self._scene.transAxes, color="#444")
        if shown.notes:
            told = "\n".join(line for note in shown.notes for line in textwrap.wrap(note, 110))
            self._scene.text(0.02, 0.065, told, transform=self._scene.transAxes, color="#a33", fontsize=7, va="bottom")
        if shown.predicted is not None:
            self._scene.text(
                0.98,
                0.025,
                f"blue: the model, anew every {shown.ahead:g} s",
                transform=self._scene.transAxes,
                ha="right",
                color="#0072B2",
            )
        self._markers = self._charts(figure)
        canvas.draw()
        self._still: Any = canvas.copy_from_bbox(figure.bbox)
        self._heading = float(shown.states[0, 8])

    def _charts(self, figure: Any) -> list[Any]:
        shown = self._shown
        states, time = shown.states, shown.time - shown.time[0]
        names = shown.vehicle.state_names
        panels: list[tuple[str, list[tuple[str, Array, Array | None]]]] = []
        for title, group in (("attitude", (6, 7, 8)), ("rates", (9, 10, 11)), ("velocity", (3, 4, 5))):
            factor, unit = channel(names[group[0]]).shown_factor, channel(names[group[0]]).shown_unit
            curves = [
                (names[i], factor * states[:, i], None if shown.predicted is None else factor * shown.predicted[:, i])
                for i in group
            ]
            panels.append((f"{title} [{unit}]", curves))
        units = inputs_of(shown.vehicle)
        turns = [np.degrees(1.0) if each["unit"] == "rad" else 1.0 for each in units]
        commands: list[tuple[str, Array, Array | None]] = [
            (each["name"], turns[i] * shown.inputs[:, i], None) for i, each in enumerate(units)
        ]
        words = {("rad",): "deg", ("1",): "1"}.get(tuple({each["unit"] for each in units}), "deg, 1")
        panels.append((f"inputs [{words}]", commands))
        broken = gaps(shown.time)
        markers = []
        for place, (title, curves) in enumerate(panels):
            axes = figure.add_axes((0.695, 0.785 - 0.24 * place, 0.29, 0.175))
            for color, (name, values, other) in zip(_COLORS, curves, strict=False):
                axes.plot(time, np.where(broken, np.nan, values), color=color, lw=1.0, label=name)
                if other is not None:
                    axes.plot(time, other, color=color, lw=0.8, ls="--")
            axes.set_title(title, fontsize=8, loc="left", pad=3)
            axes.legend(
                fontsize=6,
                ncols=len(curves),
                loc="lower right",
                bbox_to_anchor=(1.0, 0.98),
                frameon=False,
                handlelength=1.0,
                columnspacing=1.0,
            )
            axes.tick_params(labelsize=7)
            axes.grid(color="#e3e6e8", lw=0.6)
            axes.set_xlim(time[0], time[-1])
            axes.set_ylim(*_range([values for _, values, _ in curves]))
            markers.append(axes.axvline(0.0, color="#111", lw=0.9, animated=True))
        axes.set_xlabel("s", fontsize=7, labelpad=1)
        return markers

    def draw(self, k: int) -> NDArray[np.uint8]:
        shown = self._shown
        x, time = shown.states[k], float(shown.time[k] - shown.time[0])
        gap = x[8] - self._heading
        self._heading += 0.1 * float(np.arctan2(np.sin(gap), np.cos(gap)))
        canvas = self._canvas
        canvas.restore_region(self._still)
        self._drawn.look(x, heading=self._heading)
        self._drawn.track(shown.states[max(0, k - 400) : k + 1, :3])
        parts = self._pose(x, shown.inputs[k], self._around)
        if shown.predicted is not None and np.all(np.isfinite(shown.predicted[k])):
            self._drawn.helicopter(shown.predicted[k], parts, time=time, ghost=True)
        self._drawn.helicopter(x, parts, time=time)
        self._clock.set_text(f"{time:6.2f} s    height {-x[2]:.2f} m    speed {np.linalg.norm(x[3:6]):.2f} m/s")
        self._scene.draw_artist(self._clock)
        for marker in self._markers:
            marker.set_xdata([time, time])
            marker.axes.draw_artist(marker)
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _range(curves: list[Array]) -> tuple[float, float]:
    """Limits of a chart by what was logged: a prediction that runs away is cut off, not the log squeezed."""
    low, high = min(float(np.min(c)) for c in curves), max(float(np.max(c)) for c in curves)
    room = 0.35 * (high - low) + 0.05
    return low - room, high + room
