"""Names of the public modules have types that every checker agrees on."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

PUBLIC = {
    *("errors", "graph", "idl", "launch.plan", "lifecycle", "message", "names", "node", "packages"),
    *("params", "qos", "reconfigure", "remap", "time", "transforms", "typestore", "worker"),
}


def is_public(name: str) -> bool:
    """Return whether a name belongs to a public module, or to ``rosz`` itself."""
    _, _, rest = name.partition(".")
    inside = any(rest == module or rest.startswith(f"{module}.") for module in PUBLIC)
    return inside or "." not in rest


def test_public_names_are_fully_typed() -> None:
    pytest.importorskip("basedpyright", reason="needs basedpyright, of the extra 'test'")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "basedpyright"),
            *("--verifytypes", "rosz", "--ignoreexternal", "--outputjson"),
        ],
        cwd=Path(__file__).parents[2],
        env={**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout, done.stderr
    symbols: list[dict[str, Any]] = json.loads(done.stdout)["typeCompleteness"]["symbols"]
    public = [found for found in symbols if found["isExported"] and is_public(found["name"])]
    assert len(public) > 500
    untyped = [
        f"{found['name']}: {problem['message']}"
        for found in public
        if found["isTypeAmbiguous"] or not found["isTypeKnown"]
        for problem in found["diagnostics"]
    ]
    assert not untyped, "\n".join(untyped)
