"""A process that records or plays bags for the page, ``python -m rosz.web.bag_process``.

It is one of its own, so that neither the page nor the messages wait for the other. Lines of
JSON on standard input are the `BagOrder` and then `BagCommand` values; lines on standard output are
`BagReport` values. It ends by itself when standard input does: a page that is killed leaves a whole
bag.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import IO

import msgspec

from rosz.bags.play import Player, Progress
from rosz.errors import ClosedError, RoszError
from rosz.node import Node
from rosz.web.model import BagCommand, BagOrder, BagReport, PlayOrder, RecordOrder
from rosz.worker import start_thread

_PERIOD = 0.5
_SWITCH_SECONDS = 0.0005
"""The thread that reads ahead must not keep the one that publishes waiting for longer."""


class _PageChannel:
    """Both ends of the conversation."""

    def __init__(self, commands: IO[bytes], reports: IO[bytes]) -> None:
        self._commands = commands
        self._reports = reports
        self._lock = threading.Lock()

    def order(self) -> BagOrder:
        """Return the first line."""
        return msgspec.json.decode(self._commands.readline(), type=BagOrder)

    def follow(self, handle: Callable[[BagCommand], object]) -> None:
        """Handle each further line on a thread, and ``stop`` at the end."""

        def read() -> None:
            for line in self._commands:
                handle(msgspec.json.decode(line, type=BagCommand))
            handle(BagCommand("stop"))

        start_thread(threading.Thread(target=read, name="rosz-bag-commands", daemon=True))

    def report(self, report: BagReport) -> None:
        """Write a line; a page that has gone needs none."""
        line = msgspec.json.encode(report) + b"\n"
        with self._lock, suppress(BrokenPipeError):
            self._reports.write(line)

    def say(self, text: str) -> None:
        """Write a sentence."""
        self.report(BagReport(said=text))


def _record(order: RecordOrder, line: _PageChannel) -> None:
    from rosz.bags.record import BagFiles, ParameterRecord, Recorder, Selection

    selection = Selection(order.topics, every=not order.topics, exclude=order.exclude)
    ended = threading.Event()

    def handle(command: BagCommand) -> None:
        if command.do == "stop":
            ended.set()

    with ExitStack() as stack:
        node = stack.enter_context(Node("record", anonymous=True, argv=()))
        files = stack.enter_context(BagFiles(order, line.say))
        if selection.parameters:
            parameters = stack.enter_context(ParameterRecord(node, files, line.say))
            files.begin = parameters.begin
        recorder = stack.enter_context(
            Recorder(node, selection, files, lambda _: None, 0, ended, buffer=order.buffer)
        )
        begun = time.monotonic()

        def report() -> None:
            disk = os.statvfs(".")
            line.report(
                BagReport(
                    path=files.path.name,
                    seconds=time.monotonic() - begun,
                    messages=files.count,
                    size=files.size,
                    lost=recorder.lost,
                    left=disk.f_bavail * disk.f_frsize,
                    topics=len(recorder.topics),
                )
            )

        stack.callback(report)  # once more, before the bag is finished
        line.follow(handle)
        while not (files.finished.is_set() or ended.wait(_PERIOD) or node.is_shutdown):
            report()
        if recorder.error is not None:
            raise recorder.error


def _play(order: PlayOrder, line: _PageChannel) -> None:
    from rosz.bags import open_reader

    sys.setswitchinterval(_SWITCH_SECONDS)
    with ExitStack() as stack:
        reader = stack.enter_context(open_reader(order.name))
        for problem in reader.problems:
            line.say(str(problem))
        node = stack.enter_context(Node("play", anonymous=True, argv=()))

        def report(progress: Progress) -> None:
            line.report(
                BagReport(
                    path=order.name,
                    seconds=progress.elapsed,
                    duration=progress.duration,
                    messages=progress.published,
                    rate=progress.rate,
                    paused=progress.paused,
                    loop=player.loop,
                )
            )

        player = Player(node, [reader], order, line.say, report)
        line.follow(lambda command: _handle(player, command))
        player.advertise()
        player.run()


def _handle(player: Player, command: BagCommand) -> None:
    if command.do == "stop":
        player.stop()
    elif command.do == "pause":
        player.toggle()
    elif command.do == "step":
        player.step()
    elif command.do == "jump":
        player.jump(command.value)
    elif command.do == "rate":
        player.set_rate(command.value)
    elif command.do == "loop":
        player.loop = bool(command.value)


def _main() -> None:
    """Execute the command of the first line."""
    reports = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # only reports go to the page; the node's log goes to standard error
    # Unbuffered, since the thread that waits for a line must not hold a lock when the process ends.
    line = _PageChannel(os.fdopen(os.dup(0), "rb", buffering=0), reports)
    order = line.order()
    try:
        if order.record is not None:
            _record(order.record, line)
        elif order.play is not None:
            _play(order.play, line)
    except ClosedError:
        return  # the node was shut down
    except RoszError as error:
        line.report(BagReport(fault=str(error)))


if __name__ == "__main__":
    _main()
