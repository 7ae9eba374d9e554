"""Tasks over processes and over a Dask cluster: order, lost workers, faults."""

import os
import sys
import time
from concurrent.futures import wait

import pytest

from graben.errors import BadInput, Fault, NumericsFailed
from graben.stages.shared import workers
from graben.stages.shared.workers import compute

TASKS = list(range(6))


def slow_square(value):
    time.sleep(0.05 * (6 - value))
    return value**2


def die_once(task):
    """A worker that is killed at its first task."""
    marker, value = task
    if value == 2 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), 9)
    return value * 10


def refuse(value):
    raise BadInput(Fault("a.toml", "key", str(value), "another"))


def fail(value):
    raise NumericsFailed("a pivot vanished", where=f"element {value}", step=3, advice="smaller steps")


def _started(distributed, tries=5):
    """A cluster; its library gives a thread ten seconds to start, and a machine that stands still takes longer."""
    try:
        return distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", memory_limit=0
        )
    except AssertionError:
        if tries == 1:
            raise
        return _started(distributed, tries - 1)


@pytest.fixture(scope="module")
def cluster():
    """Two real worker processes."""
    distributed = pytest.importorskip("distributed")
    import cloudpickle

    # They cannot import the tests, so the functions of this module travel whole.
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    with _started(distributed) as local:
        yield local.scheduler_address
    cloudpickle.unregister_pickle_by_value(sys.modules[__name__])


@pytest.fixture
def unspoiled_dask(tmp_path):
    """What this process computes with Dask, and so every NetCDF file that it writes, stays as it was before."""
    import dask.config
    import distributed
    import xarray

    yield
    assert dask.config.get("scheduler", None) is None
    with pytest.raises(ValueError, match=r"[Cc]lient"):
        distributed.default_client()
    xarray.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf(tmp_path / "a.nc", engine="netcdf4")


@pytest.mark.parametrize("processes", [1, 2, 4])
def test_results_come_in_the_order_of_the_tasks(processes):
    told = []
    assert compute(slow_square, TASKS, processes, told.append) == [v**2 for v in TASKS]
    assert told[-1] == 1.0 and told == sorted(told)
    assert compute(slow_square, [], processes) == []


@pytest.mark.parametrize("processes", [1, 2])
def test_what_is_known_is_not_done_again(processes):
    told, got = [], {}
    known = {0: "known", 3: "known too"}
    results = compute(slow_square, TASKS, processes, told.append, known=known, got=got.__setitem__)
    wanted = [known.get(k, v**2) for k, v in enumerate(TASKS)]
    assert results == wanted and got == {k: v for k, v in enumerate(wanted) if k not in known}
    assert told[0] == pytest.approx(3 / len(TASKS)) and told[-1] == 1.0
    assert compute(fail, TASKS, processes, known=dict(enumerate(TASKS))) == list(TASKS)


def test_a_killed_process_loses_nothing(tmp_path):
    tasks = [(tmp_path / "died", v) for v in TASKS]
    assert compute(die_once, tasks, 2) == [10 * v for v in TASKS]
    assert (tmp_path / "died").exists()


@pytest.mark.parametrize("processes", [1, 2])
def test_what_the_work_raises_comes_through(processes):
    with pytest.raises(BadInput, match="another"):
        compute(refuse, TASKS, processes)
    with pytest.raises(NumericsFailed, match="element 0"):
        compute(fail, TASKS, processes)


def test_of_several_errors_the_first_by_its_task_comes_through_whichever_is_told_first(monkeypatch):
    def last_first(futures):
        wait(futures)
        return reversed(list(futures))

    monkeypatch.setattr(workers, "as_completed", last_first)
    with pytest.raises(NumericsFailed, match="element 0"):
        compute(fail, TASKS, 2)


def test_a_cluster_gives_the_same_in_the_same_order(cluster):
    told = []
    assert compute(slow_square, TASKS, done=told.append, cluster=cluster) == [v**2 for v in TASKS]
    assert told[-1] == 1.0 and told == sorted(told)
    # The same task twice is done twice: work may read a file that changed.
    assert compute(os.path.exists, ["/", "/"], cluster=cluster) == [True, True]
    with pytest.raises(BadInput, match="another"):
        compute(refuse, TASKS, cluster=cluster)
    with pytest.raises(NumericsFailed, match="element"):
        compute(fail, TASKS, cluster=cluster)


def test_a_killed_worker_of_a_cluster_loses_nothing(cluster, tmp_path):
    tasks = [(tmp_path / "died", v) for v in TASKS]
    assert compute(die_once, tasks, cluster=cluster) == [10 * v for v in TASKS]
    assert (tmp_path / "died").exists()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere://x", "127.0.0.1"])
def test_no_cluster_is_a_fault_of_the_option(address, unspoiled_dask, monkeypatch):
    distributed = pytest.importorskip("distributed")
    clients = []
    start = distributed.Client.start
    monkeypatch.setattr(distributed.Client, "start", lambda self, **kw: (clients.append(self), start(self, **kw)))
    with pytest.raises(BadInput, match=r"^cluster"):
        compute(slow_square, TASKS, cluster=address, patience_s=1.0)
    # What is left open closes itself at any later moment, and may then wait for itself.
    assert [client.status for client in clients] == ["closed"]


def test_a_cluster_leaves_no_scheduler_behind(cluster, unspoiled_dask):
    assert compute(slow_square, TASKS, cluster=cluster) == [v**2 for v in TASKS]


def test_a_cluster_without_workers(unspoiled_dask):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=0, processes=True, dashboard_address=":0") as empty,
        pytest.raises(BadInput, match="a cluster with workers"),
    ):
        compute(slow_square, TASKS, cluster=empty.scheduler_address, patience_s=1.0)
