"""How large a representative volume must be: statistics of samples by radius, and the radius they recommend.

Y 2.4: for one size, the values at many places are a sample; the size is representative from where on the sample
stays the same. Here both tests ask for evidence, so that few samples recommend nothing rather than anything.
Mean: Student's t, twice one-sided, must refute that the mean differs from that at the largest radius by the
tolerance or more (paired, sample by sample). Variance: chi-squared must refute that the scatter is as large
as the largest one to be accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, stdtr

from graben.errors import Refused

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Criteria:
    """What counts as settled.

    confidence : of intervals and tests, 0.95
    tolerance : largest relative difference of the mean from that at the largest radius
    variation : largest coefficient of variation (standard deviation over mean) to be accepted
    resamples : of the bootstrap
    """

    confidence: float = 0.95
    tolerance: float = 0.05
    variation: float = 0.10
    resamples: int = 2000


@dataclass(frozen=True)
class Convergence:
    """One scalar, by radius (radius,); p-values are nan where there is nothing to test, and deviation and interval
    where one sample tells of no scatter.

    mean_p: that the mean differs from that at the largest radius by the tolerance or more; variance_p: that the
    coefficient of variation is the accepted one or more. Small values are evidence that the radius is large enough
    """

    count: NDArray[np.int64]
    mean: Floats
    deviation: Floats
    low: Floats
    high: Floats
    mean_p: Floats
    variance_p: Floats
    mean_settled: Flags
    variance_settled: Flags

    @property
    def settled(self) -> Flags:
        """True where this radius and all larger ones pass both tests."""
        both = self.mean_settled & self.variance_settled
        return np.logical_and.accumulate(both[::-1])[::-1]


def convergence(values: Floats, criteria: Criteria, seed: int, independent: Floats | None = None) -> Convergence:
    """Statistics and tests of one scalar.

    Parameters
    ----------
    values : (radius, centre, run), radii rising; nan where a sample has no such value (left out, and counted)
    criteria : what counts as settled
    seed : of the bootstrap
    independent : (radius,) what the samples are worth, see `independent_samples`; with three runs or more, the
        chi-squared test counts no more samples than that

    Raises
    ------
    Refused : a radius without any value
    """
    radii = values.shape[0]
    flat = values.reshape(radii, -1)
    known = np.isfinite(flat)
    count = known.sum(axis=1)
    if (count == 0).any():
        raise Refused(f"no sample has a value at radius number {int(np.argmin(count)) + 1}")
    mean = np.array([flat[k, known[k]].mean() for k in range(radii)])
    if values.shape[2] >= 3:
        deviation = np.array([_deviation_over_runs(values[k]) for k in range(radii)])
    else:
        deviation = np.array([flat[k, known[k]].std(ddof=1) if count[k] > 1 else np.nan for k in range(radii)])
    low, high = bootstrap_interval(values, criteria.confidence, criteria.resamples, seed)
    alone = count < 2
    low[alone] = high[alone] = deviation[alone] = np.nan
    alpha = 1.0 - criteria.confidence
    margin = criteria.tolerance * abs(float(mean[-1]))
    mean_p = np.array([_equivalence_p(values[k], values[-1], margin) for k in range(radii)])
    variance_p = np.full(radii, np.nan)
    tested = (count > 1) & (mean != 0.0)
    limit = criteria.variation * np.abs(mean[tested])
    worth = count.astype(np.float64)
    if independent is not None and values.shape[2] >= 3:
        worth = np.minimum(worth, np.maximum(independent, 2.0))
    freedom = worth[tested] - 1.0
    variance_p[tested] = chdtr(freedom, freedom * (deviation[tested] / limit) ** 2)
    return Convergence(
        count=count,
        mean=mean,
        deviation=deviation,
        low=low,
        high=high,
        mean_p=mean_p,
        variance_p=variance_p,
        mean_settled=mean_p < alpha,
        variance_settled=variance_p < alpha,
    )


def _deviation_over_runs(values: Floats) -> float:
    """Standard deviation of single samples (centre, run) of independent runs.

    Samples of one run overlap, so they scatter less among themselves than samples of different runs. The variance
    of one sample is that of the runs' means plus the mean variance within runs (about the run's own mean, over n):
    without bias, however much the samples of a run have in common.
    """
    known = np.isfinite(values)
    n = known.sum(axis=0)
    kept, size = values[:, n > 0], n[n > 0]
    means = np.nansum(kept, axis=0) / size
    within = np.nansum((kept - means) ** 2, axis=0) / size
    between = float(means.var(ddof=1)) if means.size > 1 else 0.0
    return float(np.sqrt(between + within.mean()))


def _equivalence_p(here: Floats, there: Floats, margin: float) -> float:
    """p of the hypothesis that the mean difference of paired samples (centre, run) is `margin` or more, either way.

    With three runs or more the differences are first averaged over the centres of a run, because samples of one
    run overlap and are not independent. nan where there are not two differences.
    """
    difference = here - there
    if here.shape[1] >= 3:
        known = np.isfinite(difference)
        n = known.sum(axis=0)
        difference = np.where(known, difference, 0.0).sum(axis=0)[n > 0] / n[n > 0]
    else:
        difference = difference[np.isfinite(difference)]
    if difference.size < 2:
        return float("nan")
    middle = float(difference.mean())
    error = float(difference.std(ddof=1)) / np.sqrt(difference.size)
    if error == 0.0:
        return 0.0 if abs(middle) < margin else 1.0
    return float(stdtr(difference.size - 1, (abs(middle) - margin) / error))


def bootstrap_interval(values: Floats, confidence: float, resamples: int, seed: int) -> tuple[Floats, Floats]:
    """Percentile bootstrap interval of the mean, by radius.

    Parameters
    ----------
    values : (radius, centre, run); with three runs or more whole runs are drawn, otherwise single samples
    confidence : e.g. 0.95
    resamples : number of draws
    seed : of the draws; the same draws serve every radius

    Returns
    -------
    low, high : (radius,)
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    known = np.isfinite(values)
    filled = np.where(known, values, 0.0)
    if values.shape[2] >= 3:
        total, weight = filled.sum(axis=1), known.sum(axis=1).astype(np.float64)
    else:
        total = filled.reshape(values.shape[0], -1)
        weight = known.reshape(values.shape[0], -1).astype(np.float64)
    draw = rng.integers(0, total.shape[1], (resamples, total.shape[1]))
    drawn = weight[:, draw].sum(axis=2)
    fallback = np.broadcast_to((total.sum(axis=1) / np.maximum(weight.sum(axis=1), 1.0))[:, None], drawn.shape)
    means = np.divide(total[:, draw].sum(axis=2), drawn, out=fallback.copy(), where=drawn > 0.0)
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(means, [tail, 1.0 - tail], axis=1)
    return low, high


