"""A run of blocks, as averaging wants it: read from an artifact of kind "blocks"."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.averaging.history import Contacts, History
from graben.mechanics.averaging.outline import domain_outline
from graben.mechanics.averaging.rev import Circle, Rev
from graben.schemas.artifact import read_arrays


@dataclass(frozen=True)
class Run:
    """One artifact of blocks: its file, its arrays, its lateral stress (Pa, compression negative), and its seed
    (-1: not known); flags of blocks that are taken out sooner or later (none: empty); lateral stress at each state
    where it changes (else empty)."""

    path: Path
    history: History
    confining_stress: float
    seed: int = -1
    removed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    confining_then: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def over_applied(self, stress: np.ndarray) -> np.ndarray:
        """Lateral part of stresses (states, 4) over the stress applied to the sides; nan where none is."""
        applied = self.confining_then if len(self.confining_then) else np.full(len(stress), self.confining_stress)
        return np.divide(stress[:, 0], applied, out=np.full(len(stress), np.nan), where=applied != 0.0)

    @property
    def middle(self) -> tuple[float, float]:
        """Centre of the model's bounding box, m."""
        low, high = self.history.domain.min(axis=0), self.history.domain.max(axis=0)
        return float(low[0] + high[0]) / 2.0, float(low[1] + high[1]) / 2.0

    def refuse_outside(self, rev: Rev, key: str, state: int = 0, *, argument: bool = False) -> list[Fault]:
        """A fault where a region reaches beyond the model at a saved state by over a thousandth of its radius.

        key : of the scene, or an argument of the call, that gave the region
        """
        h = self.history
        domain = domain_outline(h.network, h.current[state]) if state else h.domain
        beyond = rev.outside_by(domain)
        if beyond <= 1e-3 * rev.radius:
            return self._refuse_removed(rev, key, argument)
        shape = "circle" if isinstance(rev, Circle) else "polygon"
        x, y = rev.centre
        low, high = domain.min(axis=0), domain.max(axis=0)
        value = f"{shape} of radius {rev.radius:g} m at ({x:g}, {y:g}) m"
        expected = (
            f"a REV inside the model, which spans {low[0]:g} to {high[0]:g} m by {low[1]:g} to {high[1]:g} m; "
            f"it reaches {beyond:g} m beyond"
        )
        return [Fault(str(self.path), key, value, expected, argument)]

    def _refuse_removed(self, rev: Rev, key: str, argument: bool) -> list[Fault]:
        """A fault where a region meets blocks that are taken out: their strain is not known."""
        network = self.history.network
        meets = rev.crossed(network, network.position) | rev.contains(network.interior)
        if not self.removed.any() or not (meets & self.removed).any():
            return []
        x, y = rev.centre
        value = f"radius {rev.radius:g} m at ({x:g}, {y:g}) m"
        return [Fault(str(self.path), key, value, "a REV clear of blocks that are taken out", argument)]


def read_run(path: Path) -> Run:
    """Read and check one artifact.

    Raises
    ------
    BadInput : not a whole artifact of blocks, or its indices do not fit together
    """
    data = read_arrays(path, "blocks")
    faults = _shape_faults(path, data)
    if faults:
        raise BadInput(faults)
    count = np.asarray(data["contact_count"].values, dtype=np.int64)
    history = History(
        time=_floats(data, "time"),
        position=_floats(data, "vertex_position"),
        displacement=_floats(data, "displacement"),
        vertex_block=_ints(data, "vertex_block"),
        zone_vertex=_ints(data, "zone_vertex"),
        zone_block=_ints(data, "zone_block"),
        corner_count=_ints(data, "block_corner_count"),
        corner=_ints(data, "block_corner"),
        zone_stress=_floats(data, "zone_stress"),
        contacts=Contacts(
            state=np.repeat(np.arange(count.size), count),
            block=_ints(data, "contact_block"),
            position=_floats(data, "contact_position"),
            force=_floats(data, "contact_force"),
            length=_floats(data, "contact_length"),
            slip=_floats(data, "contact_slip"),
            flag=_ints(data, "contact_state"),
            tangent=_floats(data, "contact_tangent"),
            moment=_floats(data, "contact_force_moment") if "contact_force_moment" in data else None,
        ),
        vertex_force=_floats(data, "boundary_force"),
        body_force=_floats(data, "body_force") if "body_force" in data else None,
        overlap_moment=_floats(data, "overlap_moment") if "overlap_moment" in data else None,
    )
    try:
        _ = history.network
    except Refused as error:
        raise BadInput(Fault(str(path), "zone_vertex", "", f"blocks with closed outlines ({error})")) from error
    removed = np.asarray(
        data["block_removed"].values > 0 if "block_removed" in data else np.zeros((0, 0), dtype=bool)
    )
    return Run(
        path,
        history,
        float(data["confining_stress"]),
        int(data.attrs.get("seed", -1)),
        np.asarray(removed.any(axis=0)),
        _floats(data, "confining_stress_then") if "confining_stress_then" in data else np.zeros(0),
    )


def _floats(data: Any, name: str) -> np.ndarray:
    return np.ascontiguousarray(data[name].values, dtype=np.float64)


def _ints(data: Any, name: str) -> np.ndarray:
    return np.ascontiguousarray(data[name].values, dtype=np.int64)


def _shape_faults(path: Path, data: Any) -> list[Fault]:
    """Dims without an entry, times that do not rise."""
    faults = []
    for name in ("time", "vertex", "block"):
        if data.sizes.get(name, 0) == 0:
            faults.append(Fault(str(path), f"dim {name}", "0", "at least one"))
    time = data["time"].values
    if time.size > 1 and not (np.diff(time) > 0).all():
        faults.append(Fault(str(path), "time", "", "rising values"))
    return faults
