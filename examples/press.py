"""Press a star into a pad with 100 gram-force and look at what it feels at four depths."""

import matplotlib.pyplot as plt
import mujoco

import mjtactile

model = mjtactile.press_scene("star", shift=(1.25e-3, 0.0), rotate_deg=20)  # metres, degrees
data = mujoco.MjData(model)
sensor = mjtactile.TactileSensor(model)

force = mjtactile.force_vector(0.98, tilt_deg=15)  # newtons, pad frame: pressing is -z
mjtactile.press(model, data, force)  # steps until the pad feels just that force

readings = sensor.read(data)  # von Mises stress [Pa], shape (layers, rows, columns)
wrench = sensor.wrench(data)  # MuJoCo's contact force [N] and moment [N m], pad frame

print(f"readings: shape {readings.shape}")
print(f"commanded force [N]: {force[0]:.4f} {force[1]:.4f} {force[2]:.4f}")
print(f"contact force   [N]: {wrench[0]:.4f} {wrench[1]:.4f} {wrench[2]:.4f}")
for depth, layer in zip(sensor.pad.depths, readings, strict=True):
    print(f"{depth * 1e3:.0f} mm deep: at most {layer.max() / 1e3:.2f} kPa, {(layer > 1e3).sum()} taxels over 1 kPa")

figure, axes = plt.subplots(1, 4, figsize=(11, 3), layout="constrained")
for depth, layer, panel in zip(sensor.pad.depths, readings, axes, strict=True):
    image = panel.imshow(layer / 1e3, origin="lower", cmap="magma", vmin=0)
    panel.set_axis_off()
    panel.set_title(f"{depth * 1e3:.0f} mm deep [kPa]")
    figure.colorbar(image, ax=panel, shrink=0.7)
figure.savefig("press.png", dpi=90)
