"""What every reader asks of what it read: increasing times, finite numbers, plausible quaternions, moving inputs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError

_NORM_TOLERANCE = 0.01  # six decimals of a motion capture export lose 1e-6; anything near 1 % is no unit quaternion


def finite(values: Array, *, channel: str, where: str, first_row: int = 0) -> None:
    """Refuses numbers that are not finite, naming the first sample.

    Args:
        values: shape (n,) or (n, k).
        first_row: what the file calls its first sample.
    """
    bad = ~np.isfinite(values)
    rows = np.flatnonzero(bad if bad.ndim == 1 else bad.any(axis=1))
    if rows.size:
        raise FlightError(
            f"{rows.size} of {len(values)} samples are not finite numbers, first at sample {rows[0] + first_row}.",
            where=where,
            channel=channel,
            hint="Cut these samples out of the log, or export it again.",
        )


def usable(time: Array, *, where: str, bad_stamps: str, channel: str = "time") -> tuple[NDArray[np.bool_], str]:
    """Which samples have a time [s] that increases, and a note where some were dropped.

    Args:
        time: stamps, shape (n,).
        bad_stamps: "error" (a stamp that repeats or goes back is an error that names the sample) or "drop".

    Returns:
        Mask of samples to keep, shape (n,), and a note ("" where all are kept).
    """
    if bad_stamps not in ("error", "drop"):
        raise FlightError(f"bad_stamps is '{bad_stamps}', expected 'error' or 'drop'.", where=where)
    if time.size < 2:
        count = "one sample" if time.size else "no samples"
        raise FlightError(
            f"has {count}; a flight needs at least two.", where=where, channel=channel, hint="Give a longer record."
        )
    finite(time, channel=channel, where=where)
    before = np.maximum.accumulate(time)[:-1]
    keep = np.concatenate(([True], time[1:] > before))
    wrong = np.flatnonzero(~keep)
    if not wrong.size:
        return keep, ""
    first = int(wrong[0])
    what = "repeats the stamp before it" if time[first] == before[first - 1] else "goes backwards"
    if bad_stamps == "error":
        raise FlightError(
            f"time {what} at sample {first} ({before[first - 1]:.6f} s, then {time[first]:.6f} s); "
            f"{wrong.size} of {time.size} samples do not increase.",
            where=where,
            channel=channel,
            hint="Repair the log, or leave these samples out: --drop-bad-stamps (in Python bad_stamps='drop').",
        )
    if keep.sum() < 2:
        raise FlightError("less than two samples have increasing times.", where=where, channel=channel)
    return keep, f"{wrong.size} samples dropped because their time repeats or goes backwards, first at sample {first}"


def quaternion_notes(quaternion: Array, *, channel: str, where: str) -> tuple[str, ...]:
    """Notes on sign flips and single bad norms of quaternions, shape (n, 4); refuses what is no attitude at all."""
    with np.errstate(over="ignore"):  # damaged numbers may be as large as they like: their norm is refused below
        error = np.abs(np.sqrt(np.sum(quaternion**2, axis=1)) - 1.0)
        products = np.sum(quaternion[1:] * quaternion[:-1], axis=1)
    if np.median(error) > _NORM_TOLERANCE:
        raise FlightError(
            f"the quaternion's norm is off 1 by {np.median(error):.3g} in the median: these are not attitudes.",
            where=where,
            channel=channel,
            hint="Check which columns hold the quaternion and in which order.",
        )
    notes = []
    off = int(np.sum(error > _NORM_TOLERANCE))
    if off:
        notes.append(f"{off} attitude quaternions have a norm off 1 by more than {_NORM_TOLERANCE:g}")
    flips = int(np.sum(products < 0.0))
    if flips:
        notes.append(f"the attitude quaternion flips its sign {flips} times, as logged (conditioning repairs it)")
    return tuple(notes)


def constant_notes(channels: Mapping[str, Array]) -> tuple[str, ...]:
    """A note for each channel that never moves: no parameter can be learnt from an input like that."""
    return tuple(
        f"{name} never moves ({values[0]:.6g} throughout): nothing about it can be identified from this record"
        for name, values in channels.items()
        if len(values) > 1 and np.all(values == values[0])
    )
