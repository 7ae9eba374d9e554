"""Scalars of curves, and the statistics that recommend a radius."""

import numpy as np
import pytest
from scipy import stats

from graben.mechanics.averaging.measures import MEASURES, curve_measures
from graben.mechanics.averaging.representative import (
    Criteria,
    bootstrap_interval,
    convergence,
    independent_samples,
    recommend,
)


def curve(shortening, push, lateral):
    stress, strain = np.zeros((len(push), 4)), np.zeros((len(push), 4))
    stress[:, 1], strain[:, 1], strain[:, 0] = -np.asarray(push), -np.asarray(shortening), lateral
    return stress, strain


def test_measures_of_a_curve_made_of_two_lines():
    """2 GPa up to 8 MPa above the start, then half as stiff up to a peak of 10 MPa above it."""
    short = np.array([0.0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007]) + 1e-4
    push = 1e6 + 1e6 * np.array([0.0, 2.0, 4.0, 6.0, 8.0, 9.0, 10.0, 5.0])
    lateral = 0.3 * np.minimum(short, 0.0021) + 0.8 * np.maximum(short - 0.0021, 0.0)
    stress, strain = curve(short, push, lateral)
    found = dict(zip(MEASURES, curve_measures(stress, strain, 0.25)))
    assert found["secant_modulus"] == pytest.approx(2e9)
    assert found["poisson_ratio"] == pytest.approx(0.3)
    assert found["peak_stress"] == pytest.approx(11e6)
    assert found["strain_at_peak"] == pytest.approx(0.006)
    found = dict(zip(MEASURES, curve_measures(stress, strain, 0.4)))
    extent = 0.006 - 0.002
    spread = 0.8 * extent
    assert found["dilation"] == pytest.approx(np.arcsin((spread - extent) / (spread + extent)), rel=1e-12)


def test_measures_of_a_curve_without_a_rise():
    stress, strain = curve([0.0, 0.01, 0.02], [5e6, 4e6, 3e6], [0.0, 0.0, 0.0])
    found = dict(zip(MEASURES, curve_measures(stress, strain)))
    assert found["peak_stress"] == 5e6 and np.isnan(found["secant_modulus"])
    with pytest.raises(ValueError, match="level"):
        curve_measures(stress, strain, 1.0)


def test_bootstrap_interval_covers_the_mean_as_often_as_it_says():
    rng = np.random.Generator(np.random.PCG64(5))
    hits = 0
    for k in range(200):
        low, high = bootstrap_interval(rng.normal(3.0, 1.0, (1, 25, 1)), 0.9, 400, k)
        hits += low[0] <= 3.0 <= high[0]
    # The percentile bootstrap covers a little less than it says for 25 samples; 3 sigma of 200 draws is 0.064.
    assert 0.9 - 0.03 - 0.064 < hits / 200 < 0.97


def test_bootstrap_draws_whole_runs():
    """Samples of one run that agree fully are worth one: the interval is that of the runs."""
    runs = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    many = np.broadcast_to(runs, (1, 50, 6))
    one = bootstrap_interval(runs.reshape(1, 1, 6), 0.95, 2000, 3)
    assert np.allclose(bootstrap_interval(many, 0.95, 2000, 3), one)
    assert one[1][0] - one[0][0] > 1.5


def test_statistics_agree_with_textbook_formulas():
    rng = np.random.Generator(np.random.PCG64(2))
    values = rng.normal(10.0, 0.4, (2, 12, 1))
    criteria = Criteria(tolerance=0.05, variation=0.1)
    c = convergence(values, criteria, 0)
    d = (values[0] - values[1]).ravel()
    margin = 0.05 * values[1].mean()
    below = stats.ttest_1samp(d, margin, alternative="less").pvalue
    above = stats.ttest_1samp(d, -margin, alternative="greater").pvalue
    assert c.mean_p[0] == pytest.approx(max(below, above))
    s = values[0].std(ddof=1)
    assert c.variance_p[0] == pytest.approx(stats.chi2.cdf(11 * s**2 / (0.1 * values[0].mean()) ** 2, 11))
    assert c.mean_p[1] == 0.0


