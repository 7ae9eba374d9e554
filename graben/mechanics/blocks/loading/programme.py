"""Loads on any outline: weight and steady pressures until rest, then pressures that rise until failure, and digging.

Loads rise as if a stiff frame held them (see rise.py), so that they pass the failure and fall with the body. Blocks
that fall are a failure too, at rest and later.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.excavation import Dig, blocks_in
from graben.mechanics.blocks.loading.failure import Failure, failure_of
from graben.mechanics.blocks.loading.falling import Falling
from graben.mechanics.blocks.loading.loads import Loads
from graben.mechanics.blocks.loading.protocol import Moment, State, refuse_unlike
from graben.mechanics.blocks.loading.rest import imbalance, settle
from graben.mechanics.blocks.loading.rise import Control, Rise, raise_load

# A block is at rest when its resultant is this share of the forces that bear on it.
_BLOCK_REST = 0.02


class Programme:
    """The test: a `Loading`. Supports are there already, as prescribed velocities of the model.

    end : load time at which the rise is complete, save_every : load time between saved states [s]
    tolerance : of `imbalance` at rest
    may_fall : whether blocks may fall without ending the test
    looks : (load time [s], settlement [m], imbalance, way, resisted, step) after every chunk, see `Rise`;
    load_times : of saved states [s]; first_look : the first since rates of loads last changed
    reference : (vertices, 2) positions at rest, carried : at the largest load [m]
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
        may_fall: bool = False,
    ) -> None:
        self.model, self.loads, self.control = model, loads, control
        self.end, self.save_every, self.tolerance = end, save_every, tolerance
        self.rise, self.falling, self.may_fall = Rise(), Falling(model), may_fall
        self.looks: list[tuple[float, ...]] = []
        self.first_look = 0
        self.load_times: list[float] = []
        self.rest: np.ndarray = np.zeros(2)
        self.reference = model.bodies.position.copy()
        self.carried = self.reference
        self._next_save = 0.0
        self._saved_at = model.time
        self._digs = sorted(digs, key=lambda dig: dig.time)
        self._dug = 0
        self._velocity = np.zeros_like(self.reference)
        self._released: list[tuple[float, float, np.ndarray]] = []  # from, over, forces
        loads.begin(model, 0.0)

    def begin(self) -> Iterator[Moment]:
        """Bring the body to rest under its weight and steady pressures."""
        m, ratio = self.model, np.inf
        where = "rest under weight and steady pressures"
        advice = "the body does not stand; strengthen the joints or support it"
        for ratio in settle(m, self.tolerance, self._unrest, limit=100_000, where=where, advice=advice):
            yield Moment(0.0, f"coming to rest, {m.steps_done} steps, unbalanced force ratio {ratio:.2g}")
            if self.falling.look(m, resting=True) and not self.may_fall:
                self.rise.failed = True
                break
        self.rest = np.array([ratio, m.steps_done])
        self.reference = m.motion.x.copy()
        self.carried = self.reference

    def _unrest(self, model: BlockModel) -> float:
        """Imbalance of the whole, and of the block that is worst: it must not be diluted by the others."""
        blocks = model.block_imbalance()
        blocks[self.falling.blocks] = 0.0
        return max(imbalance(model), self.tolerance * float(blocks.max()) / _BLOCK_REST)

    def run(self) -> Iterator[Moment]:
        """Raise the loads and dig until failure or the end."""
        m, rise = self.model, self.rise
        if not self.load_times:
            m.begin_ledger()
            yield self._moment(save=True)
        if not self.loads.direction.any() and not self._digs:
            return
        end = self.end * (1.0 - 1e-9)
        while rise.load_time < end and not rise.failed and rise.steps * m.dt < self.control.patience * self.end:
            while self._dug < len(self._digs) and self._digs[self._dug].time <= rise.load_time + 0.5 * m.dt:
                if m.time > self._saved_at:
                    yield self._moment(save=True)
                self._dig(self._digs[self._dug])
            self._step(self._digs[self._dug].time if self._dug < len(self._digs) else np.inf)
            yield self._moment(save=rise.failed or rise.load_time >= min(end, self._next_save))
        if m.time > self._saved_at:
            yield self._moment(save=True)

    def _step(self, stop: float) -> None:
        """One chunk of steps under the loads as they rise. stop : load time that it must not run past [s]"""
        model, rise = self.model, self.rise
        since = rise.since
        self._velocity = raise_load(
            model, self.loads, rise, self.control, self._velocity, end=self.end, stop=stop, reference=self.reference
        )
        look = (rise.load_time, rise.settlement, rise.imbalance, rise.way, rise.resisted, float(model.steps_done))
        self.looks.append(look)
        if rise.since != since:
            self.first_look = len(self.looks)
        if rise.load_time >= rise.largest:
            self.carried = model.motion.x.copy()
        if self.falling.look(model) and not self.may_fall:
            rise.failed = True

    def look_table(self) -> np.ndarray:
        """The looks as rows (looks, 6)."""
        return np.array(self.looks).reshape(-1, 6)

    def failure(self) -> Failure | None:
        """Load at failure in seconds of rise, and the look there; None where nothing failed under a rising load.

        Where blocks fell, what they bore counts until the first of them lost its last contact.
        """
        if not self.rise.failed:
            return None
        table = self.look_table()[self.first_look :]
        if len(self.falling.blocks) and not self.may_fall:
            table = table[table[:, 5] <= self.falling.step[self.falling.blocks].min()]
        if not len(table):
            return None
        found = failure_of(table[:, 0], table[:, 3], table[:, 4])
        return found._replace(look=found.look + self.first_look)

    @property
    def reached(self) -> float | None:
        """Share of the rise that the loads came to; None where none was to rise."""
        return min(1.0, self.rise.load_time / self.end) if self.looks else None

    def _dig(self, dig: Dig) -> None:
        """Take out the blocks of an excavation, the next one in turn."""
        m, rise = self.model, self.rise
        self._dug += 1
        forces = m.remove(blocks_in(m, dig.polygon))
        self.loads.take_off(m.removed[m.bodies.vertex_block])
        if dig.relax_over > 0.0:
            self._release(rise.load_time, dig.relax_over, forces)
        self.loads.begin(m, rise.load_time)
        rise.begin(rise.load_time)
        self.first_look = len(self.looks)

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
        words = f"load time {rise.load_time:.4g} s, settlement {rise.settlement:.3g} m"
        return Moment(min(1.0, rise.load_time / self.end), words, save)

    def state(self) -> State:
        return {
            "rest": self.rest,
            "looks": self.look_table(),
            "first_look": np.array(self.first_look),
            "velocity": self._velocity,
            "load_times": np.array(self.load_times),
            "reference": self.reference,
            "carried": self.carried,
            "next_save": np.array(self._next_save),
            "saved_at": np.array(self._saved_at),
            "dug": np.array(self._dug),
            "released": np.array([released[:2] for released in self._released]).reshape(-1, 2),
            "released_forces": np.array([forces for _, _, forces in self._released]).reshape(-1, *self.carried.shape),
            **self.falling.state(),
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
        self.first_look, self._velocity = int(state["first_look"]), state["velocity"]
        self.falling.bring_back(state)
        self._next_save, self._saved_at = float(state["next_save"]), float(state["saved_at"])
        self._dug = int(state["dug"])
        self.loads.take_off(self.model.removed[self.model.bodies.vertex_block])
        for (start, over), forces in zip(state["released"], state["released_forces"], strict=True):
            self._release(float(start), float(over), forces)
        self.rise = Rise(**{f.name: state[f"rise_{f.name}"].item() for f in fields(Rise)})
