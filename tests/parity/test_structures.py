"""Structures that Python hands to the core have the fields of its headers: their names, order and types."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import pytest

from mjtactile._native import library
from mjtactile.contact.laws import BY_NAME
from mjtactile.contact.press import Told
from mjtactile.contact.tangentials import TANGENTIALS
from mjtactile.plugin.engine import Instance
from mjtactile.plugin.health import Note

NATIVE = Path(__file__).parents[2] / "native"
CONSTANTS = {"MJT_MOST_OUTPUTS": Instance.outputs.size // ctypes.sizeof(ctypes.c_int)}
TYPES = {"double": ctypes.c_double, "int": ctypes.c_int, "int32_t": ctypes.c_int32, "int64_t": ctypes.c_int64}


def declared(header: str, name: str) -> list[tuple[str, object]]:
    """Fields of a C structure, as ctypes has them."""
    text = re.sub(r"/\*.*?\*/", "", (NATIVE / header).read_text(), flags=re.DOTALL)
    found = re.search(rf"struct {name} \{{(.*?)\}}", text, flags=re.DOTALL)
    assert found is not None, f"{header} has no struct {name}"
    fields: list[tuple[str, object]] = []
    for line in filter(None, map(str.strip, found[1].split(";"))):
        if "*" in line:
            fields.append((line.rsplit("*", 1)[1].strip(), ctypes.c_void_p))
            continue
        kind, names = line.split(maxsplit=1)
        for one in names.split(","):
            plain, _, length = one.strip().rstrip("]").partition("[")
            own = ctypes.c_char if kind == "char" else TYPES[kind]
            count = CONSTANTS.get(length) or int(length or 0)
            fields.append((plain, own * count if length else own))
    return fields


@pytest.mark.parametrize(
    ("structure", "header", "name"),
    [
        (Told, "api/api.h", "mjt_pressed"),
        (Instance, "plugin/plugin.h", "mjt_instance"),
        (Note, "plugin/plugin.h", "mjt_note"),
    ],
)
def test_fields_are_those_of_the_header(structure, header, name):
    assert [tuple(field) for field in structure._fields_] == declared(header, name)


def test_the_core_knows_every_law_and_every_way_of_shear_by_its_name():
    assert all(library().mjt_knows(law.encode(), way.encode()) for law in BY_NAME for way in TANGENTIALS)
    assert not library().mjt_knows(b"rubber", b"stick")
    assert not library().mjt_knows(b"elastic", b"glue")
