"""The pages that walk through the two papers, made anew: every number and picture of docs/papers.

python scripts/papers.py
"""

import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SITE = ROOT / "docs" / "site"
sys.path.insert(0, str(SITE))
sys.argv = ["docs_pages.py", *map(str, sorted((ROOT / "docs" / "papers").glob("*.md")))]
runpy.run_path(str(SITE / "docs_pages.py"), run_name="__main__")
