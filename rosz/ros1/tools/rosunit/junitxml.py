"""rosunit.junitxml: results of tests as JUnit XML, written and read."""

# ruff: noqa: PT028  # functions with names of tests

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from rosz.ros1.tools.rospkg import get_test_results_dir

_WIDTH = 80
# XML 1.0 has no other characters.
_INVALID = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def _printable(text: str) -> str:
    return _INVALID.sub(lambda match: f"&#x{ord(match[0]):04X};", text)


def _output(text: str) -> str:
    return f"<![CDATA[\n{_printable(text)}\n]]>"


class TestInfo:
    """Why a test did not pass.

    Args:
        type_: Type of the exception.
        text: Text, mostly a traceback.
    """

    __test__ = False  # not a test of pytest
    tag = ""

    def __init__(self, type_: str, text: str) -> None:
        self.type = type_
        self.text = text

    def xml_element(self) -> ET.Element:
        """Return the element of a file of results."""
        element = ET.Element(self.tag, type=self.type)
        element.text = _output(self.text)
        return element

    def xml(self) -> bytes:
        """Return the element as text."""
        return ET.tostring(self.xml_element())


class TestError(TestInfo):
    """A test raised something else than an AssertionError."""

    tag = "error"


class TestFailure(TestInfo):
    """A test raised an AssertionError."""

    tag = "failure"


class TestCaseResult:
    """The result of a test.

    Args:
        name: Name of the test.

    Attributes:
        classname: Name of its class.
        time: Time it took, in seconds.
    """

    __test__ = False

    def __init__(self, name: str) -> None:
        self.name = name
        self.failures: list[TestFailure] = []
        self.errors: list[TestError] = []
        self.time = 0.0
        self.classname = ""

    @property
    def passed(self) -> bool:
        """Whether the test passed."""
        return not self.errors and not self.failures

    @property
    def failure_description(self) -> str:
        """The failures as text."""
        return "".join(self._describe("FAILURE", failure.text) for failure in self.failures)

    @property
    def error_description(self) -> str:
        """The errors as text."""
        return "".join(self._describe("ERROR", error.text) for error in self.errors)

    def _describe(self, what: str, text: str) -> str:
        head = f"[{self.name}][{what}]"
        return f"{head:-<{_WIDTH}}\n{text}\n{'-' * _WIDTH}\n\n"

    @property
    def description(self) -> str:
        """The result as text."""
        if self.passed:
            return f"[{self.name}][passed]\n"
        return self.failure_description + self.error_description

    def add_failure(self, failure: TestFailure) -> None:
        """Add a failure."""
        self.failures.append(failure)

    def add_error(self, error: TestError) -> None:
        """Add an error."""
        self.errors.append(error)

    def xml_element(self) -> ET.Element:
        """Return the element of a file of results."""
        element = ET.Element(
            "testcase", classname=self.classname, name=self.name, time=str(self.time)
        )
        element.extend(info.xml_element() for info in (*self.failures, *self.errors))
        return element

    def xml(self) -> bytes:
        """Return the element as text."""
        return ET.tostring(self.xml_element())


class Result:
    """The results of several tests.

    Args:
        name: Name of the tests.
        num_errors: Number of tests with errors.
        num_failures: Number of tests with failures.
        num_tests: Number of tests.

    Attributes:
        test_case_results: The results, where they are known.
        time: Time that all took, in seconds.
        system_out: Output on stdout.
        system_err: Output on stderr.
    """

    def __init__(
        self, name: str, num_errors: int = 0, num_failures: int = 0, num_tests: int = 0
    ) -> None:
        self.name = name
        self.num_errors = num_errors
        self.num_failures = num_failures
        self.num_tests = num_tests
        self.test_case_results: list[TestCaseResult] = []
        self.system_out = ""
        self.system_err = ""
        self.time = 0.0

    def accumulate(self, r: Result) -> None:
        """Add other results."""
        self.num_errors += r.num_errors
        self.num_failures += r.num_failures
        self.num_tests += r.num_tests
        self.time += r.time
        self.test_case_results += r.test_case_results
        self.system_out = "\n".join(filter(None, (self.system_out, r.system_out)))
        self.system_err = "\n".join(filter(None, (self.system_err, r.system_err)))

    def add_test_case_result(self, r: TestCaseResult) -> None:
        """Add the result of a test."""
        self.test_case_results.append(r)

    def xml_element(self) -> ET.Element:
        """Return the element of a file of results."""
        element = ET.Element(
            "testsuite",
            errors=str(self.num_errors),
            failures=str(self.num_failures),
            name=self.name,
            tests=str(self.num_tests),
            time=str(self.time),
        )
        element.extend(case.xml_element() for case in self.test_case_results)
        for tag, text in (("system-out", self.system_out), ("system-err", self.system_err)):
            ET.SubElement(element, tag).text = _output(text)
        return element

    def xml(self) -> bytes:
        """Return a file of results."""
        text: bytes = ET.tostring(self.xml_element(), encoding="utf-8", xml_declaration=True)
        return text


