"""Files and folders that appear when they are complete, so that a failure never leaves half of one behind.

A temporary file or folder is held by a lock of the process that writes it (`flock`, which the system drops when the
process ends, however it ends). One that nobody holds was left by a process that was killed: the next one that writes to
the same folder removes it. Windows renames nothing that is open: there nothing is held, and what a kill leaves stays.
"""

from __future__ import annotations

import errno
import json
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from swashplate import systems
from swashplate.errors import WriteError
from swashplate.json_text import as_json

_MARK = ".swash-"
_NEW, _COMMIT = "new", "commit"  # inside a temporary folder: the files, and the word that they are all there
_HINTS = {
    **dict.fromkeys(
        (errno.ENOSPC, errno.EDQUOT, errno.EFBIG), "Free some space, or raise the limit, and run it again."
    ),
    **dict.fromkeys((errno.EROFS, errno.EACCES, errno.EPERM), "Choose a folder that you may write to."),
    **dict.fromkeys((errno.ENOENT, errno.ENOTDIR), "Check that the folder exists."),
    errno.EISDIR: "It is a folder: choose another name.",
    errno.ENXIO: "Nobody reads from this pipe: begin the reader first, or name a file.",
}
_swept: set[str] = set()


@contextmanager
def _named(path: str | os.PathLike[str]) -> Iterator[None]:
    """Trouble with a temporary file as trouble with `path`, which is what the user asked for."""
    try:
        yield
    except OSError as error:
        number = error.errno or 0
        reason = error.strerror or str(error) or type(error).__name__
        hint = _HINTS.get(number, "Check the folder, its permissions and the disk.")
        raise WriteError(f"cannot be written: {reason}.", where=os.fspath(path), hint=hint) from error


def _held(path: Path) -> int | None:
    """A descriptor that holds the lock of a temporary file or folder; None where another process swept it first.

    A file system without locks gives the descriptor all the same: nobody can sweep there. -1 where nothing can be held.
    """
    if not systems.HOLDS:
        return -1
    descriptor = os.open(path, os.O_RDONLY)
    with suppress(OSError):
        systems.lock(descriptor, wait=True)
    if path.exists() and os.path.samestat(os.stat(path), os.fstat(descriptor)):
        return descriptor
    os.close(descriptor)
    return None


def _let_go(held: int) -> None:
    if held >= 0:
        os.close(held)


def _new_file(target: Path) -> tuple[Path, int]:
    while True:
        # The suffix stays: some writers choose their format by it.
        path = target.parent / f"{_MARK}{secrets.token_hex(6)}{target.suffix}"
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        with suppress(FileNotFoundError):
            held = _held(path)
            if held is not None:
                return path, held


def _new_folder(place: Path) -> tuple[Path, int]:
    while True:
        path = place / f"{_MARK}{secrets.token_hex(6)}"
        path.mkdir(mode=0o700)
        with suppress(FileNotFoundError):
            held = _held(path)
            if held is not None:
                return path, held


def sweep(folder: str | os.PathLike[str]) -> None:
    """Removes the temporary files and folders of processes that were killed; finishes a swap that one had begun.

    Only what this user owns and no living process holds is touched; what cannot be removed stays.
    """
    place = Path(folder)
    if not systems.HOLDS:
        return
    with suppress(OSError), os.scandir(place) as entries:
        for name in [entry.name for entry in entries if entry.name.startswith(_MARK)]:
            with suppress(OSError, ValueError, KeyError, TypeError):  # a note that nobody here wrote is left alone
                _sweep_one(place / name)


def _sweep_one(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | systems.NO_LINK | systems.NOT_WAITING)
    try:
        if os.fstat(descriptor).st_uid != os.geteuid():
            return
        systems.lock(descriptor)  # fails where its process lives
        if not stat.S_ISDIR(os.fstat(descriptor).st_mode):
            path.unlink()
            return
        if (path / _COMMIT).is_file():
            _swap(path)
        shutil.rmtree(path)
    finally:
        os.close(descriptor)


