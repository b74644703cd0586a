"""Which files are bench records, whatever their form, and reading them: one file, a folder, or a data set by name.

A file's content decides, not its name: this project's CSV records, and the CoaX-56's MATLAB tables.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from swashplate.bench.record import BenchRecord, head_of, read_record
from swashplate.bench.record_tables import is_table, read_table
from swashplate.errors import BenchError
from swashplate.flights.datasets import REGISTRY, find, locate
from swashplate.flights.readers import mat
from swashplate.flights.readers.source import Source, open_source


def is_bench(path: str | Path) -> bool:
    """Whether a file is a bench record of a form that `read_bench` reads."""
    place = Path(path)
    return place.is_file() and place.stat().st_size > 0 and _form(open_source(place)) != ""


def _form(source: Source) -> str:
    """ "record" or "table"; "" for anything else."""
    if mat.is_level_5(source.content):
        return "table" if is_table(mat.load(source)) else ""
    text = source.text
    return "record" if text is not None and "procedure" in head_of(text[:4096])[0] else ""


def read_bench(path: str | Path) -> BenchRecord:
    """A bench record in any of the forms.

    Raises:
        BenchError: where the file is none, or contradicts its form.
        UnitError, FlightError: as the forms' readers.
    """
    source = open_source(path)
    if _form(source) == "table":
        return replace(read_table(path), sha256=source.sha256)
    if source.text is None:
        raise BenchError(
            "is no bench record.",
            where=source.path.name,
            hint="Known are swashplate's CSV records and the CoaX-56's bench tables (.mat). "
            "Flights are for `swash inspect` and `swash identify`.",
        )
    return replace(read_record(path), sha256=source.sha256)  # which says what a record needs


def read_records(*places: str | Path) -> tuple[BenchRecord, ...]:
    """Records of files, of all CSV and MATLAB files in folders, and of data sets by name, each file once.

    Args:
        places: files, folders, "coax56/bench_input_to_rpm" or the name of a data set ("coax56": its bench files).

    Raises:
        BenchError: where a folder is missing or holds none, or as `read_bench`.
        DatasetError: for a data set's file that is not on this machine.
    """
    files = dict.fromkeys(path.resolve() for place in places for path in _files(place))
    return tuple(read_bench(path) for path in files)


def _files(place: str | Path) -> Sequence[Path]:
    path = Path(place)
    if not path.exists() and path.as_posix() in REGISTRY:
        return list(_of_data_set(path.as_posix()))
    path = locate(place)
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise BenchError("is not a folder and not a file.", where=path, hint="Give the folder with the bench records.")
    paths = sorted(file for file in path.iterdir() if file.suffix.lower() in (".csv", ".mat"))
    if not paths:
        raise BenchError(
            "holds no .csv or .mat file.", where=path, hint="`swash bench simulate DIR` makes records to look at."
        )
    return paths


def _of_data_set(name: str) -> Iterator[Path]:
    files = [file for file, entry in REGISTRY[name].files.items() if entry.kind == "bench"]
    for file in files:
        found = find(name, file)
        if found is None:
            raise BenchError(
                "is not on this machine.", where=f"{name}/{file}", hint=f"Get it with `swash data fetch {name}`."
            )
        yield found
