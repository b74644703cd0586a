"""The page's files: nothing from elsewhere, every import there, libraries pinned by hash, no address in the lock."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
PAGE = ROOT / "src" / "swashplate" / "links" / "live" / "page"
OURS = sorted(path for path in PAGE.iterdir() if path.is_file())


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_asks_for_nothing_from_elsewhere(path: Path) -> None:
    text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://|\beval\(|new Function|innerHTML|document\.write", text)


@pytest.mark.parametrize("path", [p for p in OURS if p.suffix == ".js"], ids=lambda path: path.name)
def test_imports_lead_to_our_files_or_vendored_ones(path: Path) -> None:
    for target in re.findall(r'from "(\./[^"]+)"', path.read_text(encoding="utf-8")):
        if target.startswith("./vendor/"):
            assert f'"{target.removeprefix("./vendor/")}"' in (ROOT / "scripts" / "vendor_page.py").read_text("utf-8")
        else:
            assert (PAGE / target).is_file(), f"{path.name} imports {target}"


def test_libraries_are_pinned_by_hash_without_an_address() -> None:
    lock = json.loads((ROOT / "web" / "package-lock.json").read_text(encoding="utf-8"))
    wanted = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))["dependencies"]
    packages = {name.removeprefix("node_modules/"): entry for name, entry in lock["packages"].items() if name}
    assert packages.keys() == wanted.keys()
    for name, entry in packages.items():
        assert entry["version"] == wanted[name]
        assert entry["integrity"].startswith("sha512-")
        assert "resolved" not in entry


def test_every_file_of_the_libraries_has_its_hash() -> None:
    hashes = json.loads((PAGE.parent / "libraries.json").read_text(encoding="utf-8"))
    script = (ROOT / "scripts" / "vendor_page.py").read_text("utf-8")
    assert set(hashes) == set(re.findall(r'^    "[^"]+": "([^"]+)",$', script, flags=re.MULTILINE))
    assert all(re.fullmatch("[0-9a-f]{64}", text) for text in hashes.values())
