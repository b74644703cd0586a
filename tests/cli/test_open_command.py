"""`swash open` from the command line: what it refuses before a page is served, and what it is told of the logs."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import urllib.request
from contextlib import suppress
from pathlib import Path

import pytest
from typer.testing import CliRunner

pytest.importorskip("starlette", reason="the extra `live` is not installed")

from swashplate.cli.app import app
from swashplate.links.web import libraries, serving


@pytest.fixture(autouse=True)
def page_is_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The page's libraries are not what is tested here."""
    monkeypatch.setattr(libraries, "LIBRARIES", {})


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["open", str(tmp_path / "no.bin"), "--port", "0"])
    assert done.exit_code == 2
    assert "there is no such file" in done.output


def test_an_address_of_others_must_be_meant() -> None:
    done = CliRunner().invoke(app, ["open", "--port", "0", "--settings", "host=0.0.0.0"])
    assert done.exit_code == 2
    assert "allow_remote=true" in done.output


def test_the_page_is_served_with_the_options_of_the_reading(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    log = tmp_path / "a.csv"
    log.write_text("time [s],p\n0,1\n1,2\n")
    monkeypatch.setattr(serving, "serve", lambda _, on, *, begun: begun(serving.address_of(on)))
    done = CliRunner().invoke(app, ["open", str(log), "--unit", "p=deg/s", "--port", "0"])
    assert done.exit_code == 0, done.output
    assert "Open http://127.0.0.1:" in done.output


NEVER_READ = """
import os, threading
from swashplate.links.logs import opened
from swashplate.links.web import libraries
def load(self, read):
    os.write(1, b"reading\\n")  # in one piece, whatever another thread prints
    threading.Event().wait()
opened.Opened.load, libraries.LIBRARIES = load, {}
from swashplate.__main__ import main
main()
"""


def test_one_interrupt_ends_it_while_logs_are_read_and_says_nothing(tmp_path: Path) -> None:
    """One log of the command line and one request are read without an end: nobody waits for either."""
    (tmp_path / "a.csv").write_text("time [s],p\n0,1\n1,2\n")
    command = [sys.executable, "-c", NEVER_READ, "open", "a.csv", "--port", "0"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={name: value for name, value in os.environ.items() if name != "SWASHPLATE_DEBUG"},
    ) as process:  # fmt: skip
        try:
            assert process.stdout is not None
            said = [process.stdout.readline() for _ in range(2)]
            (host,) = [found[1] for line in said if (found := re.search(r"http://(\S+)/", line))]
            assert "reading\n" in said

            def ask() -> None:
                body = b'{"log": 1, "units": {}, "drop_bad_stamps": false}'
                asked = urllib.request.Request(f"http://{host}/apply", body, {"Origin": f"http://{host}"})
                with suppress(OSError):  # 503: it ends
                    urllib.request.urlopen(asked, timeout=300).close()

            asking = threading.Thread(target=ask)
            asking.start()
            assert process.stdout.readline() == "reading\n"
            process.send_signal(signal.SIGINT)
            _, told = process.communicate(timeout=300)
            asking.join()
        finally:
            process.kill()
    assert [line for line in told.splitlines() if not line.startswith("... ")] == []
    assert process.returncode == 0
