"""Builds the site of docs/ into build/site: `make site`. Needs no network; a warning is an error.

python docs/site/build_site.py [FOLDER]
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def command(out: Path, pages: Path) -> list[str]:
    """The call of Sphinx that writes the site to `out`, and what it knows of the pages to `pages`."""
    strict = ["--builder", "html", "--fail-on-warning", "--keep-going", "--quiet", "--fresh-env"]
    return [
        sys.executable,
        "-m",
        "sphinx",
        *strict,
        "-c",
        str(ROOT / "docs" / "site"),
        "-d",
        str(pages),
        *map(str, (ROOT / "docs", out)),
    ]


def main(arguments: list[str]) -> int:
    out = Path(arguments[0]) if arguments else ROOT / "build" / "site"
    code = subprocess.run(command(out, ROOT / "build" / "site-pages"), check=False).returncode
    if code == 0:
        print(f"Written: {out / 'index.html'}")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
