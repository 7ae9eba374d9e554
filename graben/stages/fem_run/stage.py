"""fem-run: gravity, then rising pressures on a plane-strain body, up to the load that it cannot carry."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, NumericsFailed, Refused
from graben.mechanics.fem.body import Body, Material, State, make_body
from graben.mechanics.fem.march import March, StepOptions, march
from graben.mechanics.fem.newton import NewtonOptions, Step
from graben.mechanics.fem.quads import body_force, edge_traction
from graben.mechanics.fem.stability import softest_stiffness
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.schemas.outputs import LAST_GOOD, SERIES, Outputs, beside, files_of
from graben.schemas.scene import Given, Overrides, load_scene
from graben.schemas.scenes.fem import FemScene
from graben.stages.fem_run.mesh import mesh_of
from graben.stages.fem_run.output import History, arrays_of, write_run
from graben.stages.fem_run.sizes import sizes_of
from graben.stages.shared.estimate import Estimate, refuse_too_large
from graben.stages.shared.last_good import keep_by, keeps_last_good
from graben.stages.shared.material import pack_material
from graben.stages.shared.measures import Measure, warnings_of
from graben.stages.shared.record import Progress, Record, silent

# Gravity is a load history of its own, of unit length, in steps that are halved as the pressures' are.
_GRAVITY_STEPS = StepOptions(first=0.1, largest=0.5, smallest=1e-3)
# Viscous stress below this multiple of the rise of the pressure in the relaxation time is that of elastic strain.
_VISCOUS = 5.0


@dataclass(frozen=True)
class Problem:
    """A scene in arrays.

    Attributes
    ----------
    steady, rising : (2 n,) nodal loads: applied with gravity, and per second after it
    unit_pressure : (2 n,) nodal loads of 1 Pa on the first rising load's segment; loaded_length its length, m
    notes : what of a mesh file was left out or mended
    """

    body: Body
    support_nodes: list[np.ndarray]
    steady: np.ndarray
    rising: np.ndarray
    unit_pressure: np.ndarray
    loaded_length: float
    rate: float
    offset: float
    notes: tuple[str, ...] = ()

    def external(self, time: float) -> np.ndarray:
        """Nodal loads (2 n,), N/m, at a load time after gravity, s."""
        return self.steady + time * self.rising


@keeps_last_good("no step had been accepted yet")
def run(
    given: Given,
    output: Path,
    *,
    material: Path | None = None,
    overrides: Overrides = (),
    overwrite: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run a fem scene and write its artifact and VTU files.

    Parameters
    ----------
    material : a file with law and parameters that replaces the scene's

    Returns
    -------
    headline numbers: failure_load_pa (None when the end was reached without failure), failed, largest_load_pa,
    settlement_m of the loaded segment, compliance_ratio and stiffness_ratio (evidence of collapse), elements,
    steps, energy_error, stabilisation_share (work of the viscous forces over that of the loads), and mesh_notes where
    something of a mesh file was left out or mended

    Raises
    ------
    BadInput : the scene, the mesh or the material has faults, or the output exists
    NumericsFailed : no equilibrium under gravity, or before the end where the goal is the end
    """
    scene: FemScene = load_scene(given, "fem", overrides)
    last_good = beside(output, LAST_GOOD + ".nc")
    kept = (LAST_GOOD + ".nc", *(LAST_GOOD + end for end in SERIES))
    Outputs(output, SERIES, kept=kept).claim([*files_of(scene), material], overwrite=overwrite)
    progress(0.0, "meshing")
    problem, inputs, _ = prepare(scene, material)
    record = Record.begin(scene, inputs)
    analysis = Analysis(scene, problem)

    def write(path: Path, partial: str = "") -> Path:
        record.cost |= analysis.cost
        record.warnings = analysis.headline["warnings"]
        write_run(path, record, problem.body.mesh, analysis.arrays(), analysis.headline, partial)
        return path

    keep_by(lambda why: write(last_good, why) if analysis.begun else None)
    headline = analysis.solve(progress)
    progress(0.98, "writing")
    write(output)
    progress(1.0, "done")
    return headline


