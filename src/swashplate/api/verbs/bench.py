"""`swash bench`: a folder of bench records becomes a card; the measurement plan; records of the virtual bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import strings
from swashplate.api.languages import Aircraft, Texts, Things
from swashplate.api.question import Answer, VerbQuestion, argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError
from swashplate.models.usual import USUAL

if TYPE_CHECKING:
    from swashplate.bench.plan import MeasurementPlan
    from swashplate.bench.record import BenchRecord
    from swashplate.bench.result import Bench
    from swashplate.models.vehicle import Vehicle


class OnBench(VerbQuestion[Answer]):
    """The published card."""

    vehicle: Aircraft = setting(
        default=USUAL, help="the published card: a vehicle's name, or a file.", complete="vehicle"
    )

    def published(self) -> Vehicle:
        """Its vehicle."""
        from swashplate.models.catalogue import vehicle

        return vehicle(self.vehicle) if isinstance(self.vehicle, str | Path) else self.vehicle


class EvaluateBench(OnBench["Bench"]):
    """Evaluate records into a card; a contradiction in one of them ends without a card.

    The card has value, standard deviation, source files and procedure of what was measured, and the published value
    of what was not. Records are this project's CSV files or the CoaX-56's bench tables (.mat).
    --out FILE.toml writes the card, --out FILE.html the report.
    """

    files: ClassVar[tuple[str, ...]] = ("card.toml", "report.html")

    records: Things = argument(
        metavar="RECORDS",
        help="Folder with one file a record, files, or a data set's name (coax56, coax56/bench_input_to_rpm).",
    )

    def answer(self, say: Say = silent) -> Bench:
        from swashplate.bench.evaluate import evaluate
        from swashplate.bench.record import BenchRecord
        from swashplate.bench.record_files import read_records

        aircraft = self.published()
        say("reading records")
        read = [one for g in self.records for one in ([g] if isinstance(g, BenchRecord) else read_records(str(g)))]
        say("evaluating the bench")
        return evaluate(read, aircraft)

    def write(self, answer: Bench, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.atomic import write_text
        from swashplate.reporting.bench import bench_report

        for name in names:
            if name.endswith(".html"):
                bench_report(answer, path=folder / name)
            elif answer.names:
                write_text(folder / name, answer.model.card.to_toml())
            elif len(names) == 1:
                raise SwashError(
                    "nothing in the records is a parameter of the card.",
                    channel="--out",
                    hint="Leave the card away; the findings are printed, and stand in the report.",
                )

    def document(self, answer: Bench) -> Any:
        from swashplate.api.bench import document

        return document(answer)

    def text(self, answer: Bench, width: int) -> list[Any]:
        from swashplate.api.bench import doubts
        from swashplate.reporting.bench_tables import bench_tables

        lines = [f"! {words}" for words in doubts(answer)]
        lines += [f"Left out: {words}" for result in answer.details.results for words in result.left_out]
        if answer.names and answer.details.kept:
            lines.append(f"Kept as published, no record: {', '.join(answer.details.kept)}")
        return [*bench_tables(answer), *(["\n" + "\n".join(lines)] if lines else [])]


class PlanBench(OnBench["MeasurementPlan"]):
    """Print the measurement plan: the records, how long each takes, and how many passes the wanted accuracy needs."""

    only: Texts = option(default=(), metavar="PROCEDURE", help="Only this procedure; may be repeated.")
    accuracy: float = option(default=0.01, help="Required relative standard deviation.", least=1e-5, most=1.0)

    def answer(self, say: Say = silent) -> MeasurementPlan:
        from swashplate.bench.plan import plan

        return plan(self.published(), only=strings(self.only), accuracy=self.accuracy)

    def text(self, answer: MeasurementPlan, width: int) -> list[Any]:
        from swashplate.text_table import text_columns as table

        rows = [(r.name, ", ".join(r.procedures), f"{r.duration:.0f}", r.about) for r in answer.records]
        cells = [
            (a.name, f"{a.value:.5g}", f"{a.sigma:.2g}", a.unit, str(a.repeats or "too many"), ", ".join(a.procedures))
            for a in answer.aims
        ]
        head = ("parameter", "value", "sigma", "unit", f"passes for {100 * self.accuracy:g} %", "by")
        return [
            table(("record", "procedure", "seconds", "points"), rows, left=2, words=(3,)),
            f"\nOne pass takes {answer.duration / 60.0:.0f} min of records. It gives, on the virtual bench:\n",
            table(head, cells, words=(3, 5)),
        ]


class SimulateBench(OnBench["tuple[BenchRecord, ...]"]):
    """Make the records of the virtual bench: the vehicle held still, by the equations of flight."""

    folder: Path | None = argument(default=None, metavar="DIR", help="Folder for the records; it is made if missing.")
    only: Texts = option(default=(), metavar="PROCEDURE", help="Only this procedure; may be repeated.")
    repeats: int = setting(default=1, help="passes through the points of each record.", least=1)
    seed: int = option(default=0, help="Seed of noise, bias, drift and vibration.", least=0)

    def check_places(self, outs: tuple[Path, ...]) -> None:
        if self.folder is None:
            raise SwashError("is missing.", channel="DIR", hint="Name the folder for the records.")

    def answer(self, say: Say = silent) -> tuple[BenchRecord, ...]:
        from swashplate import atomic
        from swashplate.bench.plan import planned
        from swashplate.bench.record import write_record
        from swashplate.bench.virtual_bench import repeated, virtual_bench

        say("simulating the bench (compiling takes longest the first time)")
        aircraft = self.published()
        wanted = [repeated(record, self.repeats) for record in planned(aircraft, strings(self.only))]
        records = tuple(virtual_bench(aircraft, wanted, seed=self.seed))
        if self.folder is not None:
            with atomic.folder_when_complete(self.folder, ours=()) as folder:
                for record in records:
                    write_record(record, folder / record.name)
        return records

    def document(self, answer: Any) -> Any:
        return {"written": [str((self.folder or Path()) / record.name) for record in answer]}

    def text(self, answer: Any, width: int) -> list[Any]:
        return [f"{len(answer)} records in {self.folder}: {', '.join(record.name for record in answer)}"]


evaluate_bench = verb("evaluate_bench", EvaluateBench)
simulate_bench = verb("simulate_bench", SimulateBench)
