"""rosunit.junitxml and rosunit.xmlrunner, compared with the real ones."""

from __future__ import annotations

import pytest
from oracle import same

_RESULTS = r"""
import io, os, re, sys, tempfile, unittest
from rosunit import junitxml
from rosunit.xmlrunner import XMLTestRunner

class Cases(unittest.TestCase):
    def test_a_pass(self):
        print("<out> & so")
    def test_b_failure(self):
        sys.stderr.write("err")
        self.assertEqual(1, 2)
    def test_c_error(self):
        raise KeyError("no\x01")

stream = io.StringIO()
XMLTestRunner(stream).run(unittest.defaultTestLoader.loadTestsFromTestCase(Cases))
text = re.sub(r'time="[0-9.]{1,9}"', "", stream.getvalue())
text = re.sub(r"(?s)(<(failure|error) [^>]*>).*?(</)", r"\1\3", text)
result = [re.sub(r'classname="[^"]*"', "", text)]

case = junitxml.TestCaseResult("one")
case.add_error(junitxml.TestError("E", "text <\x02>"))
case.add_failure(junitxml.TestFailure("F", "other"))
result.append([case.xml().decode(), case.passed, case.description])

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
