"""rosunit.junitxml, compared with the real one."""

from __future__ import annotations

import pytest
from oracle import same

_RESULTS = r"""
import os, tempfile
from rosunit import junitxml

case = junitxml.TestCaseResult("one")
case.add_error(junitxml.TestError("E", "text <\x02>"))
case.add_failure(junitxml.TestFailure("F", "other"))
result = [[case.xml().decode(), case.passed, case.description]]

FILES = [
    '<testsuite name="s" tests="2" errors="1" failures="0" time="1.5"><testcase name="a"'
    ' classname="c" time="0.5"/><testcase name="b"><error type="E">why</error></testcase>'
    '<system-out>said</system-out></testsuite>',
    '<testsuites><testsuite name="s" tests="1" errors="0" failures="1"><testcase name="a">'
    '<failure type="F" message="m"/></testcase></testsuite><testsuite name="t" tests="1"'
    ' errors="0" failures="0"><testcase name="b"/></testsuite></testsuites>',
    "<testsuites/>", "no xml",
]
folder = os.path.join(tempfile.mkdtemp(), "package")
os.mkdir(folder)
for number, content in enumerate(FILES):
    path = os.path.join(folder, str(number))
    with open(path, "w") as out:
        out.write(content)
    found = junitxml.read(path, "named")
    result.append([found.num_tests, found.num_errors, found.num_failures, found.time,
                   [[one.name, one.classname, one.passed, one.time]
                    for one in found.test_case_results]])
"""


@pytest.mark.ros1
def test_results_are_those_of_rosunit() -> None:
    same(_RESULTS, "rosunit", "python3-rosunit")
