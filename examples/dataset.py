"""Make random presses, keep them as Parquet, and learn the force from readings by least squares."""

from pathlib import Path

import numpy as np

from mjtactile.dataset import load_spec, make_dataset, read_dataset

spec = load_spec(Path(__file__).with_name("presses.toml"))
folder = Path("presses")
make_dataset(spec, folder, progress=False)  # called again, it goes on where it was interrupted

presses = read_dataset(folder)
print(f"Parquet files: {len(list(folder.glob('*.parquet')))}, readings: {presses.readings.shape}")
print(f"other columns: {', '.join(list(presses.labels)[:7])}, ...")

# Readings grow with the force. Summed over each layer they hardly depend on place and shape.
sums = presses.readings.sum(axis=(2, 3)) / 1e6
force = np.linalg.norm(presses.forces, axis=1)  # [N]
learn, test = slice(0, 500), slice(500, None)
weights, *_ = np.linalg.lstsq(sums[learn], force[learn])
error = np.abs(sums[test] @ weights - force[test]) / force[test]
print(f"force from four sums, on presses not learnt from: {np.median(error):.1%} off (median)")
