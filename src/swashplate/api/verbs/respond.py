"""`swash respond`: frequency responses from the logs of sweeps, and arithmetic on responses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FromConditioned, called, strings
from swashplate.api.languages import Band, Logs, Names, Numbers, Renamed
from swashplate.api.question import argument, option, setting, verb
from swashplate.api.saying import Say, notice_unless_quiet, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.flights.flight import Flight
    from swashplate.identification.responses.frequency_response import FrequencyResponse

RESPONSES = "responses.nc"
OPERATIONS = ("product", "ratio", "inverse", "negative", "closed", "broken")


class Respond(FromConditioned["FrequencyResponse"]):
    """Frequency responses of outputs to inputs: conditioned on all inputs, composite over windows, with errors.

    Writes responses.nc, responses.json and report.html to --out. A response that cannot be given is named with its
    reason. Exit code 2 if none can be given, if a named channel never moves, or if a log is damaged.

    With --combine the files are responses: they are multiplied, divided, inverted or negated, a loop is closed
    (L / (1 + L) of a broken loop with negative feedback) or broken (T / (1 - T)); FILE:OUTPUT/INPUT takes a pair.

    Raises:
        FlightError: no channel or no record to work on, inputs that no sweep moved while others were swept, a reference
            that is a copy of an input or output, or channels that contradict each other.
        SwashError: no sweep, where no channels are named; windows that are no lengths.
    """

    files: ClassVar[tuple[str, ...]] = (RESPONSES, "responses.json", "report.html")

    logs: Logs = argument(metavar="LOG...", help="Logs of sweeps; FILE@5-30 takes seconds 5 to 30.", complete="flight")
    inputs: Renamed = option(
        default=(),
        metavar="NAME,...",
        help="Input channels, separated by commas: all that moved; what the sweeps moved if not given. NAME=CHANNEL "
        "renames.",
    )
    outputs: Renamed = option(
        default=(),
        metavar="NAME,...",
        help="Output channels, separated by commas; what answers the sweeps if not given. NAME=CHANNEL renames, as "
        "az=az_sid.",
    )
    references: Names = option(
        default=(), help="Injected excitation, for logs flown in a loop: the joint input-output estimate."
    )
    band: Band | None = option(default=None, help="Limits in Hz, for example 0.1-10.")
    combine: str | None = option(
        default=None, help="Combine responses instead; closed and broken are of a loop.", choices=OPERATIONS
    )
    windows: Numbers | None = setting(
        default=None, help="window lengths in s, by commas; by the book's rules if not given.", least=0.001, most=1e5
    )
    direct: bool = setting(default=False, help="do not use sweeps in the inputs as references")

    def answer(self, say: Say = silent) -> FrequencyResponse:
        return self._responded(say) if self.combine is None else self._combined()

    def _responded(self, say: Say) -> FrequencyResponse:
        from swashplate.flights.checked import check_disjoint
        from swashplate.identification.responses.respond import respond

        ins, outs, references = _pairs(self.inputs), _pairs(self.outputs), strings(self.references)
        say("reading logs")
        raw = self.read(self.logs)
        if not ins or not outs:
            moved, answering = self._swept_channels(raw)
            ins, outs = ins or _pairs(moved), outs or _pairs(answering)
            told = f"inputs {', '.join(ins)}, outputs {', '.join(outs)}"
            notice_unless_quiet(f"{told}: what the sweeps moved, where --inputs and --outputs name nothing else")
        flights = self.uniform(self.logs, raw, (*ins, *outs, *references), names=ins | outs)
        check_disjoint(flights, called(self.logs))
        say("computing responses")
        return respond(
            flights,
            inputs=list(ins),
            outputs=list(outs),
            references=references,
            band=self.band,
            windows=self.windows,
            direct=self.direct,
        )

    def _swept_channels(self, flights: list[Flight]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What the logs' sweeps moved, and what answers to that, in the order of the sweeps."""
        from swashplate.flights.maneuvers.sweeps import sweeps
        from swashplate.links.logs.sweep_channels import channels_of

        swept = [channels_of(flight, sweep) for flight in flights for sweep in sweeps(flight)]
        if not swept:
            raise SwashError(
                "No sweep was found, so no response of the vehicle can be given.",
                where=", ".join(called(self.logs) or ()) or None,
                hint="`swash inspect` tells what the flight shows without one, and the sweep to fly next.",
            )
        inputs, outputs = (tuple(dict.fromkeys(one[place] for one in swept)) for place in (0, 1))
        return inputs, outputs

    def _combined(self) -> FrequencyResponse:
        from swashplate.identification.responses.arithmetic import combine

        logs = list(self.logs)
        if len(logs) > 2:
            raise SwashError(f"are {len(logs)}; it takes one or two.", channel="LOG")
        return combine(self.combine or "", *(one_response(one) for one in logs))  # it says which  # pyrefly: ignore[bad-argument-type]

    def document(self, answer: FrequencyResponse) -> Any:
        if self.combine is not None:
            return answer.to_document()
        from swashplate.identification.frequency.handling_readings import handling_lines

        return {**answer.to_document(), "handling": [one.to_document() for one in handling_lines(answer)]}

    def write(self, answer: FrequencyResponse, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.atomic import write_json
        from swashplate.reporting.report import report

        for name in names:
            if name.endswith(".nc"):
                answer.save(folder / name)
            elif name.endswith(".json"):
                write_json(folder / name, self.document(answer))
            else:
                report(answer, path=folder / name)

    def problems(self, answer: FrequencyResponse) -> Sequence[str]:
        return answer.problems

    def text(self, answer: FrequencyResponse, width: int) -> list[Any]:
        if self.combine is not None or not answer.problems:
            return super().text(answer, width)
        from swashplate.flights.maneuvers.sweeps import sweeps
        from swashplate.flights.review.review import review

        beside = [review(flight, swept=()) for flight in self.read(self.logs) if not sweeps(flight)]
        told = [f"\nWhat {each.source} tells without a sweep\n\n{each.body_text}" for each in beside if each.tells]
        return [*super().text(answer, width), *told]


def _pairs(given: Any) -> dict[str, str]:
    """Names of the result, and the log's channels behind them."""
    return dict(given) if isinstance(given, dict) else {name: name for name in strings(given)}


def one_response(given: Any) -> FrequencyResponse:
    """The responses in a file or folder, or one pair of them."""
    if not isinstance(given, str | Path):
        return given
    path, pair = Path(given), ""
    if not path.exists() and ":" in str(given):
        name, _, pair = str(given).rpartition(":")
        path = Path(name)
    responses = load_responses(path)
    output, _, input = pair.partition("/")
    return responses.select((output.strip(),), (input.strip(),)) if pair else responses


def load_responses(given: Any) -> FrequencyResponse:
    """The responses in a file, or in a folder that `swash respond` wrote; responses as they are."""
    from swashplate.identification.responses.frequency_response import FrequencyResponse

    if isinstance(given, FrequencyResponse):
        return given
    path = Path(given)
    return FrequencyResponse.load(path / RESPONSES if path.is_dir() else path)


respond = verb("respond", Respond)
