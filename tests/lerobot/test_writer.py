from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from written_sets import info, needs_lerobot, read, read_with_lerobot

from mjtactile.errors import DatasetError, PadError
from mjtactile.lerobot.features import Feature, tactile_columns, tactile_features, vector
from mjtactile.lerobot.statistics import column_statistics, joined
from mjtactile.lerobot.writer import LeRobotWriter
from mjtactile.pad import Pad

EPISODES, PER_FRAME = 50, 4


def episode(number: int, flat: bool) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(number)
    frames = int(rng.integers(1, 9))
    readings = rng.exponential(5e3, (frames, PER_FRAME, *Pad().reading_shape))
    own = {"action": rng.normal(size=(frames, 2)), "next.done": np.arange(frames) == frames - 1}
    return own | tactile_columns("thumb", readings, flat=flat)


def write(folder: Path, flat: bool = False) -> list[dict[str, np.ndarray]]:
    features = {"action": vector(["grip", "lift"], "N"), "next.done": Feature(dtype="bool")}
    features |= tactile_features("thumb", Pad(), rate=100.0, per_frame=PER_FRAME, flat=flat)
    episodes = [episode(number, flat) for number in range(EPISODES)]
    with LeRobotWriter(folder, fps=25, features=features, robot="hand") as writer:
        for number, columns in enumerate(episodes):
            writer.add_episode(columns, f"task {number % 3}")
    return episodes


@pytest.mark.parametrize("flat", [False, True])
def test_what_was_written_is_read_back(tmp_path: Path, flat: bool):
    episodes = write(tmp_path / "set", flat)
    found = read(tmp_path / "set")
    for name in episodes[0]:
        written = np.concatenate([columns[name] for columns in episodes])
        assert np.array_equal(found[name], written.astype(found[name].dtype)), name
    lengths = [len(columns["action"]) for columns in episodes]
    assert np.array_equal(found["episode_index"], np.repeat(np.arange(EPISODES), lengths))
    assert np.array_equal(found["index"], np.arange(sum(lengths)))
    assert np.allclose(found["timestamp"], found["frame_index"] / 25)


@needs_lerobot
@pytest.mark.slow
def test_lerobot_reads_back_what_was_written(tmp_path: Path):
    """As vectors; presses are read back as arrays (test_recordings.py)."""
    episodes = write(tmp_path / "set", flat=True)
    found = read_with_lerobot(tmp_path / "set", tmp_path / "found.npz")
    for name in episodes[0]:
        written = np.concatenate([columns[name] for columns in episodes])
        assert np.array_equal(found[name], written.astype(found[name].dtype)), name
        assert np.allclose(found[f"mean/{name}"].ravel(), written.mean(axis=0).ravel())
    lengths = np.cumsum([0, *(len(columns["action"]) for columns in episodes)])
    assert np.array_equal(found["ends"], np.column_stack([lengths[:-1], lengths[1:]]))
    assert (found["fps"], found["episodes"], found["frames"]) == (25, EPISODES, lengths[-1])
    assert found["task"][lengths[4]] == "task 1"
    assert found["unit/observation.tactile.thumb"] == "Pa"


def test_the_metadata_says_units_and_where_taxels_are(tmp_path: Path):
    write(tmp_path / "set", flat=True)
    feature = info(tmp_path / "set")["features"]["observation.tactile.thumb"]
    pad = Pad()
    assert feature["dtype"] == "float32"
    assert feature["shape"] == [np.prod(pad.reading_shape)]
    assert feature["info"]["unit"] == "Pa"
    assert feature["info"]["reading_shape"] == list(pad.reading_shape)
    assert feature["info"]["taxel_x"] == list(pad.grid.x)
    assert feature["info"]["taxel_depth"] == list(pad.depths)
    assert feature["info"]["rate"] == 100.0


def test_the_frame_s_reading_is_the_last_of_those_since_the_frame_before(tmp_path: Path):
    write(tmp_path / "set")
    found = read(tmp_path / "set")
    between = found["observation.tactile_between.thumb"]
    assert between.shape[1:] == (PER_FRAME, *Pad().reading_shape)
    assert np.array_equal(between[:, -1], found["observation.tactile.thumb"])


def test_large_datasets_are_cut_into_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("mjtactile.lerobot.writer._FILE_SIZE", 0.2)
    episodes = write(tmp_path / "set")
    assert len(list((tmp_path / "set" / "data").glob("*/*.parquet"))) > 3
    written = np.concatenate([columns["action"] for columns in episodes]).astype(np.float32)
    assert np.array_equal(read(tmp_path / "set")["action"], written)


