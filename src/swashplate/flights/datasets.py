"""Public data sets by name: where their files are found, by hash, and where they are fetched from when a user asks.

A file is looked for in the user's cache, in the folder that the environment variable SWASHPLATE_DATA names, and in
`shared/data` beside the checkout. A file counts only if its SHA-256 is the registered one. Nothing is fetched unasked.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from swashplate.errors import DatasetError
from swashplate.flights import example_logs
from swashplate.registry import nearest


@dataclass(frozen=True)
class DataFile:
    """One file of a data set: its SHA-256, public address and what it is; `kind` is "flight" or "bench"."""

    sha256: str
    address: str
    description: str
    kind: str = "flight"


@dataclass(frozen=True)
class Dataset:
    """A data set: what it is, and its files by name."""

    description: str
    files: Mapping[str, DataFile]


@dataclass(frozen=True)
class DatasetFile:
    """A line of `listing`: the file's path where it is found, else None."""

    name: str
    file: str
    found: Path | None
    description: str


_COAX = "https://raw.githubusercontent.com/mfaessle/coax-control"
_BENCH = f"{_COAX}/52371bb363c24fa336a88ab64fdea0f7c2189a03"

_NANOBENCH = "https://raw.githubusercontent.com/syediu/nanobench-iros2026/d45bc5a6090a8a4e522009c06edb1b7ad897891b"


def _nanobench(sha256: str, name: str) -> tuple[str, DataFile]:
    """A flight of the Crazyflie, by its trajectory."""
    flight = name.split("_", 1)[1].replace("_rep", ", flight ").replace("_", " ")
    return f"{name}.csv", DataFile(sha256, f"{_NANOBENCH}/datasets/dataset/{name}.csv", f"{flight}; at 100 Hz")


REGISTRY: Mapping[str, Dataset] = {
    "coax56": Dataset(
        "Skybotix CoaX number 56 under motion capture and on the bench (ETH Zurich, 2011; mfaessle/coax-control)",
        {
            "flight_2011-07-25_hover_crash.mat": DataFile(
                "c495ca426e21105bd186bbe803003e10cad2d8fc6093ecbbbb6273521c9241eb",
                f"{_COAX}/59f1c348af1a1f2d0f566bf90847773e5fd5ced7/system_identification/ViconData.mat",
                "hover, ends in a crash; 20 s at 150 Hz",
            ),
            "flight_2011-08-01_vertical.mat": DataFile(
                "6891ef7b33fbb0e04e60428bcf2ff3ea11c5916267d2187bafe6649b6509c946",
                f"{_COAX}/e4c1cc1a184cc2f8592fb107f489131ff65aa1e7/system_identification/ViconData.mat",
                "vertical flight; 44 s at 150 Hz",
            ),
            "bench_input_to_rpm.mat": DataFile(
                "ff10bb7dd2ac230595f3a723e16103da32d91f20b67ba62c0e7243f7b249bdaa",
                f"{_BENCH}/data/in2rpm.mat",
                "rotor speed against motor input; 11 points",
                "bench",
            ),
            "bench_voltage_to_rpm.mat": DataFile(
                "001c25ba46f6f98f8ed29a24f02467b22ee0c1e14e6e9f462c1a9dadaf00547d",
                f"{_BENCH}/data/volt2rpm.mat",
                "rotor speed against battery voltage; 14 points",
                "bench",
            ),
            "bench_rpm_voltage_compensated.mat": DataFile(
                "46a835ed8795b6209c7f2037197de346440201ecf5483fc59f581a621926d44c",
                f"{_BENCH}/data/rpmVoltComp.mat",
                "rotor speed with voltage compensation",
                "bench",
            ),
        },
    ),
    "nanobench": Dataset(
        "Crazyflie 2.1 under motion capture, with motor commands, IMU and battery (2026; syediu/nanobench-iros2026)",
        dict(
            (
                _nanobench(
                    "14e6ae607bd6bc507b3a3acc53a7e97df3539f3d2c862a4f5d073f610d18f1d0", "B10_lissajous_fast_rep1"
                ),
                _nanobench("0f3c20f91b466a4050f223120d46d332c65c88ff3870b430d832385abb7c08ae", "B2_circle_fast_rep2"),
                _nanobench("926a2881ad3590692047d193e1f9f0090b9dc258de7475f0e3038586fcbf9d89", "B2_circle_slow_rep2"),
                _nanobench("b99c65e1dd518c26b4f9fbad5d57fed09d627ad045a431a6fb27adacfeca0329", "B3_figure8_fast_rep1"),
                _nanobench(
                    "6c5e7d6feb79c3e99c2f222c53a089a4884c09caf7e7397b3056437ccd0f6f2e", "B3_figure8_medium_rep2"
                ),
                _nanobench("f2a7e983721b3ca40afc426d2e3f095043a2b3c9b847c8dcf911851fd785c99c", "B5_helix_fast_rep2"),
                _nanobench("b4c2a87c43dc5b19511d863cc8456b2ed7ffbe1dcf29579a05f232a292dae38c", "B5_helix_medium_rep1"),
                _nanobench("a4d1281854d937c94680ed8b49e176a1ac612c994c01d88964dff6689e73199a", "B6_linear_ramp_rep1"),
                _nanobench("d7b67a4f7c7136b0ccbd272b9329b4b248a7841ae64fc7612f5b1f15d78b0654", "B6_linear_ramp_rep2"),
                _nanobench("a2134e0d4e814deefb916f7034cddbcf5b5033d326545063378a383e0f2d85e9", "B8_star_fast_rep1"),
                _nanobench("bb515fdd874f2cbc68e99b082cb7fa7c27fd593f54b568e23342f90df6fbeb06", "B8_star_medium_rep1"),
            )
        ),
    ),
}


