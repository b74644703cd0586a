"""Bring three.js and uPlot, pinned by hash in web/package-lock.json, into the live page's vendor folder.

    python scripts/vendor_page.py            does nothing where the folder is current
    python scripts/vendor_page.py --if-npm   the same, but without npm only says so

Needs Node's npm; run by `make test` and when a wheel is built. Users of a wheel need neither.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WEB = ROOT / "web"
VENDOR = ROOT / "src" / "swashplate" / "links" / "live" / "page" / "vendor"
STAMP = "package-lock.json"
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
    """Whether the folder holds every file, taken under the lock file as it is now."""
    stamp, lock = VENDOR / STAMP, WEB / "package-lock.json"
    whole = all((VENDOR / name).is_file() for name in FILES.values())
    return whole and stamp.is_file() and stamp.read_bytes() == lock.read_bytes()


def fetch() -> None:
    """Install the locked packages in a temporary folder (no scripts of theirs run) and copy what the page needs.

    Raises:
        FileNotFoundError: where npm is missing.
        subprocess.CalledProcessError: where it fails (no network, a hash that differs).
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
    shutil.copyfile(WEB / "package-lock.json", VENDOR / STAMP)  # last: an interrupted run is done again


def main() -> int:
    if current():
        return 0
    try:
        fetch()
    except (FileNotFoundError, subprocess.CalledProcessError) as error:
        print(f"The live page's libraries could not be fetched: {error}.", file=sys.stderr)
        return 0 if "--if-npm" in sys.argv[1:] else 1
    print(f"Written: {VENDOR.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