def test_statistics_of_parts_are_those_of_the_whole():
    values = np.random.default_rng(0).normal(size=(60, 3))
    whole = column_statistics(values)
    parts = joined(column_statistics(values[:20]), column_statistics(values[20:]))
    for name in ("min", "max", "mean", "std", "count"):
        assert np.allclose(parts[name], whole[name]), name


def test_nothing_is_left_of_a_dataset_that_failed(tmp_path: Path):
    writer = LeRobotWriter(tmp_path / "set", fps=10, features={"action": Feature()})
    writer.__enter__()
    writer.add_episode({"action": np.zeros(3)}, "push")
    with pytest.raises(DatasetError, match="shape") as caught:
        writer.add_episode({"action": np.zeros((3, 2))}, "push")
    writer.__exit__(caught.type, caught.value, None)
    assert list(tmp_path.iterdir()) == []


def test_only_what_a_killed_run_left_is_deleted(tmp_path: Path):
    partial = tmp_path / "set.partial"
    (partial / "data").mkdir(parents=True)
    write(tmp_path / "set")
    assert not partial.exists()
    (partial / "data").mkdir(parents=True)
    (partial / "notes.txt").write_text("mine")
    (tmp_path / "set").rename(tmp_path / "done")
    with pytest.raises(DatasetError, match="Move or delete it"):
        write(tmp_path / "set")
    assert (partial / "notes.txt").read_text() == "mine"


def test_a_second_writer_of_a_dataset_is_refused_and_the_first_one_goes_on(tmp_path: Path):
    first, second = (LeRobotWriter(tmp_path / "set", fps=1, features={"a": Feature()}) for _ in range(2))
    with first:
        first.add_episode({"a": np.zeros(1)}, "push")
        with pytest.raises(DatasetError, match=r"another writer is making .*set"), second:
            pass
        first.add_episode({"a": np.ones(2)}, "push")
    assert read(tmp_path / "set")["a"].tolist() == [0.0, 1.0, 1.0]
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_second_writer_is_refused_until_the_first_one_s_folders_are_in_place(tmp_path: Path, monkeypatch):
    first, second = (LeRobotWriter(tmp_path / "set", fps=1, features={"a": Feature()}) for _ in range(2))
    refused = []

    def meanwhile(change):
        def changed(*args, **kwargs):
            with pytest.raises(DatasetError, match="another writer is making"), second:
                pass
            refused.append(change.__name__)
            return change(*args, **kwargs)

        return changed

    (tmp_path / "set.partial" / "data").mkdir(parents=True)  # left by a killed run
    monkeypatch.setattr(Path, "rename", meanwhile(Path.rename))
    monkeypatch.setattr("shutil.rmtree", meanwhile(shutil.rmtree))
    with first:
        first.add_episode({"a": np.ones(2)}, "push")
    assert refused == ["rmtree", "rename", "rmtree"]
    assert read(tmp_path / "set")["a"].tolist() == [1.0, 1.0]
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_lock_that_cannot_be_used_is_refused(tmp_path: Path):
    lock = tmp_path / "set.partial.lock"
    lock.mkdir()
    with pytest.raises(DatasetError, match=r"cannot lock .*set\.partial\.lock: .*Move or delete"):
        write(tmp_path / "set")
    assert list(tmp_path.iterdir()) == [lock]


def test_a_left_folder_that_cannot_be_listed_is_refused(tmp_path: Path, monkeypatch):
    (tmp_path / "set.partial").mkdir()

    def denied(_):
        raise PermissionError

    with monkeypatch.context() as patch:
        patch.setattr(Path, "iterdir", denied)
        with pytest.raises(DatasetError, match="Move or delete it"):
            write(tmp_path / "set")
    assert [path.name for path in tmp_path.iterdir()] == ["set.partial"]


