"""Flights as CSV files: one file a stream, units in the header, numbers as the shortest text that reads back exact."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import xarray as xr

from swashplate.atomic import write_text
from swashplate.errors import FlightError
from swashplate.flights.epoch import iso
from swashplate.flights.flight import Flight


def _header(data: xr.Dataset, zero: float) -> list[str]:
    cells = [f"time [s since {iso(zero)}]" if zero else "time [s]"]
    for name, values in data.data_vars.items():
        unit = values.attrs.get("units", "")
        cells.append(f"{name} [{unit}]" if unit else str(name))
    return cells


def as_csv(data: xr.Dataset, *, epoch: float = 0.0) -> str:
    """A stream as CSV text.

    Args:
        epoch: time zero [s since 1970], which the header then says; 0 where it is not known.

    Raises:
        FlightError: where a number is not finite (the reader would refuse it).
    """
    columns = [np.asarray(data["time"].values, dtype=np.float64)]
    for name, values in data.data_vars.items():
        columns.append(np.asarray(values.values, dtype=np.float64))
        if not np.isfinite(columns[-1]).all():
            raise FlightError(
                "holds numbers that are not finite.", channel=str(name), hint="Cut or condition it first."
            )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_header(data, epoch))
    writer.writerows(zip(*(map(repr, column.tolist()) for column in columns), strict=True))
    return text.getvalue()


def write_csv(flight: Flight, path: str | Path) -> tuple[Path, ...]:
    """Writes a flight as CSV and returns the files' paths.

    A flight of one stream becomes the file `path`; of several, one file each: `flight.csv` gives `flight_motion.csv`,
    `flight_inputs.csv`. All numbers read back exactly, the epoch too (`time [s since ...]`). Provenance, history and
    segments do not go into a CSV file; netCDF (`Flight.save`) keeps them.

    Raises:
        FlightError: where the flight has no stream or holds numbers that are not finite.
        WriteError: where a file cannot be written.
    """
    target = Path(path)
    if not flight.streams:
        raise FlightError("the flight has no stream to write.", where=target)
    names = list(flight.streams)
    paths = [target] if len(names) == 1 else [target.with_name(f"{target.stem}_{n}{target.suffix}") for n in names]
    # All of them before the first file appears.
    texts = [as_csv(flight.streams[name], epoch=flight.epoch) for name in names]
    return tuple(write_text(place, text) for place, text in zip(paths, texts, strict=True))
