"""A shell of a test: runs commands in this process, on the test's own network."""

from __future__ import annotations

import io
import json
import sys
from functools import partial
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually

from rosz.cli.main import run
from rosz.node import Node
from rosz.session import Session, SessionConfig

__all__ = ("Result", "Shell", "latch", "with_log")

_SPACE = "@ros2_lv/"
_SEVERAL = 2
"""Sessions from which on a command may be at one that does not know all tokens yet."""
_MAIN = "from rosz.cli.main import main; main()"


class _Input(io.TextIOWrapper):
    def __init__(self, text: str, *, terminal: bool) -> None:
        super().__init__(io.BytesIO(text.encode()), "utf-8")
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


class Result:
    """What a command ended with."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code = code
        self.out = out
        self.err = err

    @property
    def lines(self) -> list[str]:
        """The lines of its output, of a command that succeeded."""
        assert self.code == 0, self.err
        return self.out.splitlines()

    @property
    def json(self) -> Any:
        """Its output, read as JSON, of a command that succeeded."""
        assert self.code == 0, self.err
        return json.loads(self.out)

    def __repr__(self) -> str:
        return f"exit code {self.code}\n{self.out}\n{self.err}"


class Shell:
    """Runs ``rosz`` commands.

    Args:
        network: Where.
        monkeypatch: Sets the environment.
        capsys: Takes what they write.
    """

    def __init__(
        self,
        network: Network,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        self.network = network
        self._seen: set[str] = set()
        self._monkeypatch = monkeypatch
        self._capsys = capsys
        for name in ("ROS_NAMESPACE", "ROSZ_CONNECT", "ROSZ_LISTEN", "ROSZ_MODE", "NO_COLOR"):
            monkeypatch.delenv(name, raising=False)
        for name in ("ROS_PACKAGE_PATH", "ROSZ_PACKAGE_PATH", "ROS_HOME", "ROS_LOG_DIR"):
            monkeypatch.delenv(name, raising=False)
        for name in ("HOME", "ROS_DOMAIN_ID", "ROSZ_RENDEZVOUS", "ROSZ_COMPLETION_TIMEOUT"):
            monkeypatch.setenv(name, network.variables()[name])
        monkeypatch.chdir(network.folder)

    def __call__(self, *words: str, stdin: str = "", terminal: bool = False) -> Result:
        """Run a command to its end.

        Args:
            words: The command line.
            stdin: What it reads.
            terminal: Whether a person types that.
        """
        self._await_tokens()
        self._monkeypatch.setattr(sys, "stdin", _Input(stdin, terminal=terminal))
        self._capsys.readouterr()
        code = run(words)
        out, err = self._capsys.readouterr()
        return Result(code, out, err)

    def _await_tokens(self) -> None:
        """Wait until a command sees what sessions of the test have declared.

        It asks the session at the meeting point, to which others may have told it only just now.
        """
        opened = (getattr(entry, "session", entry) for entry in self.network._open)
        sessions = [entry for entry in opened if isinstance(entry, Session) and not entry.closed]
        tokens = [row for session in sessions for row in session._tokens.items()]
        wanted = {key for key, token in tokens if key.startswith(_SPACE) and not token.closed}
        if len(sessions) < _SEVERAL or wanted <= self._seen:
            return
        with Session.open(SessionConfig.command(self.network.environment())) as command:
            seen = partial(command.live_tokens, f"{_SPACE}**", TIMEOUT)
            eventually(lambda: wanted <= {*seen()}, "the tokens of the test")
        self._seen = wanted

    def start(self, *words: str, **variables: str) -> Program:
        """Start a command as a process of its own."""
        return self.network.program(_MAIN, *words, **variables)


def latch(node: Node, topic: str, message: Any) -> None:
    """Publish a message that stays."""
    node.publisher(topic, type(message), latch=True).publish(message)


def with_log(node: Node) -> Node:
    """Return a node once it has its publisher of /rosout, which a thread opens."""
    rosout = node.log._rosout
    assert rosout is not None
    eventually(lambda: rosout._publish, "the publisher of /rosout")
    return node
