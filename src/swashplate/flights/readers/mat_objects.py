"""What to type in MATLAB so that an object's numbers can be read: time series, tables and their like.

Objects of MATLAB's newer classes lie in a file as blocks whose layout MathWorks does not describe (it describes
numbers, text, cells and structs: MAT-File Format, R2024a). What others found out about them changes with releases, so
they are not guessed at here; MATLAB itself turns each into a struct of arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

# Class -> statement that makes readable numbers of {0}.
_AS_NUMBERS: Mapping[str, str] = {
    "timeseries": "{0} = struct('time', {0}.Time, 'data', {0}.Data);",
    "table": "{0} = table2struct({0}, 'ToScalar', true);",
    "timetable": (
        "t = {0}.Properties.RowTimes; {0} = table2struct(timetable2table({0}, 'ConvertRowTimes', false), "
        "'ToScalar', true); {0}.time = seconds(t - t(1));"
    ),
    "datetime": "{0} = posixtime({0});",
    "duration": "{0} = seconds({0});",
    "categorical": "{0} = double({0});",
    "iddata": "{0} = struct('time', {0}.SamplingInstants, 'u', {0}.InputData, 'y', {0}.OutputData);",
    "Simulink.SimulationData.Signal": "{0} = struct('time', {0}.Values.Time, 'data', {0}.Values.Data);",
    "Simulink.SimulationData.Dataset": (
        "{0} = arrayfun(@(k) struct('time', {0}{{k}}.Values.Time, 'data', {0}{{k}}.Values.Data), "
        "1:numElements({0}), 'UniformOutput', false);"
    ),
}
CELL, STRUCTS = "cell", "struct"
"""Kinds that are read from a file of version 7 as they are."""


def to_type(unread: Mapping[str, str], file: str) -> str:
    """One line for MATLAB that saves variables so that they can be read; "" where none of them is known.

    Args:
        unread: class by variable ("ts", "log.ts", "data{1}").
        file: the file's name.
    """
    turned = [_AS_NUMBERS[kind].format(f"S.{name}") for name, kind in unread.items() if kind in _AS_NUMBERS]
    if not turned and not {CELL, STRUCTS} & set(unread.values()):
        return ""
    path = PurePath(file)
    old, new = (name.replace("'", "''") for name in (path.name, f"{path.stem}_numbers.mat"))
    return " ".join([f"S = load('{old}');", *turned, f"save('{new}', '-struct', 'S', '-v7')"])