def test_the_radius_where_scatter_dies_is_recommended():
    """Scatter 0.4 / r, bias 0.5 exp(-2 r): both small enough from about 3 m on."""
    radii = np.arange(1.0, 7.0)
    rng = np.random.Generator(np.random.PCG64(7))
    values = 10.0 * (
        1.0 + 0.5 * np.exp(-2.0 * radii)[:, None, None] + rng.normal(0.0, 0.12, (6, 40, 1)) / radii[:, None, None]
    )
    c = {"peak_stress": convergence(values, Criteria(), 0)}
    advice = recommend(radii, c, np.full(6, 40.0))
    assert advice.radius in (2.0, 3.0)
    assert "peak_stress" in advice.reason and "add runs" not in advice.reason
    assert not c["peak_stress"].settled[0] and c["peak_stress"].settled[-1]


def test_few_or_scattered_samples_recommend_nothing():
    radii = np.array([1.0, 2.0, 3.0])
    rng = np.random.Generator(np.random.PCG64(7))
    scattered = convergence(rng.normal(1.0, 0.5, (3, 9, 1)), Criteria(), 0)
    advice = recommend(radii, {"x": scattered}, np.full(3, 9.0))
    assert advice.radius is None and "scatter" in advice.reason
    single = convergence(np.ones((3, 1, 1)), Criteria(), 0)
    assert recommend(radii, {"x": single}, np.ones(3)).radius is None
    drifting = convergence(np.array([3.0, 2.0, 1.0])[:, None, None] + rng.normal(0, 1e-3, (3, 9, 1)), Criteria(), 0)
    advice = recommend(radii, {"x": drifting}, np.full(3, 9.0))
    assert advice.radius is None and "still changes" in advice.reason


def test_samples_without_a_value_are_left_out():
    values = np.full((2, 4, 1), 2.0)
    values[0, 1] = np.nan
    c = convergence(values, Criteria(), 0)
    assert c.count.tolist() == [3, 4] and c.mean.tolist() == [2.0, 2.0] and c.low.tolist() == [2.0, 2.0]
    with pytest.raises(ValueError, match="no sample"):
        convergence(np.full((2, 4, 1), np.nan), Criteria(), 0)


def test_independent_samples():
    apart = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    assert np.allclose(independent_samples(apart, np.array([1.0]), 2), [6.0], rtol=0.03)
    together = np.zeros((5, 2))
    assert np.allclose(independent_samples(together, np.array([1.0, 2.0]), 3), [3.0, 3.0], rtol=0.02)


def test_overlapping_samples_of_few_runs_count_as_what_they_are_worth():
    """Nine samples of a run that differ little are no evidence of small scatter; the deviation has no bias."""
    rng = np.random.Generator(np.random.PCG64(8))
    between, within, runs, places = 1.0, 0.5, 4, 9
    variances = []
    for _ in range(1000):
        values = 10.0 + rng.normal(0, between, (1, 1, runs)) + rng.normal(0, within, (1, places, runs))
        variances.append(convergence(values, Criteria(resamples=100), 0).deviation[0] ** 2)
    assert np.mean(variances) == pytest.approx(between**2 + within**2, rel=0.08)
    # 27 samples would show a small scatter; the three that they are worth do not.
    same = 10.0 + np.tile(rng.normal(0, 0.3, (2, 1, 3)), (1, 9, 1))
    many = convergence(same, Criteria(variation=0.05), 0)
    few = convergence(same, Criteria(variation=0.05), 0, np.full(2, 3.0))
    assert many.variance_p[0] < few.variance_p[0]
    assert few.variance_p[0] == pytest.approx(stats.chi2.cdf(2 * (few.deviation[0] / (0.05 * few.mean[0])) ** 2, 2))
