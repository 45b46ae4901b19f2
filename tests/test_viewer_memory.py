"""The collector's rounds while viewers run."""

from __future__ import annotations

import gc

import pytest

from bodyplan.show.live import memory


@pytest.fixture(autouse=True)
def nothing_held() -> None:
    gc.unfreeze()


def test_what_is_there_is_held_until_the_last_release() -> None:
    assert gc.get_freeze_count() == 0
    memory.hold()
    first = gc.get_freeze_count()
    assert first > 1000
    memory.hold()
    memory.release()
    assert gc.get_freeze_count() >= first
    memory.release()
    assert gc.get_freeze_count() == 0


def test_what_comes_later_is_still_collected() -> None:
    class Ring:
        alive = 0

        def __init__(self) -> None:
            self.self = self
            Ring.alive += 1

        def __del__(self) -> None:
            Ring.alive -= 1

    memory.hold()
    try:
        Ring()
        assert Ring.alive == 1
        gc.collect()
        assert Ring.alive == 0
    finally:
        memory.release()
