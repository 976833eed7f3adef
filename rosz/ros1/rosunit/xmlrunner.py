"""rosunit.xmlrunner: a runner of unittest that writes JUnit XML."""

from __future__ import annotations

import io
import sys
import time
import unittest
from contextlib import redirect_stderr, redirect_stdout
from typing import IO, Any
from xml.etree import ElementTree as ET

from rosz.ros1.rosunit.junitxml import Result, TestCaseResult, TestError, TestFailure

__all__ = ("XMLTestRunner",)

Error = Any
"""The value of ``sys.exc_info()``, as unittest passes it on."""


def _seconds_since(began: float) -> float:
    """Return a time with four digits; readers do not expect exponents."""
    return round(time.monotonic() - began, 4)


class _Result(unittest.TestResult):
    """Results of tests as they run."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.found = Result(name)
        self._began = 0.0
        self._case = TestCaseResult("")

    def startTest(self, test: unittest.TestCase) -> None:  # noqa: N802  # unittest's
        """Begin a test."""
        super().startTest(test)
        self._began = time.monotonic()
        self._case = TestCaseResult(test.id().rpartition(".")[2])
        self._case.classname = f"{type(test).__module__}.{type(test).__qualname__}"

    def stopTest(self, test: unittest.TestCase) -> None:  # noqa: N802
        """End a test."""
        super().stopTest(test)
        self._case.time = _seconds_since(self._began)
        self.found.add_test_case_result(self._case)

    def addError(self, test: unittest.TestCase, err: Error) -> None:  # noqa: N802
        """Take an error of a test."""
        super().addError(test, err)
        self._case.add_error(TestError(err[0].__name__, self.errors[-1][1]))

    def addFailure(self, test: unittest.TestCase, err: Error) -> None:  # noqa: N802
        """Take a failure of a test."""
        super().addFailure(test, err)
        self._case.add_failure(TestFailure(err[0].__name__, self.failures[-1][1]))


class XMLTestRunner:
    """Runs tests and writes their results, with what the tests write.

    Args:
        stream: Where to write; ``sys.stdout`` when not given.
    """

    def __init__(self, stream: IO[str] | None = None) -> None:
        self._stream = stream

    def run(self, test: Any) -> Result:
        """Run a test or a suite, and return the results."""
        kind = type(test)
        result = _Result(f"{kind.__module__}.{kind.__name__}")
        out, err = io.StringIO(), io.StringIO()
        began = time.monotonic()
        with redirect_stdout(out), redirect_stderr(err):
            test(result)
        found = result.found
        found.time = _seconds_since(began)
        found.num_tests = result.testsRun
        found.num_errors, found.num_failures = len(result.errors), len(result.failures)
        found.system_out, found.system_err = out.getvalue(), err.getvalue()
        stream = sys.stdout if self._stream is None else self._stream
        stream.write(ET.tostring(found.xml_element(), encoding="unicode"))
        return found
