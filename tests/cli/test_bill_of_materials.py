"""The bill of materials holds what the locks hold, with their hashes, and twice the same."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

bill_of_materials = pytest.importorskip("bill_of_materials")
ROOT = Path(__file__).resolve().parents[2]


def test_it_holds_every_pinned_library_with_its_hashes() -> None:
    bill = bill_of_materials.bill()
    text = (ROOT / "lock" / "dev.txt").read_text()
    parts = {part["purl"]: part for part in bill["components"]}
    pins = re.findall(r"(?m)^([A-Za-z0-9._-]+)(?:\\[.*\\])?==([^ ;\\\\]+)", text)
    assert len(pins) > 50
    for name, version in pins:
        assert f"pkg:pypi/{name.lower().replace('_', '-').replace('.', '-')}@{version}" in parts
    told = [h["content"] for part in parts.values() for r in part["externalReferences"] for h in r["hashes"]]
    assert set(re.findall(r"sha256:([0-9a-f]{64})", text)) <= set(told)
    assert {name for name in parts if name.startswith("pkg:npm/")} == {"pkg:npm/three@0.180.0", "pkg:npm/uplot@1.6.32"}
    assert parts[next(p for p in parts if p.startswith("pkg:pypi/numpy@"))]["scope"] == "required"


def test_it_is_the_same_twice_and_another_for_another_lock(tmp_path: Path) -> None:
    assert json.dumps(bill_of_materials.bill()) == json.dumps(bill_of_materials.bill())
    for name in ("pyproject.toml", "web/package-lock.json"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    (tmp_path / "lock").mkdir()
    (tmp_path / "lock" / "dev.txt").write_text("numpy==1.0 \\\n    --hash=sha256:" + "a" * 64 + "\n")
    other = bill_of_materials.bill(tmp_path)
    assert other["serialNumber"] != bill_of_materials.bill()["serialNumber"]
    assert len(other["components"]) == 3


def test_a_line_that_is_no_pin_is_refused() -> None:
    with pytest.raises(ValueError, match="neither a pinned package nor a hash"):
        bill_of_materials.locked("numpy>=2\n")


def test_the_readme_s_installation_is_counted() -> None:
    plain, readme = (bill_of_materials.installation(e) for e in (frozenset(), bill_of_materials.readme_extras()))
    assert set(readme) - set(plain) == {"casadi"}
    assert len(readme) <= 45
    assert 400.0 < sum(readme.values()) < 650.0  # 400 MB are asked: CasADi alone is 281 MB