def independent_samples(centres: Floats, radii: Floats, runs: int) -> Floats:
    """(radius,) how many REVs that do not overlap the samples are worth: area covered over area of one, by runs.

    Parameters
    ----------
    centres : (centre, 2) m; radii : (radius,) m; runs : number of runs
    """
    result = np.empty(radii.size)
    for k, r in enumerate(radii):
        # A fixed grid of 200 x 200 points is enough for one digit.
        low, high = centres.min(axis=0) - r, centres.max(axis=0) + r
        x, y = np.meshgrid(np.linspace(low[0], high[0], 200), np.linspace(low[1], high[1], 200))
        covered = np.zeros(x.shape, dtype=bool)
        for c in centres:
            covered |= (x - c[0]) ** 2 + (y - c[1]) ** 2 <= r * r
        area = covered.mean() * np.prod(high - low)
        result[k] = runs * min(max(1.0, float(area / (np.pi * r * r))), centres.shape[0])
    return result


def once_each(blocks: Sequence[bytes]) -> Flags:
    """(sample,) true for the first of all samples that average the same blocks: the others say nothing more."""
    first = {key: k for k, key in reversed(list(enumerate(blocks)))}
    return np.array([first[key] == k for k, key in enumerate(blocks)])


@dataclass(frozen=True)
class Recommendation:
    """The smallest radius at which every scalar has settled, or none, and why."""

    radius: float | None
    reason: str


def recommend(radii: Floats, by_name: dict[str, Convergence], independent: Floats) -> Recommendation:
    """The smallest radius from which on every scalar has settled.

    The largest radius is what the others are compared with, so it cannot itself be shown to be large enough.

    Parameters
    ----------
    radii : (radius,) m, rising; by_name : convergence of each scalar; independent : see `independent_samples`
    """
    settled = {name: c.settled for name, c in by_name.items()}
    first = {name: int(np.argmax(s)) if s.any() else radii.size for name, s in settled.items()}
    last = max(first, key=lambda name: first[name])
    index = first[last]
    if index >= radii.size - 1:
        c = by_name[last]
        k = radii.size - 1
        if index == radii.size:
            scatter = c.deviation[k] / abs(c.mean[k]) if c.mean[k] != 0.0 else np.inf
            shown = f"coefficient of variation {scatter:.3f}, " if c.count[k] > 1 else ""
            why = (
                f"{last} has not settled at the largest radius, {radii[k]:g} m: its scatter is not shown to be "
                f"small ({shown}samples: {int(c.count[k])}, worth {independent[k]:.1f} independent ones)"
            )
        else:
            why = f"{last} still changes between {radii[k - 1]:g} m and the largest radius, {radii[k]:g} m"
        return Recommendation(None, f"no radius can be recommended: {why}; use larger models, or more of them")
    order = sorted(first, key=lambda name: first[name])
    story = ", ".join(f"{name} from {radii[first[name]]:g} m" for name in order)
    text = f"the last to settle is {last}, at {radii[index]:g} m ({story})"
    if independent[index] < 3.0:
        text += (
            f"; its samples overlap and are worth {independent[index]:.1f} independent ones only, "
            "so the scatter is understated: add runs"
        )
    return Recommendation(float(radii[index]), text)