def _synced(folder: Path) -> None:
    """A folder's names on the disk, where the file system can promise it."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextmanager
def replaced_when_complete(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file beside `path`, renamed to `path` when the block ends well and removed when it does not.

    For programs that write files themselves; what is in memory goes by `write_bytes`. The temporary file lies in the
    same folder because a rename is atomic only within one file system. It keeps the suffix of `path`, by which some
    writers choose their format.

    Raises:
        WriteError: where the folder is missing or cannot be written to, naming `path` and the reason.
    """
    with _complete(Path(path)) as temporary:
        yield temporary
        with _named(path):
            _on_disk(temporary)
            if Path(path).exists():
                temporary.chmod(stat.S_IMODE(Path(path).stat().st_mode))
            os.replace(temporary, path)


@contextmanager
def added_when_complete(path: str | os.PathLike[str]) -> Iterator[Path]:
    """As `replaced_when_complete`, but never over a file that is there, whoever made it and when.

    Raises:
        FileExistsError: where something of that name is there when the block ends.
        WriteError: as `replaced_when_complete`.
    """
    if Path(path).exists():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    with _complete(Path(path)) as temporary:
        yield temporary
        with _named(path):
            _on_disk(temporary)
        try:
            os.link(temporary, path)  # unlike a rename it fails where the name is taken
        except FileExistsError:
            raise
        except OSError:  # a file system without links: claim the name, then fill it
            os.close(os.open(path, os.O_CREAT | os.O_EXCL))
            with _named(path):
                os.replace(temporary, path)
        temporary.unlink(missing_ok=True)


@contextmanager
def _complete(target: Path) -> Iterator[Path]:
    """A temporary file beside `target`, on the disk when the block of its user ends; removed where that fails."""
    with _named(target):
        if os.path.abspath(target.parent) not in _swept:  # once: a folder of ten thousand pictures is read once
            sweep(target.parent)
            _swept.add(os.path.abspath(target.parent))
        temporary, held = _new_file(target)
    try:
        yield temporary
        _synced(target.parent)
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise
    finally:
        _let_go(held)


