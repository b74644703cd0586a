"""`swash track`: a log replayed as a stream, and what an estimator on board would have known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FLIGHT, FromFewLogs, strings
from swashplate.api.languages import Aircraft, Band, Log, Names, Renamed, Texts, Values
from swashplate.api.question import argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.track import Tracking


class TrackLog(FromFewLogs["Tracking"]):
    """Estimate coefficients of equations of motion along a log, sample by sample as on board, with bounds over time.

    Equations go through recursive Fourier regression (no derivative is taken, nothing is filtered), parameters of a
    vehicle through an extended Kalman filter. Gaps, NaN values and jumps of the clock hold the estimate, and are
    reported. Writes report.html and track.json to --out. Examples:

    swash track flight.csv --equation "q_dot = Mq*q + Md*servo_pitch + bias" --held servo_pitch --out tracked

    swash track flight.nc --vehicle coax --unknown mass --out tracked

    Raises:
        IdentificationError: an equation that is none, none at all, or settings that cannot work.
        FlightError: a channel that the flight lacks, or a stream of fewer than three samples.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "track.json")

    log: Log = argument(metavar="FLIGHT", help=f"{FLIGHT}.", complete="flight")
    equation: Texts | None = option(
        default=None, help="As 'p_dot = Lp*p + La*aileron - 9.81*theta + bias'. Repeatable.", kw_only=False
    )
    vehicle: Aircraft | None = option(
        default=None,
        help="A linear model whose rows replace --equation; or a vehicle, with --unknown.",
        complete="vehicle",
    )
    unknown: Names = option(default=(), help="Parameters of the vehicle, separated by commas, for example mass.")
    held: Names = option(default=(), help="Channels that are constant between samples (commands), separated by commas.")
    band: Band | None = option(
        default=None, help="Frequencies that are used [Hz]; 0.1-2.5 if not given, or to a fifth of the rate."
    )
    memory: float | None = option(default=None, help="Time constant of forgetting; none by default.", unit="s")
    wander: float = setting(default=0.02, help="relative change of the parameters in a second, one sigma")
    code: Path | None = option(default=None, metavar="DIR", help="Write the estimators as C99 here.")
    rate: float | None = setting(
        default=None, help="samples a second; the log's own if not given", unit="Hz", least=1.0
    )
    spacing: float | None = setting(
        default=None, help="distance between frequencies; HIGH / 25 by default", unit="Hz", least=1e-4
    )
    instrument: Names = setting(
        default=(), help="commands that no controller gives: with them strong gusts do not bias"
    )
    delay: Values | None = setting(default=None, help="channels that act late, by name", unit="s")
    spread: float = setting(default=0.2, help="possible relative error of the parameters at the start")
    every: float = setting(default=0.2, help="time between two estimates", unit="s", least=0.001)
    rename: Renamed | None = setting(
        default=None, help="NAME=CHANNEL, by commas: the log's CHANNEL as the model's NAME"
    )

    def answer(self, say: Say = silent) -> Tracking:
        from swashplate.api.track import follow_log

        if strings(self.unknown) and self.vehicle is None:
            raise SwashError("is of a vehicle: give --vehicle too.", channel="--unknown")
        if (self.vehicle is None) == (not self.equation):
            raise SwashError("is wanted, or --vehicle: one of the two.", channel="--equation")
        made = follow_log(self, say)
        if self.code is not None:
            made.code().save(self.code)
        return made

    def text(self, answer: Tracking, width: int) -> list[Any]:
        notes = [f"\n{note}" for note in answer.code().notes] if self.code is not None else []
        return [repr(answer), *notes, *([f"\nWritten: {self.code}"] if self.code is not None else [])]

    def problems(self, answer: Tracking) -> Sequence[str]:
        return answer.problems


track = verb("track", TrackLog)
