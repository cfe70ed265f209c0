"""A pad of your own: its size, its layers, where its taxels are; a soft skin on a harder base."""

import mujoco

import mjtactile

pad = mjtactile.Pad(
    size=(10e-3, 12e-3),  # x, y [m]
    layers=(
        mjtactile.Layer(thickness=1e-3, young=0.8e6, poisson=0.48),  # skin on top [m, Pa]
        mjtactile.Layer(thickness=2e-3, young=3e6, poisson=0.48),
    ),
    taxels=mjtactile.TaxelGrid(rows=8, columns=6, pitch=(1.4e-3, 1.3e-3)),
    depths=(0.8e-3, 2e-3),  # below the surface [m]
)

model = mjtactile.press_scene(mjtactile.sphere(4e-3), pad=pad)
data = mujoco.MjData(model)
sensor = mjtactile.TactileSensor(model, pad, fidelity="fast")  # builds the tables: once, seconds
mjtactile.press(model, data, (0, 0, -0.08))

readings = sensor.read(data)
print(pad.summary)
print(f"readings: shape {readings.shape}")
print(f"highest reading by layer [kPa]: {' '.join(f'{layer.max() / 1e3:.1f}' for layer in readings)}")
print(f"how far it sank in: {sensor.load(data).indentation * 1e3:.3f} mm")

# The same pad on any model, without a file: the model holds its numbers.
spec = mujoco.MjSpec.from_string("<mujoco><worldbody><body name='finger'/></worldbody></mujoco>")
mjtactile.attach_pad(spec, body="finger", name="tip", pad=pad, fidelity="fast")
print(f"numbers in its sensor: {len(mujoco.MjData(spec.compile()).sensor('tip').data)}")
