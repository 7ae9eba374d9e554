"""Loads on any outline: weight and steady pressures until rest, then pressures that rise until failure, and digging.

Loads rise as if a stiff frame held them (see rise.py), so that they pass the failure and fall with the body. A body
that bears them all comes to rest under them, or fails there. Blocks that fall are a failure too, at any time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.excavation import Dig, blocks_in
from graben.mechanics.blocks.loading.failure import Failure, failure_of, loss_of_balance, tenfold_speed
from graben.mechanics.blocks.loading.falling import REST, Falling, Standing
from graben.mechanics.blocks.loading.loads import Loads
from graben.mechanics.blocks.loading.protocol import Moment, State, refuse_unlike
from graben.mechanics.blocks.loading.resistance import Resistance
from graben.mechanics.blocks.loading.rest import REST_DAMPING, imbalance, settle
from graben.mechanics.blocks.loading.rise import Control, Rise, hold_load, raise_load

# A block is at rest when its resultant is this share of the forces that bear on it.
_BLOCK_REST = 0.02

# Steps between two looks at a body that is held; least numbers of steps after which it can be at rest, and after
# which it counts as restless.
HOLD, _STILL, RESTLESS = 100, 2000, 20_000


class Programme:
    """The test: a `Loading`. Supports are there already, as prescribed velocities of the model.

    end : load time at which the rise is complete, save_every : load time between saved states [s]
    tolerance : of `imbalance` at rest
    may_fall : whether blocks may fall without ending the test, but for those under loads, and for the last one
    set_in : steps over which weight and steady pressures grow at first; 0: they are there, as stress in situ wants
    looks : (load time [s], settlement [m], imbalance, way, resisted, step) after every chunk, see `Rise`;
    load_times : of saved states [s]; first_look : the first since rates of loads last changed
    reference : (vertices, 2) positions at rest, carried : at the largest load [m]
    at_rest : whether the body is at rest under all that acts at the end; None where the end was not reached
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
        set_in: int = 2000,
    ) -> None:
        self.model, self.loads, self.control = model, loads, control
        self.end, self.save_every, self.tolerance = end, save_every, tolerance
        self.rise, self.falling, self.may_fall = Rise(), Falling(model), may_fall
        self.resistance, self.set_in = Resistance(model), set_in
        self.at_rest: bool | None = None
        self._over_and_saved = False
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
        self._stood: Standing | None = None  # as loads began to stay; None while they change
        self._released: list[tuple[float, float, np.ndarray]] = []  # from, over, forces
        loads.begin(model, 0.0)

    def begin(self) -> Iterator[Moment]:
        """Bring the body to rest under its weight and steady pressures."""
        m, ratio = self.model, np.inf
        m.spare_joints(True)
        yield from self._set_in()
        where = "rest under weight and steady pressures"
        advice = "the body does not stand; strengthen the joints or support it"
        for ratio in settle(m, self.tolerance, self._settling, limit=100_000, where=where, advice=advice):
            yield Moment(0.0, f"coming to rest, {m.steps_done} steps, unbalanced force ratio {ratio:.2g}")
            if len(self.falling.blocks) and self._ends():
                self.rise.failed = self.rise.fell = True
                break
        m.spare_joints(False)
        self.rest = np.array([ratio, m.steps_done])
        self.reference = m.motion.x.copy()
        self.carried = self.reference

    def _set_in(self) -> Iterator[Moment]:
        """Let weight and steady pressures grow: what acts at once makes the body swing, and slender blocks fall."""
        m = self.model
        if not self.set_in:
            return
        steady = m.skeleton.steady.copy()
        m.set_loads(np.zeros_like(steady), steady)
        m.set_load(0.0, 1.0 / self.set_in)
        damping = m.damping
        m.damp(REST_DAMPING)
        for done in range(0, self.set_in, HOLD):
            m.advance(min(HOLD, self.set_in - done))
            self.resistance.look(m)
            yield Moment(0.0, f"weight and steady pressures set in, {m.steps_done} steps")
        m.damp(damping)
        self.loads.begin(m, 0.0)

    def _settling(self, model: BlockModel) -> float:
        """`_unrest` while the body comes to rest, with a look at what falls."""
        self.resistance.look(model)
        self.falling.look(model, self.resistance.force, steady=True)
        return self._unrest(model)

    def _unrest(self, model: BlockModel) -> float:
        """Imbalance of the whole, and of the block that is worst: it must not be diluted by the others.

        Nor may a block creep on, whose friction takes up nearly all that moves it.
        """
        blocks, creep = model.block_imbalance(), self.falling.mean_share(model)
        for share in (blocks, creep):
            share[self.falling.blocks] = 0.0
        return max(
            imbalance(model),
            self.tolerance * float(blocks.max()) / _BLOCK_REST,
            self.tolerance * float(creep.max()) / REST,
        )

    def run(self) -> Iterator[Moment]:
        """Raise the loads and dig until failure or the end."""
        m, rise = self.model, self.rise
        if self._over_and_saved:
            return
        if not self.load_times:
            m.begin_ledger()
            yield self._moment(save=True)
        if not self.loads.direction.any() and not self._digs:
            self.at_rest = not rise.failed
            return
        end = self.end * (1.0 - 1e-9)
        while rise.load_time < end and not rise.failed and rise.steps * m.dt < self.control.patience * self.end:
            while self._dug < len(self._digs) and self._digs[self._dug].time <= rise.load_time + 0.5 * m.dt:
                if m.time > self._saved_at:
                    yield self._moment(save=True)
                yield from self._dig(self._digs[self._dug])
            if rise.failed:
                break
            self._step(self._digs[self._dug].time if self._dug < len(self._digs) else np.inf)
            yield self._moment(save=rise.failed or end > rise.load_time >= self._next_save)
        if rise.load_time >= end and not rise.failed:
            yield from self._hold()
        yield from self._last_moment()

    def _last_moment(self) -> Iterator[Moment]:
        """The last saved state, from which a restart does not go on."""
        if self.model.time > self._saved_at:
            self._over_and_saved = True
            yield self._moment(save=True)

    def _hold(self) -> Iterator[Moment]:
        """Let the body come to rest under the whole load, or fail."""
        rise = self.rise
        if rise.load_time > self.end:
            self.model.set_load(self.end - rise.since)
            rise.load_time = self.end
        for steps, ratio in self._stand(max(RESTLESS, rise.steps)):
            yield Moment(1.0, f"under the whole load, {steps} steps, unbalanced force ratio {ratio:.2g}")

    def _stand(self, limit: int) -> Iterator[tuple[int, float]]:
        """Steps under what acts now, until the body is at rest or has failed; gives their number and the unrest."""
        m, steps, damping = self.model, 0, self.model.damping
        self.at_rest, self._stood = False, self.falling.standing(m)
        m.damp(REST_DAMPING)
        while not self.at_rest and not self._over() and steps < limit:
            self._advance(steady=True)
            steps += HOLD
            ratio = self._unrest(m)
            self.at_rest = steps >= _STILL and not self._over() and ratio < self.tolerance
            yield steps, ratio
        m.damp(damping)
        self._stood = None

    def _over(self) -> bool:
        """Whether the body has failed."""
        return self.rise.failed

    def _advance(self, *, steady: bool) -> None:
        """A chunk of steps without a frame, and a look. steady : no load changes"""
        hold_load(
            self.model, self.rise, self.control, self.resistance,
            steps=HOLD, end=self.end, direction=self.loads.direction, reference=self.reference,
        )  # fmt: skip
        self._look(steady=steady)

    def _step(self, stop: float) -> None:
        """One chunk of steps under the loads as they rise. stop : load time that it must not run past [s]"""
        model, rise = self.model, self.rise
        since = rise.since
        raise_load(
            model, self.loads, rise, self.control, self.resistance,
            end=self.end, stop=stop, reference=self.reference,
        )  # fmt: skip
        self._look()
        if rise.since != since:
            self.first_look = len(self.looks)

    def _look(self, *, steady: bool = False) -> None:
        """Note where the rise stands, and see whether blocks fall. steady : no load changes"""
        model, rise = self.model, self.rise
        look = (rise.load_time, rise.settlement, rise.imbalance, rise.way, rise.resisted, float(model.steps_done))
        self.looks.append(look)
        if rise.load_time >= rise.largest:
            self.carried = model.motion.x.copy()
        fell = self.falling.look(model, self.resistance.force, steady=steady)
        if self._dead:
            fell |= self.falling.go_on(model, self._loaded(), self.control.beyond, self._stood)
        if fell and self._ends():
            rise.failed = rise.fell = True
        elif rise.failed:
            self.falling.fail(model)
        self.resistance.counted = (self.falling.fallen[:, 3] < 0)[model.bodies.vertex_block]

    def _ends(self) -> bool:
        """Whether the blocks that fell are a failure of the body: any, or where they may fall, those that bear."""
        return not self.may_fall or self._loaded_fell() or self.falling.all_fell(self.model)

    def _loaded_fell(self) -> bool:
        return bool((self.falling.fallen[self._under(self.loads.pressed), 3] >= 0).any())

    @property
    def _dead(self) -> bool:
        """Whether no frame holds the loads now, so that loaded blocks are watched instead of the way of the ground.

        What digging moves has been pushed: it may go far, and rest.
        """
        return not self._dug and (self._stood is not None or self.rise.compliance <= 0.0)

    def _loaded(self) -> np.ndarray:
        """Blocks (flags) under loads that change; where none does, under all pressures; and where weight alone acts
        all, unless they may fall."""
        if self.loads.direction.any():
            return self._under(self.loads.direction.any(axis=1))
        if self.loads.pressed.any():
            return self._under(self.loads.pressed)
        return np.full(len(self.falling.fallen), not self.may_fall)

    def _under(self, vertices: Any) -> np.ndarray:
        """Blocks (flags) of vertices (flags)."""
        blocks = np.zeros(len(self.falling.fallen), dtype=bool)
        blocks[self.model.bodies.vertex_block[vertices]] = True
        return blocks

    def look_table(self) -> np.ndarray:
        """The looks as rows (looks, 6)."""
        return np.array(self.looks).reshape(-1, 6)

    def failure(self) -> Failure | None:
        """Load at failure in seconds of rise, and the look there; None where nothing failed under a rising load.

        Where a block fell, the load at which it lost its balance is the failure load if it is the lower one. Where
        the body failed as a whole, it is the failure load if it is known more closely.
        """
        table = self.look_table()
        stretch = table[self.first_look :]
        if not self.rise.failed or not len(stretch):
            return None
        first, fell = None if self.may_fall else self.falling.first(), self.rise.fell
        if first is not None and not fell and first.out > stretch[int(np.argmax(stretch[:, 0])), 5]:
            # It was in balance when the load fell already: what came then are swings.
            first = None
        until = stretch[stretch[:, 5] <= max(first.out, stretch[0, 5])] if first is not None and fell else stretch
        found = failure_of(until[:, 0], until[:, 3], until[:, 4])
        found = found._replace(look=found.look + self.first_look)
        if first is not None:
            single = loss_of_balance(table[:, 0], table[:, 5], *first[1:])
            single = single._replace(inertia=found.inertia)
            if fell:
                low = min(found.low, single.low)
                found = min(found, single, key=lambda failure: failure.load)._replace(low=low, high=single.high)
            else:
                found = min(found, single, key=lambda failure: failure.high - failure.low)
        return found

    def tenfold_speed(self) -> float | None:
        """Load in seconds of rise at which the ground first moved ten times as fast as at first."""
        table = self.look_table()[self.first_look :]
        return tenfold_speed(table[:, 0], table[:, 3], table[:, 5])

    def first_fall(self) -> float | None:
        """Load in seconds of rise at which the block that fell first lost its balance."""
        first, table = self.falling.first(), self.look_table()
        if first is None or not len(table):
            return None
        return float(table[min(int(np.searchsorted(table[:, 5], first.out)), len(table) - 1), 0])

    @property
    def failed(self) -> bool:
        """Whether the body has failed, under its loads or before."""
        return self.rise.failed

    @property
    def reached(self) -> float | None:
        """Share of the rise that the loads came to; None where none was to rise."""
        return min(1.0, self.rise.load_time / self.end) if self.looks else None

    def _dig(self, dig: Dig) -> Iterator[Moment]:
        """Take out the blocks of an excavation, the next one in turn.

        Where their forces vanish at once the loads wait for the body: a block that slides must not be caught by more
        load, which might press it down.
        """
        m, rise = self.model, self.rise
        self._dug += 1
        forces = m.remove(blocks_in(m, dig.polygon))
        self.loads.take_off(m.removed[m.bodies.vertex_block])
        if dig.relax_over > 0.0:
            self._release(rise.load_time, dig.relax_over, forces)
        self.loads.begin(m, rise.load_time)
        rise.dig(rise.load_time)
        self.first_look = len(self.looks)
        if dig.relax_over == 0.0:
            for steps, ratio in self._stand(max(RESTLESS, rise.steps)):
                yield Moment(
                    min(1.0, rise.load_time / self.end), f"dug, {steps} steps, unbalanced force ratio {ratio:.2g}"
                )
            self.at_rest = None

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
            "load_times": np.array(self.load_times),
            "reference": self.reference,
            "carried": self.carried,
            "next_save": np.array(self._next_save),
            "saved_at": np.array(self._saved_at),
            "dug": np.array(self._dug),
            "ended": np.array([self._over_and_saved, -1 if self.at_rest is None else self.at_rest], dtype=np.int64),
            "released": np.array([released[:2] for released in self._released]).reshape(-1, 2),
            "released_forces": np.array([forces for _, _, forces in self._released]).reshape(-1, *self.carried.shape),
            **self.falling.state(),
            **self.resistance.state(),
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
        self.first_look = int(state["first_look"])
        self.falling.bring_back(state)
        self.resistance.bring_back(self.model, state)
        self._next_save, self._saved_at = float(state["next_save"]), float(state["saved_at"])
        self._dug = int(state["dug"])
        self._over_and_saved = bool(state["ended"][0])
        self.at_rest = None if state["ended"][1] < 0 else bool(state["ended"][1])
        self.loads.take_off(self.model.removed[self.model.bodies.vertex_block])
        for (start, over), forces in zip(state["released"], state["released_forces"], strict=True):
            self._release(float(start), float(over), forces)
        self.rise = Rise(**{f.name: state[f"rise_{f.name}"].item() for f in fields(Rise)})
