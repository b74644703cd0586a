"""A tracked body of a motion capture system, brought into the schema's frames: what Vicon and OptiTrack share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights import units
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers import checks, clocked, frames
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.schema import POSITION, QUATERNION


@dataclass(frozen=True)
class Track:
    """One body as the file has it.

    Attributes:
        name: the body's name.
        time: stamps [s], shape (n,).
        position: in `length_unit`, logged world axes, shape (n, 3).
        length_unit: unit of the position.
        quaternion: logged body to logged world, scalar first, shape (n, 4); None for a single marker. Samples in
            which the body was not seen hold NaN, here or in the position.
    """

    name: str
    time: Array
    position: Array
    length_unit: str
    quaternion: Array | None


def choose(names: list[str], wanted: str | None, *, where: str) -> int:
    """The index of the wanted body; without a wish there must be one body only."""
    if wanted is None and len(names) == 1:
        return 0
    if wanted in names:
        return names.index(wanted)
    asked = "several bodies" if wanted is None else f"no body '{wanted}'"
    raise FlightError(
        f"the file has {asked}: {', '.join(names[:20]) or 'none at all'}.",
        where=where,
        channel="body",
        hint="Choose one with body='...'.",
    )


def flight(
    track: Track,
    source: Source,
    options: Options,
    *,
    reader: str,
    version: str,
    world_axes: str,
    body_axes: str,
    notes: tuple[str, ...],
    remarks: clocked.Remarks,
) -> Flight:
    """A tracked body as a flight with the stream "motion": x y z [m, NED] and qw qx qy qz (FRD to NED).

    Samples in which the body was not seen are left out and told as lost; the gap is then visible in the stamps.
    """
    where = source.name
    world = frames.axes(options.world_axes or world_axes, where=where)
    body = frames.axes(options.body_axes or body_axes, where=where)
    tracked = np.asarray(np.isfinite(track.position).all(axis=1))
    if track.quaternion is not None:
        tracked &= np.isfinite(track.quaternion).all(axis=1)
    if tracked.sum() < 2:
        raise FlightError(
            f"'{track.name}' is seen in {int(tracked.sum())} of {len(tracked)} samples; a flight needs at least two.",
            where=where,
            hint="Choose another body, or export a longer record.",
        )
    time, keep = clocked.usable(
        track.time,
        (track.position, *(() if track.quaternion is None else (track.quaternion,))),
        where=where,
        bad_stamps=options.bad_stamps,
        remarks=remarks,
    )
    kept = keep & tracked
    lost = int(len(tracked) - tracked.sum())
    if lost:
        remarks.damage.append(f"{clocked.share(lost, len(tracked))} are lost: '{track.name}' was not seen (occlusion)")
    position = units.to_inside(
        track.position[kept], track.length_unit, expected="m", channel=f"position of '{track.name}'", where=where
    )
    channels = dict(zip(POSITION, frames.to_local(position, world).T, strict=True))
    if track.quaternion is not None:
        logged = track.quaternion[kept]
        notes = (*notes, *checks.quaternion_notes(logged, channel=f"rotation of '{track.name}'", where=where))
        channels |= zip(QUATERNION, frames.attitude(logged, world=world, body=body).T, strict=True)
        given = "as told" if options.body_axes else "assumed"
        notes = (*notes, f"logged body axes point {options.body_axes or body_axes} ({given}; the file cannot say)")
    else:
        notes = (*notes, f"'{track.name}' is a single marker: there is no attitude")
    notes = (
        *notes,
        f"logged world axes point {options.world_axes or world_axes}; 'north' is only the room's first axis",
        "x y z is the tracked point, not the centre of gravity; there are no inputs in this file",
        *remarks.notes,
    )
    return Flight(
        streams={"motion": stream(time[tracked[keep]], channels)},
        provenance=source.provenance(reader, version, vehicle=track.name, notes=notes, damage=tuple(remarks.damage)),
    )
