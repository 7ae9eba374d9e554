"""Speed of the averages: joints of a model, one REV over all its saved states; JSON lines on stdout.

Running-bond bricks moved at random, 51 saved states, contacts at the ends of every joint. Options: --blocks N ...
(400 1600 6400), --states N (51).
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from dataclasses import replace

import numpy as np

from graben.mechanics.averaging.history import Contacts, History, average
from graben.mechanics.averaging.rev import Circle


def history(count: int, states: int) -> History:
    """A wall of about `count` bricks, 2:1, each cut into two zones."""
    rows = int(np.sqrt(2.0 * count))
    columns = max(2, count // rows)
    row, column = np.divmod(np.arange(rows * columns), columns)
    low = np.stack([2.0 * column + (row % 2), 1.0 * row], axis=1)
    position = (low[:, None, :] + np.array([[0, 0], [2, 0], [2, 1], [0, 1.0]])).reshape(-1, 2)
    blocks = row.size
    vertex = np.arange(4 * blocks)
    zone = np.concatenate([vertex.reshape(-1, 4)[:, [0, 1, 2]], vertex.reshape(-1, 4)[:, [0, 2, 3]]])
    rng = np.random.Generator(np.random.PCG64(0))
    move = np.repeat(rng.normal(0.0, 0.01, (states, blocks, 2)), 4, axis=1)
    move[0] = 0.0
    none, pairs = np.zeros(0, dtype=np.int64), np.zeros((0, 2))
    empty = Contacts(none, pairs.astype(np.int64), pairs, pairs, np.zeros(0), np.zeros(0), none)
    bare = History(
        time=np.arange(float(states)),
        position=position,
        displacement=move,
        vertex_block=vertex // 4,
        zone_vertex=zone,
        zone_block=np.tile(np.arange(blocks), 2),
        corner_count=np.full(blocks, 4),
        corner=vertex,
        zone_stress=rng.normal(-1e6, 1e5, (states, 2 * blocks, 4)),
        contacts=empty,
        vertex_force=np.zeros((states, 4 * blocks, 2)),
    )
    pair = np.repeat(bare.network.contact_block, 2, axis=0)
    n = pair.shape[0]
    contacts = Contacts(
        state=np.repeat(np.arange(states), n),
        block=np.tile(pair, (states, 1)),
        position=np.tile(low[pair[:, 0]], (states, 1)),
        force=rng.normal(0.0, 1e5, (states * n, 2)),
        length=np.full(states * n, 0.5),
        slip=rng.normal(0.0, 1e-3, states * n),
        flag=rng.integers(0, 4, states * n),
    )
    return replace(bare, contacts=contacts)


def timed(work) -> float:
    """CPU seconds of the faster of two calls."""
    best = float("inf")
    for _ in range(2):
        begun = time.process_time()
        work()
        best = min(best, time.process_time() - begun)
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, nargs="+", default=[400, 1600, 6400])
    parser.add_argument("--states", type=int, default=51)
    options = parser.parse_args()
    for count in options.blocks:
        h = history(count, options.states)
        network_s = timed(lambda h=h: replace(h).network)
        size = h.position.max(axis=0)
        rev = Circle((float(size[0]) / 2, float(size[1]) / 2), 0.4 * float(size.min()))
        inside = int(average(h, rev).outline.blocks.sum())
        average_s = timed(lambda h=h, rev=rev: average(h, rev))
        print(
            json.dumps(
                {
                    "benchmark": "averaging",
                    "blocks": h.corner_count.size,
                    "blocks_inside": inside,
                    "states": options.states,
                    "contacts": int(h.contacts.state.size),
                    "network_s": round(network_s, 4),
                    "average_s": round(average_s, 4),
                    "average_us_per_block_and_state": round(
                        1e6 * average_s / options.states / h.corner_count.size, 3
                    ),
                    "machine": platform.machine(),
                }
            )
        )


if __name__ == "__main__":
    main()
