"""fem-run: gravity, then rising pressures on a plane-strain body, up to the load that it cannot carry."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import NumericsFailed
from graben.mechanics.fem.body import Body, Material
from graben.mechanics.fem.collapse import LoadCurve, Overload
from graben.mechanics.fem.march import March, StepOptions, advance, at_rest
from graben.mechanics.fem.newton import NewtonOptions
from graben.mechanics.fem.stability import softest_stiffness
from graben.mechanics.fem.stored import arrays_of_march, march_of
from graben.mechanics.stored import Arrays, named, part_of
from graben.schemas.outputs import CHECKPOINT, LAST_GOOD, SERIES, Outputs, beside, files_of
from graben.schemas.scene import Given, Overrides, load_scene
from graben.schemas.scenes.fem import FemScene
from graben.stages.fem_run.mesh import mesh_of
from graben.stages.fem_run.model import Problem, problem_of
from graben.stages.fem_run.output import SavedStates, arrays_of, write_run
from graben.stages.fem_run.sizes import sizes_of
from graben.stages.shared.checkpoint import Checkpoint, Keep
from graben.stages.shared.estimate import Estimate, refuse_too_large
from graben.stages.shared.last_good import keep_by, keeps_last_good
from graben.stages.shared.material import names_of, pack_material
from graben.stages.shared.measures import Measure, warnings_of
from graben.stages.shared.record import Progress, Record, silent

# A collapse lets the ground move so many times as far per load as at first, or leaves so little of its stiffness.
# Where a march only lost its way neither does: 3.8 and .42 were seen at half of a limit load, 5 to 50 at collapses.
# What had hardly yielded says nothing: a uniform column fails as it first yields (2.1 and .51, within .1 %).
_HARDLY, _COMPLIANT, _SOFT = 2.5, 5.0, 0.3

# Displacement over the size of the body up to which small strains are a model of it.
_SMALL = 0.1

# Gravity is a load history of its own, of unit length, in steps that are halved as the pressures' are.
_GRAVITY_STEPS = StepOptions(first=0.1, largest=0.5, smallest=1e-3)


@keeps_last_good("no step had been accepted yet")
def run(
    given: Given,
    output: Path,
    *,
    material: Path | None = None,
    overrides: Overrides = (),
    overwrite: bool = False,
    restart: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run a fem scene and write its artifact and VTU files.

    Parameters
    ----------
    material : a file with law and parameters that replaces the scene's
    restart : go on from NAME.checkpoint.npz, which a run that was stopped left beside the output

    Returns
    -------
    headline numbers: failure_load_pa (None when the end was reached without failure, or where the march stopped and
    nothing collapsed), last_load_pa (carried last), failed, largest_load_pa,
    settlement_m of the loaded segment, movement_over_size (largest displacement over that of the body),
    compliance_ratio and stiffness_ratio (evidence of collapse), elements,
    steps, energy_error, stabilisation_share (work of the viscous forces over that of the loads), and mesh_notes where
    something of a mesh file was left out or mended

    Raises
    ------
    BadInput : the scene, the mesh or the material has faults, or the output exists
    NumericsFailed : no equilibrium under gravity, or before the end where the goal is the end
    """
    scene: FemScene = load_scene(given, "fem", overrides)
    last_good = beside(output, LAST_GOOD + ".nc")
    kept = (CHECKPOINT, LAST_GOOD + ".nc", *(LAST_GOOD + end for end in SERIES))
    Outputs(output, SERIES, kept=kept).claim([*files_of(scene), material], overwrite=overwrite, restart=restart)
    progress(0.0, "meshing")
    problem, inputs, _ = prepare(scene, material)
    record = Record.begin(scene, inputs)
    checkpoint = Checkpoint.of(output, scene, record, names_of(problem.body.law_ids))
    analysis = Analysis(scene, problem)
    if restart:
        stored = checkpoint.read()
        with checkpoint.bringing_back():
            analysis.bring_back(stored)

    def write(path: Path, partial: str = "") -> Path:
        record.cost |= analysis.cost
        record.warn(analysis.headline["warnings"])
        write_run(path, record, problem.body.mesh, analysis.arrays(), analysis.headline, partial, scene.output.fields)
        return path

    keep_by(lambda why: write(last_good, why) if analysis.begun else None)
    with checkpoint.guarding():
        headline = analysis.solve(progress, checkpoint.keep)
        progress(0.98, "writing")
        write(output)
    progress(1.0, "done")
    return headline | {"warnings": record.warnings}


