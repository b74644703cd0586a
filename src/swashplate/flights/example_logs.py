"""Logs that come with the package, to try it on: `swash open examples/helicopter_sweeps`.

`scripts/example_logs.py` makes them: models and flights of this project, no one else's data.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent / "examples"
NAME = "examples"
"""What stands before the name of one: "examples/coax_flight"."""


@dataclass(frozen=True)
class ExampleLog:
    """An example.

    Attributes:
        file: its name in the folder.
        title, summary: what it is, and what can be seen with it.
    """

    file: str
    title: str
    summary: str

    @property
    def path(self) -> Path:
        """Where it lies."""
        return FOLDER / self.file


EXAMPLES = (
    ExampleLog(
        "helicopter_sweeps.bin",
        "Roll and pitch sweep",
        "A 50-size helicopter under ArduPilot. From its sweeps to a model, margins and gains.",
    ),
    ExampleLog(
        "ordinary_flight.bin",
        "Ordinary flight, no sweep",
        "A helicopter in gusts. What its loops do, what shakes it, and when pitch oscillates.",
    ),
    ExampleLog(
        "coax_flight.bin",
        "Coaxial helicopter",
        "A CoaX of 0.3 kg under ArduPilot, with a yaw sweep: linear model, margins and gains of its yaw.",
    ),
)


def example(name: str) -> Path | None:
    """Where an example lies, by its file's name with or without its end; None where there is none."""
    return next((one.path for one in EXAMPLES if name in (one.file, Path(one.file).stem)), None)
