from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any, NoReturn

import pytest

from rosz.typestore import TypeStore

STORE = TypeStore()


def _refuse(*_: Any) -> NoReturn:
    raise SystemError("the generated code did not do it alone")


@pytest.fixture(scope="session")
def store() -> TypeStore:
    """Every shipped type, loaded."""
    for name in STORE.names("msg"):
        STORE.message(name)
    for name in STORE.names("srv"):
        STORE.service(name)
    return STORE


@pytest.fixture
def fast_only(store: TypeStore, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:  # noqa: ARG001
    """Let no shipped codec fall back on the plain one, which would hide its mistakes."""
    for name, module in list(sys.modules.items()):
        if name.startswith("rosz.msgs.") and hasattr(module, "_plain"):
            monkeypatch.setattr(module, "_plain", _refuse)
            monkeypatch.setattr(module, "_explain", _refuse)
    yield  # noqa: PT022  # with the patches in place
