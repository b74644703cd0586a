"""A Dask scheduler and workers as processes of their own, with certificates made for the test."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from swashplate.api.campaigns.scheduler import DaskScheduler

_LIMIT = 180.0  # s for a process to come up on a loaded machine; nothing waits for them when all is well
QUIET = {"DASK_DISTRIBUTED__SCHEDULER__HTTP__ROUTES": "[]", "DASK_DISTRIBUTED__WORKER__HTTP__ROUTES": "[]"}
"""No pages: as docs/howto/campaigns.md starts them."""


def certificates(folder: Path) -> tuple[Path, Path]:
    """A certificate that signs itself, and its key: what docs/howto/campaigns.md makes."""
    if shutil.which("openssl") is None:
        pytest.skip("there is no openssl here to make certificates with")
    folder.mkdir(parents=True, exist_ok=True)
    certificate, key = folder / "campaign.pem", folder / "campaign-key.pem"
    kind = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    made = ["openssl", "req", "-x509", *kind, "-days", "2", "-subj", "/CN=campaign"]
    made += ["-keyout", str(key), "-out", str(certificate)]
    subprocess.run(made, check=True, capture_output=True)
    return certificate, key


@dataclass
class Cluster:
    """A scheduler that is up, with workers that have joined it.

    Attributes:
        address: of the scheduler. scheduler, workers: the processes.
        certificate, key: of everybody in it; None where it speaks without TLS.
    """

    address: str
    scheduler: subprocess.Popen[str]
    workers: list[subprocess.Popen[str]]
    certificate: Path | None
    key: Path | None
    environment: Mapping[str, str]
    _kept: ExitStack

    @property
    def named(self) -> DaskScheduler:
        """As a campaign is given it."""
        if self.certificate is None:
            return DaskScheduler(self.address, insecure=True)
        return DaskScheduler(self.address, ca=self.certificate, certificate=self.certificate, key=self.key)

    @property
    def tls(self) -> list[str]:
        """Options of `dask scheduler` and `dask worker`."""
        if self.certificate is None:
            return []
        files = {"--tls-ca-file": self.certificate, "--tls-cert": self.certificate, "--tls-key": self.key}
        return [word for option, file in files.items() for word in (option, str(file))]

    def join(self, *words: str, environment: Mapping[str, str] | None = None) -> subprocess.Popen[str]:
        """A worker, and its nanny where it has one; it has joined when this returns."""
        threads = [] if "--nthreads" in words else ["--nthreads", "1"]
        command = ["worker", self.address, *threads, "--no-dashboard", *self.tls, *words]
        process, _ = started(command, "Registered to:", {**self.environment, **(environment or {})}, self._kept)
        self.workers.append(process)
        return process


def started(
    command: list[str], word: str, environment: Mapping[str, str], kept: ExitStack
) -> tuple[subprocess.Popen[str], str]:
    """A process of Dask, and the first line of it that has a word in it. What it says later goes nowhere."""
    process = subprocess.Popen(
        [sys.executable, "-m", "dask", *command], env=environment, stderr=subprocess.PIPE, text=True
    )

    assert process.stderr is not None
    found: list[str] = []
    up, said = threading.Event(), []

    def hear() -> None:
        for line in process.stderr or ():
            said.append(line)
            if word in line and not found:
                found.append(line)
                up.set()
        up.set()

    hearing = threading.Thread(target=hear, daemon=True)
    hearing.start()

    def end() -> None:
        process.terminate()  # a nanny ends its worker
        try:
            process.wait(_LIMIT)
        finally:
            process.kill()
            process.wait()
        hearing.join()
        process.stderr.close()  # type: ignore[union-attr]

    kept.callback(end)
    assert up.wait(_LIMIT), f"{command} is not up after {_LIMIT:g} s"
    assert found, "".join(said)
    return process, found[0]


@contextmanager
def cluster(
    folder: Path | None, *words: str, workers: int = 1, environment: Mapping[str, str] | None = None
) -> Iterator[Cluster]:
    """A scheduler and its workers.

    Args:
        folder: where certificates are made; None for a cluster without TLS.
        words: further options of each worker.
        workers: how many. environment: of theirs, beside this process's.
    """
    pair = (None, None) if folder is None else certificates(folder)
    with ExitStack() as kept:
        own = {"DASK_TEMPORARY_DIRECTORY": kept.enter_context(TemporaryDirectory(ignore_cleanup_errors=True))}
        here = {**os.environ, **QUIET, **own, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        made = Cluster("", None, [], *pair, here, kept)  # type: ignore[arg-type]
        protocol = ["--protocol", "tcp" if folder is None else "tls"]
        places = ["--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0", "--no-dashboard"]
        made.scheduler, line = started(["scheduler", *protocol, *places, *made.tls], "Scheduler at:", here, kept)
        made.address = line.split()[-1]
        for _ in range(workers):
            made.join("--no-nanny", "--host", "127.0.0.1", *words, environment=environment)
        yield made
