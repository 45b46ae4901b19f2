"""Write a file whole or not at all: to a temporary name beside it, then moved into place."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from bodyplan.errors import InputError


@contextmanager
def replacing(path: str | os.PathLike[str], mode: str = "w") -> Iterator[IO[Any]]:
    """Open ``path`` for writing (``"w"`` text, ``"wb"`` bytes); the old file stays until all is written.

    Raises InputError when it cannot be written there.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: cannot be written, the folder {target.parent} does not exist.")
    if target.is_dir():
        raise InputError(f"{target}: cannot be written, it is a folder.")
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}).") from error
    temporary = Path(name)
    try:
        if "b" in mode:
            with os.fdopen(handle, mode) as binary:
                yield binary
        else:
            with os.fdopen(handle, mode, encoding="utf-8", newline="\n") as text:
                yield text
        # mkstemp makes private files; a result is as readable as any other file of the user
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
