"""The verb `observability`: what sensors can see of a vehicle, and what they cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from swashplate.control.lqg.observability import Observability, in_words
from swashplate.control.lqg.observability import observability as study
from swashplate.filtering.sensor_suite import suite
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.observability import compose_observability
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.trim import trim


@dataclass(frozen=True, repr=False)
class ObservabilityStudy(Shown):
    """What a sensor suite sees of a vehicle at some speeds.

    Attributes:
        model: the card's title.
        speeds: of the trims [m/s].
        found: of each trim.
    """

    model: str
    speeds: tuple[float, ...]
    found: tuple[Observability, ...]

    def to_document(self) -> dict[str, Any]:
        """All of it as what becomes JSON."""
        trims = []
        for speed, one in zip(self.speeds, self.found, strict=True):
            hidden, faint = ([in_words(direction) for direction in part] for part in (one.hidden, one.faint))
            known = [asdict(state) for state in one.known]
            trims.append({"speed": speed, "hidden": hidden, "faint": faint, "known": known})
        return {"model": self.model, "sensors": [str(s) for s in self.found[0].sensors], "trims": trims}

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_observability(self.model, self.speeds, self.found, title=title)

    def __repr__(self) -> str:
        return "\n\n".join(f"At {v:g} m/s\n{one!r}" for v, one in zip(self.speeds, self.found, strict=True))


def observability(
    vehicle: Vehicle,
    sensors: str,
    *,
    speeds: Sequence[float] = (0.0,),
    seconds: float = 10.0,
    rate: float = 100.0,
    voltage: float | None = None,
) -> ObservabilityStudy:
    """Say which directions of a vehicle's states a sensor suite cannot see, and how well the others are known.

    Args:
        vehicle: the model.
        sensors: KIND@RATE+DELAYms, by commas; see `swashplate.filtering.sensor_suite.suite`.
        speeds: of the trims [m/s].
        seconds: how long is watched [s].
        rate: samples per second of the model [Hz].
        voltage: the battery's [V]; the card's nominal one where not given.

    Raises:
        SwashError: for sensors that are none; TrimError for a speed that cannot be flown.
    """
    chosen = suite(sensors)
    by_speed = tuple(
        study(vehicle, trim(vehicle, speed=at, voltage=voltage), chosen, rate=rate, seconds=seconds) for at in speeds
    )
    return ObservabilityStudy(vehicle.card.title, tuple(speeds), by_speed)
