"""Threads that meet at barriers: in step, and free again when one of them fails."""

import numpy as np
import pytest

from graben.mechanics.blocks.engine.threads import all_there, arrive, run_together


def meet(me, board, turns, seen):
    for turn in range(1, turns + 1):
        arrive(board, me, turn)
        if not all_there(board, turn):
            return turn
        seen[me, turn - 1] = board[:-1, 0].min()
    return 0


def test_nobody_passes_a_barrier_before_all_are_there():
    seen = np.zeros((3, 200))
    assert run_together(meet, [(200, seen)] * 3) == 0
    assert np.all(seen >= np.arange(1, 201))


@pytest.mark.parametrize("short", [0, 1])
def test_a_thread_that_leaves_frees_the_others(short):
    seen = np.zeros((2, 200))
    turns = [200, 200]
    turns[short] = 50
    result = run_together(meet, [(n, seen) for n in turns])
    assert result == (0 if short == 0 else 51)


@pytest.mark.parametrize("broken", [0, 1])
def test_a_failure_in_any_thread_is_raised(broken):
    seen = np.zeros((2, 200))
    arguments = [(200, seen), (200, seen)]
    arguments[broken] = ("many", seen)
    with pytest.raises(TypeError):
        run_together(meet, arguments)
