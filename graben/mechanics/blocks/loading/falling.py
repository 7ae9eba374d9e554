"""Blocks that fall: out of balance, they leave their place.

A block that moves slowly under loads that grow slowly is in balance all the way. One that nothing bears, or that its
joints do not hold, is not: inertia and damping take up a part of the forces on it. The part shows when it lost its
balance, however heavy slow loading made it, and without regard to what other blocks do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.shape.bodies import Bodies

# Shares of the forces on a block that inertia and damping take up: in balance below the first, out of it above the
# second; in the mean in balance below the third, and beyond doubt out of it above the fourth. They are small since
# blocks bear on each other with more than what moves them.
_BALANCE, _OUT, _STEADY, _LOST = 0.0005, 0.002, 0.005, 0.01

# Swings pass through nothing: a share counts as small when it was in so many looks. Beyond doubt is what stays in a
# mean over some steps, which swings leave.
_LOOKS, _MEAN = 10, 500.0

# A block has fallen when it moved by this share of its size without balance. When a body is put under its weight all
# blocks move at first: those that never were in balance, and that others bear, may move by their size.
_GONE, _PLACED = 0.1, 1.0

# A block under a load has fallen where it goes as far again as it had come, or by this share of its size where that
# is more: it may rest further on, but not where the load was borne.
_SLID = 0.001

# Where the body as a whole fails, blocks without balance fail with it that moved this share of the farthest way.
_WITH_IT = 0.5

# Under loads that stay, a block creeps when twice in a row it went as far in so many steps as in as many before, and
# the mean share stayed above the last number: it has fallen, damping only keeps it slow. Where a block comes to rest
# its share dies out: a slope of 3,090 blocks shows 4e-7 at most after 9,500 steps, and 1e-9 after 14,500.
_CREEP, _AS_FAR, _ROWS = 4000, 0.9, 2
REST = 1e-5


class Onset(NamedTuple):
    """A block that fell, and the steps at which it was last in balance (-1: never), out of it, and had lost it.

    share : what inertia and damping took up at the first, over what they took up at the second
    """

    block: int
    balanced: int
    out: int
    lost: int
    share: float


class Standing(NamedTuple):
    """Middles of blocks (blocks, 2), and how far each had come by when it was last in balance (blocks,) [m]."""

    middle: np.ndarray
    came: np.ndarray


class _Stretch:
    """Since when shares (blocks,) are above a limit; they are below it after some looks in a row.

    since : (blocks,) step of the first look above it, -1 where below; below : (blocks,) looks in a row below it
    """

    def __init__(self, blocks: int, limit: float) -> None:
        self.limit = limit
        self.since = np.full(blocks, -1, dtype=np.int64)
        self.below = np.zeros(blocks, dtype=np.int64)

    def look(self, share: np.ndarray, step: int) -> np.ndarray:
        """Take a look; returns where (flags) a stretch begins."""
        self.below = np.where(share < self.limit, self.below + 1, 0)
        begins = (self.below == 0) & (self.since < 0)
        self.since[begins] = step
        self.since[self.below >= _LOOKS] = -1
        return begins


class Falling:
    """Watches the blocks of a model.

    fallen : (blocks, 4) steps at which each block that has fallen was last in balance and first out of it, look by
    look, and the same of the mean; -1 for the others, and where it never was in balance
    """

    def __init__(self, model: BlockModel) -> None:
        count = len(model.bodies.block_area)
        self._size = np.sqrt(model.bodies.block_area)
        self.fallen = np.full((count, 4), -1, dtype=np.int64)
        self._balanced, self._steady = np.full((2, count), -1, dtype=np.int64)
        # Look by look, and in the mean.
        self._stretches = [_Stretch(count, limit) for limit in (_BALANCE, _OUT, _STEADY, _LOST)]
        self._resisted, self._looked = np.zeros_like(model.motion.x), model.steps_done
        self._stood = self._centres(model)
        self._from, self._went = self._stood.copy(), np.zeros(count)
        self._mark, self._marked, self._way = model.steps_done, self._stood.copy(), np.zeros_like(self._stood)
        self._as_far = np.zeros(count, dtype=np.int64)

    @property
    def blocks(self) -> np.ndarray:
        """Numbers of the blocks that have fallen."""
        return np.flatnonzero(self.fallen[:, 3] >= 0)

    def look(self, model: BlockModel, resisted: np.ndarray, *, steady: bool = False) -> bool:
        """Whether another block has fallen by now.

        resisted : (vertices, 2) forces that inertia and damping take up, see `Resistance`
        steady : no load changes, so that all that bear them come to rest
        """
        share, centre, step = model.block_share(resisted), self._centres(model), model.steps_done
        keep = float(np.exp((self._looked - step) / _MEAN))
        self._resisted, self._looked = keep * self._resisted + (1.0 - keep) * resisted, step
        mean = self.mean_share(model)
        *_, begins = (s.look(v, step) for s, v in zip(self._stretches, (share, share, mean, mean), strict=True))
        self._from[begins] = centre[begins]
        self._steady[self._stretches[2].below >= _LOOKS] = step
        calm = self._stretches[0].below >= _LOOKS
        self._balanced[calm], self._stood[calm] = step, centre[calm]
        limit = np.where(model.loose_blocks() | (self._balanced >= 0), _GONE, _PLACED)
        gone = (np.hypot(*(centre - self._from).T) > limit * self._size) & (self._stretches[3].since >= 0)
        return self._fall(model, gone | self._creeps(centre, step, mean, steady))

    def mean_share(self, model: BlockModel) -> np.ndarray:
        """Shares (blocks,) of the forces on blocks that inertia and damping take up in the mean over some steps."""
        return model.block_share(self._resisted)

    def all_fell(self, model: BlockModel) -> bool:
        """Whether no block stands but those that are fixed; one on rollers stands, whatever it does."""
        fixed = np.zeros(len(self._size), dtype=bool)
        fixed[model.bodies.vertex_block[model.held.all(axis=1)]] = True
        free = ~fixed & ~model.removed
        return bool(free.any() and (self.fallen[free, 3] >= 0).all())

    def standing(self, model: BlockModel) -> Standing:
        """Where blocks stand as loads begin to stay."""
        return Standing(self._centres(model), self._came(model))

    def go_on(self, model: BlockModel, loaded: np.ndarray, share: float, since: Standing | None) -> bool:
        """Whether another loaded block (flags) has fallen by now: they may not go as far again as they had come.

        share : of the way that they had come, instead of as far again
        since : where they stood as loads began to stay; None: loads change, so those count that lost their balance
        beyond doubt, from there on
        """
        centre = self._centres(model)
        if since is None:
            out, begin, came = self._stretches[3].since >= 0, self._from, self._came(model)
        else:
            out, (begin, came) = ~model.removed, since
        went = np.hypot(*(centre - begin).T) > np.maximum(share * came, _SLID * self._size)
        return self._fall(model, loaded & out & went)

    def _came(self, model: BlockModel) -> np.ndarray:
        """Ways (blocks,) from where blocks were laid out to where they were last in balance [m]."""
        return np.asarray(np.hypot(*(self._stood - _middles(model.bodies, model.bodies.position)).T))

    def fail(self, model: BlockModel) -> None:
        """The body as a whole has failed: blocks that are going with it have fallen."""
        going = (self._stretches[1].since >= 0) & (self.fallen[:, 3] < 0) & ~model.removed
        self._went = np.where(going, np.hypot(*(self._centres(model) - self._stood).T), 0.0)
        self._fall(model, going & (self._went > _WITH_IT * self._went.max(initial=0.0)))

    def _fall(self, model: BlockModel, blocks: np.ndarray) -> bool:
        """Blocks (flags) fall that have not; whether there are any."""
        new = blocks & (self.fallen[:, 3] < 0) & ~model.removed
        out, _, lost = (np.where(s.since < 0, model.steps_done, s.since) for s in self._stretches[1:])
        self.fallen[new] = np.column_stack([self._balanced, out, self._steady, lost])[new]
        return bool(new.any())

    def _creeps(self, centre: np.ndarray, step: int, mean: np.ndarray, steady: bool) -> np.ndarray:
        """Blocks (flags) that went as far in the last steps as in those before, and so on."""
        if steady and step - self._mark < _CREEP:
            return np.zeros(len(centre), dtype=bool)
        way, before = centre - self._marked, (self._way**2).sum(axis=1)
        as_far = (before > 0.0) & ((way * self._way).sum(axis=1) > _AS_FAR * before) & (mean >= REST)
        self._as_far = np.where(as_far, self._as_far + 1, 0) if steady else np.zeros_like(self._as_far)
        self._mark, self._marked, self._way = step, centre, way if steady else np.zeros_like(way)
        return np.asarray(self._as_far >= _ROWS)

    def first(self) -> Onset | None:
        """The fallen block that lost its balance first; of several, the one that went farthest."""
        if not len(self.blocks):
            return None
        block = int(self.blocks[np.lexsort((-self._went[self.blocks], self.fallen[self.blocks, 3]))[0]])
        balanced, out, steady, lost = (int(step) for step in self.fallen[block])
        # A block that is out of balance by looks, and long not in the mean, swings.
        if steady - out > 2.0 * _MEAN:
            return Onset(block, steady, lost, lost, _STEADY / _LOST)
        return Onset(block, balanced, out, lost, _BALANCE / _OUT)

    @staticmethod
    def _centres(model: BlockModel) -> np.ndarray:
        return _middles(model.bodies, model.motion.x)

    def state(self) -> dict[str, np.ndarray]:
        """What a saved state must hold."""
        return {
            "fallen": self.fallen.copy(),
            "fallen_balanced": self._balanced.copy(),
            "fallen_steady": self._steady.copy(),
            "fallen_since": np.array([stretch.since for stretch in self._stretches]),
            "fallen_below": np.array([stretch.below for stretch in self._stretches]),
            "fallen_resisted": self._resisted.copy(),
            "fallen_looked": np.array(self._looked),
            "fallen_from": self._from.copy(),
            "fallen_stood": self._stood.copy(),
            "fallen_went": self._went.copy(),
            "fallen_mark": np.array(self._mark),
            "fallen_marked": self._marked.copy(),
            "fallen_way": self._way.copy(),
            "fallen_as_far": self._as_far.copy(),
        }

    def bring_back(self, state: dict[str, np.ndarray]) -> None:
        """Take up a state."""
        self.fallen, self._balanced = state["fallen"].copy(), state["fallen_balanced"].copy()
        self._steady = state["fallen_steady"].copy()
        for stretch, since, below in zip(self._stretches, state["fallen_since"], state["fallen_below"], strict=True):
            stretch.since, stretch.below = since.copy(), below.copy()
        self._resisted, self._looked = state["fallen_resisted"].copy(), int(state["fallen_looked"])
        self._from, self._stood = state["fallen_from"].copy(), state["fallen_stood"].copy()
        self._went, self._mark = state["fallen_went"].copy(), int(state["fallen_mark"])
        self._marked, self._way = state["fallen_marked"].copy(), state["fallen_way"].copy()
        self._as_far = state["fallen_as_far"].copy()


def _middles(bodies: Bodies, x: np.ndarray) -> np.ndarray:
    """Mean position (blocks, 2) of the vertices of each block, at x (vertices, 2) [m]."""
    block, count = bodies.vertex_block, len(bodies.block_area)
    total = np.column_stack([np.bincount(block, axis, count) for axis in x.T])
    return total / np.bincount(block, minlength=count)[:, None]
