"""Data sets by name: found by hash, fetched only when asked, from an address that a test serves itself."""

from __future__ import annotations

import hashlib
import http.server
import threading
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import pytest

from swashplate.errors import DatasetError
from swashplate.flights import datasets
from swashplate.flights.datasets import DataFile, Dataset

CONTENT = b"time [s],x [m]\n0,1\n1,2\n"
SHA256 = hashlib.sha256(CONTENT).hexdigest()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Says nothing."""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[str]:
    """The address of a folder that holds `public.csv`."""
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "public.csv").write_bytes(CONTENT)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder))) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and no other place to look in."""
    monkeypatch.setattr(datasets, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.delenv("SWASHPLATE_DATA", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "cache"


def _registry(address: str = "http://127.0.0.1:9/public.csv", sha256: str = SHA256) -> Mapping[str, Dataset]:
    return {"toy": Dataset("a toy", {"log.csv": DataFile(sha256, address, "two samples")})}


def test_a_file_with_another_hash_does_not_count(cache: Path) -> None:
    (cache / "toy").mkdir(parents=True)
    (cache / "toy" / "log.csv").write_bytes(CONTENT + b"\n")
    assert datasets.find("toy", "log.csv", registry=_registry()) is None
    (cache / "toy" / "log.csv").write_bytes(CONTENT)
    assert datasets.find("toy", "log.csv", registry=_registry()) == cache / "toy" / "log.csv"


def test_the_environment_and_the_folder_beside_are_searched(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = cache.parent
    (root / "shared" / "data" / "toy").mkdir(parents=True)
    beside = root / "shared" / "data" / "toy" / "log.csv"
    beside.write_bytes(CONTENT)
    (root / "checkout" / "src").mkdir(parents=True)
    monkeypatch.chdir(root / "checkout" / "src")
    assert datasets.find("toy", "log.csv", registry=_registry()) == beside
    (root / "told").mkdir()
    told = root / "told" / "log.csv"
    told.write_bytes(CONTENT)
    monkeypatch.setenv("SWASHPLATE_DATA", str(told.parent))
    assert datasets.find("toy", "log.csv", registry=_registry()) == told


def test_listing_says_what_is_here(cache: Path) -> None:
    *shipped, row = datasets.listing(registry=_registry())
    assert [one.found for one in shipped] == list(datasets.fetch("examples"))
    assert all(datasets.locate(f"{one.name}/{one.file}").is_file() for one in shipped)
    assert (row.name, row.file, row.found, row.description) == ("toy", "log.csv", None, "two samples")


def test_fetching_fills_the_cache_and_then_needs_no_network(served: str, cache: Path) -> None:
    (path,) = datasets.fetch("toy", registry=_registry(f"{served}/public.csv"))
    assert path.read_bytes() == CONTENT
    assert datasets.fetch("toy", registry=_registry()) == (path,)
    assert [entry.name for entry in path.parent.iterdir()] == ["log.csv"]


def test_a_wrong_hash_is_refused_and_not_kept(served: str, cache: Path) -> None:
    with pytest.raises(DatasetError, match=r"toy/log\.csv: could not be fetched.*hash"):
        datasets.fetch("toy", registry=_registry(f"{served}/public.csv", sha256="0" * 64))
    assert [entry for entry in cache.rglob("*") if entry.is_file()] == []


def test_a_missing_page_is_said(served: str, cache: Path) -> None:
    with pytest.raises(DatasetError, match=r"could not be fetched.*404.*SWASHPLATE_DATA"):
        datasets.fetch("toy", registry=_registry(f"{served}/none.csv"))


def test_unknown_names_say_what_is_known() -> None:
    with pytest.raises(DatasetError, match="no data set 'coax57'; known are coax56"):
        datasets.fetch("coax57")
    with pytest.raises(DatasetError, match=r"coax56: has no file 'x\.mat'; it has flight_2011"):
        datasets.find("coax56", "x.mat")


def test_a_name_stands_for_a_path(cache: Path) -> None:
    (cache / "toy").mkdir(parents=True)
    (cache / "toy" / "log.csv").write_bytes(CONTENT)
    registry = _registry()
    for name in ("toy/log", "toy/log.csv"):
        assert datasets.locate(name, registry=registry) == cache / "toy" / "log.csv"
    assert datasets.locate("else/where.mat", registry=registry) == Path("else/where.mat")
    with pytest.raises(DatasetError, match="has no file 'nothing'"):
        datasets.locate("toy/nothing", registry=registry)
    (cache / "toy" / "log.csv").unlink()
    with pytest.raises(DatasetError, match=r"toy/log\.csv: the file is not on this machine.*swash data fetch toy"):
        datasets.locate("toy/log", registry=registry)


def test_a_path_that_exists_wins(cache: Path) -> None:
    (cache.parent / "toy").mkdir()
    (cache.parent / "toy" / "log").write_text("mine")
    assert datasets.locate("toy/log", registry=_registry()) == Path("toy/log")


PUBLIC = {
    "coax56": "mfaessle/coax-control",
    "nanobench": "syediu/nanobench-iros2026",
}


def test_every_registered_address_is_pinned_to_a_commit() -> None:
    for data_set, dataset in datasets.REGISTRY.items():
        for entry in dataset.files.values():
            host, owner, name, commit = entry.address.removeprefix("https://").split("/")[:4]
            assert (host, f"{owner}/{name}") == ("raw.githubusercontent.com", PUBLIC[data_set])
            assert not set(entry.address) & set(" #+")  # quoted: a fragment or a space would fetch something else
            assert len(bytes.fromhex(commit)) == 20
            assert len(bytes.fromhex(entry.sha256)) == 32
