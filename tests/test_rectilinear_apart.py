"""What is told clear by its links alone is clear part by part: random bodies, folded and straight, thin and thick."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear.apart import all_apart, apart_of
from bodyplan.gaits.rectilinear.parts import Parts
from bodyplan.gaits.rectilinear.snake import InchingSnake
from rectilinear_cases import THIN

ROBOTS: dict[str, Any] = {
    "thin": lambda: bp.snake(18, 0.1, **THIN),
    "thick": lambda: bp.snake(18, 0.1, axes="alternating", first="pitch"),
    "feet": lambda: bp.snake(18, 0.1, **(THIN | {"foot_radius": 0.03, "foot_spread": 0.06})),
    "unequal": lambda: bp.snake(10, [0.1, 0.3, 0.1, 0.1, 0.3, 0.1, 0.05, 0.2, 0.1, 0.1], axes="pitch", radius=0.01),
    "more joints": lambda: bp.snake(19, 0.1, axes="pitch", radius=0.01),
}


def body_of(snake: InchingSnake, bends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints (S, 2 N - 1, 2) and angles (S, 2 N - 2) of the links between them; the first joint in the origin."""
    angles = np.cumsum(bends, axis=1)
    steps = snake.links[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return np.concatenate([np.zeros((len(bends), 1, 2)), np.cumsum(steps, axis=1)], axis=1), angles


def told(
    parts: Parts, lengths: np.ndarray, points: np.ndarray, angles: np.ndarray, tail: float, moved: Any = None
) -> np.ndarray:
    """(S,) what the kernel says of links ``moved`` (all where None) and what is near them."""
    apart, count = apart_of(parts, lengths), len(lengths)
    turns = np.concatenate([np.zeros((len(angles), 1)), angles, np.zeros((len(angles), 1))], axis=1)
    origins = np.concatenate([points[:, :1] - [tail, 0.0], points], axis=1)
    turn = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    moved = np.ones(count, dtype=bool) if moved is None else moved
    return np.array([all_apart(apart, origins[s], turn[s], moved) for s in range(len(origins))])


def folds(rng: np.random.Generator, count: int, links: int) -> np.ndarray:
    """Bends (count, links) rad, some of them hardly any, some almost back on the link before."""
    size = rng.choice([0.02, 0.3, 1.5, np.pi], (count, links))
    bends = rng.uniform(-1.0, 1.0, (count, links)) * size
    back = rng.uniform(size=bends.shape) < 0.1
    return np.where(
        back, np.pi - rng.choice([1e-12, 1e-3, 0.05, 0.3], bends.shape) * rng.normal(size=bends.shape), bends
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_links_told_apart_have_no_parts_that_overlap(name: str) -> None:
    snake = InchingSnake.of(ROBOTS[name](), 5, None)
    parts, rng = snake.parts, np.random.default_rng(len(name))
    assert parts is not None
    lengths = np.concatenate([[snake.tail], snake.links, [snake.head]])
    points, angles = body_of(snake, folds(rng, 4000, len(snake.links)))
    into = parts.overlaps(points, angles, snake.tail).max(axis=1)
    apart = told(parts, lengths, points, angles, snake.tail)
    assert into[apart].max(initial=-1.0) <= 0.0
    assert apart[into <= -0.5 * parts.need.max()].mean() > 0.5, "most that are clear by far are told so"
    assert 100 < apart.sum() < len(apart)


@pytest.mark.parametrize("name", ROBOTS)
def test_some_links_and_the_others_are_all_of_them(name: str) -> None:
    """Two links are looked at with either of them: what some links say and what the rest says is what all say."""
    snake = InchingSnake.of(ROBOTS[name](), 5, None)
    parts, rng = snake.parts, np.random.default_rng(len(name) + 1)
    assert parts is not None
    lengths = np.concatenate([[snake.tail], snake.links, [snake.head]])
    points, angles = body_of(snake, folds(rng, 2000, len(snake.links)))
    every = told(parts, lengths, points, angles, snake.tail)
    for _ in range(5):
        some = rng.uniform(size=len(lengths)) < 0.3
        mine, others = (told(parts, lengths, points, angles, snake.tail, moved) for moved in (some, ~some))
        np.testing.assert_array_equal(mine & others, every)
    assert told(parts, lengths, points, angles, snake.tail, np.zeros(len(lengths), dtype=bool)).all()


def test_parts_beside_their_links_and_beyond_their_ends() -> None:
    """Parts no robot here has: off the axes of their links, reaching beyond the joints, needs of all sizes."""
    rng, none = np.random.default_rng(5), 0
    for _ in range(60):
        lengths, links = rng.uniform(0.05, 0.3, 6), np.sort(rng.integers(0, 6, 9))
        ends = np.stack(
            [rng.uniform(-0.1, 1.1, (9, 2)) * lengths[links, None], rng.normal(size=(9, 2)) * 0.01], axis=-1
        )
        need = np.triu(rng.uniform(0.0, 0.04, (9, 9)) * (rng.uniform(size=(9, 9)) < 0.6), 1)
        need[links[:, None] == links] = 0.0
        parts = Parts(links, ends, need, np.zeros((9, 9), dtype=bool))
        angles = np.cumsum(folds(rng, 200, 4), axis=1)
        steps = lengths[1:-1, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        points = np.concatenate([np.zeros((200, 1, 2)), np.cumsum(steps, axis=1)], axis=1)
        into = parts.overlaps(points, angles, lengths[0]).max(axis=1)
        apart = told(parts, lengths, points, angles, lengths[0])
        assert into[apart].max(initial=-1.0) <= 0.0
        none += int(apart.sum())
    assert none > 200


def test_two_links_that_fold_are_told_apart_up_to_an_angle() -> None:
    """Thin parts that begin r and s from the joint between their links keep from each other what they need at least
    down to the sine of need / max(r, s), and never below."""
    need, r, s = 0.01, 0.05, 0.02
    ends = np.array([[[0.0, 0.0], [0.2 - r, 0.0]], [[s, 0.0], [0.3, 0.0]]])
    needs = np.array([[0.0, need], [0.0, 0.0]])
    parts = Parts(np.array([1, 2]), ends, needs, np.ones((2, 2), dtype=bool))
    lengths = np.array([0.1, 0.2, 0.3, 0.1])
    inside = np.arcsin(need / r) * np.array([0.0, 0.5, 0.9, 1.0 - 1e-6, 1.0 + 1e-6, 1.1, 3.0])
    angles = np.stack([np.zeros(7), np.pi - inside], axis=1)
    steps = lengths[1:-1, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    points = np.concatenate([np.zeros((7, 1, 2)), np.cumsum(steps, axis=1)], axis=1)
    assert told(parts, lengths, points, angles, 0.1).tolist() == [False] * 4 + [True] * 3