def test_a_dataset_whose_folder_appeared_meanwhile_gets_another_name(tmp_path: Path):
    writer = LeRobotWriter(tmp_path / "set", fps=1, features={"a": Feature()})
    writer.__enter__()
    writer.add_episode({"a": np.ones(2)}, "push")
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "notes.txt").write_text("mine")
    with pytest.raises(DatasetError, match=r"set did not exist .*The dataset is .*set-1 instead"):
        writer.__exit__(None, None, None)
    assert (tmp_path / "set" / "notes.txt").read_text() == "mine"
    assert read(tmp_path / "set-1")["a"].tolist() == [1.0, 1.0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["set", "set-1"]


def test_what_cannot_be_written_is_refused(tmp_path: Path):
    (tmp_path / "there").mkdir()
    with pytest.raises(DatasetError, match="exists already"):
        LeRobotWriter(tmp_path / "there", fps=10, features={})
    with pytest.raises(DatasetError, match="whole numbers"):
        LeRobotWriter(tmp_path / "set", fps=0, features={})
    with pytest.raises(DatasetError, match="called 'index'"):
        LeRobotWriter(tmp_path / "set", fps=1, features={"index": Feature()})
    with pytest.raises(DatasetError, match="float64"):
        Feature(dtype="float64")
    with pytest.raises(DatasetError, match="axes"):
        Feature(shape=(1,) * 6)
    with LeRobotWriter(str(tmp_path / "set"), fps=1, features={"action": Feature()}) as writer:
        with pytest.raises(DatasetError, match=r"columns"):
            writer.add_episode({"force": np.zeros(3)}, "push")
        writer.add_episode({"action": np.zeros(1)}, "push")


@pytest.mark.parametrize(
    ("dtype", "values"),
    [
        ("int64", [1.0, np.nan]),
        ("int64", [1.7]),
        ("int64", [2.0**63]),
        ("int64", np.array([2**63], np.uint64)),
        ("bool", [0, 2]),
        ("bool", [np.nan]),
        ("float32", [1e39]),
    ],
)
def test_values_that_a_type_cannot_hold_are_refused(tmp_path: Path, dtype: str, values: list[float]):
    with LeRobotWriter(tmp_path / "set", fps=1, features={"a": Feature(dtype=dtype)}) as writer:
        with pytest.raises(DatasetError, match=f"'a' has a value of .*{dtype} cannot hold"):
            writer.add_episode({"a": np.array(values)}, "push")
        writer.add_episode({"a": np.zeros(1)}, "push")


def test_values_that_a_type_holds_are_written(tmp_path: Path):
    features = {"whole": Feature(dtype="int64"), "flag": Feature(dtype="bool"), "real": Feature()}
    with LeRobotWriter(tmp_path / "set", fps=1.0, features=features) as writer:  # type: ignore[arg-type]
        columns = {"whole": [-3.0, 2.0**53], "flag": [0.0, 1.0], "real": [0.1, 3e38]}
        writer.add_episode(columns, "push")  # type: ignore[arg-type]
    found = read(tmp_path / "set")
    assert found["whole"].tolist() == [-3, 2**53]
    assert found["flag"].tolist() == [False, True]
    assert found["real"].tolist() == [np.float32(0.1), np.float32(3e38)]


@pytest.mark.parametrize("values", [1.0, np.float64(1.0), None, "x", [[1.0], [1.0, 2.0]], ["a"], [1j]])
def test_a_column_that_is_no_array_of_numbers_is_refused(tmp_path: Path, values):
    with LeRobotWriter(tmp_path / "set", fps=1, features={"a": Feature()}) as writer:
        with pytest.raises(DatasetError, match=r"column 'a' is .*expected an array of numbers"):
            writer.add_episode({"a": values}, "push")
        with pytest.raises(DatasetError, match=r"columns is of type list"):
            writer.add_episode([np.zeros(1)], "push")  # type: ignore[arg-type]
        writer.add_episode({"a": np.zeros(1)}, "push")


@pytest.mark.parametrize("fps", [np.nan, np.inf, "x", None, 0.5])
def test_rates_that_are_no_whole_number_are_refused(tmp_path: Path, fps):
    with pytest.raises(DatasetError, match="whole numbers"):
        LeRobotWriter(tmp_path / "set", fps=fps, features={})


@pytest.mark.parametrize("folder", [None, 3, b"set"])
def test_a_folder_that_is_no_path_is_refused(folder):
    with pytest.raises(DatasetError, match=r"folder is of type .*expected a path"):
        LeRobotWriter(folder, fps=1, features={})


def test_nothing_is_written_outside_the_writer_s_block(tmp_path: Path):
    writer = LeRobotWriter(tmp_path / "set", fps=1, features={"a": Feature()})
    with pytest.raises(DatasetError, match="not open"):
        writer.add_episode({"a": np.zeros(1)}, "push")
    assert list(tmp_path.iterdir()) == []


def test_features_of_what_is_no_pad_are_refused():
    with pytest.raises(PadError, match=r"pad is of type str; expected a mjtactile\.Pad"):
        tactile_features("left", "dome.toml")  # type: ignore[arg-type]
