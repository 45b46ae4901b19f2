"""Write a file or a folder whole or not at all: to a temporary name beside it, then moved into place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
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


def refuse_existing(path: Path, force: bool) -> None:
    """InputError where ``path`` exists, unless it may be replaced (``force``)."""
    if path.exists() and not force:
        raise InputError(f"{path}: exists already; choose another place with --out, or --force to replace it.")


def refuse_folder(path: Path, force: bool, written: Sequence[str]) -> None:
    """InputError where ``path`` is no place for a folder of the files ``written``: it exists and may not be replaced,
    or cannot be written."""
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        raise InputError(f"{path}: is a file; --out must name a folder.")
    if path.exists():
        foreign = sorted(p.name for p in path.iterdir() if p.name not in written)
        if foreign:
            names = ", ".join(foreign[:5])
            raise InputError(f"{path}: holds files that bodyplan did not write ({names}); choose another with --out.")
        refuse_existing(path, force)
    parent = path.absolute().parent
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir() or not os.access(parent, os.W_OK):
        raise InputError(f"{path}: cannot be written, {parent} is not a folder that may be written to.")


@contextmanager
def replacing_folder(folder: Path, force: bool, written: Sequence[str]) -> Iterator[Path]:
    """A temporary folder beside ``folder``, moved into its place when all is written."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        yield scratch
        scratch.chmod(0o755)
        if folder.exists():
            refuse_folder(folder, force, written)
            old = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}.old."))
            folder.replace(old / folder.name)
            scratch.replace(folder)
            shutil.rmtree(old)
        else:
            scratch.replace(folder)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
