"""Files named by users: checked before long work begins, and written completely or not at all.

Only regular files are read and written, never devices or pipes. checksums.py notices what became of arrays in them.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from mjtactile._installed import require
from mjtactile.errors import MjTactileError, OutputError

if TYPE_CHECKING:
    from filelock import FileLock

#: Image formats in which figures can be written, as file name extensions.
FIGURE_KINDS = ("png", "pdf", "svg", "eps", "jpg", "jpeg", "tif", "tiff", "webp")
#: Suffix of a file's name while the file is being written.
PARTIAL = ".partial"

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
)


def path_from(value: object, name: str, error: type[MjTactileError]) -> Path:
    """An argument that must be a path.

    Raises:
        MjTactileError: `error`, if the argument is no path.
    """
    try:
        return Path(value)  # type: ignore[arg-type]
    except TypeError:
        raise error(f"{name} is of type {type(value).__name__}; expected a path, as text or a pathlib.Path.") from None


def make_folder(folder: Path) -> None:
    """Make a folder and those it lies in, where they do not exist.

    Raises:
        OutputError: it cannot be made, is not a folder, or its name is not a valid file name.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise OutputError(f"{folder} exists but is not a folder. Name another folder, or move that file.")
        folder.mkdir(parents=True, exist_ok=True)
    except OutputError:
        raise
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise OutputError(f"cannot make the folder {folder}: {why}. Name one in a folder you can write to.") from error


def read_text(path: Path) -> str:
    """The text of a regular file in UTF-8, without the byte order mark that some programs put at its beginning.

    Raises:
        OSError: there is no such file, it cannot be read, or it is not a regular file.
        ValueError: the content is not UTF-8 text, or the name is not a valid file name.
    """
    found = unusable(path)
    if found is not None:
        raise OSError(f"it is {found}, not a file")
    return path.read_text(encoding="utf-8-sig")


def why_unread(error: Exception) -> str:
    """Why a file could not be read, as words for an error message that names the file."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file"
    if isinstance(error, UnicodeDecodeError):
        return "it is not UTF-8 text"
    return (isinstance(error, OSError) and error.strerror) or str(error)


def unusable(path: Path) -> str | None:
    """The kind of a path that is not a regular file, such as "a folder"; None if it is one or does not exist.

    Raises:
        OSError: the path cannot be examined: too long, a loop of links, or a folder without search permission.
        ValueError: the name is not a valid file name.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISREG(mode):
        return None
    return next((name for is_kind, name in _KINDS if is_kind(mode)), "no regular file")


def is_there(path: Path) -> bool:
    """Whether a path leads to a file; False as well if that cannot be found out, as in a folder that is locked."""
    try:
        return path.is_file()
    except OSError:
        return False


def check_writable(path: Path | None) -> None:
    """Check before long work that a file can be written; None stands for no file.

    Raises:
        OutputError: its folder is missing or not writable, the name is not a valid file name, or the path exists and
            is write-protected or not a regular file.
    """
    if path is None:
        return
    try:
        target = _target(path)
        with tempfile.TemporaryFile(dir=target.parent):
            pass
    except (OSError, ValueError) as error:
        raise _refused(path, error) from error


def check_npz(path: Path | None) -> None:
    """Check before long work that arrays can be written to a file; None stands for no file.

    Raises:
        OutputError: the file name's extension is not .npz, or the file cannot be written.
    """
    check_writable(path)
    if path is not None and path.suffix.lower() != ".npz":
        raise OutputError(f"cannot write arrays to {path}: expected a name that ends in .npz, which numpy.load reads.")


def check_figure(path: Path | None) -> None:
    """Check before long work that a figure can be drawn to a file; None stands for no file.

    Raises:
        OutputError: the file name's extension is not one of `FIGURE_KINDS`, or the file cannot be written.
        MissingExtraError: matplotlib, which draws figures, is not installed.
    """
    if path is not None:
        figure_kind(path)
        require("figures")
        check_writable(path)


