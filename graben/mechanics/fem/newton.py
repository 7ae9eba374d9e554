"""One load step: Newton's method with the consistent (in general unsymmetric) tangent and a line search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from graben.mechanics.fem.body import Body, Response, State


@dataclass(frozen=True)
class NewtonOptions:
    """Parameters of the iteration.

    tolerance : residual of the free degrees of freedom over the largest of external load and reactions
    max_iterations : factorisations per step
    patience : give up after so many iterations without a better residual
    max_cuts : halvings of the Newton step in the line search (0: none)
    """

    tolerance: float = 1e-6
    max_iterations: int = 20
    patience: int = 6
    max_cuts: int = 4


@dataclass(frozen=True)
class Drag:
    """Viscous stabilisation: a Kelvin-Voigt stress `relaxation * C_elastic : strain rate` beside the law's own.

    Attributes
    ----------
    values : elastic stiffness in the value array of the body's pattern
    factor : relaxation time over the length of the step
    """

    matrix: sp.csc_matrix
    values: np.ndarray
    factor: float

    def force(self, increment: np.ndarray) -> np.ndarray:
        """Viscous nodal forces (2 n,), N/m, against a displacement increment."""
        return self.factor * (self.matrix @ increment)


@dataclass(frozen=True)
class Step:
    """Outcome of one step.

    Attributes
    ----------
    state : the new state; the old one when not converged
    force : (2 n,) internal forces of `state` (reactions at fixed degrees of freedom), N/m
    residuals : relative residual before each factorisation, and the last
    reason : "" when converged, else what went wrong
    drag : (2 n,) viscous forces, N/m, where the step was stabilised
    """

    state: State
    force: np.ndarray
    residuals: tuple[float, ...]
    converged: bool
    reason: str = ""
    drag: np.ndarray | None = None

    @property
    def iterations(self) -> int:
        """Number of factorisations."""
        return len(self.residuals) - 1


def equilibrate(
    body: Body,
    old: State,
    external: np.ndarray,
    prescribed: np.ndarray,
    options: NewtonOptions,
    guess: np.ndarray | None = None,
    drag: Drag | None = None,
) -> Step:
    """Find the state in equilibrium with `external` from the converged state `old`.

    Parameters
    ----------
    external : (2 n,) nodal loads, N/m
    prescribed : displacement of `body.fixed`, m
    guess : (2 n,) increment to start from (an extrapolation of the last one); None: zero
    drag : viscous stabilisation, where a scene asks for it
    """
    fixed_move = prescribed - old.displacement[body.fixed]
    increment = np.zeros(body.pattern.size)
    if guess is not None:
        increment = guess.copy()
        increment[body.fixed] = fixed_move
        response = body.respond(old, increment, True)
    if guess is None or response.failed_point >= 0:
        guess, increment = None, np.zeros(body.pattern.size)
        response = body.respond(old, increment, True)
    residuals: list[float] = []

    def stop(reason: str) -> Step:
        return Step(old, response.force, tuple(residuals), False, reason)

    best, since_best = np.inf, 0
    norm = np.inf
    while True:
        if response.failed_point >= 0:
            return stop(_law_failed(body, response.failed_point))
        unbalanced = _unbalanced(external, response, increment, drag)
        move = fixed_move - increment[body.fixed]
        norm = float(np.linalg.norm(unbalanced[body.free]))
        scale = max(float(np.linalg.norm(external)), float(np.linalg.norm(response.force[body.fixed])), 1e-300)
        residuals.append(norm / scale if norm > 0 else 0.0)
        moved = not np.any(move)
        # A load that is small beside the others is below the tolerance, but what it does is asked for: one round.
        begun = guess is not None or len(residuals) > 1 or norm == 0.0
        if moved and begun and residuals[-1] <= options.tolerance:
            new = State(old.displacement + increment, response.stress, response.internal)
            viscous = None if drag is None else drag.force(increment)
            return Step(new, response.force, tuple(residuals), True, drag=viscous)
        if residuals[-1] < 0.999 * best or not moved:
            best, since_best = residuals[-1], 0
        else:
            since_best += 1
        if len(residuals) > options.max_iterations:
            return stop(f"residual {residuals[-1]:.1e} after {options.max_iterations} iterations")
        if since_best >= options.patience:
            return stop(f"residual {residuals[-1]:.1e} did not fall in {options.patience} iterations")
        correction = _solve(body, response.values, unbalanced, move, drag)
        if correction is None:
            return stop("the stiffness is singular")
        increment, response = _line_search(
            body, old, increment, correction, external, drag, norm if moved else np.inf, options.max_cuts
        )


def _unbalanced(external: np.ndarray, response: Response, increment: np.ndarray, drag: Drag | None) -> np.ndarray:
    unbalanced = external - response.force
    return unbalanced if drag is None else unbalanced - drag.force(increment)


def _solve(
    body: Body, values: np.ndarray, unbalanced: np.ndarray, move: np.ndarray, drag: Drag | None
) -> np.ndarray | None:
    """Correction (2 n,) of the displacement increment; None when the matrix is singular."""
    if drag is not None:
        values = values + drag.factor * drag.values
    matrix = body.free_block.matrix(values)
    right = unbalanced[body.free]
    if np.any(move):
        right = right - body.coupling_block.matrix(values) @ move
    try:
        solved = factorise(matrix).solve(right)
    except RuntimeError:  # SuperLU: "Factor is exactly singular"
        return None
    if not np.all(np.isfinite(solved)):
        return None
    correction = np.zeros(body.pattern.size)
    correction[body.free], correction[body.fixed] = solved, move
    return correction


def factorise(matrix: object) -> spla.SuperLU:
    """Sparse LU of a structurally symmetric matrix; a diagonal pivot is kept unless it is far too small."""
    return spla.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3, options={"SymmetricMode": True})


def _line_search(
    body: Body,
    old: State,
    increment: np.ndarray,
    correction: np.ndarray,
    external: np.ndarray,
    drag: Drag | None,
    norm: float,
    max_cuts: int,
) -> tuple[np.ndarray, Response]:
    """Full step, or the best of its halvings when the full one does not lower the residual."""
    best: tuple[float, np.ndarray, Response] | None = None
    part = 1.0
    for _ in range(max_cuts + 1):
        trial = increment + part * correction
        response = body.respond(old, trial, True)
        if response.failed_point < 0:
            unbalanced = _unbalanced(external, response, trial, drag)
            trial_norm = float(np.linalg.norm(unbalanced[body.free]))
            if best is None or trial_norm < best[0]:
                best = (trial_norm, trial, response)
            if trial_norm <= norm:
                break
        part *= 0.5
    return (trial, response) if best is None else best[1:]


def _law_failed(body: Body, point: int) -> str:
    where = body.mesh.points[body.mesh.quads[point // 4]].mean(axis=0)
    return f"the constitutive law failed in element {point // 4} near ({where[0]:.4g}, {where[1]:.4g}) m"