class Analysis:
    """A problem on its way to the end of its loads, of which nothing is written.

    Attributes
    ----------
    headline : numbers, as `run` returns them; cost : figures for the record
    begun : whether there is a state to keep
    settled, loaded : how far gravity is, and the rising loads
    """

    def __init__(self, scene: FemScene, problem: Problem) -> None:
        self.scene, self.problem, self.begun = scene, problem, False
        notes = {"mesh_notes": list(problem.notes)} if problem.notes else {}
        self.cost: dict[str, Any] = dict(notes)
        self.headline: dict[str, Any] = {
            "failed": True, "failure_load_pa": None, "compliance_ratio": 1.0, "stiffness_ratio": 1.0, "warnings": [],
        }  # fmt: skip
        self._notes = notes
        self.settled = at_rest(problem.body, problem.body.untouched(), 0.0)
        self.loaded: March | None = None

    def solve(self, progress: Progress = silent, keep: Keep = lambda take: None) -> dict[str, Any]:
        """Gravity, then the rising loads, from where they stand; returns the headline numbers.

        keep : told of each state to go on from, and how to take it

        Raises
        ------
        NumericsFailed : no equilibrium under gravity, or before the end where the goal is the end
        """
        scene, problem, body = self.scene, self.problem, self.problem.body
        progress(0.01, f"{len(body.mesh.quads)} elements; gravity")
        newton = NewtonOptions(scene.stepping.tolerance, scene.stepping.max_iterations)
        settled = self.settled
        if self.loaded is None:
            for _ in advance(settled, body, lambda t: t * problem.steady, 1.0, _GRAVITY_STEPS, newton):
                keep(self.stored)
            self._begin_loads()
        if not settled.complete:
            raise NumericsFailed(
                f"no equilibrium beyond {100 * settled.time:.3g} % of gravity ({settled.reason})",
                advice="the body does not stand under its own weight: check supports, strength and density",
            )
        options = scene.stepping
        if self.loaded is None:
            self.loaded = at_rest(body, settled.state, 0.0)
        loaded = self.loaded
        for step in advance(
            loaded, body, problem.external, options.end,
            StepOptions(
                options.first, options.largest, options.smallest, extrapolate=options.extrapolate, resolve=True
            ),
            newton,
            save_times=np.arange(options.save_every, options.end, options.save_every),
            relaxation=options.relaxation,
            overload=Overload(problem.pressure, options.overload, options.relaxation),
        ):  # fmt: skip
            self.curve.add(loaded.time, loaded.state.displacement, step.drag, step.iterations)
            self.saved.add(loaded)
            keep(self.stored)
            done = f"{loaded.time:.4g} s, {self.curve.pressure[-1] / 1e6:.4g} MPa, {step.iterations} iterations"
            progress(0.02 + 0.95 * loaded.time / options.end, done)
        headline = _headline(scene, problem, settled, loaded, self.curve) | self._notes
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

    def _begin_loads(self) -> None:
        self.curve = LoadCurve(self.problem.pressure, self.settled.state.displacement)
        self.saved = SavedStates(self.scene.stepping, self.settled)
        self.begun = True

    def stored(self) -> Arrays:
        """The state of the analysis, to go on from bitwise."""
        found = named("settled", arrays_of_march(self.settled))
        if self.loaded is not None:
            found |= named("loaded", arrays_of_march(self.loaded))
            found |= named("curve", self.curve.stored()) | named("saved", self.saved.stored())
        return found

    def bring_back(self, stored: Arrays) -> None:
        """Take up a state of `stored`. Refused where it is none of this problem."""
        body, loaded = self.problem.body, part_of(stored, "loaded")
        self.settled = march_of(part_of(stored, "settled"), body, 1.0)
        if loaded:
            self.loaded = march_of(loaded, body, self.scene.stepping.end)
            self._begin_loads()
            self.curve.bring_back(part_of(stored, "curve"), self.loaded.state.displacement)
            self.saved.bring_back(part_of(stored, "saved"), body, self.loaded)

    def arrays(self) -> dict[str, Any]:
        """Arrays of the layout "fem"."""
        problem, settled = self.problem, self.settled
        carried = problem if settled.complete else replace(problem, steady=settled.time * problem.steady)
        return arrays_of(
            self.scene, problem.body, settled, self.saved, self.curve, problem.support_nodes, carried.external
        )


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


def _headline(scene: FemScene, problem: Problem, settled: March, loaded: March, curve: LoadCurve) -> dict[str, Any]:
    failed = not loaded.complete
    elastic = softest_stiffness(problem.body, settled.state)
    last = loaded.state
    stiffness = elastic
    if loaded.before is not None:
        increment = last.displacement - loaded.before.displacement
        stiffness = softest_stiffness(problem.body, last, increment, loaded.before)
    carried = max(curve.carried) if failed else curve.carried[-1]
    size = problem.body.mesh.diameter()
    way = last.displacement.reshape(-1, 2)
    reason = loaded.reason
    hidden = problem.pressure.hidden(scene.stepping.relaxation)
    known = loaded.time > 0.0 and carried > hidden
    compliance, softness = curve.compliance_ratio(), stiffness / elastic if elastic > 0 else 0.0
    collapsed = not _HARDLY < compliance < _COMPLIANT or softness <= _SOFT
    if failed and loaded.time == 0.0:
        reason = f"no equilibrium at the smallest rise of the load that was tried; {reason}"
    elif failed and not known:
        hides = f"stabilisation hides failures below {hidden / 1e6:.3g} MPa"
        reason = f"{hides}; lower the rate or stepping.relaxation; {reason}"
    elif failed and not collapsed:
        still = f"the last step moves {compliance:.3g} times as far as the first, at {softness:.2g} of its stiffness"
        reason = f"no equilibrium was found beyond the last load, but that is no collapse: {still}; {reason}"
    return {
        "failure_load_pa": carried if failed and known and collapsed else None,
        "last_load_pa": curve.carried[-1],
        "failed": failed,
        "largest_load_pa": problem.pressure.at(loaded.time),
        "settlement_m": curve.settlement[-1],
        "movement_over_size": float(np.hypot(*way.T).max()) / size,
        "compliance_ratio": compliance,
        "stiffness_ratio": softness,
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
            "movement_over_size", headline["movement_over_size"], _SMALL,
            "the body moved by {percent} of its size: strains and loads are those of small displacements, and say "
            "nothing so far from the first shape",
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
