"""What the properties of the store are tried with."""

from __future__ import annotations

import datetime as dt
from typing import Any

from hypothesis import strategies as st

from rosz.params.paths import Path
from rosz.params.writes import DELETED, Write, put

# Few names, so that writes meet; odd ones among them.
PARTS = st.sampled_from(["a", "b", "a b", "*", "ü?#$@%/"[:-1]])
PATHS: st.SearchStrategy[Path] = st.lists(PARTS, min_size=0, max_size=4).map(tuple)
BELOW_ROOT = PATHS.filter(bool)

MOMENTS = st.datetimes(
    min_value=dt.datetime(1970, 1, 1),  # noqa: DTZ001  # with and without a zone
    max_value=dt.datetime(2100, 1, 1),  # noqa: DTZ001
    timezones=st.sampled_from([None, dt.UTC, dt.timezone(dt.timedelta(hours=5, minutes=30))]),
).map(lambda moment: moment.replace(fold=0))
SCALARS = st.one_of(
    st.booleans(),
    st.integers(-(1 << 63), (1 << 63) - 1),
    st.floats(allow_nan=False),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=8),
    st.binary(max_size=8),
    MOMENTS,
    st.dates(),
)
VALUES: st.SearchStrategy[Any] = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(PARTS, inner, max_size=3)),
    max_leaves=6,
)
DICTS = st.dictionaries(PARTS, VALUES, max_size=3)


@st.composite
def writes(draw: st.DrawFn, max_size: int = 12) -> list[Write]:
    """Draw writes by a few clocks, with stamps that no two share."""
    stamps = draw(
        st.lists(
            st.tuples(st.integers(1, 20), st.sampled_from(["a1", "b2", "c3"])),
            max_size=max_size,
            unique=True,
        )
    )
    found = []
    for stamp in stamps:
        path = draw(PATHS)
        value = draw(st.one_of(st.just(DELETED), VALUES if path else DICTS))
        found.append(put(path, stamp, value, "" if value is DELETED else "test"))
    return found


@st.composite
def shared(draw: st.DrawFn, replicas: int) -> list[list[Write]]:
    """Draw writes and who has seen which: a write is the same wherever it arrives."""
    everything = draw(writes())
    return [[write for write in everything if draw(st.booleans())] for _ in range(replicas)]