def _on_disk(file: Path) -> None:
    descriptor = os.open(file, os.O_RDWR)  # Windows flushes only what may be written to
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(path: str | os.PathLike[str]) -> Path:
    """A folder, made with those above it where missing.

    Raises:
        WriteError: where it cannot be made.
    """
    with _named(path):
        Path(path).mkdir(parents=True, exist_ok=True)
    return Path(path)


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Writes a text file (UTF-8, line ends as they stand in `text`) by rename when complete.

    Names of files may hold bytes that are no UTF-8; "?" stands for each.
    """
    return write_bytes(path, text.encode("utf-8", errors="replace"))


def write_bytes(path: str | os.PathLike[str], content: bytes | memoryview) -> Path:
    """Writes a file by rename when complete and on the disk; returns its path.

    Raises:
        WriteError: where it cannot be written, naming `path` and the reason; nothing is left behind then.
    """
    target = Path(path)
    if target.exists() and not target.is_file() and not target.is_dir():  # a pipe or a device is never replaced
        with _named(path):
            # A pipe that nobody reads from is an error at once: opened to wait, it would wait for ever.
            descriptor = os.open(target, os.O_WRONLY | systems.NOT_WAITING | systems.BYTES)
            if systems.NOT_WAITING:
                os.set_blocking(descriptor, True)
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(content)
        return target
    with replaced_when_complete(path) as temporary, _named(path), temporary.open("wb") as stream:
        stream.write(content)
    return target


def write_json(path: str | os.PathLike[str], value: Any) -> Path:
    """Write a value as a JSON document (see `as_json`)."""
    return write_text(Path(path), as_json(value) + "\n")


@contextmanager
def folder_when_complete(target: str | os.PathLike[str], *, ours: Collection[str]) -> Iterator[Path]:
    """A temporary folder whose files move into `target` when the block ends well, and vanish when it does not.

    The temporary folder is made at once and inside `target`, so that a place which cannot be written to is found before
    an hour of computing and not after it, and so that nothing is ever left beside `target`. Other people's files in
    `target` stay.

    Old and new files never lie beside each other: the old ones go first. A process that is killed between leaves the
    rest in the temporary folder with a note of what is to be done; the next one to write there does it.

    Args:
        target: the folder that the user asked for; it and missing folders above it are made.
        ours: the names that belong to this result. Those that this run did not write are removed from `target`: a
            model of an earlier run must not lie beside the report of a failed one.

    Raises:
        WriteError: where `target` is a file or cannot be written to.
    """
    place = Path(os.path.abspath(target))
    if place.exists() and not place.is_dir():
        raise WriteError("is a file, expected a folder.", where=os.fspath(target), hint="Choose another --out.")
    missing = [folder for folder in (place, *place.parents) if not folder.exists()]
    with _named(target):
        try:
            place.mkdir(parents=True, exist_ok=True)
            sweep(place)
            temporary, held = _new_folder(place)
        except OSError:
            _without_empty(missing)
            raise
    try:
        with _named(target):
            (temporary / _NEW).mkdir()
        yield temporary / _NEW
        with _named(target):
            written = {file.name for file in (temporary / _NEW).iterdir()}
            note = {"remove": sorted(set(ours) - written), "move": sorted(written)}
            _synced(temporary / _NEW)
            before = _lying(place, note)
            write_text(temporary / _COMMIT, json.dumps(note))
            try:
                _swap(temporary)
            except KeyboardInterrupt:
                _swap(temporary)  # all of it is there: it is quicker to finish than to go back
                raise
            except OSError as error:
                if _lying(place, note) == before and _lying(temporary / _NEW, note) == written:  # nothing was moved yet
                    (temporary / _COMMIT).unlink()
                    raise
                raise WriteError(
                    f"not all of it could be moved to its place: {error.strerror or error}. All of it is written and "
                    f"waits in {temporary.name}.",
                    where=os.fspath(target),
                    hint="Free some space: the next command that writes there moves it to its place first.",
                ) from error
    finally:
        if not (temporary / _COMMIT).exists() or not any((temporary / _NEW).iterdir()):  # otherwise it is still needed
            shutil.rmtree(temporary, ignore_errors=True)
        _let_go(held)
        _without_empty(missing)


def temporary_place() -> str:
    """The system's folder for temporary files.

    Python's own search writes a file into it, which would stay behind where the process is killed at that moment: a
    folder that is there and may be written to is taken without.

    Raises:
        WriteError: where there is none.
    """
    named = [os.environ.get(name) for name in ("TMPDIR", "TEMP", "TMP")]
    named += [os.path.join(os.sep, "tmp")] if os.name == "posix" else []
    if tempfile.tempdir is None:
        usable = (place for place in named if place and os.access(place, os.W_OK | os.X_OK) and os.path.isdir(place))
        tempfile.tempdir = next((os.path.abspath(place) for place in usable), None)
    try:
        return tempfile.gettempdir()
    except OSError as error:
        raise WriteError(
            "there is no folder for temporary files that can be written to.", hint="Name one by TMPDIR."
        ) from error


@contextmanager
def scratch_folder(place: str | os.PathLike[str] | None = None) -> Iterator[Path]:
    """A folder for what no user asked for, removed after the block; where a process is killed before, by the next one.

    Args:
        place: the folder it lies in; by default the system's place for temporary files.

    Raises:
        WriteError: where it cannot be made.
    """
    around = Path(temporary_place() if place is None else place)
    with _named(around):
        sweep(around)
        folder, held = _new_folder(around)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _let_go(held)


def _without_empty(folders: list[Path]) -> None:
    """Removes the folders, innermost first, that are empty."""
    with suppress(OSError):
        for folder in folders:
            folder.rmdir()


def _lying(place: Path, note: Mapping[str, list[str]]) -> set[str]:
    """The names of a note that are in a folder."""
    return {name for names in note.values() for name in names if os.path.lexists(place / name)}


def _swap(temporary: Path) -> None:
    """Moves what a temporary folder holds into the folder around it; a second call finishes what a first one began."""
    place, new = temporary.parent, temporary / _NEW
    note = json.loads((temporary / _COMMIT).read_text(encoding="utf-8"))
    remove, move = note["remove"], note["move"]
    if any(name in ("", ".", "..") or os.path.basename(name) != name for name in (*remove, *move)):
        raise ValueError("the note names what lies outside its folder")
    waiting = [name for name in move if (new / name).exists()]
    old = [name for name in (*remove, *waiting) if os.path.lexists(place / name)]
    if old != waiting or len(move) > 1:  # a single file is replaced without a gap
        for name in old:
            if (place / name).is_dir() and not (place / name).is_symlink():
                shutil.rmtree(place / name)
            else:
                (place / name).unlink()
        _synced(place)
    for name in waiting:
        os.replace(new / name, place / name)
    _synced(place)
