"""What a page draws over time comes back as series: named, with units, predictions apart; other pages are refused."""

from __future__ import annotations

import base64
import gzip
import io
import json
import os
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import ExportError
from swashplate.reporting import packing
from swashplate.reporting.packing import figures_text
from swashplate.reporting.page_series import page_series
from swashplate.reporting.structure import Figure
from swashplate.reporting.theme import line

TIME = np.arange(1000) / 100.0


def page(folder: Path, *, over: str = "time [s]") -> Path:
    twice = np.concatenate([TIME[:100], [np.nan], TIME[50:150]])
    spec = {
        "data": [
            line(TIME, np.sin(TIME), name="phi, flight", color="#000"),
            line(twice, np.cos(twice), name="model", color="#000"),
            line(TIME, np.zeros(TIME.size), name="±2σ", color="#000", fill="toself"),
            line(TIME, TIME, name="servo_roll", color="#000", axis="2"),
        ],
        "layout": {"yaxis": {"title": {"text": "phi [deg]"}}, "yaxis2": {"title": {"text": "input [-]"}},
                   "xaxis2": {"title": {"text": over}}},
    }  # fmt: skip
    figure = Figure("prediction-1", spec, 300, "", "")
    path = folder / "report.html"
    path.write_text(f'<script type="text/plain" id="figures-gzip">{figures_text([figure])}</script>', encoding="utf-8")
    return path


def test_every_line_over_time_with_its_unit(tmp_path: Path) -> None:
    found = page_series(page(tmp_path))
    assert sorted(found.streams) == [
        "prediction-1/input_servo_roll", "prediction-1/phi_flight", "prediction-1/phi_model_1",
        "prediction-1/phi_model_2",
    ]  # fmt: skip
    measured = found["prediction_1_phi_flight"]
    assert measured.attrs["units"] == "deg"
    assert measured.values == pytest.approx(np.sin(TIME), abs=1e-4)
    assert found.time("prediction_1_phi_flight") == pytest.approx(TIME, abs=1e-3)
    assert found.values("prediction_1_phi_model_2") == pytest.approx(np.cos(TIME[50:150]), abs=1e-4)
    assert found["prediction_1_input_servo_roll"].attrs["units"] == "1"


def test_it_is_written_as_mcap(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader", reason="the extra 'mcap' is not installed")
    (content,) = sp.export_flight(page(tmp_path), name="predicted").files.values()
    read = list(reader.make_reader(io.BytesIO(content)).iter_messages())
    mine = [json.loads(m.data) for _, c, m in read if c.topic == "/prediction-1/phi_flight"]
    assert [row["prediction_1_phi_flight"] for row in mine] == pytest.approx(np.sin(TIME), abs=1e-4)


def test_other_pages_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="draws nothing over time"):
        page_series(page(tmp_path, over="frequency [Hz]"))
    (tmp_path / "a.html").write_text("<html></html>", encoding="utf-8")
    with pytest.raises(ExportError, match=r"a\.html: is no report of swashplate"):
        page_series(tmp_path / "a.html")
    with pytest.raises(ExportError, match="cannot be read"):
        page_series(tmp_path / "none.html")
    damaged = page(tmp_path).read_text(encoding="utf-8")
    for cut in (60, 100, len(damaged) - 40):
        (tmp_path / "b.html").write_text(damaged[:cut] + "<", encoding="utf-8")
        with pytest.raises(ExportError, match="figures cannot be read"):
            page_series(tmp_path / "b.html")


def test_a_page_of_zeros_and_a_pipe_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packing, "LARGEST", 100_000)
    zeros = base64.b64encode(gzip.compress(bytes(1_000_000))).decode()
    (tmp_path / "report.html").write_text(f'<script id="figures-gzip">{zeros}</script>')
    with pytest.raises(ExportError, match="are cut off, or unpack to more than 100,000 bytes"):
        page_series(tmp_path / "report.html")
    os.mkfifo(tmp_path / "pipe.html")
    with pytest.raises(ExportError, match="it is a pipe or a device"):
        page_series(tmp_path / "pipe.html")
