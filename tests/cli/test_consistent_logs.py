"""A gyroscope in the wrong unit or with the wrong sign: told, refused, and mended by the option that is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from commands import one_message, swash
from scipy.signal import chirp


def _log(folder: Path, *, factor: float = 1.0) -> Path:
    """A pitch sweep of 40 s at 50 Hz, with the pitch rate times `factor` and no heading."""
    t = np.arange(0.0, 40.0, 0.02)
    rng = np.random.default_rng(6)
    stick = chirp(t, 0.3, 40.0, 3.0, phi=-90)
    rate = np.convolve(stick, np.exp(-5.0 * t[:100]) * 0.1, "full")[: t.size]
    theta = np.cumsum(rate) * 0.02
    columns = [t, 0.02 * np.sin(t), theta - theta.mean(), factor * (rate + 0.002 * rng.standard_normal(t.size)), stick]
    lines = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
    path = folder / "log.csv"
    path.write_text("\n".join(["time [s],phi [rad],theta [rad],q [rad/s],mixer_pitch", *lines, ""]), encoding="utf-8")
    return path


def test_the_named_option_mends_it(tmp_path: Path) -> None:
    ask = ("--inputs", "mixer_pitch", "--outputs", "q")
    for factor, unit, words in ((57.29578, "deg/s", "looks like deg/s"), (-1.0, "-rad/s", "has the other sign")):
        path = _log(tmp_path, factor=factor)
        told = swash("inspect", path)
        assert told.code == 0
        assert words in " ".join(told.out.split())
        message = one_message(swash("respond", path, *ask))
        assert words in message
        assert f"--unit q={unit}" in message
        assert swash("respond", path, *ask, "--unit", f"q={unit}").code == 0
    assert swash("respond", _log(tmp_path), *ask).code == 0
