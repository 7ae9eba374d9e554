"""homogenize for beds of spheres: Love-Weber stress and best-fit strain of the spheres inside a ball.

Beds stand on end in z and curves on end in yy, so the axes x, z, y of a bed become xx, yy, zz of its curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.averaging.spheres import best_fit_gradient, love_weber
from graben.schemas.artifact import read_arrays
from graben.stages.shared.record import Progress

_AXES = (0, 2, 1)
_FEWEST = 10  # spheres whose motion still makes a strain

Floats = np.ndarray


@dataclass(frozen=True)
class _State:
    """Contacts of one bed at one state, each side by itself: sphere, force on it (n, 3) N, arm (n, 3) m."""

    sphere: np.ndarray
    force: Floats
    arm: Floats


@dataclass(frozen=True)
class _Bed:
    """One bed from its first state with contacts on: position (state, n, 3) m, height m of the piston at the end."""

    path: Path
    name: str
    time: Floats
    radius: Floats
    position: Floats
    contacts: tuple[_State | None, ...]
    width: float
    height: float
    periodic: bool
    whole_forces: bool


def curves_of(
    inputs: Sequence[Path],
    *,
    radii: Sequence[float],
    centre: Sequence[float] | None,
    chosen_at: int,
    progress: Progress,
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Headline numbers, arrays and attributes of the curves of every bed over every ball; see `homogenize`.

    centre : x, y, z m; the middle of the bed at the end unless given
    chosen_at : step of the curve (0: settled) at which spheres are said to lie in the ball

    Raises
    ------
    BadInput : faults of the inputs, a ball beyond its bed, or one with fewer than ten spheres
    """
    beds: list[_Bed] = []
    faults: list[Fault] = []
    for path in inputs:
        try:
            beds += _beds(path)
        except BadInput as error:
            faults += error.faults
    for bed in beds:
        if not 0 <= chosen_at < bed.time.size:
            expected = f"a step of the curve, 0 to {bed.time.size - 1} (0 is the first state with contacts)"
            faults.append(Fault(str(bed.path), "chosen_at", str(chosen_at), expected, True))
        else:
            faults += [f for r in radii for f in _ball_faults(bed, r, _middle(bed, centre), chosen_at)]
    if faults:
        raise BadInput(faults)
    paths = []
    for k, bed in enumerate(beds):
        for radius in radii:
            progress(k / len(beds), f"averaging {bed.name} over {radius:g} m")
            paths.append((bed, radius, _average(bed, radius, _middle(bed, centre), chosen_at)))
    steps = max(bed.time.size for bed, *_ in paths)

    def padded(part: Floats) -> Floats:
        return np.concatenate([part, np.full((steps - part.shape[0], *part.shape[1:]), np.nan)])

    many = len(radii) > 1
    names = [f"{bed.name} r={radius:g} m" if many else bed.name for bed, radius, _ in paths]
    arrays: dict[str, Any] = {
        "path_name": np.array(names),
        "step_count": [bed.time.size for bed, *_ in paths],
        "time": np.array([padded(bed.time) for bed, *_ in paths]),
        # nobody applies a lateral stress to a bed: the one that it has at the end
        "confining_stress": [_lateral(average) for *_, average in paths],
        "area": [4.0 / 3.0 * np.pi * radius**3 for _, radius, _ in paths],
        "centre": [_middle(bed, centre) for bed, *_ in paths],
        "radius": [radius for _, radius, _ in paths],
        "block_count": [average.pop("block_count") for *_, average in paths],
    }
    for name in paths[0][2]:
        arrays[name] = np.array([padded(average[name]) for *_, average in paths])
    whole = all(bed.whole_forces for bed, *_ in paths)
    attributes = {
        "measure": "volume of the ball, m3",
        "axes": "xx, yy, zz are x, z (up) and y of the bed; xy is its xz",
        "outline_chosen_at": chosen_at,
        "forces": "all, at every state" if whole else "normal forces between spheres, at the last state only",
    }
    headline = {
        "paths": [_headline(n, p) for n, p in zip(names, paths)],
        "forces": attributes["forces"],
        "warnings": [],
    }
    return headline, arrays, attributes


