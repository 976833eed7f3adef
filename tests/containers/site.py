"""A package with Python nodes, and launches and containers of them."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

from network import Network, Program

__all__ = ("Site",)

_MANIFEST = """\
<package format="2"><name>{name}</name><version>1.0.0</version><description>d</description>
<maintainer email="a@b.cd">m</maintainer><license>l</license></package>
"""

SCRIPTS = {
    "talker.py": """
        import os, sys, rospy
        from std_msgs.msg import String
        rospy.init_node("talker")
        own = rospy.myargv()[1:]
        rospy.on_shutdown(lambda: print("bye", rospy.get_name(), flush=True))
        print("I am", rospy.get_name(), os.getpid(), own, rospy.get_param("~word", "-"), flush=True)
        words = rospy.Publisher("words", String, queue_size=100, latch=True)
        words.publish("hello from " + rospy.get_name())
        rospy.spin()
    """,
    "listener.py": """
        import os, rospy
        from std_msgs.msg import String
        def heard(message):
            origin = message._connection_header["callerid"]
            print(rospy.get_name(), "heard", message.data, "of", origin, flush=True)
        rospy.init_node("listener")
        rospy.on_shutdown(lambda: print("bye", rospy.get_name(), flush=True))
        print("I am", rospy.get_name(), os.getpid(), flush=True)
        rospy.Subscriber("words", String, heard)
        rospy.spin()
    """,
    "crasher.py": """
        import rospy
        rospy.init_node("crasher")
        raise ValueError("broken on purpose")
    """,
    "native.py": """
        import os, rosz
        with rosz.Node("native") as node:
            print("I am", node.name, os.getpid(), flush=True)
            node.spin()
        print("end of", node.name, flush=True)
    """,
    "deaf.py": """
        import rospy, time
        rospy.init_node("deaf")
        print("deaf to all", flush=True)
        while True:
            time.sleep(0.05)
    """,
    "wrong.py": "def f(:\n",
    "fatal.py": """
        import ctypes, threading, rosz
        def fail():
            raise ValueError("broken in a thread")
        thread = threading.Thread(target=fail)
        thread.start()
        thread.join()
        ctypes.string_at(0)
    """,
    "compiled": "#!/bin/sh\necho no Python; exec sleep 600\n",
}


class Site:
    """A package path with a package ``pk``.

    Args:
        network: The network of its programs.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self.root = network.folder / "packages"
        for name, text in SCRIPTS.items():
            self.add("pk", name, text)

    def add(self, package: str, name: str, text: str) -> Path:
        """Add a program to a package."""
        file = self.root / package / "scripts" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        (self.root / package / "package.xml").write_text(_MANIFEST.format(name=package))
        shebang = "" if text.startswith("#!") else "#!/usr/bin/env python3\n"
        file.write_text(shebang + dedent(text))
        file.chmod(0o755)
        return file

    def rosz(self, *words: str) -> Program:
        """Start a command of rosz."""
        home = str(self.network.folder / "home")
        return self.network.run(
            "-m", "rosz", *words, ROSZ_PACKAGE_PATH=str(self.root), ROS_HOME=home
        )

    def launch(self, text: str, *words: str) -> Program:
        """Start a launch of some tags."""
        file = self.network.folder / f"{len(list(self.network.folder.glob('*.launch')))}.launch"
        file.write_text(f"<launch>{dedent(text)}</launch>")
        return self.rosz("launch", str(file), *words)
