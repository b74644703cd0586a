"""Whether the air moved, as a fit's own noise tells it."""

from __future__ import annotations

from swashplate.filtering.disturbances import Noise
from swashplate.identification.time.feedback import moving_air


def test_a_fit_without_a_wind_says_where_gusts_tilted_the_aircraft() -> None:
    """The noise that the July flight's fit finds, and that of its counterpart in still air."""
    july, still = Noise(gust_tilt=3.45, tau_gust_moment=0.62), Noise(gust_tilt=0.0076, tau_gust_moment=0.41)
    assert moving_air(july).startswith("gusts of 1.9 rad/s^2 (rms) in roll and pitch that fade in 0.62 s.")
    assert "--wind (wind=True)" in moving_air(july)
    assert moving_air(still) == ""
    assert moving_air(july._replace(wind=0.4)) == ""
    assert moving_air(july._replace(gust_tilt=float("nan"))) == ""
