"""The installed version, the address of the docs site, and the optional extras of pyproject.toml."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

from mjtactile.errors import MissingExtraError

__version__ = "0.1.0"
#: Address of the docs site; the same as in pyproject.toml and mkdocs.yml.
DOCUMENTATION = "https://mjtactile.github.io/mjtactile/latest/"


@dataclass(frozen=True)
class Extra:
    """An extra of pyproject.toml."""

    modules: tuple[str, ...]  #: names of the Python modules it installs
    purpose: str  #: what needs these modules, as the subject of "need" in an error message

    @property
    def missing(self) -> list[str]:
        """Modules that are not installed."""
        return [name for name in self.modules if not _is_installed(name)]


def _is_installed(name: str) -> bool:
    """Whether there is a package of that name; a mere folder, which Python also imports, does not count."""
    spec = find_spec(name)
    return spec is not None and spec.origin is not None


#: Extras of pyproject.toml by name, without those that only combine others.
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
    """Address of a page of the docs site, by the page's file in docs/, such as "contact.md"."""
    return f"{DOCUMENTATION}{page.removesuffix('.md')}.html"


def require(name: str) -> None:
    """Check that the packages of an extra, a key of `EXTRAS`, are installed; call it before importing them.

    Raises:
        MissingExtraError: a package is missing; the message gives the command that installs the extra.
    """
    extra = EXTRAS[name]
    if extra.missing:
        raise MissingExtraError(
            f"{extra.purpose} need {' and '.join(extra.missing)}, not installed here. Install it: {install_line(name)}"
        )


def install_line(name: str) -> str:
    """The command that installs an extra."""
    return f'pip install "mjtactile[{name}]"'
