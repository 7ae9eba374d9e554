"""Pictures of curves begin at zero strain, wherever the strain in the artifact was zeroed."""

import numpy as np
import xarray
from matplotlib.figure import Figure

from graben.stages.tools.show import calibration, curves


def test_pictures_count_strain_from_the_first_state():
    stress, strain = np.zeros((1, 3, 4)), np.zeros((1, 3, 4))
    stress[0, :, 1] = [0.0, -1e6, -2e6]
    strain[0, :, 1], strain[0, :, 0] = [-0.01, -0.02, -0.03], [-0.01, -0.008, -0.006]
    field = ("path", "step", "component")
    data = xarray.Dataset(
        {"path_name": ("path", ["a"]), "step_count": ("path", [3]), "stress": (field, stress),
         "strain": (field, strain), "confining_stress": ("path", [0.0])}
    )  # fmt: skip
    figure = Figure()
    curves.draw(data, figure)
    push, wide = figure.axes
    np.testing.assert_allclose(push.lines[0].get_xdata(), [0.0, 1.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(wide.lines[0].get_ydata(), [0.0, 0.2, 0.4], atol=1e-12)

    data = data.rename(path="curve", path_name="curve_name").assign(
        strain_measured=data["strain"].rename(path="curve"), stress_measured=data["stress"].rename(path="curve"),
        role=("curve", ["fit"]), stress_rmse=("curve", [0.0]),
        member_axial_stress=(("member", "curve", "step"), stress[None, :, :, 1]),
    )  # fmt: skip
    axes = Figure().subplots()
    calibration._curves(data, axes, lateral=True)
    for line in axes.lines:
        np.testing.assert_allclose(line.get_xdata(), [0.0, 1.0, 2.0], atol=1e-12)
        np.testing.assert_allclose(line.get_ydata(), [0.0, 0.2, 0.4], atol=1e-12)
