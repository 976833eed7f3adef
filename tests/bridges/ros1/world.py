"""A master of rosz for the tests of a module, and programs of ROS 1 that register with it."""

from __future__ import annotations

import fcntl
import hashlib
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, Program
from oracle import PYTHON, is_installed

from rosz.bridges.ros1 import MasterBridge

__all__ = ("LISTENER", "SERVER", "TALKER", "World", "roscpp")

_PROGRAMS = Path(__file__).parent / "programs"
_GENCPP = Path("/usr/lib/gencpp/gen_cpp.py")
_GENCPP_TEMPLATES = Path("/usr/share/gencpp")
_DYNAMIC_RECONFIGURE = Path("/usr/share/dynamic_reconfigure")
_CACHE = Path(__file__).parents[3] / ".pytest_cache" / "d" / "roscpp"

TALKER = """
import rospy, sys
from std_msgs.msg import String
rospy.init_node(sys.argv[1])
publisher = rospy.Publisher(sys.argv[2], String, queue_size=10, latch=len(sys.argv) > 3)
if len(sys.argv) > 3:
    publisher.publish(sys.argv[3])
    print("ready")
    rospy.spin()
number = 0
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    publisher.publish("rospy %d" % number)
    number += 1
    rate.sleep()
"""
LISTENER = """
import rospy, sys
from std_msgs.msg import String
rospy.init_node(sys.argv[1])
def heard(message):
    print("heard " + message.data)
rospy.Subscriber(sys.argv[2], String, heard)
print("ready")
rospy.spin()
"""
SERVER = """
import rospy
from std_srvs.srv import SetBool, SetBoolResponse
rospy.init_node("rospy_server")
def handle(request):
    if not request.data:
        raise rospy.ServiceException("never false")
    return SetBoolResponse(True, "from rospy")
rospy.Service("/of_rospy", SetBool, handle)
rospy.logwarn("serving")
print("ready")
rospy.spin()
"""


@cache
def roscpp(
    name: str = "partner",
    *packages: str,
    folder: Path = _PROGRAMS,
    interfaces: Path | None = None,
    options: tuple[str, ...] = (),
) -> str:
    """Return a compiled program, kept in pytest's cache from run to run.

    The test is skipped where it cannot be compiled.

    Args:
        name: Name of the program.
        packages: Packages of ROS 1 that it uses, beside roscpp.
        folder: Where its source is.
        interfaces: Package of its own messages, services and ``.cfg`` files, of a name equal to the
            program's.
        options: Further options for the compiler.
    """
    if shutil.which("g++") is None or shutil.which("pkg-config") is None:
        pytest.skip("needs g++ and pkg-config (Debian: g++, pkg-config)")
    ask = ["pkg-config", "--cflags", "--libs", "roscpp", *packages]
    flags = subprocess.run(ask, check=False, capture_output=True, text=True)
    if flags.returncode:
        pytest.skip(f"needs C++ libraries of Debian: {flags.stderr.strip()}")
    source = folder / f"{name}.cpp"
    files = [] if interfaces is None else sorted(interfaces.glob("*/*.[ms][sr][gv]"))
    settings = [] if interfaces is None else sorted(interfaces.glob("cfg/*.cfg"))
    if files and not _GENCPP.exists():
        pytest.skip("needs gencpp (Debian: python3-gencpp)")
    if settings and not is_installed("dynamic_reconfigure"):
        pytest.skip("needs dynamic_reconfigure (Debian: python3-dynamic-reconfigure)")
    versions = subprocess.check_output(["pkg-config", "--modversion", *ask[3:]])
    versions += subprocess.check_output(["g++", "-dumpfullversion"])
    content = source.read_bytes() + versions + flags.stdout.encode()
    included = [folder / part for part in re.findall(r'#include "(\w+\.cpp)"', source.read_text())]
    content += b"".join(file.read_bytes() for file in (*files, *settings, *included))
    _CACHE.mkdir(parents=True, exist_ok=True)
    made = _CACHE / f"{name}-{hashlib.sha256(content).hexdigest()[:16]}"
    with (_CACHE / f"{name}.lock").open(
        "w"
    ) as lock:  # workers of pytest-xdist wait for one another
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.exists():
            new = made.with_suffix(".new")
            include = made.with_suffix(".include")
            for file in files:
                generate = [PYTHON, str(_GENCPP), str(file), "-p", name, "-o", str(include / name)]
                subprocess.run([*generate, "-e", str(_GENCPP_TEMPLATES)], check=True)
            for file in settings:
                places = [str(include / part) for part in ("docs", name, "python")]
                generate = [PYTHON, str(file), str(_DYNAMIC_RECONFIGURE), *places]
                subprocess.run(generate, check=True, cwd=include)
            compiled = ["g++", "-O0", *options, f"-I{include}", "-o", str(new), str(source)]
            subprocess.run([*compiled, *flags.stdout.split()], check=True)
            new.rename(made)
    return str(made)


class World:
    """A network with a master of ROS 1.

    Attributes:
        network: The network.
        bridge: The master.
        port: Its port.
    """

    def __init__(self) -> None:
        if not is_installed("rospy", "std_srvs"):
            pytest.skip("needs rospy of ROS 1 (Debian: python3-rospy, python3-std-srvs)")
        self.network = Network()
        self.bridge = MasterBridge(self.network.environment(), port=0)
        self.port = self.bridge.port

    def variables(self) -> dict[str, str]:
        """Return the environment of a program of ROS 1."""
        return {
            "PATH": "/usr/bin:/bin",
            "HOME": str(self.network.folder),
            "ROS_HOME": str(self.network.folder / "ros1"),
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_IP": "127.0.0.1",
            "PYTHONUNBUFFERED": "1",
            "ROSCONSOLE_STDOUT_LINE_BUFFERED": "1",
        }

    def start(self, *command: str) -> Program:
        """Start a program of ROS 1."""
        return self.network._keep(Program(command, self.variables()))

    def rospy(self, script: str, *argv: str) -> Program:
        """Start a Python program on real rospy."""
        return self.start(PYTHON, "-c", script, *argv)

    def partner(self, role: str, *argv: str) -> Program:
        """Start the roscpp program."""
        return self.start(roscpp(), role, *argv)

    def run(self, *command: str) -> str:
        """Return what a command of ROS 1 prints, to both streams."""
        done = subprocess.run(
            command,
            env=self.variables(),
            check=False,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=TIMEOUT * 2,
        )
        return done.stdout

    def call(self, method: str, *args: Any) -> Any:
        """Return the answer of the master to a call."""
        import xmlrpc.client

        with xmlrpc.client.ServerProxy(f"http://127.0.0.1:{self.port}/") as master:
            return getattr(master, method)(*args)

    def close(self) -> None:
        """End everything."""
        self.bridge.close()
        self.network.close()
