"""Checkpoints of a run of blocks: NAME.checkpoint.npz beside the output, from which a restart goes on."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import graben
from graben.errors import BadInput, Fault
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.record.history import History
from graben.schemas.outputs import CHECKPOINT, beside
from graben.schemas.saved import Arrays, read_saved, write_saved
from graben.schemas.scene import Scene

_LARGEST = 1e60  # of the finite numbers of a model, in SI units
# Wall time between checkpoints on disk; a killed run loses no more than this and one saved state [s].
EVERY_S = 60.0


def path_for(output: Path) -> Path:
    """Where the checkpoint of a run with this output lies."""
    return beside(output, CHECKPOINT)


@dataclass
class Keeper:
    """Keeps the state of the last saved moment in memory, and on disk at times and when the run is stopped."""

    output: Path
    scene: Scene
    states: int = 0  # saved ones that passed every check
    _last: Arrays = field(default_factory=dict)
    _history: History | None = None
    _written: float = field(default_factory=time.monotonic)

    def keep(self, model: BlockModel, history: History, test: Arrays) -> None:
        """Remember the state that was just saved; test : what the loading needs to go on."""
        self._last = {f"model.{k}": v for k, v in snapshot.take(model).items()}
        self._last |= {f"test.{k}": np.array(v) for k, v in test.items()}
        self.states = len(history.time)
        self._last["states"] = np.array(self.states)
        self._history = history
        if time.monotonic() - self._written > EVERY_S:
            self.write()

    def write(self) -> Path | None:
        """Put the last state on disk; None where there is none yet, or no room."""
        if self._history is None:
            return None
        rows = self._history.stored(int(self._last["states"]))
        stored = self._last | {f"history.{k}": v for k, v in rows.items()}
        self._written = time.monotonic()
        written = write_saved(path_for(self.output), _marks(self.scene), stored)
        return path_for(self.output) if written else None

    def stopped(self) -> None:
        """The run was interrupted or failed: leave the last state on disk and say so."""
        path = self.write()
        if path is not None:
            logging.getLogger(__name__).warning("state %s kept in %s (--restart)", int(self._last["states"]), path)

    def remove(self) -> None:
        """The run is complete."""
        path_for(self.output).unlink(missing_ok=True)


def _marks(scene: Scene) -> dict[str, str]:
    """What a checkpoint belongs to."""
    return {"scene": scene.source.sha256, "version": graben.__version__}


def read(output: Path, scene: Scene) -> dict[str, Arrays]:
    """The parts of a checkpoint: "model", "test" and "history".

    Raises
    ------
    BadInput : there is none, it is damaged, or it belongs to another scene
    """
    path = path_for(output)
    if not path.is_file():
        raise BadInput(Fault(str(path), "restart", "", "a checkpoint, as an interrupted run leaves it", True))
    parts: dict[str, Arrays] = {"model": {}, "test": {}, "history": {}}
    for name, values in read_saved(path, _marks(scene), "that of the same scene, settings and version").items():
        part, _, rest = name.partition(".")
        if values.dtype.kind == "f" and (np.abs(values[np.isfinite(values)]) > _LARGEST).any():
            raise BadInput(Fault(str(path), name, "", f"numbers below {_LARGEST:g}"))
        if part in parts:
            parts[part][rest] = values
    return parts
