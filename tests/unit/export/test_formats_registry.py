"""Formats and readers of other packages are found by name and content."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import ExportError, SwashError
from swashplate.export.formats import FORMATS, Export, ExportRequest
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.read import READERS
from swashplate.flights.readers.source import Source


def _names(asked: ExportRequest) -> Export:
    return Export({f"{asked.name}.txt": " ".join(asked.linear().states).encode()})


@pytest.fixture
def other_package(monkeypatch: pytest.MonkeyPatch) -> None:
    package = ModuleType("of_another")
    package.names = _names  # type: ignore[attr-defined]
    package.NAME, package.VERSION = "counted", "1"  # type: ignore[attr-defined]
    package.recognises = lambda source: source.content.startswith(b"COUNTED,")  # type: ignore[attr-defined]

    def read(source: Source, options: Options) -> Flight:
        values = np.array([float(v) for v in source.content.decode().split(",")[1:]])
        return Flight({"a": stream(np.arange(values.size) * 0.1, {"u": values})})

    package.read = read  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "of_another", package)
    for registry, name, value in ((FORMATS, "names", "of_another:names"), (READERS, "counted", "of_another")):
        point = EntryPoint(name, value, f"swashplate.{registry.group}")
        monkeypatch.setitem(registry.__dict__, "_others", {name: point})


def test_a_format_of_another_package_writes_its_files(other_package: None, tmp_path: Path) -> None:
    model = sp.structure("heave")
    made = sp.export_model(model, "names", name="h")
    assert made.save(tmp_path) == [tmp_path / "h.txt"]
    assert (tmp_path / "h.txt").read_text().split() == list(model.structure.states)  # type: ignore[union-attr]


def test_a_format_that_nobody_has_is_told_with_those_that_there_are() -> None:
    with pytest.raises(ExportError, match=r"'names' is no format.*c, fmu"):
        sp.export_model("heave", "names")


def test_another_packages_reader_is_asked_before_the_plain_table(other_package: None, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("COUNTED,1,2,3")
    assert sp.read(log).values("u").tolist() == [1.0, 2.0, 3.0]


def test_without_that_package_the_same_log_is_refused(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("COUNTED,1,2,3")
    with pytest.raises(SwashError):
        sp.read(log)


def test_an_export_is_opened_by_its_name_or_file_and_carries_its_name(tmp_path: Path) -> None:
    made = sp.export_model("heave", "control")
    [path] = made.save(tmp_path)
    assert path.name == "heave_control.json"
    again = sp.export_model(path, "control", name="heave")
    assert again.files["heave_control.json"] == made.files["heave_control.json"]