def read(test_file: str, test_name: str) -> Result:
    """Return the results in a file; none, with a line on stderr, if it cannot be read.

    Args:
        test_file: Path of the file.
        test_name: Name of the tests.
    """
    total = Result(test_name)
    try:
        text = Path(test_file).read_text("utf-8", errors="replace")
        top = ET.fromstring(_printable(text))  # noqa: S314  # results of the user's own tests
    except (OSError, ET.ParseError) as error:
        sys.stderr.write(f"Unable to read test result file [{test_file}]: {error}\n")
        return total
    for suite in [top] if top.tag == "testsuite" else top.findall("testsuite"):
        total.accumulate(_read_suite(suite, test_name, Path(test_file)))
    return total


def _read_suite(suite: ET.Element, test_name: str, file: Path) -> Result:
    counts = (int(suite.get(name, "0")) for name in ("errors", "failures", "tests"))
    total = Result(test_name, *counts)
    total.time = float(suite.get("time", "0"))
    total.system_out = suite.findtext("system-out", "")
    total.system_err = suite.findtext("system-err", "")
    for case in suite.findall("testcase"):
        result = TestCaseResult(f"{file.parent.name}.{file.stem}/{case.get('name', '')}")
        kind = (case.get("classname") or "unknown").rpartition("__main__.")[2]
        result.classname = kind if kind.startswith(test_name) else f"{test_name}.{kind}"
        result.time = float(case.get("time", "0"))
        for tag in case:
            values = tag.get("type", ""), tag.text or tag.get("message") or ""
            if tag.tag == "failure":
                result.add_failure(TestFailure(*values))
            elif tag.tag == "error":
                result.add_error(TestError(*values))
        total.add_test_case_result(result)
    return total


def read_all(filter_: Sequence[str] = ()) -> Result:
    """Return the results in the folder of test results.

    Args:
        filter_: Packages to read; all when empty.
    """
    total = Result("ros-all")
    for file in sorted(Path(get_test_results_dir()).glob("*/*.xml")):
        if not filter_ or file.parent.name in filter_:
            total.accumulate(read(str(file), file.stem))
    return total


def test_failure_junit_xml(
    test_name: str,
    message: str,
    stdout: str | None = None,
    class_name: str = "Results",
    testcase_name: str = "test_ran",
) -> bytes:
    """Return a file of results with one failure.

    Args:
        test_name: Name of the tests.
        message: What failed.
        stdout: Output on stdout.
        class_name: Class of the test.
        testcase_name: Name of the test.
    """
    return _single(test_name, class_name, testcase_name, TestFailure("", message), stdout)


def test_success_junit_xml(
    test_name: str, class_name: str = "Results", testcase_name: str = "test_ran"
) -> bytes:
    """Return a file of results with one test that passed; see `test_failure_junit_xml`."""
    return _single(test_name, class_name, testcase_name, None, None)


def _single(
    test_name: str, class_name: str, name: str, failure: TestFailure | None, stdout: str | None
) -> bytes:
    case = TestCaseResult(name)
    case.classname = class_name
    result = Result(test_name, 0, 0 if failure is None else 1, 1)
    if failure is not None:
        case.add_failure(failure)
    result.add_test_case_result(case)
    result.system_out = stdout or ""
    return result.xml()


# pytest takes no functions of this module for tests.
vars(test_failure_junit_xml)["__test__"] = vars(test_success_junit_xml)["__test__"] = False


def print_summary(junit_results: Result, runner_name: str = "ROSUNIT") -> None:
    """Write results to stdout.

    Args:
        junit_results: The results.
        runner_name: Name in front of them.
    """
    write: Any = sys.stdout.write
    write(f"\n[{runner_name}]{'-' * 71}\n\n")
    for case in junit_results.test_case_results:
        write(case.description)
    bad = junit_results.num_errors + junit_results.num_failures
    write(f"\nSUMMARY\n * RESULT: {'FAIL' if bad else 'SUCCESS'}\n")
    write(f" * TESTS: {junit_results.num_tests}\n")
    write(f" * ERRORS: {junit_results.num_errors}\n")
    write(f" * FAILURES: {junit_results.num_failures}\n\n")
