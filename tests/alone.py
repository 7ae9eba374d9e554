"""A plugin: each test in a process of its own, forked before any test ran (`pytest -p tests.alone`; POSIX)."""

import json
import os
import sys
import traceback

import pytest
from _pytest.runner import runtestprotocol


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item):
    """Fixtures of any scope are set up for this test alone: nothing hides what another test left behind."""
    hook, config = item.ihook, item.config
    hook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            reports = runtestprotocol(item, log=False, nextitem=None)
            said = [config.hook.pytest_report_to_serializable(config=config, report=r) for r in reports]
            with os.fdopen(write, "w") as pipe:
                json.dump(said, pipe, default=str)
            os._exit(0)
        except BaseException:
            traceback.print_exc(file=sys.__stderr__)
            os._exit(1)
    os.close(write)
    with os.fdopen(read) as pipe:
        said = pipe.read()
    status = os.waitpid(child, 0)[1]
    if status:
        raise RuntimeError(f"{item.nodeid}: its process ended with status {status}")
    for data in json.loads(said):
        hook.pytest_runtest_logreport(report=config.hook.pytest_report_from_serializable(config=config, data=data))
    hook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True
