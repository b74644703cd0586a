"""What ordinary flights tell: nothing that is not there, on logs of real firmware and under motion capture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from field_cases import loiter_log
from swashplate.flights.readers.read import read
from swashplate.flights.review.review import review


def quiet(data: Path) -> list[Path]:
    paths = [*data.glob("ardupilot_firmware/*.BIN"), *data.glob("ardupilot_sitl/*.BIN"), *data.glob("nanobench/*.csv")]
    return sorted([*paths, data / "logs" / "2016-07-14_06_53_11.px4log", data / "logs" / "dataflash_reference.bin"])


def test_no_healthy_log_has_incidents(shared_data: Path) -> None:
    paths = quiet(shared_data)
    assert len(paths) >= 18
    for path in paths:
        found = {each.kind for each in review(read(path)).incidents}
        # The Crazyflie's motor commands do stand at 65535, as the data set's page says.
        assert found <= ({"saturation"} if path.suffix == ".csv" else set()), path.name


def test_vibration_gps_and_raw_gyros_are_read(shared_data: Path) -> None:
    flight = read(shared_data / "ardupilot_sitl" / "heli_sid_allbits_roll_rate.BIN")
    assert {"vibe_x", "clips", "gps_status", "latitude", "p_raw", "az_raw"} <= set(flight.channels)
    assert flight.rate("p_raw") > 1000.0
    assert np.median(flight.values("gps_status")) >= 3.0
    noise = {each.channel: each for each in review(flight).noise}
    assert noise["p"].source == "p_raw"


def test_parameters_of_a_real_log_name_its_filters(shared_data: Path) -> None:
    told = review(read(shared_data / "ardupilot_firmware" / "raptor50_three_sweeps.BIN"))
    assert [each.name for each in told.filters][:2] == ["INS_GYRO_FILTER", "ATC_RAT_RLL_FLTT"]
    assert [each.parameters["SID_AXIS"] for each in told.next] == [10.0, 11.0, 12.0]
    for loop in told.loops:
        assert loop.step is None
        assert loop.why.startswith("logged at 10 Hz")  # but in its sweeps, which move no target


@pytest.mark.parametrize(("rate", "words"), [(10, "logged at 10 Hz"), (100, "the motion comes before its target")])
def test_a_loiter_in_gusts_has_no_step_response(shared_data: Path, tmp_path: Path, rate: int, words: str) -> None:
    told = review(read(loiter_log(shared_data, tmp_path / "loiter.bin", rate=rate)))
    assert told.incidents == ()
    assert all(words in loop.why for loop in told.loops)
