"""One material point along a path of prescribed strains and stresses, in any mix.

Each component is under strain control or stress control. An increment prescribes the change of the controlled
quantity; the strains under stress control follow by Newton with the law's own tangent. An increment that does
not converge is halved, down to a smallest one; where that fails too the path has no solution there (a damaged
point cannot carry the prescribed stress): the driver stops, keeps what it reached and says how far it came.

Axes under one and the same stress may share one strain, see `unknowns.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.law import OK
from graben.mechanics.materials.laws import find, update
from graben.mechanics.materials.unknowns import equations, level, number_unknowns, solve_small

SMALLEST = 2.0**-12  # of an increment; below it the path counts as without solution
_NEWTON = 12
_BRACKETED = 40


@kernel(error_model="numpy")
def increment(
    law_id, par, length, tolerance, share, m, change, sig, state, eps, tangent, old_sig, old_state, deps, bend, a, b,
    x, miss,
):  # fmt: skip
    """One increment: change[i] is the strain change, or the new stress of a component under stress control.

    share, m: the unknown strains, see `number_unknowns`. tangent holds the one of the last increment (the
    predictor) and gets the new one. bend (n + 1,) holds by how much the last predictor missed the unknown strains,
    and the size of that increment: a miss grows as the square of the size, which makes the next predictor one order
    better. sig, state, eps change in place on success; on failure they are as before and False is returned.
    """
    n = sig.shape[0]
    scale = 0.0
    for i in range(n):
        old_sig[i] = sig[i]
        scale = max(scale, abs(sig[i]))
        deps[i] = change[i]
        if share[i] >= 0:
            deps[i] = 0.0
            scale = max(scale, abs(change[i]))
    for i in range(state.shape[0]):
        old_state[i] = state[i]
    # predictor: what the last tangent makes of the prescribed changes
    if m > 0:
        for i in range(n):
            miss[i] = change[i] - sig[i]
            for j in range(n):
                miss[i] -= tangent[i, j] * deps[j]
        equations(share, m, miss, tangent, a, b)
        solved = solve_small(a, b, m)
        for i in range(m):
            x[i] = b[i] if solved else 0.0
        stride = 0.0
        for i in range(n):
            stride += abs(x[share[i]] if share[i] >= 0 else deps[i])
        ratio = stride / bend[n] if bend[n] > 0.0 else 0.0
        grown = ratio * ratio if ratio < 2.0 else 0.0
        bend[n] = stride
        for i in range(m):
            foreseen = grown * bend[i]
            bend[i] = x[i]
            x[i] += foreseen
    # One unknown is one equation: its root is kept between bounds, so that a kink in the law cannot make Newton go
    # back and forth. A free side is at one: it is the largest principal stress of a pressed plane, 0.
    below, above = -np.inf, np.inf
    for iteration in range(_NEWTON if m != 1 else _BRACKETED):
        for i in range(n):
            if share[i] >= 0:
                deps[i] = x[share[i]]
        code = update(law_id, deps, sig, state, par, length, tangent)
        if code != OK:
            break
        size = scale
        for i in range(n):
            size = max(size, abs(sig[i]))
            miss[i] = change[i] - sig[i]
        equations(share, m, miss, tangent, a, b)
        worst = 0.0
        for i in range(m):
            worst = max(worst, abs(b[i])) if b[i] == b[i] else np.inf
        if worst <= tolerance * size:
            level(share, m, sig)
            for i in range(n):
                eps[i] += deps[i]
            for i in range(m):
                bend[i] = x[i] - bend[i]
            return True
        lacking = b[0]
        for i in range(n):
            sig[i] = old_sig[i]
        for i in range(state.shape[0]):
            state[i] = old_state[i]
        solved = solve_small(a, b, m)
        if m == 1:
            now = x[0]
            if lacking > 0.0:
                below = max(below, now)
            else:
                above = min(above, now)
            if above - below < 1e300 and below < above:
                inside = solved and below < now + b[0] < above
                if not inside or (iteration > 6 and iteration % 2 == 0):
                    b[0] = 0.5 * (below + above) - now
                    solved = True
        if not solved:
            break
        for i in range(m):
            x[i] += b[i]
    for i in range(n):
        sig[i] = old_sig[i]
    for i in range(state.shape[0]):
        state[i] = old_state[i]
    return False


@kernel(error_model="numpy")
def drive(
    law_id, par, length, tolerance, parts, control, targets, sig, state, eps, stress_out, strain_out, state_out
):
    """Follow one path from its present state; returns how many rows of targets were reached (a fraction
    counts).

    control (n,) is 1 under stress control, else 0. targets (rows, n): row 0 is where the path stands, each
    later row the strain (engineering shear) or stress to reach. parts: increments per row. sig, eps (n,) and
    state (m,) are the present values and change in place. Outputs (rows, ...) get row 0 as it stands; rows
    beyond the end hold the last state. state_out may have 0 rows.
    """
    rows, n = targets.shape
    share = np.empty(n, np.int64)
    m = number_unknowns(law_id, control, targets, sig, tolerance, share)
    work = np.empty((6, n))
    change, deps, b, old_sig, x, miss = work[0], work[1], work[2], work[3], work[4], work[5]
    old_state = np.empty(state.shape[0])
    bend = np.zeros(n + 1)
    a = np.empty((n, n))
    tangent = np.empty((n, n))
    # the elastic tangent, or the reloading one, as the first predictor
    change[:] = 0.0
    for i in range(n):
        old_sig[i] = sig[i]
    for i in range(state.shape[0]):
        old_state[i] = state[i]
    alive = update(law_id, change, sig, state, par, length, tangent) == OK
    for i in range(n):
        sig[i] = old_sig[i]
    for i in range(state.shape[0]):
        state[i] = old_state[i]
    reached = 0.0
    for row in range(rows):
        if row > 0 and alive:
            done = 0.0
            size = 1.0 / parts
            while done < 1.0:
                if done + size > 1.0 - 1e-12:
                    size = 1.0 - done
                for i in range(n):
                    now = targets[row - 1, i]
                    full = targets[row, i] - now
                    change[i] = now + (done + size) * full if control[i] == 1 else size * full
                if increment(
                    law_id, par, length, tolerance, share, m, change, sig, state, eps, tangent, old_sig, old_state,
                    deps, bend, a, b, x, miss,
                ):  # fmt: skip
                    done += size
                    size = min(2.0 * size, 1.0 / parts)
                else:
                    # the tangent of a failed trial is no predictor: take the one at rest
                    bend[:] = 0.0
                    for i in range(n):
                        change[i] = 0.0
                        old_sig[i] = sig[i]
                    for i in range(state.shape[0]):
                        old_state[i] = state[i]
                    update(law_id, change, sig, state, par, length, tangent)
                    for i in range(n):
                        sig[i] = old_sig[i]
                    for i in range(state.shape[0]):
                        state[i] = old_state[i]
                    size *= 0.5
                    if size < SMALLEST / parts:
                        alive = False
                        break
            reached = row - 1 + done if done < 1.0 else float(row)
        for i in range(n):
            stress_out[row, i] = sig[i]
            strain_out[row, i] = eps[i]
        if state_out.shape[0] > 0:
            for i in range(state.shape[0]):
                state_out[row, i] = state[i]
    return reached


@kernel(error_model="numpy")
def drive_paths(
    law_id, par, length, tolerance, parts, control, targets, rows, sig, state, eps, stress, strain, states
):
    """`drive` for several paths: targets (paths, steps, n) of which rows[p] count; returns reached
    (paths,)."""
    reached = np.empty(targets.shape[0])
    for p in range(targets.shape[0]):
        r = rows[p]
        reached[p] = drive(
            law_id, par, length, tolerance, parts, control[p], targets[p, :r], sig[p], state[p], eps[p],
            stress[p, :r], strain[p, :r], states[p, :r],
        )  # fmt: skip
        for row in range(r, targets.shape[1]):
            stress[p, row] = sig[p]
            strain[p, row] = eps[p]
            states[p, row] = state[p]
    return reached


@dataclass(frozen=True)
class Response:
    """What a point did along its paths.

    stress (paths, steps, n) Pa, strain (paths, steps, n) with tensor shear, state (paths, steps, m); reached
    (paths,): steps reached, the last one as a fraction; complete (paths,) whether the whole path has a
    solution. Steps beyond `reached` repeat the last state.
    """

    stress: NDArray[np.float64]
    strain: NDArray[np.float64]
    state: NDArray[np.float64]
    reached: NDArray[np.float64]
    complete: NDArray[np.bool_]


def _with_free_zz(word: str) -> str:
    """A control word over (xx, yy, xy) -> over (xx, yy, zz, xy)."""
    return word[:2] + "s" + word[2:]


def follow(
    law: str,
    par: NDArray[np.float64],
    control: str | list[str],
    targets: NDArray[np.float64],
    *,
    length: float = 1.0,
    stress: NDArray[np.float64] | None = None,
    parts: int = 1,
    tolerance: float = 1e-9,
    rows: NDArray[np.int64] | None = None,
) -> Response:
    """Drive a point along paths.

    Parameters
    ----------
    law, par : name of the law and its packed parameters (`laws.pack`)
    control : one word over components, "e" strain and "s" stress, such as "seee"; or one word per path
    targets : (paths, steps, n) or (steps, n); strain (tensor shear) or stress in Pa to reach at each step;
        step 0 is where the path starts and nothing is done to get there. n = 6: space (xx, yy, zz, xy, yz, zx);
        n = 4: plane or axisymmetric (xx, yy, zz, xy); n = 3: plane stress (xx, yy, xy), the same as n = 4 with zz
        under stress control at 0, and answered with four components
    length : characteristic length in m, for laws with damage
    stress : (paths, n) or (n,) stress at the start, default 0
    parts : increments per step
    tolerance : on the stress under stress control, relative to the largest stress
    rows : (paths,) how many steps of each path count, default all

    Refused for shapes that do not fit, unknown control letters or values that are not finite.
    """
    record = find(law)
    goal = np.array(targets, dtype=np.float64)
    if goal.ndim == 2:
        goal = goal[None]
    if goal.ndim == 3 and goal.shape[2] == 3:
        goal = np.insert(goal, 2, 0.0, axis=2)
        control = _with_free_zz(control) if isinstance(control, str) else [_with_free_zz(w) for w in control]
        if stress is not None and np.shape(stress)[-1:] == (3,):
            stress = np.insert(np.asarray(stress, dtype=np.float64), 2, 0.0, axis=-1)
    if goal.ndim != 3 or goal.shape[2] not in (4, 6) or goal.shape[1] < 1:
        raise Refused(f"targets: expected (paths, steps, 3, 4 or 6), found {np.shape(targets)}")
    paths, steps, n = goal.shape
    count = np.full(paths, steps, np.int64) if rows is None else np.ascontiguousarray(rows, dtype=np.int64)
    if count.shape != (paths,) or count.min() < 1 or count.max() > steps:
        raise Refused(f"rows: expected ({paths},) numbers from 1 to {steps}, found {rows!r}")
    for p in range(paths):
        if not np.isfinite(goal[p, : count[p]]).all():
            raise Refused(f"targets of path {p}: expected finite numbers")
    words = [control] * paths if isinstance(control, str) else list(control)
    if len(words) != paths or any(len(w) != n or set(w) - {"e", "s"} for w in words):
        raise Refused(f"control: expected {n} letters e or s for each of {paths} paths, found {control!r}")
    flags = np.array([[1 if letter == "s" else 0 for letter in w] for w in words], dtype=np.int64)
    for p in range(paths):  # engineering shear inside
        goal[p, :, 3:] *= np.where(flags[p, 3:] == 1, 1.0, 2.0)
    begin = np.zeros(n) if stress is None else np.asarray(stress, dtype=np.float64)
    if begin.shape not in ((n,), (paths, n)) or not np.isfinite(begin).all():
        raise Refused(f"stress at the start: expected ({n},) or ({paths}, {n}) finite numbers, found {begin.shape}")
    sig = np.array(np.broadcast_to(begin, (paths, n)))
    if parts < 1:
        raise Refused(f"parts: expected at least 1, found {parts}")
    eps = np.where(flags == 1, 0.0, goal[:, 0])
    start = record.initial_state(par)
    state = np.repeat(start[None], paths, axis=0)
    out_stress, out_strain = np.empty((paths, steps, n)), np.empty((paths, steps, n))
    out_state = np.empty((paths, steps, start.size))
    reached = drive_paths(
        record.id, par, float(length), float(tolerance), int(parts), flags, goal, count, sig, state, eps,
        out_stress, out_strain, out_state,
    )  # fmt: skip
    out_strain[:, :, 3:] *= 0.5
    return Response(out_stress, out_strain, out_state, reached, reached >= count - 1)
