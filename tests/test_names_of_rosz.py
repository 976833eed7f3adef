"""The names of the package ``rosz``."""

from __future__ import annotations

import rlcompleter
import subprocess
import sys

import rosz


def test_the_interpreter_completes_all_public_names() -> None:
    completer = rlcompleter.Completer({"rosz": rosz})
    found = {
        (completer.complete("rosz.", number) or "").removeprefix("rosz.").rstrip("(")
        for number in range(len(dir(rosz)))
    }
    assert set(rosz.__all__) <= found
    assert not {"TYPE_CHECKING", "annotations"} & found


def test_listing_names_loads_nothing() -> None:
    code = "import sys, rosz; dir(rosz); print([n for n in sys.modules if n.startswith('rosz')])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=40, check=True
    )
    assert done.stdout == "['rosz']\n"
