"""Who evaluates candidates: this process and its threads, worker processes, or the workers of a Dask cluster."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context

from graben.stages.workers import PATIENCE_S, await_worker, connect


@dataclass(frozen=True)
class Workers:
    """executor None: this process. chunk: particles in one task of the asynchronous swarm."""

    executor: Executor | None = None
    chunk: int = 1


@contextmanager
def workers_of(search: str, workers: int, particles: int, cluster: str | None) -> Iterator[Workers]:
    """The workers of a search: with `cluster` those of the Dask scheduler there, with "appso" processes.

    Two tasks for each worker and generation: fewer leave workers idle, more cost more than they share out.
    """
    if cluster is not None:
        client = connect(cluster, PATIENCE_S)
        with client:
            await_worker(client, cluster, PATIENCE_S)
            lanes = max(1, sum(client.nthreads().values()))
            yield Workers(client.get_executor(pure=False), math.ceil(particles / (2 * lanes)))
    elif search == "appso" and workers > 1:
        # Processes begun afresh: a fork of a process with compiled threads may hang.
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            yield Workers(pool, math.ceil(particles / (2 * workers)))
    else:
        yield Workers()
