"""The cache of generated sources."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosz.idl.cache import SourceCache


def test_a_source_of_the_same_size_and_second_is_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.dont_write_bytecode", False)

    def load(stem: str, member: str) -> tuple[object, int]:
        module = SourceCache(tmp_path).load("made", stem, {}, [member], lambda: f"{member} = 1\n")
        return getattr(module, member), int((tmp_path / f"{stem}.py").stat().st_mtime)

    for attempt in range(100):
        stem = f"source_{attempt}"
        (first, at_first), (second, at_second) = load(stem, "A"), load(stem, "B")
        assert (first, second) == (1, 1)
        if at_first == at_second:
            return
    pytest.fail("no two sources were written in one second")
