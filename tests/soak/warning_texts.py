"""Texts of warnings, as far as they say the same."""

from __future__ import annotations

import re

_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")


def without_numbers(text: str) -> str:
    """A warning without its numbers; names, in quotes, stay."""
    parts = text.split("'")
    return "'".join(part if k % 2 else _NUMBER.sub("#", part) for k, part in enumerate(parts))
