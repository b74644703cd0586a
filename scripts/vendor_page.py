"""Bring three.js and uPlot, pinned by hash in web/package-lock.json, into the live page's vendor folder.

    python scripts/vendor_page.py            does nothing where the folder is current
    python scripts/vendor_page.py --if-npm   the same, but without npm only says so
    python scripts/vendor_page.py --pin      after a change of the lock: the files' hashes are written down anew

Needs Node's npm; run by `make test` and when a wheel is built. Users of a wheel need neither.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WEB = ROOT / "web"
VENDOR = ROOT / "src" / "swashplate" / "links" / "live" / "page" / "vendor"
STAMP = "package-lock.json"
HASHES = VENDOR.parent.parent / "libraries.json"
"""SHA-256 of each file; the server refuses to serve others. With `--pin` they are those of what was fetched."""
FILES = {
    "three/build/three.module.min.js": "three.module.min.js",
    "three/build/three.core.min.js": "three.core.min.js",
    "three/LICENSE": "three.LICENSE",
    "uplot/dist/uPlot.esm.js": "uPlot.esm.js",
    "uplot/dist/uPlot.min.css": "uPlot.min.css",
    "uplot/LICENSE": "uPlot.LICENSE",
}
"""What is taken of each package, and what it is called here."""


def current() -> bool:
    """Whether the folder holds every file as pinned, taken under the lock file as it is now."""
    stamp, lock = VENDOR / STAMP, WEB / "package-lock.json"
    return not changed() and stamp.is_file() and stamp.read_bytes() == lock.read_bytes()


def digests() -> dict[str, str]:
    """SHA-256 of the files that are there."""
    there = [name for name in FILES.values() if (VENDOR / name).is_file()]
    return {name: hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() for name in there}


def changed() -> list[str]:
    """Files that are missing or are not those that were pinned."""
    pinned, actual = json.loads(HASHES.read_text(encoding="utf-8")), digests()
    return [name for name in FILES.values() if name not in actual or actual[name] != pinned.get(name)]


def fetch(*, pin: bool = False) -> None:
    """Install the locked packages in a temporary folder (no scripts of theirs run) and copy what the page needs.

    Raises:
        FileNotFoundError: where npm is missing.
        subprocess.CalledProcessError: where it fails (no network, a hash that differs).
        ValueError: where a file is not the one that was pinned, unless it is pinned now.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise FileNotFoundError("npm is not installed (Debian: apt-get install npm)")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("package.json", "package-lock.json", ".npmrc"):
            shutil.copy(WEB / name, folder)
        subprocess.run([npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--silent"], cwd=folder, check=True)
        VENDOR.mkdir(parents=True, exist_ok=True)
        for source, name in FILES.items():
            shutil.copyfile(Path(folder) / "node_modules" / source, VENDOR / name)
    if pin:
        HASHES.write_text(json.dumps(digests(), indent=2) + "\n", encoding="utf-8")
    if changed():
        raise ValueError(f"{', '.join(changed())}: not as in {HASHES.name}; after a new version run with --pin")
    shutil.copyfile(WEB / "package-lock.json", VENDOR / STAMP)  # last: an interrupted run is done again


def main() -> int:
    pin = "--pin" in sys.argv[1:]
    if current() and not pin:
        return 0
    try:
        fetch(pin=pin)
    except (FileNotFoundError, ValueError, subprocess.CalledProcessError) as error:
        print(f"The live page's libraries could not be fetched: {error}.", file=sys.stderr)
        return 0 if "--if-npm" in sys.argv[1:] else 1
    print(f"Written: {VENDOR.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
