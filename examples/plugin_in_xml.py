"""A pad written in XML is a sensor like any other: MuJoCo reads it in every step."""

from pathlib import Path

import mujoco

import mjtactile  # registers the plugin; from MuJoCo 4.0 on `import mujoco` is enough

model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name("finger.xml")))
data = mujoco.MjData(model)
mujoco.mj_step(model, data, 200)

numbers = data.sensor("touch").data  # what `output` names, in that order
readings, wrench = numbers[:676].reshape(4, 13, 13), numbers[676:]

print(f"sensor 'touch': {len(numbers)} numbers")
print(f"weight of the body: {0.05 * 9.81:.4f} N, force on the pad: {-wrench[2]:.4f} N")
print(f"highest reading by layer [kPa]: {' '.join(f'{layer.max() / 1e3:.2f}' for layer in readings)}")
print(f"column of the top layer that feels most: {readings[0].sum(axis=0).argmax()}, the middle one being 6")
print(f"contacts read so far: {mjtactile.plugin_health(model, data, 'touch').readings}")
