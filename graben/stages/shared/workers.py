"""Tasks over worker processes of this machine, or over the workers of a Dask cluster.

Results come in the order of the tasks, so they do not depend on how many workers there are; what a lost worker had
not finished is done again by another.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from typing import TYPE_CHECKING, Any

from graben.errors import BadInput, Fault

if TYPE_CHECKING:
    from distributed import Client

Done = Callable[[float], None]
Got = Callable[[int, Any], None]

_ATTEMPTS = 3
PATIENCE_S = 60.0  # a cluster without any worker for so long is given up


def compute(
    work: Callable[[Any], Any],
    tasks: Sequence[Any],
    processes: int = 1,
    done: Done = lambda fraction: None,
    *,
    cluster: str | None = None,
    patience_s: float = PATIENCE_S,
    known: Mapping[int, Any] | None = None,
    got: Got = lambda number, result: None,
) -> list[Any]:
    """`work` of every task, in the order of the tasks.

    Parameters
    ----------
    work : a function of a module (workers import it); files that it reads must be there for each worker
    tasks : what it is called with
    processes : worker processes on this machine; 1 computes in this one. Not used with a cluster
    done : told the finished fraction
    cluster : address of a Dask scheduler, such as "tcp://10.0.0.1:8786"
    patience_s : seconds to wait for a scheduler, and for workers where there are none
    known : results that are there already, by number of the task
    got : told each new result, with the number of its task

    Raises
    ------
    BadInput : no Dask here, no scheduler at the address, or no worker there
    BrokenProcessPool : a task whose worker was lost three times
    whatever `work` raises
    """
    results = dict(known or {})
    left = [k for k in range(len(tasks)) if k not in results]

    def take(number: int, result: Any) -> None:
        results[number] = result
        got(number, result)
        done(len(results) / len(tasks))

    if not left:
        pass
    elif cluster is not None:
        _on_cluster(work, tasks, left, take, cluster, patience_s)
    elif processes == 1 or len(left) == 1:
        for k in left:
            take(k, work(tasks[k]))
    else:
        _in_processes(work, tasks, left, take, processes)
    return [results[k] for k in range(len(tasks))]


@contextmanager
def worker_processes(count: int, start: str | None = None) -> Iterator[ProcessPoolExecutor]:
    """Worker processes that end with this block: at once where it is left by an exception.

    start : how they are begun ("spawn", ...); None for the usual way of the system
    """
    before = set(active_children())
    pool = ProcessPoolExecutor(count, mp_context=get_context(start), initializer=_begin_worker)
    try:
        yield pool
    except BaseException:
        for worker in set(active_children()) - before:
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin_worker() -> None:
    """Leave Ctrl-C to the process that began this one; end when asked to, and when that process is gone."""
    for name, action in (("SIGINT", signal.SIG_IGN), ("SIGTERM", signal.SIG_DFL), ("SIGHUP", signal.SIG_DFL)):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), action)
    parent = parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _in_processes(
    work: Callable[[Any], Any], tasks: Sequence[Any], left: list[int], take: Got, processes: int
) -> None:
    for attempt in range(_ATTEMPTS):
        if not left:
            break
        lost: list[int] = []
        first = len(tasks)  # task of the first error that was seen
        with worker_processes(min(processes, len(left))) as pool:
            futures: dict[Future[Any], int] = {pool.submit(work, tasks[k]): k for k in left}
            again = BrokenProcessPool if attempt < _ATTEMPTS - 1 else ()
            # As they are done: what is done must not wait for a slower one before it is kept.
            for future in as_completed(futures):
                k, error = futures[future], future.exception()
                if error is None:
                    take(k, future.result())
                elif isinstance(error, again):
                    lost.append(k)
                else:
                    first = min(first, k)
                # Of several errors the first by its task, whichever came first: also one that is not yet told here.
                if first == len(tasks):
                    continue
                earlier = [f for f, number in futures.items() if number <= first]
                if all(f.done() for f in earlier):
                    errors = (f.exception() for f in earlier)
                    raise next(e for e in errors if e is not None and not isinstance(e, again))
        left = lost


def _on_cluster(
    work: Callable[[Any], Any], tasks: Sequence[Any], left: list[int], take: Got, address: str, patience_s: float
) -> None:
    """The scheduler gives the tasks of a lost worker to another; one that killed its workers is asked for again."""
    client = connect(address, patience_s)
    from distributed import KilledWorker, wait

    with client, client.as_current():
        await_worker(client, address, patience_s)
        asked = dict.fromkeys(left, 1)
        # One by one, so that tasks need not be hashable, and none is taken for another (pure).
        futures = {k: client.submit(work, tasks[k], pure=False) for k in left}
        while futures:
            try:
                wait(list(futures.values()), timeout=patience_s, return_when="FIRST_COMPLETED")
            except TimeoutError:
                await_worker(client, address, patience_s)  # slow tasks are no fault, no worker is
                continue
            for k in [k for k, future in futures.items() if future.done()]:
                try:
                    result = futures.pop(k).result()
                except KilledWorker:
                    if asked[k] == _ATTEMPTS:
                        raise
                    asked[k] += 1
                    futures[k] = client.submit(work, tasks[k], pure=False)
                    continue
                take(k, result)


def connect(address: str, patience_s: float) -> Client:
    try:
        from distributed import Client
    except ModuleNotFoundError as error:
        expected = "Dask on this machine: pip install 'graben[cluster]'"
        raise BadInput(Fault("", "cluster", address, f"{expected} ({error})", True)) from None

    class ClosedAtFailure(Client):
        """One that did not connect would close itself when memory is cleaned up: at the start of another one this
        waits for itself, for ever."""

        def start(self, **arguments: Any) -> None:
            try:
                super().start(**arguments)
            except BaseException:
                self.close()
                raise

    try:
        # As a default, Dask would send every computation of this process there, and go on when the client is gone.
        return ClosedAtFailure(address, timeout=patience_s, set_as_default=False)
    except (OSError, ValueError) as error:
        expected = f'the address of a Dask scheduler, such as "tcp://10.0.0.1:8786" ({error})'
        raise BadInput(Fault("", "cluster", address, expected, True)) from None


def await_worker(client: Client, address: str, patience_s: float) -> None:
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except (TimeoutError, OSError):
        expected = f"a cluster with workers (none for {patience_s:g} s)"
        raise BadInput(Fault("", "cluster", address, expected, True)) from None