class Analysis:
    """A problem on its way to the end of its loads, of which nothing is written.

    Attributes
    ----------
    headline : numbers, as `run` returns them; cost : figures for the record
    begun : whether there is a state to keep
    """

    def __init__(self, scene: FemScene, problem: Problem) -> None:
        self.scene, self.problem, self.begun = scene, problem, False
        notes = {"mesh_notes": list(problem.notes)} if problem.notes else {}
        self.cost: dict[str, Any] = dict(notes)
        self.headline: dict[str, Any] = {
            "failed": True, "failure_load_pa": None, "compliance_ratio": 1.0, "stiffness_ratio": 1.0, "warnings": [],
        }  # fmt: skip
        self._notes = notes

    def solve(self, progress: Progress = silent) -> dict[str, Any]:
        """Gravity, then the rising loads; returns the headline numbers.

        Raises
        ------
        NumericsFailed : no equilibrium under gravity, or before the end where the goal is the end
        """
        scene, problem, body = self.scene, self.problem, self.problem.body
        progress(0.01, f"{len(body.mesh.quads)} elements; gravity")
        newton = NewtonOptions(scene.stepping.tolerance, scene.stepping.max_iterations)
        settled = march(body, body.untouched(), lambda t: t * problem.steady, 0.0, 1.0, _GRAVITY_STEPS, newton)
        settling = problem.unit_pressure / problem.loaded_length
        self.settled = settled
        self.history = History(scene, settled, settling, problem.loaded_length, problem.offset)
        self.begun = True
        if not settled.complete:
            raise NumericsFailed(
                f"no equilibrium beyond {100 * settled.time:.3g} % of gravity ({settled.reason})",
                advice="the body does not stand under its own weight: check supports, strength and density",
            )
        loaded = _load_up(scene, problem, settled, newton, self.history, progress)
        headline = _headline(scene, problem, settled, loaded, self.history) | self._notes
        self.cost |= _cost(body, settled, loaded, headline)
        headline["warnings"] = warnings_of(_measures(headline))
        self.headline = headline
        if not loaded.complete and scene.stepping.goal == "end":
            raise NumericsFailed(
                f"no equilibrium beyond load time {loaded.time:.6g} s of {scene.stepping.end:g} s ({loaded.reason})",
                step=len(loaded.iterations),
                advice='set stepping.goal = "failure" if this load is what you want, or lower stepping.smallest',
            )
        return headline

    def arrays(self) -> dict[str, Any]:
        """Arrays of the layout "fem"."""
        problem, settled = self.problem, self.settled
        carried = problem if settled.complete else replace(problem, steady=settled.time * problem.steady)
        return arrays_of(self.scene, problem.body, settled, self.history, problem.support_nodes, carried.external)


def prepare(scene: FemScene, material: Path | None = None) -> tuple[Problem, list[Path], list[Estimate]]:
    """Mesh, law and loads of a scene, the files that they came from, and sizes, after every check that the run makes.

    Raises
    ------
    BadInput : the scene, the mesh or the material has faults, or the run would be too large
    """
    file = scene.source.path
    sizes = sizes_of(scene)
    refuse_too_large(file, sizes)
    source = material if material is not None else scene.material.file
    law, parameters, _ = pack_material(material if material is not None else scene.material, file)
    inputs = [] if source is None else [source]
    if scene.mesh.method == "file" and scene.mesh.file is not None:
        inputs.append(scene.mesh.file)
    mesh, notes = mesh_of(scene)
    if scene.mesh.method == "file":
        sizes = sizes_of(scene, len(mesh.quads))
        refuse_too_large(file, sizes)
    problem = problem_of(scene, mesh, Material(law.id, parameters, law.initial_state(parameters)))
    return replace(problem, notes=tuple(notes)), inputs, sizes


