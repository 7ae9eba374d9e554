"""What a run leaves behind: states saved along the way, as plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.record.balance import balance
from graben.mechanics.blocks.record.rock_part import RockPart, on_sides

ENERGIES = (
    "kinetic",
    "strain",
    "joint",
    "friction",
    "plastic",
    "damping",
    "boundary",
    "external",
    "excavated",
    "error",
)


class History:
    """Collects states of a model; the first one is the reference for displacements.

    model : the model; balanced : keep what closes the balance of forces, too, see `balance`
    rock : the part that is kept of a model with platens; None: all of it. Each state then has the moments
    (1, platens) of the forces of platens on it along x about its middle [N], as `platen_spread`.
    """

    def __init__(self, model: BlockModel, balanced: bool = False) -> None:
        self.model = model
        self.optional = ("body_force", "overlap_moment") if balanced else ()
        self.start_time = model.time
        self.rock = RockPart(model.bodies) if model.bodies.platens else None
        self._vertices: Any = slice(None) if self.rock is None else self.rock.vertex
        self.reference = model.motion.x[self._vertices].copy()
        self.time: list[float] = []
        self.rows: dict[str, list[np.ndarray]] = {
            name: []
            for name in (
                "displacement",
                "velocity",
                *model.state_of_blocks(),
                "boundary_force",
                "wall_reaction",
                "energy",
                "contact",
                "contact_pair",
                "contact_state",
                "contact_set",
                "loose",
                "removed",
                *self.optional,
                *(() if self.rock is None else ("platen_spread",)),
            )
        }
        self.overlap: list[float] = []
        self.damping: list[float] = []

    def save(self) -> None:
        """Append the present state."""
        m, b = self.model, self.model.bodies
        self.time.append(m.time - self.start_time)
        rock, there = self.rock, self._vertices
        among = None if rock is None else rock.pairs(m)
        out, ints, _ = m.contacts(among=among)
        energy = m.energies()
        force = m.boundary_force()
        reaction = side_forces(force, b.vertex_side, b.outline)
        if rock is not None:
            by_platen = rock.platen_forces(m)
            reaction += on_sides(by_platen, b.outline)
            spread = (by_platen[:, there, 0] @ (m.motion.x[there, 0] - m.motion.x[there, 0].mean()))[None]
            self.rows["platen_spread"].append(spread)
            force += by_platen.sum(axis=0)
        rows = self.rows
        rows["displacement"].append(m.motion.x[there] - self.reference)
        rows["velocity"].append(m.motion.v[there].copy())
        state = m.state_of_blocks() if rock is None else rock.state_of_blocks(m)
        for name, value in state.items():
            rows[name].append(value)
        rows["boundary_force"].append(force[there])
        rows["wall_reaction"].append(reaction)
        rows["energy"].append(np.array([energy[k] for k in ENERGIES]))
        rows["contact"].append(out)
        pair = ints[:, 0]
        ends = np.column_stack([m.pairs.first[pair], m.pairs.second[pair]])
        rows["contact_pair"].append(m.skin.block[ends])
        rows["contact_state"].append(ints[:, 1])
        rows["contact_set"].append(m.pairs.joint[pair])
        loose = m.loose_blocks()
        rows["loose"].append(np.array([[np.count_nonzero(loose[: b.rock]), m.kinetic_energy(loose)]]))
        rows["removed"].append(m.removed[: b.rock].copy())
        if self.optional:
            stress = rows["zone_stress"][-1] if rock is None else m.zone_stress()
            closed = balance(m, stress, force, among)
            rows["body_force"].append(closed.body_force[there])
            rows["overlap_moment"].append(closed.overlap_moment[: b.rock])
        self.overlap.append(m.largest_overlap)
        self.damping.append(m.damping_coefficient)

    def cut(self, states: int) -> None:
        """Forget all but the first saved states."""
        every: list[list[Any]] = [self.time, self.overlap, self.damping, *self.rows.values()]
        for rows in every:
            del rows[states:]

    def stored(self, states: int) -> dict[str, np.ndarray]:
        """The first saved states as arrays that `bring_back` takes."""
        result = {"reference": self.reference, "start_time": np.array(self.start_time)}
        for name in ("time", "overlap", "damping"):
            result[name] = np.array(getattr(self, name)[:states])
        for name, rows in self.rows.items():
            sizes = [len(r) for r in rows[:states]]
            result[f"{name}.sizes"] = np.array(sizes, dtype=np.int64)
            result[f"{name}.rows"] = np.concatenate(rows[:states])
        return result

    def bring_back(self, stored: dict[str, np.ndarray]) -> None:
        """Take up the states of `stored`. Refused where they are not those of a model like this one."""
        like = History(self.model, bool(self.optional))
        like.save()
        states = np.size(stored.get("time", ()))
        for name, own in like.stored(1).items():
            found = stored.get(name)
            alike = found is not None and found.dtype == own.dtype and found.ndim == own.ndim
            if found is None or not alike or found.shape[1:] != own.shape[1:]:
                raise Refused(f"history.{name}: shape (..., {own.shape[1:]}) of {own.dtype}")
            if name in ("reference", "start_time") and found.shape != own.shape:
                raise Refused(f"history.{name}: shape {own.shape}")
            each = name in ("time", "overlap", "damping") or name.endswith(".sizes")
            if each and (found.shape != (states,) or states == 0):
                raise Refused(f"history.{name}: as many entries as saved states ({states})")
            if found.dtype.kind == "f" and not np.isfinite(found).all():
                raise Refused(f"history.{name}: finite numbers")
        for name, rows in like.rows.items():
            sizes, length = stored[f"{name}.sizes"], len(stored[f"{name}.rows"])
            varies = name.startswith("contact")
            if (sizes < 0).any() or sizes.sum() != length or not (varies or (sizes == len(rows[0])).all()):
                raise Refused(f"history.{name}.sizes: those of its rows")
        pair, blocks = stored["contact_pair.rows"], self.model.bodies.rock
        if pair.size and (pair.min() < 0 or pair.max() >= blocks):
            raise Refused(f"history.contact_pair: blocks 0 to {blocks - 1}")
        if (np.diff(stored["time"]) <= 0.0).any():
            raise Refused("history.time: rising values")
        self.reference = stored["reference"]
        self.start_time = float(stored["start_time"])
        for name in ("time", "overlap", "damping"):
            setattr(self, name, stored[name].tolist())
        for name in self.rows:
            ends = np.cumsum(stored[f"{name}.sizes"])[:-1]
            self.rows[name] = np.split(stored[f"{name}.rows"], ends)

    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of all saved states, named as in the artifact; contacts are ragged over time."""
        b, rows = self.model.bodies, self.rows
        contact = np.vstack(rows["contact"])
        zone_vertex, zone_block, corner = b.zone_vertex, b.zone_block, b.block_corner
        if self.rock is not None:
            number, zone = self.rock.number, self.rock.zone
            zone_vertex, zone_block = number[zone_vertex[zone]], zone_block[zone]
            corner = number[corner[: b.block_start[b.rock]]]
        zoned = "zone_stress" in rows
        result = {
            "time": np.array(self.time),
            "vertex_position": self.reference,
            "vertex_block": b.vertex_block[self._vertices],
            "zone_vertex": zone_vertex if zoned else zone_vertex[:0],
            "zone_block": zone_block if zoned else zone_block[:0],
            "block_area": b.block_area[: b.rock],
            "block_corner_count": np.diff(b.block_start[: b.rock + 1]),
            "block_corner": corner,
            "contact_count": np.array([len(c) for c in rows["contact"]]),
            "contact_block": np.vstack(rows["contact_pair"]),
            "contact_position": contact[:, 0:2],
            "contact_force": contact[:, 2:4],
            "contact_normal_stress": contact[:, 4],
            "contact_shear_stress": contact[:, 5],
            "contact_length": contact[:, 6],
            "contact_slip": contact[:, 7],
            "contact_opening": contact[:, 8],
            "contact_tangent": contact[:, 9:11],
            "contact_force_moment": contact[:, 11:13],
            "contact_state": np.concatenate(rows["contact_state"]),
            "loose_blocks": np.vstack(rows["loose"])[:, 0].astype(np.int32),
            "energy_kinetic_loose": np.vstack(rows["loose"])[:, 1],
        }
        # Platens have sets of their own, which no contact of the rock has.
        if len(self.model.joints) > 1 if self.rock is None else b.edge_set is not None:
            result["contact_set"] = np.concatenate(rows["contact_set"])
        whole = (*self.model.state_of_blocks(), "boundary_force", "wall_reaction", *self.optional)
        for name in ("displacement", "velocity", *whole):
            result[name] = np.array(rows[name])
        # Rigid blocks have no zones.
        result.setdefault("zone_stress", np.zeros((len(self.time), 0, 4)))
        energy = np.array(rows["energy"])
        for k, name in enumerate(ENERGIES):
            # Zones that cannot yield take nothing, nor does what is not dug.
            if (name != "plastic" or "zone_state" in rows) and (name != "excavated" or self.model.removed.any()):
                result["energy_" + name] = energy[:, k]
        if self.model.removed.any():
            result["block_removed"] = np.array(rows["removed"]).reshape(len(self.time), -1).astype(np.int8)
        return result


def side_forces(force: np.ndarray, vertex_side: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """External force (sides, 2) on each side of the domain [N/m] from forces on vertices (vertices, 2).

    What acts on a corner goes, component by component, to the side whose normal has the larger part in it.
    """
    along = np.roll(outline, -1, axis=0) - outline
    part = np.abs(along[:, ::-1]) / np.linalg.norm(along, axis=1)[:, None]
    # A side parallel to a component takes it only where no other side is there.
    weight = vertex_side[:, :, None] * (part[None] + 1e-9)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
    return np.einsum("vsd,vd->sd", weight, force)


def mean_stress(zone_stress: np.ndarray, area: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Area mean (..., 4) of zone stresses (..., zones, 4) over the zones inside [Pa]."""
    w = area[inside] / area[inside].sum()
    return np.einsum("z,...zc->...c", w, zone_stress[..., inside, :])
