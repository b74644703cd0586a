"""The page as text: self-contained, escaped, written in one piece; and the still pictures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from report_pages import read_figures
from report_samples import fit, modes, validation
from swashplate.errors import SwashError
from swashplate.reporting.figures.of_flight import over_time
from swashplate.reporting.html import render, write_page
from swashplate.reporting.packing import figures_text
from swashplate.reporting.report import report
from swashplate.reporting.structure import Figure, Report, Section
from swashplate.reporting.theme import line

NASTY = "<script>alert('x')</script><img src=x onerror=alert(1)>.mat"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("report")
    path = report(fit(name=NASTY, simulated=True), validation(name=NASTY), path=folder / "r.html", modes=modes())
    return path.read_text(encoding="utf-8")


def without_scripts(page: str) -> str:
    return re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def packed_of(page: str) -> str:
    """The figures as they lie in a page."""
    found = re.search(r'id="figures-gzip">([A-Za-z0-9+/=]*)</script>', page)
    assert found
    return found[1]


def test_words_from_files_stay_words(page: str) -> None:
    assert "<script>alert" not in page
    assert "<img" not in without_scripts(page)
    assert "&lt;script&gt;alert" in page
    spec = {"data": [line([0], [0], name=NASTY, color="#000000")], "layout": {"height": 100}}
    nasty = Figure("one", spec, NASTY, NASTY)
    drawn = render(Report(NASTY, (), (), nasty, (), made=""))
    assert "<script>alert" not in drawn
    (spec,) = read_figures(packed_of(drawn))
    assert spec["data"][0]["name"] == NASTY.replace("<", "‹")
    assert spec["data"][0]["hovertemplate"].endswith("<extra></extra>"), "plotly's own tags stay"


def test_page_is_complete_in_itself(page: str) -> None:
    rest = without_scripts(page)
    assert not re.search(r"""(src|href)\s*=\s*["'](https?:)?//""", rest)
    assert "@import" not in rest
    assert "url(" not in rest
    assert page.count('id="plotly-gzip"') == 1
    assert page.count("<script>") == 1


def test_first_words_of_the_body_say_simulated(page: str) -> None:
    body = page[page.index("<body>") :]
    words = re.sub(r"<[^>]*>|\s+", " ", body).strip()
    assert words.startswith("SIMULATED FLIGHT")


def test_headings_and_tables_can_be_read_aloud(page: str) -> None:
    rest = without_scripts(page)
    assert rest.count("<h1>") == 1
    tables = rest.count("<table")
    assert tables > 5
    assert rest.count('scope="row"') > tables
    assert len(re.findall(r'role="img" aria-label="[^"]{20,}"', rest)) == rest.count('class="canvas"')
    identifiers = re.findall(r' id="([^"]+)"', rest)
    assert len(identifiers) == len(set(identifiers))
    for target in re.findall(r'href="#([^"]+)"', rest):
        assert target in identifiers


def test_page_is_small_enough_to_mail(page: str) -> None:
    assert len(page.encode()) < 2.5e6


def test_numbers_come_through_the_packing_as_they_were() -> None:
    time = np.linspace(5.0, 65.0, 3001)
    values = np.where(np.abs(time - 30.0) < 1.0, np.nan, 100.0 * np.sin(time))
    still = np.full(time.size, -2.5)
    layout = {"xaxis": {}, "yaxis": {}, "xaxis2": {"type": "log"}, "yaxis2": {}}
    data = [line(time, values, name="a", color="#000000"), line(time, still, name="b", color="#000000", axis="2")]
    given = Figure("one", {"data": data, "layout": {**layout, "height": 100}}, "", "")
    (spec,) = read_figures(figures_text([given]))
    assert spec["name"] == "one"
    back = np.array([[np.nan if v is None else v for v in trace[side]] for trace in spec["data"] for side in "xy"])
    np.testing.assert_allclose(back[0], time, atol=60.0 / 65534)
    np.testing.assert_array_equal(np.isnan(back[1]), np.isnan(values))
    np.testing.assert_allclose(back[1], values, atol=200.0 / 65534)
    np.testing.assert_allclose(back[2], time, rtol=1e-5)
    np.testing.assert_array_equal(back[3], still)


def test_same_result_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    first, second = (report(fit(), path=tmp_path / name, modes=modes()).read_bytes() for name in ("a.html", "b.html"))
    assert first == second


def test_failure_leaves_nothing_half_written(tmp_path: Path) -> None:
    with pytest.raises(SwashError, match="nothing to report"):
        report(path=tmp_path / "r.html")
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(SwashError, match="cannot be written"):
        report(fit(), path=tmp_path / "file" / "r.html", modes=modes())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file"]


def test_a_page_of_many_long_channels_is_small_enough_to_mail(tmp_path: Path) -> None:
    """Noise compresses worst, and twelve panels are the most that are drawn."""
    rng = np.random.default_rng(0)
    rows = {f"channel_{k}": rng.standard_normal(20_000) for k in range(14)}
    flight = sp.Flight.from_arrays(np.arange(20_000) / 100.0, rows)
    figure = over_time([flight])
    report = Report("noise", (), (), None, (Section("channels", "Channels", (figure,)),), made="today")
    assert len(figure.spec["data"]) == 12
    assert 1.9e6 < write_page(tmp_path / "page.html", report).stat().st_size < 2.5e6
