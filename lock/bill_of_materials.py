"""Writes the software bill of materials, CycloneDX 1.6 JSON, from lock/dev.txt and web/package-lock.json.

    python lock/bill_of_materials.py [FILE]        build/swashplate.cdx.json where not given

The same locks in the same environment give the same bytes: no time, no random number. Every library has its version,
its package URL and the hashes of its archives as the lock has them; a licence where it is installed and names one.
Then it prints how many packages and megabytes the README's installation is.
"""

from __future__ import annotations

import base64
import json
import re
import sys
import tomllib
import uuid
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "build" / "swashplate.cdx.json"


def locked(text: str) -> list[tuple[str, str, list[str]]]:
    """Names, versions and SHA-256 of a lock in pip's format.

    Raises:
        ValueError: for a line that is none of it.
    """
    pins: list[tuple[str, str, list[str]]] = []
    for line in text.splitlines():
        stripped = line.strip().rstrip("\\").strip()
        if not stripped or stripped.startswith("#"):
            continue
        if digest := re.fullmatch(r"--hash=sha256:([0-9a-f]{64})", stripped):
            pins[-1][2].append(digest[1])
        elif pin := re.match(r"([A-Za-z0-9._-]+)(?:\[[^]]*\])?==([^\s;]+)", stripped):
            pins.append((re.sub(r"[-_.]+", "-", pin[1]).lower(), pin[2], []))
        else:
            raise ValueError(f"lock: {line!r} is neither a pinned package nor a hash")
    return pins


def _licences(name: str, version: str) -> list[dict[str, Any]]:
    """What an installed library of just this version says of its licence."""
    try:
        said = metadata.metadata(name)
    except metadata.PackageNotFoundError:
        return []
    if said["Version"] != version:
        return []
    if expression := said.get("License-Expression"):
        return [{"expression": expression}]
    classes = [c.rpartition(" :: ")[2] for c in said.get_all("Classifier") or () if c.startswith("License ::")]
    return [{"license": {"name": text}} for text in sorted(set(classes) - {"OSI Approved"})]


def _component(kind: str, name: str, version: str, hashes: list[tuple[str, str]], licences: Any) -> dict[str, Any]:
    address = f"pkg:{kind}/{name}@{version}"
    component = {"type": "library", "bom-ref": address, "name": name, "version": version, "purl": address}
    if licences:
        component["licenses"] = licences
    # A lock holds one hash for every archive of a version; a component's own hashes would be those of one archive.
    references = [
        {"type": "distribution", "url": address, "hashes": [{"alg": alg, "content": digest}]} for alg, digest in hashes
    ]
    return component | ({"externalReferences": references} if references else {})


def _of_pip(text: str) -> list[dict[str, Any]]:
    return [
        _component("pypi", name, version, [("SHA-256", digest) for digest in digests], _licences(name, version))
        for name, version, digests in locked(text)
    ]


def _of_npm(text: str) -> list[dict[str, Any]]:
    components = []
    for place, entry in json.loads(text)["packages"].items():
        if place:
            digest = base64.b64decode(entry["integrity"].removeprefix("sha512-")).hex()
            licence = [{"license": {"id": entry["license"]}}] if "license" in entry else []
            name = place.rpartition("node_modules/")[2]
            components.append(_component("npm", name, entry["version"], [("SHA-512", digest)], licence))
    return components


def bill(root: Path = ROOT) -> dict[str, Any]:
    """The bill of materials as a document."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    texts = [(root / name).read_text(encoding="utf-8") for name in ("lock/dev.txt", "web/package-lock.json")]
    direct = {re.sub(r"[-_.]+", "-", re.match(r"[A-Za-z0-9._-]+", d)[0]).lower() for d in project["dependencies"]}  # type: ignore[index]
    parts = sorted([*_of_pip(texts[0]), *_of_npm(texts[1])], key=lambda part: part["bom-ref"])
    for part in parts:
        part["scope"] = "required" if part["name"] in direct or "pkg:npm" in part["purl"] else "optional"
    own = f"pkg:pypi/{project['name']}@{project['version']}"
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, own + ''.join(texts))}",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": own,
                "name": project["name"],
                "version": project["version"],
                "purl": own,
                "licenses": [{"license": {"id": project["license"]}}],
            }
        },
        "components": parts,
        "dependencies": [
            {"ref": own, "dependsOn": [part["bom-ref"] for part in parts if part["scope"] == "required"]},
        ],
    }


def installation(extras: frozenset[str]) -> dict[str, float]:
    """The distributions that pip installs for this package with some extras, and their files' size [MB], as here."""
    sizes: dict[str, float] = {}
    done: set[tuple[str, frozenset[str]]] = set()
    waiting = [("swashplate", extras)]
    while waiting:
        name, wanted = waiting.pop()
        key = re.sub(r"[-_.]+", "-", name).lower()
        if (key, wanted) not in done:
            done.add((key, wanted))
            found = metadata.distribution(name)
            sizes[key] = sum(file.size or 0 for file in found.files or ()) / 1e6
            for needed in map(Requirement, found.requires or ()):
                if needed.marker is None or any(needed.marker.evaluate({"extra": extra}) for extra in (*wanted, "")):
                    waiting.append((needed.name, frozenset(needed.extras)))
    return sizes


def readme_extras(root: Path = ROOT) -> frozenset[str]:
    """The extras of the README's first command."""
    named = re.search(r"\$ pip install '\.\[([\w,]+)\]'", (root / "README.md").read_text(encoding="utf-8"))
    return frozenset(named[1].split(",")) if named else frozenset()


def main() -> int:
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else OUT
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(bill(), indent=2, sort_keys=True) + "\n", encoding="utf-8")
    print(f"Written: {out}")
    sizes = installation(readme_extras())
    print(f"The README's installation: {len(sizes)} packages, {sum(sizes.values()):.0f} MB without compiled Python")
    return 0


if __name__ == "__main__":
    sys.exit(main())
