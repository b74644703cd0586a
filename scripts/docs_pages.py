"""The documentation's pages, made anew: see docs/site/docs_pages.py, which this calls.

python scripts/docs_pages.py [--real] [PAGE ...]
"""

import runpy
import sys
from pathlib import Path

SITE = Path(__file__).resolve().parent.parent / "docs" / "site"
sys.path.insert(0, str(SITE))
runpy.run_path(str(SITE / "docs_pages.py"), run_name="__main__")