def _headline(name: str, path: tuple[_Bed, float, dict[str, Any]]) -> dict[str, Any]:
    _, radius, average = path
    return {
        "name": name,
        "volume_m3": 4.0 / 3.0 * np.pi * radius**3,
        "vertical_stress_pa": float(average["stress"][-1, 1]),
        "lateral_stress_pa": _lateral(average),
        "vertical_strain": float(average["strain"][-1, 1]),
        "porosity": float(average["porosity"][-1]),
    }


def _lateral(average: dict[str, Any]) -> float:
    return float(average["stress"][-1, [0, 2]].mean())


def _average(bed: _Bed, radius: float, centre: Floats, chosen_at: int) -> dict[str, Any]:
    """Measures of the curve layout over the states of one bed; nan where no forces are known."""
    offset = bed.position[chosen_at] - centre
    _nearest(offset, bed)
    inside = np.einsum("ij,ij->i", offset, offset) <= radius**2
    moved = bed.position[:, inside] - bed.position[chosen_at, inside]
    _nearest(moved, bed)
    gradient = best_fit_gradient(offset[inside], moved)
    # The ball goes with its spheres; strain counts from the first state, as that of blocks does.
    volume = 4.0 / 3.0 * np.pi * radius**3 * np.linalg.det(np.eye(3) + gradient)
    since = (np.eye(3) + gradient) @ np.linalg.inv(np.eye(3) + gradient[0]) - np.eye(3)
    count = bed.time.size
    stress, fabric = np.full((count, 3, 3), np.nan), np.full((count, 3, 3), np.nan)
    coordination = np.full(count, np.nan)
    for k, state in enumerate(bed.contacts):
        if state is None:
            continue
        # Side by side: a contact across a periodic side is near its two spheres, in two places.
        own = np.stack([state.sphere, np.full(state.sphere.size, -1)], axis=1)
        stress[k] = love_weber(inside, bed.position[k], own, state.force, bed.position[k][state.sphere] + state.arm,
                               float(volume[k]))  # fmt: skip
        arms = state.arm[inside[state.sphere]]
        size = np.linalg.norm(arms, axis=1)
        coordination[k] = size.size / inside.sum()
        if size.size:
            normal = arms / size[:, None]
            fabric[k] = normal.T @ normal / size.size
    solid = 4.0 / 3.0 * np.pi * (bed.radius[inside] ** 3).sum() / volume
    skew = np.linalg.norm(stress - np.swapaxes(stress, 1, 2), axis=(1, 2))
    scale = np.linalg.norm(stress, axis=(1, 2))
    return {
        "block_count": int(inside.sum()),
        "stress": _components(stress),
        "strain": _components(since),
        "rotation": 0.5 * (since[:, 2, 0] - since[:, 0, 2]),
        "solid_fraction": solid,
        "porosity": 1.0 - solid,
        "moment_imbalance": np.divide(skew, scale, out=np.zeros(count) + 0.0 * scale, where=scale > 0.0),
        "fabric": _components(fabric),
        "coordination": coordination,
    }


def _components(tensor: Floats) -> Floats:
    """(..., 3, 3) of a bed -> (..., 4) xx, yy, zz, xy of its curve, symmetric part."""
    t = 0.5 * (tensor + np.swapaxes(tensor, -1, -2))[..., _AXES, :][..., _AXES]
    return np.stack([t[..., 0, 0], t[..., 1, 1], t[..., 2, 2], t[..., 0, 1]], axis=-1)


def _nearest(offset: Floats, bed: _Bed) -> None:
    if bed.periodic:
        offset[..., :2] -= bed.width * np.rint(offset[..., :2] / bed.width)


def _middle(bed: _Bed, centre: Sequence[float] | None) -> Floats:
    return np.array(centre) if centre is not None else np.array([bed.width / 2, bed.width / 2, bed.height / 2])


