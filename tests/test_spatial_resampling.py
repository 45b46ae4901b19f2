"""Shapes at nodes from few samples: exact for polynomials, frames as from samples at every node, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from bodyplan.errors import InputError
from bodyplan.spatial import GAUSS_NODES, NodeSampling, frames_from_nodes


def nodes_of(steps: np.ndarray) -> np.ndarray:
    ends = np.concatenate([[0.0], np.cumsum(steps)])
    return ends[:-1, None] + steps[:, None] * np.array(GAUSS_NODES)


def wave(s: np.ndarray) -> np.ndarray:
    return np.stack([0.3 * np.cos(2 * s), 1.5 * np.sin(3 * s + 0.2), 2 * np.cos(s)], axis=-1)


@pytest.mark.parametrize("cell", [0.01, 0.2, 0.7, 100.0])
def test_polynomials_are_exact(cell: float) -> None:
    rng = np.random.default_rng(0)
    steps = rng.uniform(0.02, 0.2, size=30)
    sampling = NodeSampling(steps, cell)
    terms = rng.normal(size=(16, 3))

    def shape(s: np.ndarray) -> np.ndarray:
        return np.moveaxis(np.polynomial.chebyshev.chebval(2.0 * s / steps.sum() - 1.0, terms), 0, -1)

    found = sampling.nodes(shape(sampling.places))
    assert found.shape == (30, 3, 3)
    assert np.abs(found - shape(nodes_of(steps))).max() < 1e-12
    # cells hold whole steps and are no longer than asked for, where steps allow it
    assert len(sampling.places) % 16 == 0
    assert len(sampling.places) <= 16 * 30


def test_waves_and_batches() -> None:
    steps = np.full(100, 0.05)
    phases = np.linspace(0.0, 1.0, 6).reshape(2, 3, 1)
    sampling = NodeSampling(steps, 1.0)
    assert len(sampling.places) == 80
    u = sampling.nodes(wave(sampling.places + phases))
    direct = wave(nodes_of(steps) + phases[..., None])
    assert u.shape == direct.shape == (2, 3, 100, 3, 3)
    assert np.abs(u - direct).max() < 1e-12
    assert np.abs(frames_from_nodes(u, steps) - frames_from_nodes(direct, steps)).max() < 1e-12
    # the stated error: (k cell / 22)^16, here with a cell that is too long
    long = NodeSampling(steps, 5.0)
    off = np.abs(long.nodes(wave(long.places)) - wave(nodes_of(steps))).max()
    assert 1e-7 < off < 1.5 * (3.0 * 5.0 / 22.0) ** 16


def test_refusals() -> None:
    for steps in ([], [0.1, 0.0], [-0.1]):
        with pytest.raises(InputError, match="steps"):
            NodeSampling(steps, 1.0)
    with pytest.raises(InputError, match="cell"):
        NodeSampling([0.1], 0.0)
    with pytest.raises(InputError, match="shapes"):
        NodeSampling([0.1], 1.0).nodes(np.zeros((15, 3)))
