"""What the kernels stand on: sine and cosine, the fused product, moving blocks in and out of lanes."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numba import njit

from bodyplan.spatial.lanes import LANES, SINCOS_LIMIT, fma, load, sincos, strip, table, unload

mpmath.mp.dps = 60


@njit
def sines(x, out):
    for i in range(x.size):
        out[0, i], out[1, i] = sincos(x[i])


@njit
def fused(a, b, c):
    return fma(a, b, c)


@njit
def there_and_back(flat, start, stride, count, lanes, rows, out):
    load(flat, start, stride, count, lanes, rows, 1)
    unload(strip(rows, 0, rows.size), 0, count, lanes, out, start, stride, 1)


@njit
def corner(a, start, rows, columns):
    t, s = table(a, start, rows, columns), strip(a, start, columns)
    value = t[rows - 1, columns - 1] - s[0]
    return value, t.shape, s.shape, a.size


def test_sine_and_cosine_against_mpmath() -> None:
    rng = np.random.default_rng(6)
    quarter = np.arange(-40, 41) * np.pi / 2
    x = np.concatenate(
        [
            rng.uniform(-10, 10, 400),
            rng.uniform(-1, 1, 200) * SINCOS_LIMIT,
            10.0 ** rng.uniform(-300, 0, 100),
            quarter,
            np.nextafter(quarter, np.inf),
            quarter + np.pi / 4,
            [0.0, SINCOS_LIMIT, -SINCOS_LIMIT],
        ]
    )
    out = np.empty((2, x.size))
    sines(x, out)
    for xi, s, c in zip(x, *out, strict=True):
        for got, want in ((s, mpmath.sin(mpmath.mpf(xi))), (c, mpmath.cos(mpmath.mpf(xi)))):
            assert abs(mpmath.mpf(float(got)) - want) <= 1.5 * np.spacing(max(abs(float(want)), 1e-9)), xi


def test_fused_product_rounds_once() -> None:
    a = 1.0 + 2.0**-30
    assert a * a - (1.0 + 2.0**-29) == 0.0
    assert fused(a, a, -(1.0 + 2.0**-29)) == 2.0**-60


@pytest.mark.parametrize("count", [0, 1, 3, 4, 6, 9])
@pytest.mark.parametrize("lanes", [1, 5, LANES])
def test_blocks(count: int, lanes: int) -> None:
    rng = np.random.default_rng(7)
    start, stride = 3, count + 2
    flat = rng.normal(size=start + stride * lanes)
    rows, out = np.full((count + 1, LANES), np.nan), np.full(flat.shape, np.nan)
    there_and_back(flat, start, stride, count, lanes, rows, out)
    which = start + stride * np.minimum(np.arange(LANES), lanes - 1)
    assert np.array_equal(rows[:count], flat[which + np.arange(count)[:, None]])
    assert np.isnan(rows[count]).all()
    copied = (start + stride * np.arange(lanes)[:, None] + np.arange(count)).ravel()
    assert np.array_equal(out[copied], flat[copied])
    assert np.isnan(np.delete(out, copied)).all()


def test_views_without_references() -> None:
    a = np.arange(24.0).reshape(2, 3, 4)
    assert corner(a, 4, 3, 5) == (14.0, (3, 5), (5,), 24)
