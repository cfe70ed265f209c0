"""A dome as a pad: what its taxels read under a known pressure, in section."""

import matplotlib.pyplot as plt
import numpy as np
from shapely import Point

import mjtactile

pad = mjtactile.Pad(
    size=(12e-3, 12e-3),  # seen from above [m]
    surface=mjtactile.SphereCap(radius=12e-3),  # the top of a sphere, its apex in the pad frame's origin
    layers=(
        mjtactile.Layer(thickness=1e-3, young=1e6, poisson=0.49),  # along the inward normal [m, Pa]
        mjtactile.Layer(thickness=2e-3, young=3e6, poisson=0.49),
    ),
    taxels=mjtactile.TaxelGrid(rows=11, columns=11, pitch=(1e-3, 1e-3)),
    depths=(0.5e-3, 1e-3, 1.5e-3, 2e-3, 2.5e-3),
    sampling_radius=0.4e-3,
)
influence = mjtactile.influence_matrices(pad, "fast")  # built once, kept on disk

# 20 kPa against the surface, on a spot 3 mm wide, 3 mm off the apex: where the dome leans by 14 degrees.
spot = Point(3e-3, 0.0).buffer(1.5e-3)
load = mjtactile.SurfaceLoad.from_tractions(influence, spot, lambda points, normals: -20e3 * normals)
readings = influence.readings(load)  # von Mises stress [Pa], (depths, rows, columns)

force, _ = load.resultant()
print(pad.summary)
print(f"force of the pressure [N]: {force[0]:.4f} {force[1]:.4f} {force[2]:.4f}")
for depth, layer in zip(pad.depths, readings, strict=True):
    row, column = np.unravel_index(layer.argmax(), layer.shape)
    print(f"{depth * 1e3:.1f} mm deep: at most {layer.max() / 1e3:.2f} kPa at x = {pad.grid.x[column] * 1e3:.0f} mm")


def line(x, depth):
    """A line along x in the middle of the pad: x and z [mm]."""
    return pad.surface.positions(x, 0.0 * x, depth).T[[0, 2]] * 1e3


figure, axes = plt.subplots(figsize=(8, 4.2), layout="constrained")
across = np.linspace(-6e-3, 6e-3, 121)
x, z = np.stack([line(pad.grid.x, depth) for depth in pad.depths], axis=1)
shown = axes.pcolormesh(x, z, readings[:, 5] / 1e3, shading="gouraud", cmap="magma", vmin=0)
axes.plot(x.ravel(), z.ravel(), "o", color="white", markeredgecolor="0.35", markersize=4, label="taxels")
for depth, style, name in ((0.0, "-", "surface"), (1e-3, "--", "layers meet"), (3e-3, "-", "base, on the bone")):
    axes.plot(*line(across, depth), style, color="0.35", label=name)
axes.plot(*line(np.linspace(1.5e-3, 4.5e-3, 31), 0.0), color="tab:orange", linewidth=4, label="pressed")
for end in (-6e-3, 6e-3):
    axes.plot(*np.stack([line(np.array([end]), depth)[:, 0] for depth in (0.0, 3e-3)], axis=1), "-", color="0.35")
axes.set(aspect="equal", xlabel="x [mm]", ylabel="z [mm]", facecolor="0.92", title="a dome in section")
axes.legend(loc="lower center", ncols=5, fontsize="small")
axes.set_ylim(-5.4, 0.6)
figure.colorbar(shown, ax=axes, shrink=0.8).set_label("von Mises [kPa]")
figure.savefig("curved_pad.png", dpi=110)
