"""`swash data` and `swash demo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from swashplate.api.question import VerbQuestion, argument, option, setting
from swashplate.api.saying import Say, silent
from swashplate.api.verbs.identify import AnswersFit, Identify

if TYPE_CHECKING:
    from pathlib import Path

    from swashplate.identification.core.result import Result


class ListData(VerbQuestion[Any]):
    """List the files of every known data set and where each is found on this machine."""

    def answer(self, say: Say = silent) -> Any:
        from swashplate.flights.datasets import listing

        return listing()

    def document(self, answer: Any) -> Any:
        return [{**vars(row), "found": row.found and str(row.found)} for row in answer]

    def text(self, answer: Any, width: int) -> list[Any]:
        from swashplate.text_table import text_columns

        cells = [(row.name, row.file, str(row.found or "not here"), row.description) for row in answer]
        missing = sorted({row.name for row in answer if row.found is None})
        hint = [f"\nGet what is not here with `swash data fetch {missing[0]}`."] if missing else []
        return [text_columns(("data set", "file", "where", "what"), cells, left=4), *hint]


class FetchData(VerbQuestion["list[Path]"]):
    """Download the missing files of a data set from its public address into the user's cache, checked by hash."""

    name: str = argument(metavar="NAME", help="The data set, as in `swash data list`.")

    def answer(self, say: Say = silent) -> list[Path]:
        from swashplate.flights.datasets import fetch

        say(f"fetching {self.name}")
        return list(fetch(self.name))

    def document(self, answer: list[Path]) -> Any:
        return list(map(str, answer))

    def text(self, answer: list[Path], width: int) -> list[Any]:
        return ["\n".join(map(str, answer))]


class Demo(AnswersFit):
    """Run the main job: identify the CoaX from one flight and predict another, with a report.

    On the real flights of the data set coax56 where they are found on this machine, otherwise on simulated flights
    with sensor noise, gaps and outliers (the report's first line says so).
    """

    files = Identify.files

    simulated: bool = option(default=False, help="Use simulated flights even if real ones are available.")
    seed: int = setting(default=1, help="seed of the simulated flights' noise.", least=0)

    def answer(self, say: Say = silent) -> Result[object, object]:
        from swashplate.api.demo import run_demo

        return run_demo(self, say)

    def text(self, answer: Result[object, object], width: int) -> list[Any]:
        parts = super().text(answer, width)
        if any(source.simulated for source in answer.data):
            parts = ["On simulated flights; `swash data fetch coax56` gets the real ones.\n", *parts]
        return parts + ([f"Truth:      {answer.beside_truth}"] if answer.beside_truth else [])
