"""What is installed: this version, as pyproject.toml has it, its docs site, and what only some uses need."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

from mjtactile.errors import MissingExtraError

__version__ = "0.1.0"
#: Where the docs site stands, as pyproject.toml and mkdocs.yml have it.
DOCUMENTATION = "https://mjtactile.github.io/mjtactile/latest/"


@dataclass(frozen=True)
class Extra:
    """An extra of pyproject.toml.

    Attributes:
        modules: what it brings, as Python imports it.
        purpose: what these are needed for, as the subject of "need".
    """

    modules: tuple[str, ...]
    purpose: str

    @property
    def missing(self) -> list[str]:
        """Modules that are not installed."""
        return [name for name in self.modules if find_spec(name) is None]


#: Extras by name, as pyproject.toml has them; those that only gather others are left out.
EXTRAS = {
    "figures": Extra(("matplotlib", "PIL"), "figures and videos"),
    "dataset": Extra(("pyarrow",), "datasets of presses"),
    "torch": Extra(("torch",), "the pad as a PyTorch module, and training"),
    "envs": Extra(("gymnasium",), "environments"),
    "train": Extra(("stable_baselines3",), "policies"),
    "ray": Extra(("ray",), "workers on many machines"),
    "view": Extra(("viser", "mjviser"), "live views"),
}


def page_address(page: str) -> str:
    """Address of a page of the docs site.

    Args:
        page: its file in docs/, such as "contact.md".
    """
    return f"{DOCUMENTATION}{page.removesuffix('.md')}.html"


def require(name: str) -> None:
    """Make sure, before they are imported, that the packages of an extra are installed.

    Args:
        name: of the extra, a key of `EXTRAS`.

    Raises:
        MissingExtraError: one is not; the message says the line that installs them.
    """
    extra = EXTRAS[name]
    if extra.missing:
        raise MissingExtraError(
            f"{extra.purpose} need {' and '.join(extra.missing)}, not installed here. Install it: {install_line(name)}"
        )


def install_line(name: str) -> str:
    """The command that installs an extra."""
    return f'pip install "mjtactile[{name}]"'