def cache_folder() -> Path:
    """The folder that fetched files go to."""
    import platformdirs  # loaded only where data sets are asked for

    return Path(platformdirs.user_cache_dir("swashplate")) / "data"


def places() -> Iterator[Path]:
    """The folders that are searched, in order; not all of them need exist."""
    yield cache_folder()
    folders = os.environ.get("SWASHPLATE_DATA")
    if folders:
        yield Path(folders)
    for start in (Path(__file__).resolve().parent, Path.cwd()):
        for folder in (start, *start.parents):
            yield folder / "shared" / "data"


def _entry(name: str, file: str, registry: Mapping[str, Dataset]) -> DataFile:
    files = _dataset(name, registry).files
    if file not in files:
        raise DatasetError(
            f"has no file '{file}'; it has {', '.join(files)}.", channel=name, hint="Choose one of them."
        )
    return files[file]


def _dataset(name: str, registry: Mapping[str, Dataset]) -> Dataset:
    if name not in registry:
        hint = f"{nearest(name, registry)} See `swash data list`.".strip()
        raise DatasetError(f"there is no data set '{name}'; known are {', '.join(registry)}.", hint=hint)
    return registry[name]


def _has_hash(path: Path, sha256: str) -> bool:
    try:
        return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == sha256
    except OSError:
        return False


def find(name: str, file: str, *, registry: Mapping[str, Dataset] = REGISTRY) -> Path | None:
    """Where a data set's file lies on this machine, None where it does not (or only with another hash).

    Raises:
        DatasetError: where the data set or the file is not registered.
    """
    entry = _entry(name, file, registry)
    candidates = (folder / part for folder in places() for part in (Path(name) / file, Path(file)))
    return next((path for path in candidates if _has_hash(path, entry.sha256)), None)


def listing(*, registry: Mapping[str, Dataset] = REGISTRY) -> tuple[DatasetFile, ...]:
    """Every file: data set, name, where it is found (or None), description; first those that come with the package."""
    shipped = tuple(DatasetFile(example_logs.NAME, one.file, one.path, one.summary) for one in example_logs.EXAMPLES)
    return shipped + tuple(
        DatasetFile(name, file, find(name, file, registry=registry), entry.description)
        for name, dataset in registry.items()
        for file, entry in dataset.files.items()
    )


def fetch(name: str, *, registry: Mapping[str, Dataset] = REGISTRY) -> tuple[Path, ...]:
    """The paths of all files of a data set; those not found on this machine are downloaded into the user's cache.

    Downloads are checked by hash (pooch; Uieda et al., 2020) and appear in the cache only when complete.

    Raises:
        DatasetError: where the data set is unknown, the network fails, or the hash differs.
    """
    if name == example_logs.NAME:
        return tuple(one.path for one in example_logs.EXAMPLES)
    import pooch

    paths = []
    for file, entry in _dataset(name, registry).files.items():
        path = find(name, file, registry=registry)
        if path is None:
            try:
                got = pooch.retrieve(
                    entry.address, known_hash=f"sha256:{entry.sha256}", fname=file, path=cache_folder() / name
                )
            except (OSError, ValueError) as error:  # requests' errors are OSErrors; a wrong hash is a ValueError
                reason = " ".join(str(error).split())
                raise DatasetError(
                    f"could not be fetched from {entry.address}: {reason}.",
                    channel=f"{name}/{file}",
                    hint="Check the network, or put the file into the folder that SWASHPLATE_DATA names.",
                ) from error
            path = Path(got)
        paths.append(path)
    return tuple(paths)


def locate(path_or_name: str | Path, *, registry: Mapping[str, Dataset] = REGISTRY) -> Path:
    """The file that a user means: a path, or a registered file as "coax56/flight_2011-08-01_vertical".

    "examples/NAME" is one of those that come with the package.

    A path that exists wins. What is neither is returned as a path, for the reader to say that it is missing.

    Raises:
        DatasetError: where a registered data set is named but the file is unknown or not on this machine.
    """
    path = Path(path_or_name)
    name, _, file = path.as_posix().partition("/")
    if name == example_logs.NAME and not path.exists() and (shipped := example_logs.example(file)):
        return shipped
    if path.exists() or name not in registry or not file:
        return path
    files = registry[name].files
    full = next((known for known in files if file in (known, Path(known).stem)), file)
    match = find(name, full, registry=registry)
    if match is None:
        raise DatasetError(
            "the file is not on this machine.", channel=f"{name}/{full}", hint=f"Get it with `swash data fetch {name}`."
        )
    return match
