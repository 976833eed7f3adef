"""The public API: names and signatures stay."""

from __future__ import annotations

import pytest

from .api import MODULES, signatures
from .golden import check, check_files


@pytest.mark.parametrize("module", MODULES)
def test_names_and_signatures(module: str) -> None:
    check(f"api/{module}.txt", signatures(module))


def test_every_file_is_of_a_module() -> None:
    check_files("api", [f"{module}.txt" for module in MODULES])
