"""Checkpoints of a run of blocks: NAME.checkpoint.npz beside the output, from which --restart goes on."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.blocks import snapshot
from graben.mechanics.blocks.history import History
from graben.mechanics.blocks.model import BlockModel
from graben.schemas.files import whole_file
from graben.schemas.outputs import CHECKPOINT, beside
from graben.schemas.scene import Scene

# Wall time between checkpoints on disk; a killed run loses no more than this and one saved state [s].
EVERY_S = 60.0

Arrays = dict[str, np.ndarray]


def path_for(output: Path) -> Path:
    """Where the checkpoint of a run with this output lies."""
    return beside(output, CHECKPOINT)


@dataclass
class Keeper:
    """Keeps the state of the last saved moment in memory, and on disk at times and when the run is stopped."""

    output: Path
    scene: Scene
    _last: Arrays = field(default_factory=dict)
    _history: History | None = None
    _written: float = field(default_factory=time.monotonic)

    def keep(self, model: BlockModel, history: History, test: Arrays) -> None:
        """Remember the state that was just saved; test : what the loading needs to go on."""
        self._last = {f"model.{k}": v for k, v in snapshot.take(model).items()}
        self._last |= {f"test.{k}": np.array(v) for k, v in test.items()}
        self._last["states"] = np.array(len(history.time))
        self._history = history
        if time.monotonic() - self._written > EVERY_S:
            self.write()

    def write(self) -> Path | None:
        """Put the last state on disk; None where there is none yet."""
        if self._history is None:
            return None
        rows = self._history.stored(int(self._last["states"]))
        stored: dict[str, Any] = {"scene": np.array(self.scene.source.sha256), **self._last}
        stored |= {f"history.{k}": v for k, v in rows.items()}
        with whole_file(path_for(self.output)) as temporary:
            np.savez(temporary, **stored)
        self._written = time.monotonic()
        return path_for(self.output)

    def stopped(self) -> None:
        """The run was interrupted or failed: leave the last state on disk and say so."""
        path = self.write()
        if path is not None:
            logging.getLogger(__name__).warning("state %s kept in %s (--restart)", int(self._last["states"]), path)

    def remove(self) -> None:
        """The run is complete."""
        path_for(self.output).unlink(missing_ok=True)


def read(output: Path, scene: Scene) -> dict[str, Arrays]:
    """The parts of a checkpoint: "model", "test" and "history".

    Raises
    ------
    BadInput : there is none, or it belongs to another scene
    """
    path = path_for(output)
    if not path.is_file():
        raise BadInput(Fault(str(path), "--restart", "", "a checkpoint, as an interrupted run leaves it"))
    parts: dict[str, Arrays] = {"model": {}, "test": {}, "history": {}}
    try:
        with np.load(path, allow_pickle=False) as stored:
            found = str(stored["scene"])
            for name in stored.files:
                part, _, rest = name.partition(".")
                if part in parts:
                    parts[part][rest] = stored[name]
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise BadInput(Fault(str(path), "--restart", "", f"a whole checkpoint ({error})")) from error
    if found != scene.source.sha256:
        raise BadInput(Fault(str(path), "--restart", "a checkpoint of another scene", "the same scene and --set"))
    return parts
