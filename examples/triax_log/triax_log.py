"""A reader of your own: text logs of the (made-up) recorder TRIAX, angles in degrees, z up."""

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream

NAME, VERSION = "triax", "1"
MAGIC = b"TRIAX 1"
COLUMNS = ("seconds", "roll", "pitch", "yaw", "height", "stick")


def recognises(source) -> bool:
    """Whether a file is such a log: by what it holds, not by what it is called."""
    return source.content.startswith(MAGIC)


def read(source, options) -> Flight:
    """The flight in SI units and radians, axes north-east-down and forward-right-down, repaired in no way.

    Raises:
        FlightError: naming the file, what was found, and what was expected.
    """
    if options.units or options.mapping:
        raise FlightError("says its units itself.", where=source.path, hint="Leave units and mapping out.")
    lines = source.text.splitlines()
    head = tuple(lines[1].split(",")) if len(lines) > 1 else ()
    if head != COLUMNS:
        raise FlightError(f"has the columns {', '.join(head)}, expected {', '.join(COLUMNS)}.", where=source.path)
    try:
        table = np.array([[float(cell) for cell in line.split(",")] for line in lines[2:]])
        seconds, roll, pitch, yaw, height, stick = table.T
    except ValueError as error:
        raise FlightError(
            f"holds a line that is no row of {len(COLUMNS)} numbers ({error}).",
            where=source.path,
            hint="The recorder was switched off too early: remove the last line.",
        ) from None
    channels = {
        "phi": np.radians(roll),
        "theta": np.radians(pitch),
        "psi": np.unwrap(np.radians(yaw)),
        "z": -height,
        "servo_roll": stick,
    }
    return Flight({"triax": stream(seconds, channels)}, source.provenance(NAME, VERSION))