def _ball_faults(bed: _Bed, radius: float, centre: Floats, chosen_at: int) -> list[Fault]:
    sides = "it may be as wide as the bed" if bed.periodic else "it must lie between the sides"
    expected = f"a ball inside the bed, {bed.width:g} m wide and {bed.height:g} m high at the end; {sides}"
    found = f"ball of radius {radius:g} m at ({centre[0]:g}, {centre[1]:g}, {centre[2]:g}) m"
    low, high = centre - radius, centre + radius
    beyond = low[2] < 0.0 or high[2] > bed.height or radius <= 0.0 or 2.0 * radius > bed.width
    if not bed.periodic:
        beyond = beyond or bool((low[:2] < 0.0).any() or (high[:2] > bed.width).any())
    if beyond:
        return [Fault(str(bed.path), "radius", found, expected, True)]
    offset = bed.position[chosen_at] - centre
    _nearest(offset, bed)
    count = int((np.einsum("ij,ij->i", offset, offset) <= radius**2).sum())
    if count < _FEWEST:
        expected = f"a ball with {_FEWEST} spheres at least; it has {count}"
        return [Fault(str(bed.path), "radius", found, expected, True)]
    return []


def _beds(path: Path) -> list[_Bed]:
    """The beds of one artifact, from the end of the first phase (settled) on: what was poured has no strain."""
    data = read_arrays(path, "particles")
    of, names = data["particle_bed"].values, data["state_name"].values.tolist()
    whole = "state_contact_count" in data
    beds = []
    for b in range(data.sizes["bed"]):
        mine = np.flatnonzero(of == b)
        first = int(mine[0])
        states: list[_State | None]
        if whole:
            states = [_saved(data, b, k, first) for k in range(1, len(names))]
        else:
            states = [None] * (len(names) - 2) + [_last(data, mine)]
        pairs = data["contact_particle"].values
        pairs = pairs[of[pairs[:, 0]] == b]
        width = float(data["bed_width"].values[b])
        last = data["position"].values[-1]
        apart = np.abs(last[pairs[:, 0], :2] - last[pairs[:, 1], :2]) if len(pairs) else np.zeros((1, 2))
        periodic = bool(data["bed_periodic"].values[b]) if "bed_periodic" in data else bool(apart.max() > width / 2)
        beds.append(
            _Bed(
                path=path,
                name=path.stem if data.sizes["bed"] == 1 else f"{path.stem} bed {b + 1}",
                time=data["state_time"].values[b, 1:],
                radius=data["particle_radius"].values[mine],
                position=data["position"].values[1:, mine],
                contacts=tuple(states),
                width=width,
                height=float(data["bed_piston_height"].values[b]),
                periodic=periodic,
                whole_forces=whole,
            )
        )
    return beds


def _saved(data: Any, bed: int, state: int, first: int) -> _State:
    count = data["state_contact_count"].values
    start = int(count.ravel()[: bed * count.shape[1] + state].sum())
    part = slice(start, start + int(count[bed, state]))
    pair = data["state_contact_particle"].values[part]
    force, arm = data["state_contact_force"].values[part], data["state_contact_arm"].values[part]
    return _sides(pair, force, arm, data["particle_radius"].values, first)


def _last(data: Any, mine: np.ndarray) -> _State:
    """What artifacts without forces by state have: normal forces between spheres at the end."""
    pair = data["contact_particle"].values
    here = np.isin(pair[:, 0], mine)
    pair, normal, push = pair[here], data["contact_normal"].values[here], data["contact_force"].values[here]
    radius = data["particle_radius"].values
    arm = radius[pair[:, 0]][:, None] * normal
    return _sides(pair, -push[:, None] * normal, arm, radius, int(mine[0]))


def _sides(pair: np.ndarray, force: Floats, arm: Floats, radius: Floats, first: int) -> _State:
    """Both sides of every contact; the arm of the second sphere ends at the same point."""
    second = pair[:, 1] >= 0
    size = np.linalg.norm(arm[second], axis=1)
    other = radius[pair[second, 1]] - radius[pair[second, 0]] + size
    return _State(
        sphere=np.concatenate([pair[:, 0], pair[second, 1]]) - first,
        force=np.concatenate([force, -force[second]]),
        arm=np.concatenate([arm, -arm[second] * (other / size)[:, None]]),
    )
