"""Large datasets of presses: specified in TOML, sampled from seeds, simulated, and stored in parts."""

from mjtactile.dataset.files import Dataset, make_dataset, read_dataset
from mjtactile.dataset.spec import ContactSpec, DatasetSpec, load_spec
from mjtactile.errors import DatasetError, DatasetWarning

__all__ = [
    "ContactSpec",
    "Dataset",
    "DatasetError",
    "DatasetSpec",
    "DatasetWarning",
    "load_spec",
    "make_dataset",
    "read_dataset",
]
