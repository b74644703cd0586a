"""python-control draws our responses: two by two, as it does its own."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np

from swashplate.identification.responses.frequency_response import FrequencyResponse


def test_python_control_draws_two_by_two_responses() -> None:
    mpl.use("Agg")
    import control
    import matplotlib.pyplot as plt

    omega = np.geomspace(0.5, 20.0, 30)
    h = np.stack([np.stack([k / (1j * omega + k) for k in row], axis=-1) for row in ((1.0, 2.0), (3.0, 4.0))], axis=1)
    none = np.full((30, 2), np.nan)
    made = FrequencyResponse(
        omega, ("a", "b"), ("p", "q"), h, np.ones(h.shape), none, np.zeros(h.shape), none, none, np.ones(h.shape)
    )
    drawn = control.bode_plot(made.to_control())
    assert drawn.axes.shape == (4, 2)
    plt.close("all")
