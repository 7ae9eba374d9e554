"""Where a result came from and what it cost: stored in every artifact."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import resource
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import graben
from graben.schemas.doubts import doubts_of
from graben.schemas.plain import to_json
from graben.schemas.scene import Scene


def sha256_of(path: str | Path) -> str:
    """SHA-256 of a file's bytes, as hexadecimal digits."""
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _cpu_seconds() -> float:
    """CPU time of this process and of its workers that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@dataclass
class Record:
    """Provenance and cost of one run. Begin it when a stage starts; `attributes` closes the clocks.

    ``cost`` takes the stage's own figures (steps, elements, energy error, ...), keys with units; ``warnings`` what a
    person should know before trusting the result, beginning with what the inputs warn of.
    """

    scene_text: str = ""
    seed: int | None = None
    inputs: dict[str, str] = field(default_factory=dict)
    cost: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    _wall: float = field(default_factory=time.perf_counter)
    _cpu: float = field(default_factory=_cpu_seconds)

    @classmethod
    def begin(cls, scene: Scene | None = None, inputs: Iterable[str | Path] = ()) -> Record:
        """Start the clocks and hash the inputs."""
        read = list(inputs)
        return cls(
            scene_text=scene.source.effective_text if scene is not None else "",
            seed=scene.seed if scene is not None else None,
            inputs={str(p): sha256_of(p) for p in read},
            warnings=doubts_of(read),
        )

    def warn(self, texts: Iterable[str]) -> list[str]:
        """Add what the run itself has to say; returns all warnings."""
        self.warnings = list(dict.fromkeys([*texts, *self.warnings]))
        return self.warnings

    def spent(self) -> tuple[float, float]:
        """Wall and CPU time up to now, s."""
        return time.perf_counter() - self._wall, _cpu_seconds() - self._cpu

    def count(self, wall: float, cpu: float) -> None:
        """Add what the run took before it was stopped, s."""
        self._wall -= wall
        self._cpu -= cpu

    def closed_cost(self) -> dict[str, Any]:
        """The cost record with wall time, CPU time and peak memory up to now."""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        wall, cpu = self.spent()
        return {
            "wall_s": wall,
            "cpu_s": cpu,
            "peak_memory_bytes": int(peak) * (1 if sys.platform == "darwin" else 1024),
            **self.cost,
        }

    def attributes(self) -> dict[str, Any]:
        """NetCDF global attributes."""
        return {
            "software": "graben",
            "software_version": graben.__version__,
            "machine": f"{platform.system()} {platform.machine()} python {platform.python_version()}",
            "scene": self.scene_text,
            "scene_sha256": hashlib.sha256(self.scene_text.encode()).hexdigest(),
            "seed": -1 if self.seed is None else self.seed,
            "inputs": json.dumps(self.inputs, sort_keys=True),
            "cost": to_json(self.closed_cost()),
            "warnings": "\n".join(self.warnings),
        }
