"""The public API: names and signatures stay; wordings of docstrings change on purpose only."""

from __future__ import annotations

import pytest

from .api import MODULES, docs, signatures
from .golden import check, check_files


@pytest.mark.parametrize("module", MODULES)
def test_names_and_signatures(module: str) -> None:
    check(f"api/{module}.txt", signatures(module))


@pytest.mark.parametrize("module", MODULES)
def test_first_lines_of_docstrings(module: str) -> None:
    check(f"docs/{module}.txt", docs(module))


@pytest.mark.parametrize("folder", ["api", "docs"])
def test_every_file_is_of_a_module(folder: str) -> None:
    check_files(folder, [f"{module}.txt" for module in MODULES])