def problem_of(scene: FemScene, mesh: QuadMesh, law: Material) -> Problem:
    """Supports and loads of a scene on a mesh, whichever the scene asks for; BadInput names every fault."""
    file = str(scene.source.path)
    faults: list[Fault] = []
    fixed = np.zeros((len(mesh.points), 2), dtype=bool)
    outline = np.unique(mesh.boundary_edges())
    support_nodes = []
    for k, support in enumerate(scene.supports):
        start, end = np.array(support.start), np.array(support.end)
        nodes = mesh.nodes_on_segment(start, end)
        nodes = nodes[np.isin(nodes, outline)]
        if len(nodes) < (2 if np.any(start != end) else 1):
            expected = "a segment that holds nodes of the outline, two at least where it has a length"
            faults.append(Fault(file, f"supports.{k}", support.name, expected + _sizes(scene, mesh)))
        fixed[nodes, 0] |= support.fix in ("x", "both")
        fixed[nodes, 1] |= support.fix in ("y", "both")
        support_nodes.append(nodes)
    if not faults and not _holds_still(mesh, fixed):
        faults.append(Fault(file, "supports", "", "supports that leave the body no rigid motion"))
    weight = np.array([scene.gravity.horizontal, scene.gravity.vertical])
    steady = body_force(mesh, scene.gravity.density, weight)
    rising = np.zeros_like(steady)
    unit, length, rate, offset = np.zeros_like(steady), 1.0, 0.0, 0.0
    for k, load in enumerate(scene.loads):
        try:
            force, covered = edge_traction(mesh, np.array(load.start), np.array(load.end))
        except Refused as error:
            expected = f"a segment of the outline ({error})" + _sizes(scene, mesh)
            faults.append(Fault(file, f"loads.{k}", load.name, expected))
            continue
        steady += load.pressure * force
        rising += load.rate * force
        if load.rate != 0 and rate == 0:
            unit, length, rate, offset = force, covered, load.rate, load.pressure
    if faults:
        raise BadInput(faults)
    try:
        body = make_body(mesh, [law], fixed.ravel(), least_length=scene.softening_width)
    except Refused as error:
        raise BadInput(Fault(file, "supports", "", f"supports that leave something free ({error})")) from None
    return Problem(body, support_nodes, steady, rising, unit, length, rate, offset)


def _sizes(scene: FemScene, mesh: QuadMesh) -> str:
    """A hint for a mesh file whose size is far from that of the scene's segments: units slip."""
    segments = [(s.start, s.end) for s in scene.supports] + [(load.start, load.end) for load in scene.loads]
    ends = np.array(segments, dtype=float).reshape(-1, 2)
    spans = np.ptp(mesh.points, axis=0), np.ptp(ends, axis=0)
    ratio = spans[0].max() / spans[1].max() if spans[1].max() > 0 else 1.0
    if scene.mesh.method != "file" or 0.1 < ratio < 10.0:
        return ""
    mine, others = (f"{a[0]:g} m x {a[1]:g} m" for a in spans)
    return f"; the mesh spans {mine}, loads and supports {others}: coordinates of the file are taken as metres"


def _holds_still(mesh: QuadMesh, fixed: np.ndarray) -> bool:
    """Whether the supports stop both translations and the rotation."""
    x, y = (mesh.points - mesh.points.mean(axis=0)).T
    rigid = np.zeros((len(x), 2, 3))
    rigid[:, 0, 0], rigid[:, 1, 1] = 1.0, 1.0
    rigid[:, 0, 2], rigid[:, 1, 2] = -y / mesh.diameter(), x / mesh.diameter()
    return int(np.linalg.matrix_rank(rigid[fixed], tol=1e-6)) == 3 if fixed.any() else False


