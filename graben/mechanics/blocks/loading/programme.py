"""Loads on any outline: weight and steady pressures until rest, then pressures that rise until failure, and digging.

Loads rise at their rate as long as the blocks keep up, wait while they do not, and the rock has failed when waiting
does not bring it to rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.excavation import Dig, blocks_in
from graben.mechanics.blocks.loading.loads import Loads, settlement_of
from graben.mechanics.blocks.loading.protocol import Moment, State, refuse_unlike
from graben.mechanics.blocks.loading.rest import imbalance, settle

# Settlement that runs this many times as fast as at first, while the load waits, is a collapse: no need for patience.
_COLLAPSE = 300.0


@dataclass(frozen=True)
class Control:
    """When rising loads wait, and when waiting means failure.

    calm : the loads rise while `imbalance` is below this
    patience : steps of waiting after which the rock has failed, if its settlement still runs faster than at the start
    of loading; four times as many where it does not (then something else than the loaded ground gives way); at once
    where it runs 300 times as fast
    chunk : steps between two looks
    """

    calm: float
    patience: int
    chunk: int = 100


@dataclass
class Rise:
    """Where a rising load stands.

    load_time : s of rise so far, waiting not counted; since : load time at which rates of loads last changed
    settlement : m, displacement along the loads, weighted by them
    speed, first_speed : of the settlement, now and in the first per cent of the rise [m/s]
    waited, waited_in_all : steps; failed : whether the last wait was in vain
    """

    load_time: float = 0.0
    since: float = 0.0
    settlement: float = 0.0
    speed: float = 0.0
    first_speed: float = 0.0
    imbalance: float = 0.0
    waited: int = 0
    waited_in_all: int = 0
    failed: bool = False


class Programme:
    """The test: a `Loading`. Supports are there already, as prescribed velocities of the model.

    end : load time at which the rise is complete, save_every : load time between saved states [s]
    tolerance : of `imbalance` at rest
    looks : (load time [s], settlement [m], imbalance) after every chunk; load_times : of saved states [s]
    reference : (vertices, 2) positions at rest, carried : when the blocks last kept up [m]
    """

    def __init__(
        self,
        model: BlockModel,
        loads: Loads,
        control: Control,
        *,
        end: float,
        save_every: float,
        tolerance: float,
        digs: Sequence[Dig] = (),
    ) -> None:
        self.model, self.loads, self.control = model, loads, control
        self.end, self.save_every, self.tolerance = end, save_every, tolerance
        self.rise = Rise()
        self.looks: list[tuple[float, float, float]] = []
        self.load_times: list[float] = []
        self.rest: np.ndarray = np.zeros(2)
        self.reference = model.bodies.position.copy()
        self.carried = self.reference
        self._next_save = 0.0
        self._saved_at = model.time
        self._digs = sorted(digs, key=lambda dig: dig.time)
        self._dug = 0
        self._released: list[tuple[float, float, np.ndarray]] = []  # from, over, forces
        loads.begin(model, 0.0)

    def begin(self) -> Iterator[Moment]:
        """Bring the body to rest under its weight and steady pressures."""
        m, ratio = self.model, np.inf
        where = "rest under weight and steady pressures"
        advice = "the body does not stand; strengthen the joints or support it"
        for ratio in settle(m, self.tolerance, imbalance, limit=100_000, where=where, advice=advice):
            yield Moment(0.0, f"coming to rest, {m.steps_done} steps, unbalanced force ratio {ratio:.2g}")
        self.rest = np.array([ratio, m.steps_done])
        self.reference = m.motion.x.copy()
        self.carried = self.reference

    def run(self) -> Iterator[Moment]:
        """Raise the loads and dig until failure or the end."""
        m, rise = self.model, self.rise
        if not self.load_times:
            m.begin_ledger()
            yield self._moment(save=True)
        if not self.loads.direction.any() and not self._digs:
            return
        end = self.end * (1.0 - 1e-9)
        while rise.load_time < end and not rise.failed:
            if rise.waited == 0:
                self.carried = m.motion.x.copy()
            while self._dug < len(self._digs) and self._digs[self._dug].time <= rise.load_time + 0.5 * m.dt:
                if m.time > self._saved_at:
                    yield self._moment(save=True)
                self._dig(self._digs[self._dug])
            self._step(self._digs[self._dug].time if self._dug < len(self._digs) else np.inf)
            yield self._moment(save=rise.failed or rise.load_time >= min(end, self._next_save))

    def _step(self, stop: float) -> None:
        """One chunk of steps; the loads rise in it if the blocks kept up in the last one.

        stop : load time that the chunk must not run past [s]; it does not run past points of courses either
        """
        model, rise, control, loads = self.model, self.rise, self.control, self.loads
        calm, chunk = rise.imbalance < control.calm, control.chunk
        point = loads.next_point(rise.since)
        if calm:
            left = (min(stop, point) - rise.load_time) / model.dt
            chunk = int(min(chunk, max(1.0, np.rint(left))))
        model.raise_load(model.dt if calm else 0.0)
        model.advance(chunk)
        model.raise_load(0.0)
        rise.load_time = rise.since + model.load_factor
        if rise.load_time > point - 0.5 * model.dt:
            rise.since = rise.load_time = point
            loads.begin(model, point)
        settlement = settlement_of(loads.direction, model.motion.x - self.reference)
        rise.speed = (settlement - rise.settlement) / (chunk * model.dt)
        rise.settlement = settlement
        rise.imbalance = imbalance(model)
        self.looks.append((rise.load_time, rise.settlement, rise.imbalance))
        if calm:
            rise.waited = 0
            if rise.load_time <= 0.01 * self.end or rise.first_speed == 0.0:
                rise.first_speed = settlement / rise.load_time
            return
        rise.waited += chunk
        rise.waited_in_all += chunk
        sinking = rise.speed > rise.first_speed
        collapsing = rise.first_speed > 0.0 and rise.speed > _COLLAPSE * rise.first_speed
        rise.failed = collapsing or rise.waited >= (control.patience if sinking else 4 * control.patience)

    def _dig(self, dig: Dig) -> None:
        """Take out the blocks of an excavation, the next one in turn."""
        m, rise = self.model, self.rise
        self._dug += 1
        forces = m.remove(blocks_in(m, dig.polygon))
        self.loads.take_off(m.removed[m.bodies.vertex_block])
        if dig.relax_over > 0.0:
            self._release(rise.load_time, dig.relax_over, forces)
        rise.since = rise.load_time
        self.loads.begin(m, rise.since)
        rise.imbalance = imbalance(m)
        # What moves now has nothing to do with the speed before.
        rise.first_speed = 0.0

    def _release(self, start: float, over: float, forces: np.ndarray) -> None:
        """Let forces that stand in for blocks taken out fade away."""
        self._released.append((start, over, forces))
        self.loads.add(forces, Course([(start, 1.0), (start + over, 0.0)]), leading=False)

    def _moment(self, save: bool) -> Moment:
        rise = self.rise
        if save:
            self._saved_at = self.model.time
            self.load_times.append(rise.load_time)
            while self._next_save <= rise.load_time:
                self._next_save += self.save_every
        wait = f", waiting for {rise.waited} steps" if rise.waited else ""
        words = f"load time {rise.load_time:.4g} s, settlement {rise.settlement:.3g} m{wait}"
        return Moment(min(1.0, rise.load_time / self.end), words, save)

    def state(self) -> State:
        return {
            "rest": self.rest,
            "looks": np.array(self.looks).reshape(-1, 3),
            "load_times": np.array(self.load_times),
            "reference": self.reference,
            "carried": self.carried,
            "next_save": np.array(self._next_save),
            "saved_at": np.array(self._saved_at),
            "dug": np.array(self._dug),
            "released": np.array([released[:2] for released in self._released]).reshape(-1, 2),
            "released_forces": np.array([forces for _, _, forces in self._released]).reshape(-1, *self.carried.shape),
            **{f"rise_{k}": np.array(v) for k, v in asdict(self.rise).items()},
        }

    def bring_back(self, state: State) -> None:
        refuse_unlike(state, self.state(), ("looks", "load_times", "released", "released_forces"))
        if len(state["released"]) != len(state["released_forces"]):
            raise Refused("test.released: as many as released_forces")
        if not 0 <= state["dug"] <= len(self._digs):
            raise Refused(f"test.dug: 0 to {len(self._digs)}")
        self.rest, self.reference, self.carried = state["rest"], state["reference"], state["carried"]
        self.looks = [tuple(row) for row in state["looks"].tolist()]
        self.load_times = state["load_times"].tolist()
        self._next_save, self._saved_at = float(state["next_save"]), float(state["saved_at"])
        self._dug = int(state["dug"])
        self.loads.take_off(self.model.removed[self.model.bodies.vertex_block])
        for (start, over), forces in zip(state["released"], state["released_forces"], strict=True):
            self._release(float(start), float(over), forces)
        self.rise = Rise(**{f.name: state[f"rise_{f.name}"].item() for f in fields(Rise)})
