"""Who evaluates candidates: this process and its threads, worker processes, or the workers of a Dask cluster."""

from __future__ import annotations

import math
import pickle
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from graben.errors import BadInput, Fault, Refused
from graben.stages.shared.workers import PATIENCE_S, await_worker, connect, worker_processes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Workers:
    """executor None: this process. chunk: particles in one task of the asynchronous swarm."""

    executor: Executor | None = None
    chunk: int = 1


class Sent:
    """A function of points (c, k) that is packed once, and unpacked once in each process: the curves within it cost
    more to send with every task than a tenth of the task."""

    def __init__(self, function: Callable[[Array], Array]) -> None:
        self.packed = zlib.compress(pickle.dumps(function))

    def __call__(self, points: Array) -> Array:
        return _unpacked(self.packed)(points)


@lru_cache(maxsize=8)
def _unpacked(packed: bytes) -> Callable[[Array], Array]:
    try:
        function: Callable[[Array], Array] = pickle.loads(zlib.decompress(packed))
    except Refused as error:
        raise BadInput(Fault("", "law", "", f"a law that worker processes find: {error}")) from error
    return function


@contextmanager
def workers_of(search: str, workers: int, particles: int, cluster: str | None) -> Iterator[Workers]:
    """The workers of a search: with `cluster` those of the Dask scheduler there, with "appso" processes.

    On a cluster two tasks for each worker and generation, since workers differ. Processes here get one each: the
    swarm runs ahead by a generation, so none waits for another, and a task costs as much as one particle.
    """
    if cluster is not None:
        client = connect(cluster, PATIENCE_S)
        with client:
            await_worker(client, cluster, PATIENCE_S)
            lanes = max(1, sum(client.nthreads().values()))
            yield Workers(client.get_executor(pure=False), math.ceil(particles / (2 * lanes)))
    elif search == "appso" and workers > 1:
        # Processes begun afresh: a fork of a process with compiled threads may hang.
        with worker_processes(workers, "spawn") as pool:
            yield Workers(pool, math.ceil(particles / workers))
    else:
        yield Workers()
