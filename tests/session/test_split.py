"""ViewDifferences between what cores know, and how long they have been there."""

from __future__ import annotations

import pytest
from network import Network

from rosz.session import stale_links
from rosz.session.stale_links import CoreView, SplitWatch, ViewDifferences

ONE, TWO = "1a", "2b"


def test_what_stays_different_is_found_in_time() -> None:
    differences = ViewDifferences(15)
    assert differences.update({ONE: 1}, {TWO: {ONE: 1, TWO: 5}}, 100) is None
    assert differences.update({ONE: 1}, {TWO: {ONE: 1, TWO: 5}}, 114) is None
    assert differences.update({ONE: 1}, {TWO: {ONE: 1, TWO: 5}}, 115) == (TWO, TWO)


def test_what_changes_meanwhile_is_not() -> None:
    differences = ViewDifferences(15)
    for second in range(100):
        theirs = {ONE: 1, TWO: second}
        assert differences.update({ONE: 1, TWO: second - 1}, {TWO: theirs}, second) is None


def test_what_agrees_in_between_is_not() -> None:
    differences = ViewDifferences(15)
    assert differences.update({ONE: 1}, {TWO: {}}, 0) is None
    assert differences.update({ONE: 1}, {TWO: {ONE: 1}}, 10) is None
    assert differences.update({ONE: 1}, {TWO: {}}, 20) is None


def test_who_lacks_something_acts_first() -> None:
    has, lacks = ViewDifferences(15), ViewDifferences(15)
    for second, expected in ((0, None), (15, None), (30, (TWO, ONE))):
        assert has.update({ONE: 1}, {TWO: {}}, second) == expected
    for second, found in ((0, None), (15, (TWO, ONE))):
        assert lacks.update({}, {TWO: {ONE: 1}}, second) == found


def test_a_core_that_replies_no_more() -> None:
    differences = ViewDifferences(15)
    assert differences.update({}, {TWO: None}, 0) is None
    assert differences.update({}, {TWO: None}, 15) == (TWO, "")
    assert differences.update({}, {}, 16) is None


def test_cores_that_came_and_went_are_forgotten(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A core that starts afresh again and again has another id each time."""
    monkeypatch.setattr(stale_links, "_PERIOD", 1e6)
    session = network.session()
    watch = SplitWatch(session, 0, (), lambda _: None)
    for number in range(3000):
        views: dict[str, CoreView] = {ONE: {}, f"{number:x}": {}}
        monkeypatch.setattr(watch, "_replies", views.copy)
        watch._compare()
    assert len(watch._cores) == len(set(watch._cores)) == 1000
    assert {ONE, f"{2999:x}"} <= set(watch._cores)
    watch.close()
