"""rosunit: runs a test case and writes its results as JUnit XML (ROS wiki, rosunit).

It may import rospkg.
"""

from __future__ import annotations

import sys
import time
import unittest
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from rosz.ros1.tools.rospkg import get_test_results_dir
from rosz.ros1.tools.rosunit import junitxml
from rosz.ros1.tools.rosunit.junitxml import print_summary

__all__ = ("junitxml", "print_summary", "rosrun", "unitrun")

_OUTPUT = "--gtest_output=xml:"


class _Result(unittest.TextTestResult):
    """A result that records every test with its time and its errors."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.cases: list[ET.Element] = []
        self._began = 0.0

    def startTest(self, test: unittest.TestCase) -> None:  # noqa: N802  # unittest's
        super().startTest(test)
        self._began = time.monotonic()

    def stopTest(self, test: unittest.TestCase) -> None:  # noqa: N802  # unittest's
        super().stopTest(test)
        name = test.id().rpartition(".")[2]
        kind = type(test)
        case = ET.Element(
            "testcase",
            classname=f"{kind.__module__}.{kind.__qualname__}",
            name=name,
            time=f"{time.monotonic() - self._began:.4f}",
        )
        for tag, faults in (("failure", self.failures), ("error", self.errors)):
            for failed, text in faults:
                if failed is test:
                    ET.SubElement(case, tag, type=tag).text = text
        self.cases.append(case)


def unitrun(
    package: str,
    test_name: str,
    test: Any,
    sysargs: Sequence[str] | None = None,
    coverage_packages: Sequence[str] | None = None,  # noqa: ARG001  # rosunit's
) -> None:
    """Run a test case, write its results, and exit the program if it failed.

    The results are written to the file of the option ``--gtest_output=xml:FILE``, or to
    ``<test results>/<package>/rosunit-<test_name>.xml``.

    Args:
        package: Package of the test.
        test_name: Name of the test.
        test: A ``TestCase`` class, or the name of a module, class or method.
        sysargs: Command line; that of the process when not given.
        coverage_packages: Ignored.

    Raises:
        SystemExit: A test failed; the code is 1.
    """
    words = sys.argv if sysargs is None else sysargs
    load = unittest.defaultTestLoader
    suite = (
        load.loadTestsFromName(test) if isinstance(test, str) else load.loadTestsFromTestCase(test)
    )
    runner = unittest.TextTestRunner(
        resultclass=_Result, verbosity=2 if "--text" in words or "-t" in words else 1
    )
    result: Any = runner.run(suite)
    given = [word.removeprefix(_OUTPUT) for word in words if word.startswith(_OUTPUT)]
    default = Path(get_test_results_dir(), package, f"rosunit-{test_name}.xml")
    _write(Path(given[0]) if given else default, test_name, result)
    if not result.wasSuccessful():
        sys.exit(1)


def rosrun(package: str, test_name: str, test: Any, sysargs: Sequence[str] | None = None) -> None:
    """Run a test case of a program that is a node; see `unitrun`."""
    unitrun(package, test_name, test, sysargs)


def _write(path: Path, name: str, result: Any) -> None:
    suite = ET.Element(
        "testsuite",
        name=name,
        tests=str(result.testsRun),
        failures=str(len(result.failures)),
        errors=str(len(result.errors)),
        time=f"{sum(float(case.get('time', 0)) for case in result.cases):.4f}",
    )
    suite.extend(result.cases)
    path.parent.mkdir(parents=True, exist_ok=True)
    ET.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)