def _load_up(
    scene: FemScene,
    problem: Problem,
    settled: March,
    newton: NewtonOptions,
    history: History,
    progress: Progress,
) -> March:
    options = scene.stepping

    def overloaded(time: float, step: Step) -> str | None:
        pressure = problem.offset + problem.rate * time
        viscous = history.viscous(step)
        # The elastic response to a rising pressure has a viscous part of its own, which is no overload.
        if viscous > options.overload * pressure and viscous > _VISCOUS * problem.rate * options.relaxation:
            return f"viscous stress carries {viscous / 1e6:.3g} MPa of the pressure"
        return None

    def accepted(time: float, state: State, force: np.ndarray, step: Step) -> None:
        pressure = problem.offset + problem.rate * time
        history.add(time, state, force, step, pressure)
        progress(
            0.02 + 0.95 * time / options.end,
            f"{time:.4g} s, {pressure / 1e6:.4g} MPa, {step.iterations} iterations",
        )

    return march(
        problem.body,
        settled.state,
        problem.external,
        0.0,
        options.end,
        StepOptions(options.first, options.largest, options.smallest, extrapolate=options.extrapolate, resolve=True),
        newton,
        save_times=np.arange(options.save_every, options.end, options.save_every),
        relaxation=options.relaxation,
        accepted=accepted,
        overloaded=overloaded,
    )


def _headline(scene: FemScene, problem: Problem, settled: March, loaded: March, history: History) -> dict[str, Any]:
    pressure = problem.offset + problem.rate * loaded.time
    failed = not loaded.complete
    elastic = softest_stiffness(problem.body, settled.state)
    last = loaded.state
    stiffness = elastic
    if history.previous is not None:
        increment = last.displacement - history.previous.displacement
        stiffness = softest_stiffness(problem.body, last, increment, history.previous)
    carried = max(history.carried)
    reason = loaded.reason
    hidden = _VISCOUS * problem.rate * scene.stepping.relaxation
    known = loaded.time > 0.0 and carried > hidden
    if failed and loaded.time == 0.0:
        reason = f"no equilibrium at the smallest rise of the load that was tried; {reason}"
    elif failed and not known:
        hides = f"stabilisation hides failures below {hidden / 1e6:.3g} MPa"
        reason = f"{hides}; lower the rate or stepping.relaxation; {reason}"
    return {
        "failure_load_pa": carried if failed and known else None,
        "failed": failed,
        "largest_load_pa": pressure,
        "settlement_m": history.settlement[-1],
        "compliance_ratio": history.compliance_ratio(),
        "stiffness_ratio": stiffness / elastic if elastic > 0 else 0.0,
        "stabilisation_share": loaded.drag_work / loaded.external_work if loaded.external_work > 0 else 0.0,
        "reason": reason,
        "elements": len(problem.body.mesh.quads),
        "steps": len(loaded.iterations),
        "energy_error": max(settled.energy_error(), loaded.energy_error()),
    }


def _measures(headline: dict[str, Any]) -> list[Measure]:
    """Error measures with their thresholds; a load march that is followed closes its work to a thousandth."""
    unknown = headline["failed"] and headline["failure_load_pa"] is None
    return [
        Measure(
            "failure_load_pa", 1.0 if unknown else None, 0.0,
            f"the failure load is not known: {headline['reason']}",
        ),
        Measure(
            "energy_error", headline["energy_error"], 0.02,
            "work of loads and of stresses differ by {percent}: take smaller steps (stepping.largest)",
        ),
        Measure(
            "stabilisation_share", headline["stabilisation_share"], 0.05,
            "viscous stabilisation took {percent} of the work of the loads: lower stepping.relaxation",
        ),
    ]  # fmt: skip


def _cost(body: Body, settled: March, loaded: March, headline: dict[str, Any]) -> dict[str, Any]:
    residuals = [r[-1] for r in settled.residuals + loaded.residuals]
    return {
        "elements": len(body.mesh.quads),
        "degrees_of_freedom": len(body.free),
        "smallest_element_m": float(np.sqrt(body.elements.weight.sum(axis=1).min())),
        "steps": len(settled.iterations) + len(loaded.iterations),
        "rejected_steps": settled.rejected + loaded.rejected,
        "factorisations": settled.factorisations + loaded.factorisations,
        "largest_residual": max(residuals, default=0.0),
        "energy_error": headline["energy_error"],
    }
