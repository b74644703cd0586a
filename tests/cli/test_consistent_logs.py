"""A gyroscope in the wrong unit or with the wrong sign: told, refused, and mended by the option that is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from commands import one_message, swash
from scipy.signal import chirp


def _log(folder: Path, *, factor: float = 1.0, other: float = 1.0) -> Path:
    """A pitch sweep of 40 s at 50 Hz, with the pitch rate times `factor`, the roll rate times `other`, no heading."""
    t = np.arange(0.0, 40.0, 0.02)
    rng = np.random.default_rng(6)
    stick = chirp(t, 0.3, 40.0, 3.0, phi=-90)
    rate = np.convolve(stick, np.exp(-5.0 * t[:100]) * 0.1, "full")[: t.size]
    theta = np.cumsum(rate) * 0.02
    phi, p = 0.02 * np.sin(t), other * (0.02 * np.cos(t) + 0.0002 * rng.standard_normal(t.size))
    columns = [t, phi, theta - theta.mean(), p, factor * (rate + 0.002 * rng.standard_normal(t.size)), stick]
    lines = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
    path = folder / "log.csv"
    path.write_text(
        "\n".join(["time [s],phi [rad],theta [rad],p [rad/s],q [rad/s],mixer_pitch", *lines, ""]), encoding="utf-8"
    )
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


ASK = ("--inputs", "mixer_pitch", "--outputs", "q")


def test_a_channel_that_is_not_used_stops_nothing_and_an_option_takes_the_log_as_it_is(tmp_path: Path) -> None:
    path = _log(tmp_path, other=-1.0)
    assert "p: has the other sign" in " ".join(swash("inspect", path).out.split())
    done = swash("respond", path, *ASK)
    assert done.code == 0
    assert "has the other sign" not in done.out
    message = one_message(swash("respond", path, *ASK, "--references", "p"))
    assert "p: has the other sign" in message
    assert "--as-logged" in message
    turned = _log(tmp_path, factor=-1.0)
    assert "has the other sign" in one_message(swash("respond", turned, *ASK))
    taken = swash("respond", turned, *ASK, "--as-logged")
    assert taken.code == 2, "the responses are there, and say that no gains follow from them"
    assert "turn the unit of that channel" in taken.out
    assert "! log.csv: q: has the other sign" in taken.out


def test_a_wrong_scale_goes_with_the_responses_into_the_fit(tmp_path: Path) -> None:
    path, out = _log(tmp_path, factor=1.25), tmp_path / "out"
    done = swash("respond", path, *ASK, "--out", out)
    assert done.code == 2
    words = "log.csv: q: is 1.2"
    for told in (done.out, done.err, (out / "report.html").read_text(encoding="utf-8")):
        assert words in told
    fit = swash("identify", "--responses", out / "responses.nc", "--input", "mixer_pitch", "--form", "0/1")
    assert fit.code == 2
    assert words in fit.out
    taken = swash("respond", path, *ASK, "--as-logged")
    assert taken.code == 0
    assert words in taken.out


def test_gaps_of_a_log_are_told_with_its_responses(tmp_path: Path) -> None:
    path, out = _log(tmp_path), tmp_path / "out"
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([*lines[:401], *lines[406:901], *lines[907:], ""]), encoding="utf-8")
    done = swash("respond", path, *ASK, "--out", out)
    told = "2 gaps in the time stamps, the longest 140 ms"
    assert told in done.out
    assert told in (out / "report.html").read_text(encoding="utf-8")
    assert "no problem was found" not in (out / "report.html").read_text(encoding="utf-8")
