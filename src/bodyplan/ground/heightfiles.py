"""Heights from files: NumPy arrays, ESRI ASCII grids, greyscale PNG; sizes are bounded, rows ascend in y."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError, MissingExtraError, UnknownNameError

#: samples of one height map
MAX_SAMPLES = 2048 * 2048
_MAX_BYTES = 128 * 1024 * 1024


@dataclass(frozen=True)
class Grid:
    """What a file says: ``z`` (ny, nx), y ascending; ``cell`` (dx, dy) and ``origin`` (x, y) or None."""

    z: Array
    cell: tuple[float, float] | None = None
    origin: tuple[float, float] | None = None


def read_grid(path: str | Path, height_range: tuple[float, float] | None, fill: float | None) -> Grid:
    """The grid in a .npy, .npz, .asc or .png file; see :meth:`bodyplan.HeightMap.from_file`."""
    file = Path(path)
    reader = _READERS.get(file.suffix.lower())
    if reader is None:
        raise UnknownNameError("kind of file", file.suffix, _READERS, f"height map {str(path)!r}")
    if not file.is_file():
        raise InputError(f"height map {str(path)!r}: there is no such file.")
    if file.stat().st_size > _MAX_BYTES:
        raise InputError(f"height map {str(path)!r}: larger than the {_MAX_BYTES // 2**20} MiB allowed.")
    for name, value, kind in (("height_range", height_range, ".png"), ("fill", fill, ".asc")):
        if value is not None and file.suffix.lower() != kind:
            raise InputError(f"height map {str(path)!r}: {name} is for {kind} files only.")
    try:
        return reader(file, height_range, fill)
    except (OSError, ValueError, zipfile.BadZipFile, struct.error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"height map {str(path)!r}: cannot be read: {error}.") from error


def check_size(rows: int, columns: int, where: str) -> None:
    """InputError unless the grid has at least 2 x 2 samples and at most MAX_SAMPLES."""
    if rows < 2 or columns < 2 or rows * columns > MAX_SAMPLES:
        raise InputError(f"{where}: needs at least 2 x 2 samples and at most {MAX_SAMPLES}, got {rows} x {columns}.")


def _npy(file: Path, height_range: Any, fill: Any) -> Grid:
    # mapped, so that a header cannot claim more than the file holds
    return Grid(np.array(np.load(file, mmap_mode="r", allow_pickle=False)))


def _npz(file: Path, height_range: Any, fill: Any) -> Grid:
    with zipfile.ZipFile(file) as archive:  # the sizes unpacked, before anything is
        if sum(entry.file_size for entry in archive.infolist()) > _MAX_BYTES:
            raise InputError(f"height map {str(file)!r}: larger than the {_MAX_BYTES // 2**20} MiB allowed.")
    with np.load(file, allow_pickle=False) as data:
        for name in data.files:
            if name not in ("z", "cell", "origin"):
                raise UnknownNameError("array", name, ("z", "cell", "origin"), f"height map {str(file)!r}")
        if "z" not in data.files:
            raise InputError(f"height map {str(file)!r}: has no array z.")
        cell = pair(data["cell"], "cell") if "cell" in data.files else None
        origin = pair(data["origin"], "origin") if "origin" in data.files else None
        return Grid(data["z"], cell, origin)


def _asc(file: Path, height_range: Any, fill: float | None) -> Grid:
    """ESRI ASCII grid: header, then rows from north to south. Its cells are samples at their centres."""
    where = f"height map {str(file)!r}"
    words = file.read_text(encoding="ascii").split()
    header: dict[str, float] = {}
    while 2 * len(header) + 1 < len(words) and words[2 * len(header)][0].isalpha():
        key = words[2 * len(header)].lower()
        if key in ("nan", "inf"):
            break
        if key not in _ASC_KEYS or key in header:
            raise UnknownNameError("header entry (or one given twice)", key, _ASC_KEYS, where)
        header[key] = float(words[2 * len(header) + 1])
    missing = [name for name in ("ncols", "nrows") if name not in header]
    if "cellsize" not in header and not {"dx", "dy"} <= header.keys():
        missing.append("cellsize")
    if missing:
        raise InputError(f"{where}: the header lacks {', '.join(missing)}.")
    columns, rows = int(header["ncols"]), int(header["nrows"])
    check_size(rows, columns, where)
    values = words[2 * len(header) :]
    if len(values) != rows * columns:
        raise InputError(f"{where}: the header says {rows} x {columns} values, the file has {len(values)}.")
    z = np.array(values, dtype=np.float64).reshape(rows, columns)[::-1]
    dx, dy = header.get("dx", header.get("cellsize", 0.0)), header.get("dy", header.get("cellsize", 0.0))
    origin = tuple(
        header.get(f"{axis}llcenter", header.get(f"{axis}llcorner", 0.0) + 0.5 * size)
        for axis, size in (("x", dx), ("y", dy))
    )
    gone = z == header.get("nodata_value", np.nan)
    if gone.any():
        if fill is None:
            row, column = np.argwhere(gone)[0]
            raise InputError(
                f"{where}: {np.count_nonzero(gone)} samples have no data, the first in row {row} "
                f"from the south, column {column}; give fill= a height to use there."
            )
        z = np.where(gone, number(fill, "fill"), z)
    return Grid(z, (dx, dy), (origin[0], origin[1]))


_ASC_KEYS = (
    *("ncols", "nrows", "cellsize", "dx", "dy", "nodata_value"),
    *("xllcorner", "yllcorner", "xllcenter", "yllcenter"),
)


def _png(file: Path, height_range: tuple[float, float] | None, fill: Any) -> Grid:
    """Greyscale, 1 to 16 bits; black and white are the ends of ``height_range``; the top row is the last."""
    where = f"height map {str(file)!r}"
    if height_range is None:
        raise InputError(f"{where}: height_range=(z of black, z of white) in m is missing.")
    black, white = finite(height_range, "height_range", (2,))
    with file.open("rb") as stream:
        head = stream.read(26)
    if head[:8] != b"\x89PNG\r\n\x1a\n":
        raise InputError(f"{where}: is not a PNG file.")
    columns, rows, _, colour = struct.unpack(">IIBB", head[16:26])
    check_size(rows, columns, where)
    if colour != 0:
        raise InputError(f"{where}: must be greyscale without transparency.")
    try:
        from matplotlib.image import imread
    except ImportError as error:
        raise MissingExtraError("matplotlib", "report", "reading a PNG height map") from error
    grey = np.asarray(imread(file, format="png"), dtype=np.float64)
    # imread gives single precision; every depth of grey is a whole number of 65535ths
    grey = np.rint(grey * 65535.0) / 65535.0
    return Grid(black + (white - black) * grey[::-1])


_READERS: dict[str, Callable[[Path, Any, Any], Grid]] = {
    ".npy": _npy,
    ".npz": _npz,
    ".asc": _asc,
    ".png": _png,
}


def pair(value: Any, field: str) -> tuple[float, float]:
    """One number or two, as two floats."""
    out = finite(value, field)
    if out.shape not in ((), (2,)):
        raise InputError(f"{field}: expected one number or two, got {value!r}.")
    x, y = np.broadcast_to(out, (2,))
    return float(x), float(y)
