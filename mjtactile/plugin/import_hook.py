"""Something done once another package has been imported, whichever of the two comes first."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import sys
from collections.abc import Callable, Sequence
from types import ModuleType


def after_import(package: str, action: Callable[[], None]) -> None:
    """Do it now if the package is imported already, otherwise right after it will be; asked twice, done once."""
    if package in sys.modules:
        action()
    elif not any(isinstance(finder, _After) and finder.package == package for finder in sys.meta_path):
        sys.meta_path.insert(0, _After(package, action))


class _After(importlib.abc.MetaPathFinder):
    """Finds one package, once, and has something done when it is there."""

    def __init__(self, package: str, action: Callable[[], None]) -> None:
        self.package, self._action = package, action

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self.package:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            execute, action = spec.loader.exec_module, self._action

            def exec_module(module: ModuleType) -> None:
                execute(module)
                action()

            spec.loader.exec_module = exec_module
        return spec
