"""Height maps from files."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.ground import HeightMap, from_dict
from bodyplan.ground.heightfiles import MAX_SAMPLES

Z = np.random.default_rng(2).normal(size=(4, 6))

ASC = """ncols 3
nrows 2
xllcorner 10
yllcorner 20
cellsize 2
NODATA_value -9999
1 2 3
4 5 {last}
"""


def png(path: Path, grey: np.ndarray, *, colour: int = 0, size: tuple[int, int] | None = None) -> Path:
    """A PNG file of unfiltered samples."""
    depth = 8 * grey.itemsize
    rows, columns = size or grey.shape[:2]
    lines = b"".join(b"\0" + row.tobytes() for row in grey.astype(grey.dtype.newbyteorder(">")))
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, depth, colour, 0, 0, 0)),
        (b"IDAT", zlib.compress(lines)),
        (b"IEND", b""),
    ]
    body = b"".join(struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)
    return path


def test_npy(tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", Z)
    ground = HeightMap.from_file(tmp_path / "m.npy", cell=0.1, origin=(1.0, 2.0), scale=2.0, friction=0.3)
    assert ground == HeightMap(Z, 0.1, (1.0, 2.0), scale=2.0, friction=0.3)
    assert from_dict({"kind": "height_map", "file": str(tmp_path / "m.npy"), "cell": 0.1}) == HeightMap(Z, 0.1)
    with pytest.raises(UnknownNameError, match="cel"):
        from_dict({"kind": "height_map", "file": str(tmp_path / "m.npy"), "cel": 0.1})
    with pytest.raises(InputError, match="give cell="):
        HeightMap.from_file(tmp_path / "m.npy")
    np.save(tmp_path / "objects.npy", np.array([{}, {}]), allow_pickle=True)
    with pytest.raises(InputError, match="cannot be read"):
        HeightMap.from_file(tmp_path / "objects.npy", cell=1.0)


def test_npz(tmp_path: Path) -> None:
    np.savez(tmp_path / "m.npz", z=Z, cell=[0.1, 0.2], origin=[3.0, 4.0])
    assert HeightMap.from_file(tmp_path / "m.npz") == HeightMap(Z, (0.1, 0.2), (3.0, 4.0))
    assert HeightMap.from_file(tmp_path / "m.npz", cell=0.3) == HeightMap(Z, 0.3, (3.0, 4.0))
    np.savez(tmp_path / "plain.npz", z=Z)
    assert HeightMap.from_file(tmp_path / "plain.npz", cell=0.3) == HeightMap(Z, 0.3)
    np.savez(tmp_path / "other.npz", heights=Z)
    with pytest.raises(UnknownNameError, match=r"'heights'.*cell, origin, z"):
        HeightMap.from_file(tmp_path / "other.npz", cell=1.0)
    np.savez(tmp_path / "none.npz", cell=1.0)
    with pytest.raises(InputError, match="no array z"):
        HeightMap.from_file(tmp_path / "none.npz")
    np.savez_compressed(tmp_path / "bomb.npz", z=np.zeros(20_000_000))
    with pytest.raises(InputError, match="larger than"):
        HeightMap.from_file(tmp_path / "bomb.npz", cell=1.0)
    (tmp_path / "text.npz").write_text("heights")
    with pytest.raises(InputError, match="cannot be read"):
        HeightMap.from_file(tmp_path / "text.npz", cell=1.0)


def test_asc_has_the_north_row_first(tmp_path: Path) -> None:
    file = tmp_path / "m.asc"
    file.write_text(ASC.format(last=6))
    ground = HeightMap.from_file(file)
    # corners are of cells, samples are their centres
    assert ground == HeightMap([[4, 5, 6], [1, 2, 3]], 2.0, (11.0, 21.0))
    assert ground.height(11.0, 23.0) == 1.0
    file.write_text(ASC.format(last=6).replace("llcorner", "llcenter"))
    assert HeightMap.from_file(file).origin == (10.0, 20.0)
    file.write_text(ASC.format(last=6).replace("cellsize 2", "dx 2\ndy 3"))
    assert HeightMap.from_file(file).cell == (2.0, 3.0)
    assert HeightMap.from_file(file, origin=(0, 0), scale=0.5).origin == (0.0, 0.0)


def test_asc_samples_without_data_are_named_or_filled(tmp_path: Path) -> None:
    file = tmp_path / "m.ASC"
    file.write_text(ASC.format(last=-9999))
    with pytest.raises(InputError, match="1 samples have no data, the first in row 0 from the south, column 2"):
        HeightMap.from_file(file)
    assert HeightMap.from_file(file, fill=7.0).z[0, 2] == 7.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("ncols 3", "ncols 4", "2 x 4 values, the file has 6"),
        ("nrows 2\n", "", "lacks nrows"),
        ("cellsize 2\n", "", "lacks cellsize"),
        ("nrows 2", "nrows 1000000000", "at most"),
        ("cellsize", "cell_size", "unknown header"),
        ("1 2", "1 two", "cannot be read"),
        ("1 2", "nan 2", "finite"),
        ("cellsize 2", "cellsize 0", "cell"),
        ("xllcorner 10", "xllcorner east", "cannot be read"),
    ],
)
def test_broken_asc(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = tmp_path / "m.asc"
    file.write_text(ASC.format(last=6).replace(old, new))
    with pytest.raises(InputError, match=message):
        HeightMap.from_file(file)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_png_spans_the_height_range_and_its_top_row_is_north(tmp_path: Path, kind: type) -> None:
    top = np.iinfo(kind).max
    grey = np.array([[0, 1, top], [top - 1, 7, 1000 % top]], dtype=kind)
    ground = HeightMap.from_file(png(tmp_path / "m.png", grey), cell=0.1, height_range=(-1.0, 2.0))
    np.testing.assert_allclose(ground.z, -1.0 + 3.0 * grey[::-1].astype(float) / top, rtol=0, atol=5e-16)


def test_png_refusals(tmp_path: Path) -> None:
    grey = np.arange(12, dtype=np.uint8).reshape(3, 4)
    file = png(tmp_path / "m.png", grey)
    with pytest.raises(InputError, match="height_range"):
        HeightMap.from_file(file, cell=0.1)
    with pytest.raises(InputError, match="greyscale"):
        HeightMap.from_file(
            png(tmp_path / "rgb.png", np.zeros((2, 2, 3), np.uint8), colour=2), cell=1, height_range=(0, 1)
        )
    with pytest.raises(InputError, match="at most"):
        huge = png(tmp_path / "huge.png", grey, size=(MAX_SAMPLES, 3))
        HeightMap.from_file(huge, cell=1, height_range=(0, 1))
    (tmp_path / "text.png").write_text("no picture")
    with pytest.raises(InputError, match="not a PNG"):
        HeightMap.from_file(tmp_path / "text.png", cell=1, height_range=(0, 1))
    (tmp_path / "cut.png").write_bytes(file.read_bytes()[:45])
    with pytest.raises(InputError, match="cannot be read"):
        HeightMap.from_file(tmp_path / "cut.png", cell=1, height_range=(0, 1))


def test_other_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        HeightMap.from_file(tmp_path / "m.npy", cell=1.0)
    with pytest.raises(UnknownNameError, match=r"'\.tif'.*\.asc, \.npy, \.npz, \.png"):
        HeightMap.from_file(tmp_path / "m.tif")
    np.save(tmp_path / "m.npy", Z)
    with pytest.raises(InputError, match=r"fill is for \.asc files only"):
        HeightMap.from_file(tmp_path / "m.npy", cell=1.0, fill=0.0)
    with pytest.raises(InputError, match=r"height_range is for \.png files only"):
        HeightMap.from_file(tmp_path / "m.npy", cell=1.0, height_range=(0, 1))
