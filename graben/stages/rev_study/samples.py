"""The samples of a study: averages of every run at every radius and place, shared out in chunks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graben.mechanics.averaging.history import average
from graben.mechanics.averaging.rev import Circle
from graben.schemas.scenes.rev_study import RevStudyScene
from graben.stages.blocks.history import Run, read_run
from graben.stages.rev_study.done import Done, Sample
from graben.stages.shared.record import Progress
from graben.stages.shared.workers import compute

# One chunk of samples: the file, and its (radius, x, y).
Chunk = tuple[Path, list[tuple[float, float, float]]]


def chunks_of(runs: list[Run], centres: np.ndarray, scene: RevStudyScene) -> list[Chunk]:
    """Samples in the order (run, centre, radius), some centres of one run per chunk, so that each is read seldom."""
    chunks = []
    for source, points in zip(runs, centres):
        for part in np.array_split(points, min(4, len(points))):
            chunks.append((source.path, [(r, float(x), float(y)) for x, y in part for r in scene.samples.radii]))
    return chunks


def sample_chunk(chunk: Chunk) -> list[Sample]:
    """The averages of one chunk; runs in a worker process."""
    path, places = chunk
    history = read_run(path).history
    results = []
    for radius, x, y in places:
        a = average(history, Circle((x, y), radius))
        which = a.outline.blocks
        results.append((a.stress, a.strain, a.area, int(which.sum()), np.packbits(which).tobytes()))
    return results


def sampled(chunks: list[Chunk], processes: int, cluster: str | None, done: Done, progress: Progress) -> list[Sample]:
    """All samples in the order of the chunks, whatever the number of workers and their fate."""
    if cluster is not None:
        chunks = [(path.resolve(), places) for path, places in chunks]
    results = compute(
        sample_chunk, chunks, processes, lambda f: progress(0.1 + 0.9 * f, "averaging"), cluster=cluster,
        known=done.chunks, got=done.averaged,
    )  # fmt: skip
    return [sample for part in results for sample in part]
