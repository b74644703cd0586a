"""How many threads libraries of linear algebra may have."""

from __future__ import annotations

from typing import Final

ONE_THREAD: Final = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment, read when NumPy is imported. In two threads BLAS adds in another order, so that a fit ends 1e-12 apart,
and with matrices of some tens of rows takes twice the processor time. What pays in threads has threads of its own."""
