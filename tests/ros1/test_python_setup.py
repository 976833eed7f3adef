"""Packages offer the Python modules of their setup.py, as in a devel space that catkin makes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest
from cached import build_once
from oracle import PYTHON, require

from rosz.packages import PackageIndex
from rosz.ros1.python_setup import Offers
from rosz.ros1.setup_reader import read_setup

TOP = Path(__file__).parents[2]

CATKIN = "from catkin_pkg.python_setup import generate_distutils_setup\n"
MANIFEST = (
    '<package format="2"><name>{}</name><version>1.0.0</version><description>d</description>'
    '<maintainer email="me@example.com">m</maintainer><license>BSD</license>'
    "<buildtool_depend>catkin</buildtool_depend></package>"
)
BUILD = """\
cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED {needs})
{setup}
{messages}
catkin_package()
{more}
"""

PACKAGES: dict[str, dict[str, str]] = {
    # distutils, with catkin's function; a module imports another one that lies beside the package.
    "plain": {
        "setup.py": f"from distutils.core import setup\n{CATKIN}"
        "d = generate_distutils_setup(packages=['plain'], package_dir={'': 'src'})\nsetup(**d)\n",
        "src/plain/__init__.py": "WHO = 'plain'\n",
        "src/plain/inner.py": "import beside_plain\nY = beside_plain.Y\n",
        "src/beside_plain.py": "Y = 2\n",
    },
    # Messages and modules under one name, which import each other.
    "both": {
        "msg/Bolt.msg": "int32 size\n",
        "setup.py": f"from setuptools import setup\n{CATKIN}d = generate_distutils_setup()\n"
        "d['packages'] = ['both', 'both.deep']\nd['package_dir'] = {'both': 'src/both'}\n"
        "setup(**d)\n",
        "src/both/__init__.py": "from both.msg import Bolt\n",
        "src/both/tools.py": "from both.msg import Bolt\ndef bolt():\n    return Bolt(3)\n",
        "src/both/deep/__init__.py": "from ..tools import bolt\n",
    },
    # Modules that do not have the name of the package.
    "several": {
        "setup.py": "from setuptools import setup, find_packages\nNAME = 'first'\n"
        "setup(name='several', version='1.0.0', packages=[NAME] + ['second'],\n"
        "      package_dir={'': 'python'})\n",
        "python/first/__init__.py": "import second\n",
        "python/second/__init__.py": "",
    },
    "found": {
        "setup.py": "from setuptools import setup, find_packages\n"
        "setup(name='found', version='1.0.0', package_dir={'': 'lib'},\n"
        "      packages=find_packages('lib', exclude=['test_*']))\n",
        "lib/found_one/__init__.py": "",
        "lib/test_found/__init__.py": "",
    },
    # The values are known only by running it.
    "computed": {
        "setup.py": "import os\nfrom distutils.core import setup\n"
        "names = sorted(n for n in os.listdir('src') if n.startswith('computed_'))\n"
        "setup(name='computed', version='1.0.0', packages=names, package_dir={'': 'src'})\n",
        "src/computed_here/__init__.py": "",
        "src/other_here/__init__.py": "",
    },
    "single": {
        "setup.py": "from distutils.core import setup\n"
        "setup(name='single', version='1.0.0', py_modules=['one_file'],"
        " package_dir={'': 'src'})\n",
        "src/one_file.py": "ONE = 1\n",
    },
    # A program that is not executable; its folder comes before what packages offer.
    "user": {
        "scripts/user.py": "#!/usr/bin/env python\n" + "import own\n"
        "from both.tools import bolt\nprint(own.WHERE, bolt().size)\n",
        "scripts/own.py": "WHERE = 'beside the script'\n",
        "more": "catkin_install_python(PROGRAMS scripts/user.py  # a comment\n"
        "  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n",
    },
}

PROGRAMS = {
    "a package and its submodule": "import plain.inner\nprint(plain.WHO, plain.inner.Y)",
    "a neighbour, after the package": "import plain\nimport beside_plain\nprint(beside_plain.Y)",
    "messages and modules": (
        "import both.tools, both.deep\nfrom both.msg import Bolt\n"
        "print(both.Bolt is Bolt is both.tools.Bolt, both.deep.bolt().size)"
    ),
    "other names": "import first\nprint(first.second.__name__)",
    "found packages": "import found_one\nprint(found_one.__name__)",
    "what a setup.py computes": "import computed_here\nprint(computed_here.__name__)",
    "what is not offered": (
        "for name in 'other_here', 'test_found', 'first.second', 'nothing', 'plain.nothing':\n"
        "    try:\n        __import__(name)\n    except ImportError as e:\n        print(e.name)"
    ),
}


def write_packages(top: Path) -> None:
    """Write the packages to a workspace."""
    for name, files in PACKAGES.items():
        messages = "add_message_files(FILES Bolt.msg)\ngenerate_messages()\n"
        build = BUILD.format(
            name=name,
            needs="COMPONENTS message_generation" if "msg/Bolt.msg" in files else "",
            setup="catkin_python_setup()" if "setup.py" in files else "",
            messages=messages if "msg/Bolt.msg" in files else "",
            more=files.get("more", ""),
        )
        whole = {**files, "package.xml": MANIFEST.format(name), "CMakeLists.txt": build}
        for file, text in whole.items():
            path = top / "src" / name / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    top = tmp_path_factory.mktemp("ws")
    write_packages(top)
    return top


@pytest.fixture(scope="module")
def devel() -> Path:
    """The devel space that real catkin makes of the packages, in a workspace of its own."""
    require("genpy", package="python3-genpy")
    catkin_make = Path("/usr/bin/catkin_make")
    if not catkin_make.exists():
        pytest.skip("catkin is not installed: apt-get install catkin")

    def make(place: Path) -> None:
        write_packages(place)
        options = ("-DPYTHON_EXECUTABLE=/usr/bin/python3", "both_generate_messages_py")
        subprocess.run(
            [catkin_make, *options],
            cwd=place,
            env={"PATH": "/usr/bin:/bin", "HOME": str(place)},
            check=True,
            capture_output=True,
            timeout=300,
        )

    sources = repr((PACKAGES, MANIFEST, BUILD)).encode() + catkin_make.read_bytes()
    return build_once("catkin", sources, make) / "devel"


def rosz(*words: str, workspace: Path, home: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", *words],
        cwd=home,
        env={
            "PATH": os.environ["PATH"],
            "HOME": str(home),
            "PYTHONPATH": str(TOP),
            "ROS_PACKAGE_PATH": str(workspace / "src"),
        },
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def real(*words: str, devel: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        words,
        env={
            "PATH": "/usr/bin:/bin",
            "PYTHONPATH": str(devel / "lib/python3/dist-packages"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.ros1
@pytest.mark.parametrize("what", PROGRAMS)
def test_modules_are_those_of_a_devel_space(
    workspace: Path, devel: Path, tmp_path: Path, what: str
) -> None:
    script = tmp_path / "program.py"
    script.write_text(PROGRAMS[what])
    ours = rosz("-m", "rosz.script", str(script), workspace=workspace, home=tmp_path)
    expected = real(PYTHON, str(script), devel=devel)
    assert (ours.stdout, ours.returncode) == (expected.stdout, 0), ours.stderr + expected.stderr


@pytest.mark.ros1
def test_a_script_that_catkin_installs(workspace: Path, devel: Path, tmp_path: Path) -> None:
    ours = rosz("-m", "rosz", "run", "user", "user.py", workspace=workspace, home=tmp_path)
    expected = real(str(devel / "lib/user/user.py"), devel=devel)
    assert ours.stdout == "beside the script 3\n", ours.stderr
    # What catkin puts there runs the script from another folder, where its neighbour is not.
    assert "No module named 'own'" in expected.stderr
    (package,) = PackageIndex([workspace / "src" / "user"]).packages()
    assert package.executables() == ["user.py"]


def test_what_was_read_is_kept_until_the_file_changes(workspace: Path, tmp_path: Path) -> None:
    for name in ("computed", "plain"):
        shutil.copytree(workspace / "src" / name, tmp_path / "src" / name)
    memory = tmp_path / "home" / "modules.json"

    def offers() -> Offers:
        return Offers(PackageIndex([tmp_path / "src"]), memory)

    here = tmp_path / "src" / "computed" / "src"
    assert offers().find("computed_here") == here / "computed_here"
    kept = memory.stat().st_mtime_ns
    (here / "computed_later").mkdir()
    (here / "computed_later" / "__init__.py").touch()
    assert offers().find("computed_later") is None
    assert memory.stat().st_mtime_ns == kept
    with (here.parent / "setup.py").open("a") as file:
        file.write("# changed\n")
    assert offers().find("computed_later") == here / "computed_later"
    memory.write_text("not JSON")
    assert offers().find("plain") == tmp_path / "src" / "plain" / "src" / "plain"
    assert Offers(PackageIndex([tmp_path / "src"]), Path("/proc/none")).find("plain") is not None
    single = Offers(PackageIndex([workspace / "src" / "single"]), tmp_path / "single.json")
    assert single.find("one_file") is not None
    # catkin's own relay of such a module is not there in a devel space, only when it is installed.


@pytest.mark.parametrize(
    "text",
    [
        "syntax error",
        "from setuptools import setup\nraise SystemExit(3)\n",
        "import no_such_module\nfrom setuptools import setup\nfor p in ['x']: setup(packages=[p])",
        "from setuptools import setup\nsetup(packages=open('none').read())\n",
        "print('no call')\n",
    ],
)
def test_a_setup_that_fails_offers_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / "setup.py").write_text(text)
    assert read_setup(tmp_path) == ({}, [])


def test_a_setup_that_is_run(tmp_path: Path) -> None:
    text = """
        import os
        from setuptools import Extension, setup, find_packages
        from distutils.command.build import build
        from catkin_pkg.python_setup import generate_distutils_setup
        class Build(build): pass
        print("text of its own")
        if os.environ["ROS_VERSION"] == "1":
            d = generate_distutils_setup(
                packages=find_packages("src"), package_dir={"": "src"}, py_modules=["a.b"]
            )
            setup(cmdclass={"build": Build}, **d)
    """
    (tmp_path / "setup.py").write_text(dedent(text))
    (tmp_path / "src" / "inside").mkdir(parents=True)
    (tmp_path / "src" / "inside" / "__init__.py").touch()
    src = tmp_path / "src"
    expected = {"inside": str(src / "inside"), "a": str(src / "a")}
    assert read_setup(tmp_path) == (expected, [])


def test_a_package_of_rosbuild(tmp_path: Path) -> None:
    folder = tmp_path / "src" / "old_one"
    (folder / "src" / "old_one").mkdir(parents=True)
    (folder / "src" / "old_one" / "__init__.py").write_text("OLD = True\n")
    (folder / "manifest.xml").write_text(
        '<package><description brief="b">text</description><author>Me</author>'
        '<license>BSD</license><depend package="std_msgs"/><rosdep name="gcc"/></package>'
    )
    script = folder / "bin" / "node"
    script.parent.mkdir()
    script.write_text(
        "#!/usr/bin/env python\nimport old_one, rospkg\n"
        "m = rospkg.RosPack().get_manifest('old_one')\n"
        "print(old_one.OLD, m.brief, m.is_catkin, [d.name for d in m.depends + m.rosdeps])\n"
    )
    script.chmod(0o755)
    done = rosz("-m", "rosz", "run", "old_one", "node", workspace=tmp_path, home=tmp_path)
    assert done.stdout == "True b False ['std_msgs', 'gcc']\n", done.stderr
    listed = rosz("-m", "rosz", "pkg", "find", "old_one", workspace=tmp_path, home=tmp_path)
    assert listed.stdout == f"{folder}\n"


def test_a_module_beside_shipped_messages(tmp_path: Path) -> None:
    """A package on the path may have code that rosz, which ships its messages, has not."""
    folder = tmp_path / "src" / "geometry_msgs"
    (folder / "src" / "geometry_msgs").mkdir(parents=True)
    (folder / "src" / "geometry_msgs" / "__init__.py").touch()
    (folder / "src" / "geometry_msgs" / "extra.py").write_text(
        "from geometry_msgs.msg import Twist\nX = Twist().linear.x\n"
    )
    (folder / "package.xml").write_text(MANIFEST.format("geometry_msgs"))
    code = tmp_path / "code.py"
    code.write_text("import geometry_msgs.extra\nprint(geometry_msgs.extra.X)\n")
    done = rosz("-m", "rosz.script", str(code), workspace=tmp_path, home=tmp_path)
    assert done.stdout == "0.0\n", done.stderr
