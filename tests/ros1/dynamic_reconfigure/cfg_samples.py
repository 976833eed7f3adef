"""Files as people wrote them for ROS 1."""

from __future__ import annotations

from pathlib import Path

__all__ = ("BROKEN", "OLD", "SAMPLES", "write_package", "write_samples")

TUTORIALS = """\
#!/usr/bin/env python
PACKAGE = "sample"

from dynamic_reconfigure.parameter_generator_catkin import *

gen = ParameterGenerator()

gen.add("int_param", int_t, 0, "A whole number", 50, 0, 100)
gen.add("double_param", double_t, 1, "A number", .5, 0, 1)
gen.add("str_param", str_t, 2, "A text", "Hello World")
gen.add("bool_param", bool_t, 4, "A truth value", True)

size_enum = gen.enum([gen.const("Small", int_t, 0, "A small one"),
                      gen.const("Medium", int_t, 1, "A middling one"),
                      gen.const("Large", int_t, 2, "A large one")],
                     "How large")
gen.add("size", int_t, 8, "One of a few", 1, 0, 2, edit_method=size_enum)

exit(gen.generate(PACKAGE, "dynamic_tutorials", "Tutorials"))
"""

GROUPS = """\
#! /usr/bin/env python2
from dynamic_reconfigure.parameter_generator_catkin import *
from math import pi

gen = ParameterGenerator()
left = gen.add_group("Left Arm", state=False)
right = gen.add_group("Right", type="tab")
deep = left.add_group("Deep", "collapse", True)
deeper = deep.add_group("Deeper", state=False)
gen.add("first", double_t, 1, "Outside of all", -pi, -pi, pi)
left.add("joint", double_t, 2, "No bounds", 1.0)
left.add("low", int_t, 2, "A lower bound", 3, min=-5)
deep.add("high", double_t, 4, "An upper bound", max=7, default=2.5)
deeper.add("name", str_t, 0xf0, "", "")
right.add("on", bool_t, 0x80000000, "Default is false")
right.add("count", int_t, 0, "Default is nought")
gen.add("last", str_t, 0, "Behind the groups", "x")
sys.exit(gen.generate("sample", "arms", "Groups"))
"""

ENUMS = """\
#!/usr/bin/env python
# -*- coding: utf-8 -*-
PKG = 'sample'
import roslib; roslib.load_manifest('dynamic_reconfigure')
import os
from dynamic_reconfigure.parameter_generator_catkin import *

gen = ParameterGenerator()
modes = [gen.const(name, str_t, name.lower(), "Mode " + name) for name in ("Fast", "Slow")]
rates = gen.enum([gen.const("Half", double_t, 0.5, "50"), gen.const("2xHalf", double_t, 1, "100")],
                 "Rates")
gen.const("Alone", bool_t, True, "Of no enumeration")
gen.add("mode", str_t, 1, "Größe", "slow", edit_method=gen.enum(modes, "Modes"))
gen.add("rate", double_t, 2, "A rate", 1, 0, 1, rates)
gen.generate(PKG, os.path.basename("sample"), "Enums")
"""

OLD = """\
#!/usr/bin/env python
PACKAGE='sample'
import roslib; roslib.load_manifest(PACKAGE)

from dynamic_reconfigure.parameter_generator import *

gen = ParameterGenerator()
#       Name     Type  Level  Description  Default  Min  Max
gen.add("speed", int_t, SensorLevels.RECONFIGURE_RUNNING if False else 0, "Speed", 3, 1, 9)
exit(gen.generate(PACKAGE, "old", "Old"))
"""

LOOPS = """\
from dynamic_reconfigure.parameter_generator_catkin import *
from beside_it import add_limits

if __name__ == "__main__":
    gen = ParameterGenerator()
    for index in range(4):
        gen.add("gain_%d" % index, double_t, 1 << index, "Gain %d" % index, index * 0.1, 0, 1)
    group = gen.add_group("Limits")
    add_limits(group)
    print("described")
    quit(gen.generate("sample", "loops", "Loops"))
"""

