"""Flights as CSV files: one file a stream, units in the header, numbers as the shortest text that reads back exact."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import xarray as xr

from swashplate.atomic import write_text
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight


def _header(data: xr.Dataset) -> list[str]:
    cells = ["time [s]"]
    for name, values in data.data_vars.items():
        unit = values.attrs.get("units", "")
        cells.append(f"{name} [{unit}]" if unit else str(name))
    return cells


def as_csv(data: xr.Dataset) -> str:
    """A stream as CSV text.

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
    writer.writerow(_header(data))
    writer.writerows(zip(*(map(repr, column.tolist()) for column in columns), strict=True))
    return text.getvalue()


def write_csv(flight: Flight, path: str | Path) -> tuple[Path, ...]:
    """Writes a flight as CSV and returns the files' paths.

    A flight of one stream becomes the file `path`; of several, one file each: `flight.csv` gives `flight_motion.csv`,
    `flight_inputs.csv`. All numbers read back exactly. Provenance, history and segments do not go into a CSV file;
    netCDF (`Flight.save`) keeps them.

    Raises:
        FlightError: where the flight has no stream, holds numbers that are not finite, or the file cannot be written.
    """
    target = Path(path)
    if not flight.streams:
        raise FlightError("the flight has no stream to write.", where=target)
    names = list(flight.streams)
    paths = [target] if len(names) == 1 else [target.with_name(f"{target.stem}_{n}{target.suffix}") for n in names]
    texts = [as_csv(flight.streams[name]) for name in names]  # all of them before the first file appears
    try:
        return tuple(write_text(place, text) for place, text in zip(paths, texts, strict=True))
    except OSError as error:
        reason = error.strerror or str(error)
        raise FlightError(
            f"cannot be written: {reason}.", where=target, hint="Check that the folder exists and is yours."
        ) from error
