"""Hold the generated modules of actions to fingerprints made by other code."""

from importlib import import_module

import pytest

from .fingerprints import TYPES, type_hash

NAMES = [name for name in TYPES if "/action/" in name and not name.endswith("_Event")]


@pytest.mark.parametrize("name", NAMES)
def test_hash_of_each_type(name: str) -> None:
    package, _, base = name.split("/")
    module = import_module(f"rosz.msgs.{package}.action")
    assert getattr(module, base)._type_hash == f"RIHS01_{type_hash(name)}"
