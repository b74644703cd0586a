"""The user's cache folder: what is kept there is run later, so nobody else may be able to put it there.

Without a home of one's own (`HOME=/tmp`, or as root with somebody's home) another user of the machine could have made
the folder, with a library in it under the name that is looked for.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

import platformdirs


def cache_folder(name: str) -> Path | None:
    """A folder in the user's cache folder, made where missing; None where it cannot be made or is not `is_own`."""
    place = Path(platformdirs.user_cache_dir("swashplate", appauthor=False)) / name
    try:
        place.mkdir(parents=True, exist_ok=True, mode=0o700)
        return place if is_own(place) else None
    except (OSError, RuntimeError):  # RuntimeError: links in a circle
        return None


def is_own(place: Path) -> bool:
    """Whether this user and root alone can put files into a folder, or another folder into its place.

    A folder that its group may write to counts as the user's where the group has the user's number, as systems that
    give each user a group have it. Windows keeps the folders of users apart itself.

    Raises:
        OSError: where it, or a folder above it, cannot be looked at.
    """
    if not hasattr(os, "geteuid"):
        return True
    whole = Path(os.path.abspath(place))
    for folder in {whole, *whole.parents, (real := whole.resolve()), *real.parents}:
        status = folder.stat()
        mode, shared = status.st_mode, status.st_gid != status.st_uid
        open_to_others = mode & stat.S_IWOTH or (mode & stat.S_IWGRP and shared and status.st_gid != 0)
        guarded = mode & stat.S_ISVTX and folder not in (whole, real)  # /tmp: others cannot rename what is not theirs
        if status.st_uid not in (0, os.geteuid()) or (open_to_others and not guarded):
            return False
    return True
