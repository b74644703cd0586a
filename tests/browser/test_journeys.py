"""Three newcomers from nothing to a result: a dropped log, a notebook, a wheel in an environment of its own.

The pictures of README and site are made here: `SWASH_PICTURES=FOLDER` keeps them, `scripts/screenshots.py` says it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import docs_running
import pytest
import site_pages
import test_live_in_chromium as live_page
import test_open_in_chromium as open_page
from test_open_in_chromium import SIZES, Visit, served

import chromium
from swashplate.links.web.libraries import PAGE

ROOT = Path(__file__).resolve().parents[2]
MINUTE = 60.0  # s
FEW = 4  # clicks
_PICTURES = os.environ.get("SWASH_PICTURES")


def keep(name: str, picture: bytes) -> None:
    """A picture of a journey, where it is asked for."""
    if _PICTURES:
        (Path(_PICTURES) / name).write_bytes(picture)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "uPlot.esm.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    yield from chromium.running_browser(webgl=True)


def busy(seconds_of: int) -> float:
    """Processor time [s] that a process has used so far; what others do on the machine does not count."""
    fields = Path(f"/proc/{seconds_of}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


# ---- one: an ArduPilot tuner drops a .BIN ----------------------------------------------------------------------------
@pytest.mark.parametrize("by", ["processor", pytest.param("clock", marks=pytest.mark.proof)])
def test_a_dropped_log_gives_gains_within_a_minute_and_four_clicks(
    by: str, browser: Any, shared_data: Path, tmp_path: Path
) -> None:
    """From an empty page of a server that has just been started to gains, files and a report.

    The minute is the server's processor time, so that a busy machine cannot fail it; `proof` takes a watch.
    """
    with served(cwd=tmp_path) as url:
        visit = Visit(browser, url, clear=False)
        visit.of("window.clicks = 0; addEventListener('click', (e) => e.isTrusted && (window.clicks += 1), true)")
        began = time.monotonic()
        visit.drop(shared_data / "ardupilot_sitl" / "heli_sid_roll_mix.BIN")
        visit.until("document.querySelector('#sweeps button')")
        visit.page.locator("#sweeps button").click()
        visit.until("['done', 'failed'].includes(document.getElementById('identify').dataset.state)", seconds=240.0)
        told = visit.text("#identify")
        assert "ATC_RAT_RLL_P" in told, told
        took = time.monotonic() - began if by == "clock" else busy(open_page.servers[url])
        assert took < MINUTE
        assert visit.of("window.clicks") <= FEW
        assert "NO verification" in told, "this log holds nothing but its sweep"
        margin = "document.querySelector('[data-loop=RLL] tbody').innerText"
        before, drawn = visit.of(margin), visit.of("document.querySelector('.tune').dataset.drawn")
        slide = "(s => { s.value = 0.5 * s.value; s.dispatchEvent(new Event('input')); })"
        visit.of(f"{slide}(document.querySelector('[data-loop=RLL] [data-gain=P]'))")
        visit.until(f"document.querySelector('.tune').dataset.drawn !== '{drawn}'")
        assert visit.of(margin) != before, "the margins move with the slider"
        assert "Against flown" in visit.text("[data-loop=RLL] .verdict")
        with visit.page.expect_download() as mine:
            visit.page.click("[data-loop=RLL] [data-mine]")
        assert mine.value.suggested_filename == "mine.param"
        assert "\nATC_RAT_RLL_P,0.0" in Path(mine.value.path()).read_text()
        titles = visit.of("[...document.querySelectorAll('.curves strong')].map(e => e.textContent)")
        assert titles[:2] == ["Step of the target", "Disturbance: 0.1 of the command"]
        assert "Coherence, from 0.6 on it counts" in titles
        assert visit.of("document.querySelectorAll('.curves :is(canvas, .nyquist)').length") == len(titles)
        keep("journey-gains.png", visit.page.screenshot())
        with visit.page.expect_download() as download:
            visit.page.click("a[href='/download/gains.param']")
        assert Path(download.value.path()).read_text().startswith("ATC_RAT_RLL_FF,0.2")
        with visit.page.context.expect_page() as opened:
            visit.page.click("a[href='/download/report.html']")
        opened.value.wait_for_selector("html[data-drawn=all]", state="attached", timeout=60_000)
        opened.value.close()
        visit.page.set_viewport_size(dict(zip(("width", "height"), SIZES["telephone"], strict=True)))
        visit.width = SIZES["telephone"][0]
        visit.until("document.documentElement.scrollWidth <= innerWidth")  # the curves are drawn anew
        visit.close()


# ---- two: a student with a CSV of his own, in a notebook; its cells run always, as a page (test_pages.py) ------------
@pytest.mark.proof
def test_a_notebook_is_told_of_a_flipped_gyro_mends_it_and_identifies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page "A CSV of your own" as the notebook that the site offers, run by Jupyter's own runner."""
    nbclient = pytest.importorskip("nbclient", reason="nbclient and ipykernel are not installed")
    pytest.importorskip("ipykernel", reason="nbclient and ipykernel are not installed")
    import nbformat

    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    page = (ROOT / "docs" / "notebooks" / "your-own-csv.md").read_text(encoding="utf-8")
    made = nbformat.reads(json.dumps(site_pages.notebook(page)), as_version=4)
    shown = ("log", "found", "responses", "fit", "compared", "sp.residuals(fit, last)")
    made.cells += [nbformat.v4.new_code_cell(name) for name in shown]
    nbclient.NotebookClient(made, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()

    cells = [cell for cell in made.cells if cell.cell_type == "code"]
    printed = "\n".join(o.text for cell in cells for o in cell.outputs if o.output_type == "stream")
    assert "p: has the other sign" in printed
    assert "--unit p=-deg/s" in printed
    assert "1753850000 s of the log's clock (2025-07-30" in printed
    assert "()" in printed.splitlines(), "after the mending nothing is wrong"
    assert "omega_pole" in printed
    assert (tmp_path / "own.pdf").read_bytes().startswith(b"%PDF")
    for name, cell in zip(shown, cells[-len(shown) :], strict=True):
        (output,) = (o for o in cell.outputs if o.output_type == "execute_result")
        assert "<img" in output.data["text/html"], name
    fit = next(f for f in docs_running.fences(page) if "omega_pole" in f.text)
    assert docs_running.same(
        fit.text, "\n".join(line for line in printed.splitlines() if line in fit.text.splitlines())
    )
    keep("journey-csv.png", (tmp_path / "journey-csv.png").read_bytes())


# ---- three: a control engineer installs the wheel and flies ----------------------------------------------------------
@pytest.fixture(scope="module")
def installed(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a new environment that holds the wheel; what the wheel needs comes from this environment."""
    folder = tmp_path_factory.mktemp("installed")
    wheels, there = folder / "wheels", folder / "there"
    built = {**os.environ, "SOURCE_DATE_EPOCH": "1577836800"}
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(wheels)]
    subprocess.run(build, cwd=ROOT, env=built, check=True, capture_output=True)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(there)], check=True, capture_output=True)
    (site,) = there.glob("lib/python*/site-packages")
    (wheel,) = wheels.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    (site / "needed.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return there / "bin" / "python"


@pytest.mark.proof  # that a wheel runs elsewhere is always tried by tests/cli/test_wheel.py, the keys on the live page
@pytest.mark.parametrize("seconds", [5.0, MINUTE])
def test_an_installed_wheel_is_flown_by_keys(seconds: float, installed: Path, browser: Any, tmp_path: Path) -> None:
    """A newcomer's first flight: the Raptor, short presses of every key, nothing falls, nothing complains."""
    where = [str(installed), "-c", "import swashplate; print(swashplate.__file__)"]
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    found = subprocess.run(where, cwd=tmp_path, env=plain, capture_output=True, text=True, check=True).stdout
    assert found.startswith(str(installed.parents[1]))
    with live_page._served("live", "raptor50", cwd=tmp_path, python=installed, without=("PYTHONPATH",)) as url:
        visit = live_page.Visit(browser, url).flies()
        keys = ("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "KeyA", "KeyD", "KeyW", "KeyS")
        clock, tilts = [0.0], []
        end = time.monotonic() + 20.0 * seconds
        while clock[-1] < seconds and time.monotonic() < end:
            key = keys[len(clock) % len(keys)]
            visit.page.keyboard.down(key)
            visit.page.wait_for_timeout(250)
            visit.page.keyboard.up(key)
            visit.page.wait_for_timeout(100)
            now, x = visit.of("[swash.now.t, swash.now.own.x]")
            clock.append(now)
            tilts.append(abs(x[6]) + abs(x[7]))
            assert -x[2] > 0.5, f"down at {now} s"
        assert clock[-1] >= seconds
        assert clock == sorted(clock), "it was set back: it had been lost"
        assert 0.02 < max(tilts) < 1.0
        visit.done()
        keep("live-page.png", visit.page.screenshot())
        visit.page.close()


def test_a_journeys_picture_is_on_a_page() -> None:
    """What the journeys draw is what README and site show."""
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = "".join(page.read_text(encoding="utf-8") for page in pages)
    source = Path(__file__).read_text(encoding="utf-8")
    for name in ("journey-gains.png", "journey-csv.png", "live-page.png"):
        assert f'keep("{name}"' in source
        assert f"docs/pictures/{name}" in (ROOT / "README.md").read_text(encoding="utf-8"), name
        assert f"pictures/{name}" in shown
        assert (ROOT / "docs" / "pictures" / name).read_bytes().startswith(b"\x89PNG")
