"""How much a compression confines the rock: lateral stress inside over applied, and what friction at ends adds."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.record.history import History, mean_stress
from graben.mechanics.blocks.shape.platens import BOTTOM, LEFT, RIGHT, TOP
from graben.stages.blocks.report import ratio

# Radius of the circle in the middle over the smaller side: it keeps clear of the ends.
_INSIDE = 0.4


def lateral_inside(history: History) -> np.ndarray:
    """Mean lateral stress (states,) of the zones in the circle, of all where none lies in it [Pa]."""
    b, rows, area = history.model.bodies, history.rows, history.model.zone_area
    zone_vertex, zone_block = b.zone_vertex, b.zone_block
    if history.rock is not None:
        area, zone_block = area[history.rock.zone], zone_block[history.rock.zone]
        zone_vertex = history.rock.number[zone_vertex[history.rock.zone]]
    low, size = b.outline.min(axis=0), np.ptp(b.outline, axis=0)
    middle = history.reference[zone_vertex].mean(axis=1)
    inside = np.hypot(*(middle - (low + size / 2.0)).T) < _INSIDE * size.min()
    if "block_stress" in rows:
        stress = np.array(rows["block_stress"])[:, zone_block]
    else:
        stress = np.array(rows["zone_stress"])
    return mean_stress(stress, area, inside if inside.any() else area > 0.0)[:, 0]


def friction_share(history: History, confining: np.ndarray) -> np.ndarray:
    """Lateral confinement (states,) by the ends over that by the pressure on the sides; 0 where ends are smooth.

    Both are moments: the sum of force along x times x is the area times the mean lateral stress of the whole rock.
    confining : (states,) stress applied to the sides, compression negative [Pa]
    """
    b, rows = history.model.bodies, history.rows
    x = history.reference[None, :, 0] + np.array(rows["displacement"])[:, :, 0]
    x = x - x.mean(axis=1)[:, None]
    # A pressure of 1 Pa on the sides, as forces along x on the vertices.
    unit = -history.model.skeleton.rising[:, 0]
    if history.rock is not None:
        unit = unit[history.rock.vertex]
        spread = np.array(rows["platen_spread"])[:, 0]
        ends = spread[:, BOTTOM] + spread[:, TOP]
        by_pressure = confining * (x @ unit) if b.platens <= LEFT else spread[:, LEFT] + spread[:, RIGHT]
        return ratio(ends, by_pressure)
    by_pressure = confining * (x @ unit)
    everything = (np.array(rows["boundary_force"])[:, :, 0] * x).sum(axis=1)
    return ratio(everything - by_pressure, by_pressure)