BESIDE = """\
from dynamic_reconfigure.parameter_generator_catkin import double_t


def add_limits(group):
    group.add("top", double_t, 0, "Top", 1.5, 0, 2)
"""

SAMPLES = {
    "Tutorials": TUTORIALS,
    "Groups": GROUPS,
    "Enums": ENUMS,
    "Loops": LOOPS,
}
"""Name to text; `OLD` is none of them, as ROS 1's old generator needs a package of rosbuild."""


def write_samples(folder: Path) -> None:
    """Write the files, and the module that one of them imports, to a new folder."""
    folder.mkdir(parents=True)
    (folder / "beside_it.py").write_text(BESIDE)
    for name, text in SAMPLES.items():
        (folder / f"{name}.cfg").write_text(text)


def write_package(folder: Path) -> None:
    """Write a package with the files in ``cfg``."""
    write_samples(folder / "cfg")
    (folder / "package.xml").write_text("<package><name>sample</name></package>")


_HEAD = (
    "from dynamic_reconfigure.parameter_generator_catkin import *\n"
    "import roslib; roslib.load_manifest('sample')\n"
    "gen = ParameterGenerator()\n"
)
_TAIL = "exit(gen.generate('sample', 'node', 'Broken'))\n"

BROKEN: tuple[tuple[str, int, str], ...] = (
    ("gen.add('a', int_t, 0, '', 1.5)", 4, "'a' has type int, but default is 1.5"),
    ("gen.add('a', int_t, 0, '', '1')", 4, "'a' has type int, but default is '1'"),
    ("gen.add('a', int_t, 0, '', 1, 0.5)", 4, "'a' has type int, but min is 0.5"),
    ("gen.add('a', bool_t, 0, '', 1)", 4, "'a' has type bool, but default is 1"),
    ("gen.add('a', str_t, 0, '', 'x', 'a', 'z')", 4, "'a' is of type 'str', which has no min and"),
    ("gen.add('1a', int_t, 0, '', 1)", 4, "'1a' is not a name of a setting: expected a letter"),
    ("gen.add('a', 'float', 0, '', 1)", 4, "'a' has the unknown type 'float'; expected int_t"),
    ("gen.add('a', float, 0, '', 1)", 4, "'a' has the unknown type <class 'float'>; expected"),
    ("gen.add('a', int_t, None, '')", 4, "'a' has the level None; expected a whole number"),
    ("gen.const('a', int_t, 'x', '')", 4, "'a' has type int, but default is 'x'"),
    (
        "gen.enum([gen.const('a', int_t, 1, ''), gen.const('b', str_t, '', '')], '')",
        4,
        "expected constants of one type in an enumeration, got a (int), b (str)",
    ),
    (
        "gen.add('a', int_t, 0, '')\ngen.add_group('G').add('a', int_t, 0, '')",
        5,
        "there is a parameter 'a' already, in line 4",
    ),
    ("print 'x'", 4, "this is Python 2 (print without parentheses); convert the file with: 2to3"),
    ("x = (1,", 4, "'(' was never closed"),
    ("\n1 / 0", 5, "ZeroDivisionError: division by zero"),
    ("xrange(3)", 4, "NameError: name 'xrange' is not defined; 'xrange' is Python 2; Python 3 has"),
    ("import nothing_like_it", 4, "ModuleNotFoundError: No module named 'nothing_like_it'"),
    ("exit(3)", 4, "it exits with 3 before it has generated anything"),
    ("exit()", 4, "it exits with None before it has generated anything"),
    ("gen.add('a')", 4, "TypeError: Group.add() missing 3 required positional arguments"),
    ("def f():\n    raise KeyError('k')\nf()", 5, "KeyError: 'k'"),
)
BROKEN = tuple((_HEAD + body + "\n" + _TAIL, line, text) for body, line, text in BROKEN)
