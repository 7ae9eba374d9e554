"""What ends a run from outside: Ctrl-C, SIGTERM (make and schedulers send it) and SIGHUP. Exit code 130.

Until a command is at work a signal ends the process at once: nothing has been made. A command at work unwinds by
KeyboardInterrupt, so that half-made files go and the last state is kept. Once its outputs are in place signals are
passed over. Signals that were ignored when the process began (nohup) stay ignored.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

EXIT = 130
# Senders such as timeout(1) and terminals repeat a signal at once; what comes later is meant.
_REPEATED_S = 1.0
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_IDLE, _AT_WORK, _COMPLETE = range(3)


class _State:
    mood = _IDLE
    process = 0  # whose signals these are: 0 for a program that only calls graben
    came_at = 0.0  # when the first signal came, 0 for none
    raised = False  # to be raised once, or once more where it was swallowed
    interrupted = False
    held = 0


def take() -> None:
    """From now on signals end this process with exit code 130; for the programs that graben installs."""
    if _State.process != os.getpid():
        _State.process = os.getpid()
        _set()
        # The interpreter puts back what ends a process by the signal while it still tidies up.
        atexit.register(lambda: [signal.signal(number, signal.SIG_IGN) for number in _SIGNALS])


def _set() -> dict[int, Any]:
    """Put the handler in place; returns the former ones."""
    import threading

    if threading.current_thread() is not threading.main_thread():
        return {}
    return {n: signal.signal(n, _end) for n in _SIGNALS if signal.getsignal(n) not in (signal.SIG_IGN, None)}


def _end(number: int, frame: FrameType | None) -> None:
    if _State.process not in (0, os.getpid()):
        os._exit(EXIT)  # a worker process that has not begun
    now = time.monotonic()
    insisted = 0.0 < _State.came_at < now - _REPEATED_S
    if not _State.held and (_State.mood == _IDLE or insisted):
        _leave()
    _State.came_at = _State.came_at or now
    _raise_once()


def _raise_once() -> None:
    if _State.came_at and _State.mood == _AT_WORK and not _State.held and not _State.raised:
        _State.raised = _State.interrupted = True
        raise KeyboardInterrupt


def _leave() -> NoReturn:
    """End without unwinding."""
    if "multiprocessing" in sys.modules:
        from multiprocessing import active_children

        for child in active_children():
            child.kill()
    os.write(2, f"{os.path.basename(sys.argv[0])}: interrupted\n".encode())
    os._exit(EXIT)


@contextmanager
def at_work() -> Iterator[None]:
    """Within this block signals raise KeyboardInterrupt, the first one only; one that is sent later ends the process.

    After it they are passed over where this process is graben's own, and are what they were before where it is not.
    """
    former, hook = _set(), sys.unraisablehook
    _State.mood, _State.came_at, _State.raised, _State.interrupted, _State.held = _AT_WORK, 0.0, False, False, 0
    sys.unraisablehook = lambda unraisable: _again(unraisable.exc_value) or hook(unraisable)
    try:
        yield
    finally:
        _State.mood = _COMPLETE
        sys.unraisablehook = hook
        if not _State.process:
            _State.mood = _IDLE
            for number, handler in former.items():
                signal.signal(number, handler)


def _again(error: BaseException | None) -> bool:
    """Raise an interrupt once more that was swallowed, as finalizers and callbacks from C swallow exceptions."""
    if not isinstance(error, KeyboardInterrupt) or _State.mood != _AT_WORK:
        return False
    import threading

    def send() -> None:
        number = next((n for n in _SIGNALS if signal.getsignal(n) is _end), None)
        if _State.mood == _AT_WORK and number is not None:  # what was swallowed has not ended the command
            _State.came_at, _State.raised = 0.0, False
            os.kill(os.getpid(), number)

    threading.Timer(0.05, send).start()
    return True


def came() -> bool:
    """Whether the last command at work was interrupted, whatever exception that became on its way up."""
    return _State.interrupted


def complete() -> None:
    """The outputs are in place: from now on signals are passed over, so that the run ends as done."""
    if _State.mood == _AT_WORK:
        _State.mood = _COMPLETE


@contextmanager
def held() -> Iterator[None]:
    """Within this block signals wait: for libraries that may not be broken off, and steps that belong together."""
    import threading

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _State.held += 1
    try:
        yield
    finally:
        _State.held -= 1
        _raise_once()
