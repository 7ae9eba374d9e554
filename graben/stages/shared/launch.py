"""Starts one command and tells what it cost: python launch.py RESULT.json COMMAND...

A process of its own, with no imports beside Python's: the peak memory of a child counts what its parent held when it
forked.
"""

import json
import os
import signal
import sys
import time


def main() -> None:
    result, command = sys.argv[1], sys.argv[2:]
    begun = time.perf_counter()
    child = os.fork()
    if child == 0:
        os.execv(command[0], command)
    # Ctrl-C reaches the child as well: its end is told, whatever it is.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: os.kill(child, signal.SIGTERM))
    _, status, used = os.wait4(child, 0)
    found = {
        "code": os.waitstatus_to_exitcode(status),
        "wall_s": time.perf_counter() - begun,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_memory_bytes": used.ru_maxrss * (1 if sys.platform == "darwin" else 1024),
    }
    with open(result, "w") as file:
        json.dump(found, file)


if __name__ == "__main__":
    main()
