"""How long predictions run, and how much of a record is spent on what belongs to it."""

from __future__ import annotations

HORIZONS = (0.5, 1.0, 2.0, 5.0)
"""Seconds ahead at which predictions are judged."""
CALIBRATION = 5.0
"""Seconds at the start of a record that may be used; no prediction starts before they are over."""

SHORTEST_CALIBRATION = 1.0
"""Seconds: the filter has settled and a delay of a tenth of a second has left its trace."""
