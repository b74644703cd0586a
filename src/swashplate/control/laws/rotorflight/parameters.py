"""The parameters that the law reads, by the names and in the units of Rotorflight's command line, with its values.

Facts from its sources (4.6: pg/pid.c, pg/mixer.c, pg/governor.c, cli/settings.c). An array of the command line
(`error_limit`) has one name for each axis here, with `_roll`, `_pitch` or `_yaw` behind it.
"""

from __future__ import annotations

from collections.abc import Mapping

from swashplate.errors import ControllerError

AXES = ("roll", "pitch", "yaw")
SCALES: Mapping[str, tuple[float, float, float]] = {
    "p_gain": (6.66666e-6, 6.66666e-6, 6.666666e-5),
    "i_gain": (2e-4, 2e-4, 5e-4),
    "d_gain": (1e-7, 1e-6, 1e-6),
    "f_gain": (2.5e-5, 2.5e-5, 2.5e-5),
    "b_gain": (1e-7, 1e-7, 1e-6),
    "o_gain": (2e-4, 2e-4, 0.0),
}
"""Command per deg/s (or deg, deg/s^2) of a gain of one, by axis (pid.h)."""
CROSS_COUPLING = 1e-5


def _each(name: str, *values: float) -> dict[str, float]:
    return {f"{axis}_{name}": value for axis, value in zip(AXES, values, strict=False)}


DEFAULTS: Mapping[str, float] = {
    **_each("p_gain", 50.0, 50.0, 80.0),
    **_each("i_gain", 100.0, 100.0, 120.0),
    **_each("d_gain", 0.0, 40.0, 10.0),
    **_each("f_gain", 100.0, 100.0, 0.0),
    **_each("b_gain", 0.0, 0.0, 0.0),
    **_each("o_gain", 50.0, 50.0),
    **_each("d_cutoff", 15.0, 15.0, 20.0),
    **_each("b_cutoff", 15.0, 15.0, 20.0),
    **_each("gyro_cutoff", 50.0, 50.0, 100.0),
    **{f"error_limit_{axis}": value for axis, value in zip(AXES, (45.0, 45.0, 60.0), strict=True)},
    **{f"offset_limit_{axis}": 90.0 for axis in AXES[:2]},
    **{f"iterm_relax_level_{axis}": 40.0 for axis in AXES},
    **{f"iterm_relax_cutoff_{axis}": 10.0 for axis in AXES},
    "iterm_relax_type": 2.0,  # 0 off, 1 roll and pitch, 2 yaw too
    "error_decay_time_cyclic": 250.0,
    "error_decay_time_yaw": 0.0,
    "error_decay_limit_cyclic": 12.0,
    "error_decay_limit_yaw": 0.0,
    "offset_flood_relax_level": 40.0,
    "offset_flood_relax_cutoff": 3.0,
    "yaw_cw_stop_gain": 120.0,
    "yaw_ccw_stop_gain": 80.0,
    "yaw_precomp_cutoff": 5.0,
    "yaw_cyclic_ff_gain": 10.0,
    "yaw_collective_ff_gain": 60.0,
    "yaw_inertia_precomp_gain": 0.0,
    "yaw_inertia_precomp_cutoff": 25.0,
    "pitch_collective_ff_gain": 0.0,
    "cyclic_cross_coupling_gain": 50.0,
    "cyclic_cross_coupling_ratio": 0.0,
    "cyclic_cross_coupling_cutoff": 25.0,
    "angle_level_strength": 40.0,
    "angle_level_limit": 55.0,
    "gyro_lpf1_static_hz": 100.0,
    "swash_ring": 100.0,
    "gov_headspeed": 0.0,  # 0: none is governed here, the throttle is the engine's whole
    "gov_gain": 40.0,
    "gov_p_gain": 40.0,
    "gov_i_gain": 50.0,
    "gov_d_gain": 0.0,
    "gov_f_gain": 10.0,
    "gov_p_limit": 20.0,
    "gov_i_limit": 95.0,
    "gov_d_limit": 20.0,
    "gov_f_limit": 100.0,
    "gov_max_throttle": 100.0,
    "gov_min_throttle": 10.0,
    "gov_yaw_weight": 10.0,
    "gov_cyclic_weight": 10.0,
    "gov_collective_weight": 50.0,
    "gov_collective_curve": 20.0,
    "gov_rpm_filter": 10.0,
    "gov_ff_filter": 5.0,
    "gov_d_filter": 50.0,
}
_ARRAYS = ("error_limit", "offset_limit", "iterm_relax_level", "iterm_relax_cutoff")
_REFUSED: Mapping[str, tuple[float, ...]] = {"pid_mode": (3.0,), "swash_phase": (0.0,), "gov_tta_gain": (0.0,)}
"""Parts that the law has not, and the values with which nothing of them acts."""


def known(given: Mapping[str, float]) -> dict[str, float]:
    """All parameters of the law: Rotorflight's, and what is given over them. Other names are passed over.

    Raises:
        ControllerError: for a part of the firmware that the law has not, where it is switched on.
    """
    values = dict(DEFAULTS)
    for name, value in given.items():
        if name in _REFUSED and value not in _REFUSED[name]:
            right = " or ".join(f"{each:g}" for each in _REFUSED[name])
            raise ControllerError(f"is {value:g}; the rebuilt law has no such part, expected {right}.", channel=name)
        if name in values:
            values[name] = float(value)
    return values


def cli_dump(values: Mapping[str, float], *, title: str) -> str:
    """The lines of Rotorflight's command line that set parameters, and the one that keeps them.

    An array is one line, with its own value where only another axis' is given.
    """
    arrays = {name: AXES[: 2 if name == "offset_limit" else 3] for name in _ARRAYS}
    lines = [f"# {' '.join(title.split())}: written by swash control gains"]
    for name, value in values.items():
        if not name.startswith(_ARRAYS):
            lines.append(f"set {name} = {value:g}")
    for name, axes in arrays.items():
        if any(f"{name}_{axis}" in values for axis in axes):
            each = (values.get(f"{name}_{axis}", DEFAULTS[f"{name}_{axis}"]) for axis in axes)
            lines.append(f"set {name} = {','.join(f'{one:g}' for one in each)}")
    return "\n".join([*lines, "save", ""])
