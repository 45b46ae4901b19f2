"""The kernel of :mod:`bodyplan.curves.quadrature`: Legendre series, one cell's for each place."""

from __future__ import annotations

from bodyplan.arrays import Array, IntArray
from bodyplan.kernels import lean


@lean
def series_at(series: Array, cell: IntArray, x: Array, factors: Array, out: Array) -> None:
    """Into ``out`` (N, 3) the three Legendre series (k + 1 terms each, k >= 2) of cells ``cell`` (N,) at ``x`` (N,) in
    [-1, 1], of ``series`` (C, k + 1, 3); by Clenshaw's recurrence with the ``factors`` (k + 1, 2): (2 i - 1) / i and
    (i - 1) / i. The three go side by side, as each step waits for the one before."""
    last = series.shape[1] - 1
    for i in range(len(x)):
        place, at = x[i], cell[i]
        a, b, c = series[at, last, 0], series[at, last, 1], series[at, last, 2]
        p, q, r = series[at, last - 1, 0], series[at, last - 1, 1], series[at, last - 1, 2]
        for k in range(last, 1, -1):
            way, back = factors[k, 0] * place, factors[k, 1]
            a, p = p + a * way, series[at, k - 2, 0] - a * back
            b, q = q + b * way, series[at, k - 2, 1] - b * back
            c, r = r + c * way, series[at, k - 2, 2] - c * back
        out[i, 0], out[i, 1], out[i, 2] = p + a * place, q + b * place, r + c * place
