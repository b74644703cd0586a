"""Files that are something else are told as what they are; tables that begin like them are read."""

from __future__ import annotations

from pathlib import Path

import pytest

from swashplate.errors import FlightError
from swashplate.flights.readers.read import read

ROWS = "time [s],p [rad/s]\n" + "".join(f"{0.01 * k:.2f},{k % 7}\n" for k in range(50))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("version https://git-lfs.github.com/spec/v1\noid sha256:aa\nsize 123456\n", "of a file of 123,456 bytes"),
        ("<!DOCTYPE html>\n<html><head><title>Sign in, please</title></head></html>", r"web \('Sign in, please'\)"),
        ('{"time": [0, 1], "p": [0.1, 0.2]}', "is JSON"),
        ('[{"time": 0, "p": 1}]', "is JSON"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("ending", [".csv", ".log", ".bin", ".mat"])
def test_it_is_named(tmp_path: Path, text: str, words: str, ending: str) -> None:
    path = tmp_path / f"flight{ending}"
    path.write_text(text)
    with pytest.raises(FlightError, match=words):
        read(path)


@pytest.mark.parametrize("head", ["", "<made by hand>,,\n", "{settings},1\n", "[log]\n"])
def test_a_table_that_begins_oddly_is_a_table(tmp_path: Path, head: str) -> None:
    path = tmp_path / "flight.csv"
    path.write_text(head + ROWS)
    assert read(path).values("p").size == 50
