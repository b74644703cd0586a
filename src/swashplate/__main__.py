"""`python -m swashplate` is `swash`."""

from __future__ import annotations

from swashplate.cli.app import main

main()