def check_apart(paths: Mapping[str, Path | None]) -> None:
    """Refuse two outputs, by their options, to the same file, since one would overwrite the other; None is no file.

    Raises:
        OutputError: two are the same.
    """
    seen: dict[str, str] = {}
    for option, path in paths.items():
        if path is None:
            continue
        try:
            real = os.path.realpath(path)
        except (OSError, ValueError) as error:
            raise _refused(path, error) from error
        if real in seen:
            raise OutputError(f"{seen[real]} and {option} are the same file, {path}. Give each a file of its own.")
        seen[real] = option


def figure_kind(path: Path) -> str:
    """The image format that a file name asks for by its extension; "png" without one.

    Raises:
        OutputError: the extension is not one of `FIGURE_KINDS`.
    """
    kind = path.suffix.removeprefix(".").lower() or "png"
    if kind not in FIGURE_KINDS:
        raise OutputError(f"cannot draw {path}: expected a name that ends in .{', .'.join(FIGURE_KINDS)}.")
    return kind


def save_figure(path: Path, figure: Any, dpi: int) -> None:
    """Write a matplotlib figure in the format of the file name's extension; the file appears complete or not at all.

    Raises:
        OutputError: the file name's extension is not one of `FIGURE_KINDS`, or the file cannot be written.
    """
    kind = figure_kind(path)
    write_atomically(path, lambda file: figure.savefig(file, format=kind, dpi=dpi))


def write_atomically(path: Path, write: Callable[[Any], None], *, prefix: str = ".") -> None:
    """Call `write` with an open binary file; the file appears at `path` complete or not at all.

    Links are followed. An existing file is replaced and keeps its permissions.

    Args:
        path: of the file.
        write: what writes the content.
        prefix: beginning of the temporary file's name. By default it does not contain the file's own name, which may
            already have the largest possible length.

    Raises:
        OutputError: when it cannot be written; the message says why.
    """
    try:
        target = _target(path)
    except (OSError, ValueError) as error:
        raise _refused(path, error) from error
    try:
        with replacing(target, prefix=prefix) as file:
            write(file)
    except OSError as error:
        raise _refused(path, error) from error


@contextmanager
def replacing(target: Path, prefix: str) -> Iterator[IO[bytes]]:
    """Yield a temporary binary file in the folder of `target`, named `prefix` and more.

    It replaces `target`, a regular file that need not exist, when the block ends, and is removed if the block fails.

    An existing file keeps its permissions.

    Raises:
        OSError: when it cannot be written.
    """
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o644
    with tempfile.NamedTemporaryFile(dir=target.parent, prefix=prefix, suffix=PARTIAL, delete=False) as file:
        partial = Path(file.name)
        try:
            yield file
            file.close()
            # Opened again: a caller may have written to the file by its name, through another handle.
            with partial.open("rb+") as whole:
                os.fsync(whole.fileno())
            partial.chmod(mode)
            partial.replace(target)
        finally:
            partial.unlink(missing_ok=True)


def lock_file(path: Path, busy: str, error: type[MjTactileError]) -> FileLock:
    """Lock a file of a dataset at once; `release()` unlocks it. Where the file system has no locks, it is not locked.

    Raises:
        MjTactileError: `error`: with the text `busy` if another process has locked the file, or if it cannot be used.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise error(busy) from None
    except NotImplementedError:  # a file system without locks
        pass
    except (OSError, ValueError) as failure:
        raise error(
            f"cannot lock {path}: {why_unread(failure)}. That file keeps other writers out while the dataset is made. "
            "Move or delete what is there, or name a folder where you can write."
        ) from failure
    return lock


def _target(path: Path) -> Path:
    """The file that a path leads to when symbolic links are followed.

    Raises:
        OSError: the path is not a regular file, or it is write-protected.
        ValueError: the name is not a valid file name.
    """
    found = unusable(path)
    if found == "a folder":
        raise OSError("it is a folder; give a file name")
    if found is not None:
        raise OSError(f"it is {found}; only regular files are written")
    target = Path(os.path.realpath(path))
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError("it is write-protected")
    return target


def _refused(path: Path, error: Exception) -> OutputError:
    why = error.strerror if isinstance(error, OSError) and error.strerror else error
    return OutputError(f"cannot write {path}: {why}. Choose a file in a folder you can write to.")
