"""Launch files of our own, read by rosz and by real roslaunch."""

from __future__ import annotations

import re

import pytest

from .corpus import INVALID, VALID, Case, expected, plain
from .roslaunch_oracle import Roslaunch, Rosz, differences

EXPECTED = expected()


def ids(case: Case) -> str:
    return case.name


@pytest.mark.parametrize("case", VALID, ids=ids)
def test_rosz_reads_files_as_roslaunch_does(case: Case, roslaunch: Roslaunch, rosz: Rosz) -> None:
    question = ([case.path.name], case.path.parent, case.argv, case.environ)
    real = roslaunch.ask(*question)
    assert real["error"] is None
    found = differences(rosz.ask(*question), real)
    assert not [text for text in found if not text.startswith(case.skip or ("\0",))]


@pytest.mark.parametrize("case", INVALID, ids=ids)
def test_roslaunch_refuses_the_files_that_rosz_refuses(case: Case, roslaunch: Roslaunch) -> None:
    real = roslaunch.ask([case.path.name], case.path.parent, case.argv, case.environ)
    assert real["error"] is not None


@pytest.mark.parametrize("case", INVALID, ids=ids)
def test_errors_have_a_place_and_a_reason(case: Case, rosz: Rosz) -> None:
    ours = rosz.ask([case.path.name], case.path.parent, case.argv, case.environ)
    message, wanted = plain(ours["error"]), EXPECTED[case.name]
    open_end = re.escape(wanted).replace(re.escape("..."), ".*")
    assert message == wanted or re.fullmatch(open_end, message)


def test_every_refused_file_has_its_message() -> None:
    assert sorted(EXPECTED) == sorted(case.name for case in INVALID)
    assert len(VALID) + len(INVALID) >= 120
