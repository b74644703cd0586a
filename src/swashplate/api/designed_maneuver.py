"""What a designed maneuver is: ways to fly, what each would tell, what seconds buy, and the flight card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swashplate.arrays import Array
from swashplate.atomic import write_text
from swashplate.errors import ManeuverError
from swashplate.flights.maneuvers.ardupilot_chirp import MIXER, Chirp
from swashplate.flights.maneuvers.composed import ComposedMultisine
from swashplate.flights.maneuvers.maneuver_design import sampled
from swashplate.flights.maneuvers.series import FADE, Maneuver
from swashplate.flights.tabular import as_csv
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.figures.of_results import plain_page, section_of_pieces
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.text_table import text_table

LEAD = 3.0
"""s of hover before and after a maneuver."""


def sample_times(piece: Maneuver, rate: float) -> Array:
    """Of a maneuver sampled at a rate [Hz], from its start [s]."""
    return np.arange(round(piece.duration * rate)) / rate


@dataclass(frozen=True)
class Offer:
    """One way to fly, and what it would tell.

    Attributes:
        kind: "multisine" (designed), "sweep" or "3211".
        pieces: maneuvers, flown one after the other.
        seconds: of excitation.
        bounds: standard deviation of each unknown, in its unit, the worst of the draws.
        peaks: largest attitude [deg], rate [deg/s] and distance [m] in the draws.
    """

    kind: str
    pieces: tuple[Maneuver, ...]
    seconds: float
    bounds: Mapping[str, float]
    peaks: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class DesignedManeuver(Shown):
    """What to fly for some parameters.

    Attributes:
        vehicle: whose. unknown: the parameters.
        offers: the designed multisine first, then the usual maneuvers of the same length and limits.
        buys: seconds of the designed one, and the bounds then.
        limits: that were kept. criterion, robust, draws, spread: see `design_maneuver`.
        rate: of the series [Hz].
        noise: whose noise of air and sensors the bounds are for, in words.
    """

    vehicle: Vehicle
    unknown: tuple[str, ...]
    offers: tuple[Offer, ...]
    buys: tuple[tuple[float, Mapping[str, float]], ...]
    limits: Mapping[str, float]
    criterion: str
    robust: str
    draws: int
    spread: float
    rate: float
    noise: str = "usual indoors"

    @property
    def best(self) -> Offer:
        """The offer whose bounds multiply (D) or add up, in squares, (A) to least."""
        values = [abs(self.vehicle.numbers[n].value) or 1.0 for n in self.unknown]

        def size(offer: Offer) -> float:
            relative = np.array([offer.bounds[n] for n in self.unknown]) / values
            return float(np.sum(np.log(relative)) if self.criterion == "D" else np.sum(relative**2))

        return min(self.offers, key=size)

    @property
    def columns(self) -> tuple[str, ...]:
        """What bounds are told of: the unknowns in percent."""
        return tuple(f"{name} %" for name in self.unknown)

    def cells(self, bounds: Mapping[str, float]) -> list[str]:
        """Bounds by `columns`."""
        return [f"{100.0 * bounds[n] / (abs(self.vehicle.numbers[n].value) or np.nan):.3g}" for n in self.unknown]

    def rows(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heading and cells: what each way to fly would tell, bounds in percent."""
        head = ("fly", "seconds", *self.columns, "attitude deg", "rate deg/s", "place m")
        rows: list[tuple[str, ...]] = [
            (
                o.kind,
                f"{o.seconds:g}",
                *self.cells(o.bounds),
                *(f"{o.peaks[k]:.3g}" for k in ("attitude", "rate", "place")),
            )
            for o in self.offers
        ]
        return head, rows

    def seconds_rows(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heading and cells: what each length of the designed maneuver buys."""
        head = ("seconds", *self.columns)
        return head, [(f"{t:g}", *self.cells(bounds)) for t, bounds in self.buys]

    def card(self) -> str:
        """The flight card, to print: what to fly, in which order, when to stop."""
        best, limits = self.best, self.limits
        bounds = [f"{name} {cell} %" for name, cell in zip(self.unknown, self.cells(best.bounds), strict=True)]
        lines = [
            f"FLIGHT CARD   {self.vehicle.card.title}",
            f"To find      {', '.join(self.unknown)}",
            "",
            "Before",
            f"  [ ] log at {self.rate:g} Hz or faster: commands, pose, battery voltage"
            + (", both rotor speeds" if self.vehicle.traits.coaxial else ""),
            f"  [ ] room of {2.0 * limits['place']:.3g} m, nobody inside; battery for at least "
            f"{best.seconds + 2.0 * LEAD * len(best.pieces):.0f} s",
            "Fly",
        ]
        for number, piece in enumerate(best.pieces, 1):
            band = "" if piece.band is None else f", {piece.band[0]:.2g}-{piece.band[1]:.2g} Hz"
            peaks = f"at most {piece.amplitude:.3g}"
            if isinstance(piece, ComposedMultisine):
                tops = {
                    axis: float(np.max(np.abs(s))) for axis, s in piece.signals(sample_times(piece, self.rate)).items()
                }
                peaks = ", ".join(f"{axis} at most {top:.3g}" for axis, top in tops.items())
            lines.append(
                f"  [ ] {number}. hover {LEAD:g} s, {piece.kind} of {'+'.join(piece.axes)}{band}, "
                f"{piece.duration:.4g} s, {peaks}, hover {LEAD:g} s"
            )
        lines += [
            "Expect",
            f"  attitude within {best.peaks['attitude']:.3g} deg, rates within {best.peaks['rate']:.3g} deg/s, "
            f"{best.peaks['place']:.2g} m from the start",
            "Stop",
            f"  [ ] beyond {limits['attitude']:g} deg, {limits['rate']:g} deg/s or {limits['place']:g} m; "
            "an input at its limit for a second; a sound that is new; battery low",
            "After",
            f"  [ ] the bounds should be {', '.join(bounds)} (noise {self.noise})",
        ]
        return "\n".join(lines)

    def save(self, path: str | Path) -> tuple[Path, ...]:
        """Write the best offer's series as .csv (numbered where there are several), the card as .txt, and ArduPilot's
        parameters as .param where all of it is sweeps of sticks.

        Raises:
            ManeuverError: for another suffix than .csv.
        """
        file = Path(path)
        if file.suffix.lower() != ".csv":
            raise ManeuverError(f"ends in '{file.suffix}', expected .csv.", where=path)
        written, pieces = [], self.best.pieces
        for number, piece in enumerate(pieces, 1):
            own = file if len(pieces) == 1 else file.with_stem(f"{file.stem}-{number}")
            written.append(write_text(own, as_csv(sampled(piece, rate=self.rate))))
            if piece.kind == "sweep" and piece.axes[0] in MIXER and piece.amplitude <= 1.0 and piece.band is not None:
                fade = FADE * piece.duration
                chirp = Chirp.planned(
                    MIXER[piece.axes[0]], piece.amplitude, piece.band, record=piece.duration, fade=fade
                )
                written.append(write_text(own.with_suffix(".param"), chirp.parameter_file()))
        written.append(write_text(file.with_suffix(".txt"), self.card() + "\n"))
        return tuple(written)

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        return {
            "vehicle": self.vehicle.name,
            "unknown": list(self.unknown),
            "best": self.best.kind,
            "offers": [
                {"kind": o.kind, "seconds": o.seconds, "bounds": dict(o.bounds), "peaks": dict(o.peaks),
                 "pieces": [vars(p) for p in o.pieces]}
                for o in self.offers
            ],
            "buys": [{"seconds": t, "bounds": dict(bounds)} for t, bounds in self.buys],
            "limits": dict(self.limits),
            "criterion": self.criterion,
            "noise": self.noise,
            "robust": self.robust,
            "draws": self.draws,
            "spread": self.spread,
        }  # fmt: skip

    def page(self, *, title: str | None = None) -> Report:
        """The page of `sp.report`, under a heading, its own where None."""
        head, rows = self.rows()
        ways = {
            row[0]: ", ".join(f"{name} {cell}" for name, cell in zip(head[1:], row[1:], strict=True)) for row in rows
        }
        return plain_page(
            title or f"Maneuver for {', '.join(self.unknown)} of {self.vehicle.name}",
            summary={"Best": self.best.kind, **ways},
            sections=[section_of_pieces(self.best.pieces, rate=self.rate)],
        )

    def __repr__(self) -> str:
        told = (
            f"bounds are the worst of {self.draws} draws of the prior" if self.draws > 1 else "at the model's numbers"
        )
        return "\n".join(
            [
                f"For {', '.join(self.unknown)} of {self.vehicle.name}: {self.best.kind} ({told}).",
                text_table(*self.rows()),
                "",
                "What each second buys: the same maneuver shorter or longer, bounds with the root of the seconds",
                text_table(*self.seconds_rows()),
                "",
                self.card(),
            ]
        )
