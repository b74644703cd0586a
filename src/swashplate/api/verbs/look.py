"""`swash open` and `swash inspect`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FLIGHT, FromLogs
from swashplate.api.languages import Logs, Names, Texts
from swashplate.api.question import argument, option, setting
from swashplate.api.saying import QUIET, Say, silent
from swashplate.errors import FlightError, SwashError

if TYPE_CHECKING:
    from swashplate.flights.flight import Flight


class Served(FromLogs[None]):
    """What is shown on a page in the browser until it is interrupted."""

    port: int | None = option(default=8017, help="Port of the page; 0 takes any free one.", least=0, most=65535)
    allow_remote: bool = setting(default=False, help="let other machines open the page.")
    host: str = setting(default="127.0.0.1", help="address to listen on; other than loopback with allow_remote")
    open_page: bool = option(default=False, flag="--open", help="Open the page in the browser.")

    def document(self, answer: Any) -> Any:
        raise SwashError("is not for a page in the browser.", channel="--json")

    def text(self, answer: Any, width: int) -> list[Any]:
        return []


class Open(Served):
    """Look at logs in the browser: plots, problems and their corrections, events, spectra, track, sweeps to gains.

    Without a log the page offers examples that come with the package, and a place to drop files; `swash` alone opens
    it. Every view says which command and which lines of Python do the same.
    """

    logs: Logs = argument(default=(), metavar="LOG...", help="Logs to look at; more may be dropped onto the page.")
    port: int | None = option(
        default=None, help="Port of the page; 0 takes any free one. If not given: 8019.", least=0, most=65535
    )

    def answer(self, say: Say = silent) -> None:
        from swashplate.api.open_logs import serve_logs

        serve_logs(self, say)


@dataclass(frozen=True, repr=False)
class Looked:
    """What was seen in logs.

    Attributes:
        shown: tables and texts, in order.
        document: as what becomes JSON.
        flight: what `--out` writes as .nc; None for figures.
        draw: what writes a figure to a file.
        damage: why a log could not be read to its end.
    """

    shown: tuple[Any, ...]
    document: Any
    flight: Any = None
    draw: Any = None
    damage: str = ""


class Inspect(FromLogs[Looked]):
    """Show logs' channels, units, rates, gaps and frequency sweeps, and the problems in them; nothing is changed.

    Then what a flight tells without a sweep: incidents with their times, step responses of the rate loops, filters and
    their delay, noise, and the sweep to fly next.

    With --out FILE.html (or .pdf, .svg, .png) their channels are drawn, several logs over each other. --rotor-speed
    measures the rotor's speed from vibration, --reconstruct finds biases and scale factors of the sensors: with --out
    FILE.nc each writes the flight with it. --map guesses the columns of your own table.
    A record of the test bench shows its columns and procedures. A log that is itself damaged (cut off, bytes lost, its
    clock set back) is shown as far as it could be read, and ends with an error.
    """

    by_name: ClassVar[tuple[str, ...]] = ("plot.html", "plot.pdf", "plot.svg", "plot.png", "flight.nc")

    logs: Logs = argument(metavar="LOG...", help=f"{FLIGHT}.", complete="flight")
    channels: Names | None = option(default=None, help="Channels to draw, one panel each; the usual ones by default.")
    figure: str = option(
        default="time",
        help="What to draw: time, spectrum (Welch), or spectrogram.",
        choices=("time", "spectrum", "spectrogram"),
    )
    align: str = setting(
        default="auto", help="how several logs are aligned", choices=("auto", "motion", "clock", "start", "none")
    )
    theme: str = setting(default="paper", help="colours of a .pdf, .svg or .png", choices=("paper", "light", "dark"))
    map: bool = option(
        default=False,
        help="Guess which column of a table is which channel, and keep the mapping for logs like it; with --mapping, "
        "keep that one.",
    )
    rotor_speed: bool = option(default=False, help="Tell the rotor speed: as the log has it, else from vibration.")
    line: Texts | None = setting(
        default=None,
        metavar="CHANNEL=LOW..HIGH",
        help="with rotor_speed: where a rotor's line lies [Hz]; positive turns clockwise from above",
    )
    per_turn: float = setting(default=1.0, help="with rotor_speed: vibrations per turn that cause the line")
    reconstruct: bool = option(
        default=False, help="Compare rates and accelerations with attitude and position: biases, scale factors."
    )
    rate: float = setting(default=100.0, help="with reconstruct: conditioned rate", unit="Hz", least=1.0, most=2000.0)

    def check_places(self, outs: tuple[Path, ...]) -> None:
        if self.channels and not outs:
            raise SwashError("says what a figure shows.", channel="--channels", hint="Add --out FILE.html.")
        kinds = {out.suffix.lower() == ".nc" for out in outs}
        wanted = self.rotor_speed or self.reconstruct
        if outs and kinds != {wanted}:
            hint = "--rotor-speed and --reconstruct write a flight (.nc); without them a figure is written."
            raise SwashError("is of another kind.", where=outs[0], channel="--out", hint=hint)

    def answer(self, say: Say = silent) -> Looked:
        from swashplate.bench.record_files import is_bench
        from swashplate.flights.datasets import locate

        logs = list(self.logs)
        if self.rotor_speed and self.reconstruct:
            raise SwashError("and --rotor-speed are two questions.", channel="--reconstruct")
        if self.rotor_speed or self.reconstruct or self.map:
            if len(logs) != 1:
                raise SwashError(f"are {len(logs)}, expected one.", channel="LOG")
            if self.map:
                return self._mapped(str(logs[0]))
            return self._rotor() if self.rotor_speed else self._reconstructed()
        if len(logs) == 1 and isinstance(logs[0], str | Path) and is_bench(place := locate(str(logs[0]))):
            return self._bench(str(logs[0]), place)
        return self._inspected(self.read(logs))

    def _inspected(self, flights: list[Flight]) -> Looked:
        from swashplate.flights.inspect import inspect
        from swashplate.flights.review.review import review

        result = [inspect(flight) for flight in flights]
        reviews = [review(flight, swept=one.sweeps) for flight, one in zip(flights, result, strict=True)]
        documents = [
            {**one.to_document(), "review": beside.to_document()} for one, beside in zip(result, reviews, strict=True)
        ]
        damage = [words for one in result for words in one.damage]
        shown = [
            part
            for one, beside in zip(result, reviews, strict=True)
            for part in (one, *([f"\n{beside.body_text}"] if beside.tells else []))
        ]
        return Looked(
            tuple(shown),
            documents[0] if len(documents) == 1 else documents,
            draw=lambda path: self._drawn(flights, path),
            damage="; ".join(damage),
        )

    def _mapped(self, name: str) -> Looked:
        from swashplate.links.logs.kept_mappings import map_table

        mapped = map_table(Path(name), self.mapping)
        return Looked((str(mapped),), mapped.to_document(), damage=" ".join(mapped.faults))

    def _drawn(self, flights: list[Flight], path: Path) -> None:
        from swashplate.api.plot_logs import plot_logs

        plot_logs(
            flights,
            channels=self.channels,
            kind=self.figure,  # pyrefly: ignore[bad-argument-type]
            path=path,
            theme=self.theme,  # pyrefly: ignore[bad-argument-type]
            alignment=self.align,  # pyrefly: ignore[bad-argument-type]
        )

    def _bench(self, name: str, place: Path) -> Looked:
        from swashplate.bench.record_files import read_bench
        from swashplate.reporting.bench_tables import record_as_dict, record_table

        record = read_bench(place)
        return Looked((record_table(record), f"\nEvaluate it with `swash bench {name}`."), record_as_dict(record))

    def _rotor(self) -> Looked:
        from swashplate.flights.rotor_speed import line_words, lines_of, rotor_speed

        measured = rotor_speed(self.read(self.logs)[0], lines=lines_of(self.line or ()), per_turn=self.per_turn)
        lines: Mapping[str, Any] = measured.history[-1].details["lines"]
        return Looked(tuple(line_words(lines)), lines, flight=measured)

    def _reconstructed(self) -> Looked:
        from swashplate.flights.conditioning.reconstruction import reconstruct

        flown = self.read(self.logs)[0].condition(rate=self.rate, cutoff=0.0)
        result = reconstruct(flown)
        return Looked((str(result),), result.to_document(), flight=result.corrected(flown))

    def write(self, answer: Looked, folder: Path, names: tuple[str, ...]) -> None:
        for name in names:
            if answer.flight is not None:
                answer.flight.save(folder / name)
            else:
                answer.draw(folder / name)

    def document(self, answer: Looked) -> Any:
        return answer.document

    def text(self, answer: Looked, width: int) -> list[Any]:
        return list(answer.shown)

    def problems(self, answer: Looked) -> list[str]:
        if not answer.damage:
            return []
        (where, *_) = map(str, self.logs)
        error = FlightError(
            f"{answer.damage}.",
            where=where,
            hint="Everything else was read" + ("." if QUIET.get() else ", and is shown."),
        )
        return [str(error)]
