from __future__ import annotations

import threading

import pytest
from network import Network

from rosz.session.starting import start

AT_THE_END = """
import atexit
import threading
from rosz.session.starting import start
atexit.register(lambda: print(start(threading.Thread(target=threading.get_ident))))
"""


def test_at_the_end_of_the_process_it_says_so(network: Network) -> None:
    program = network.program(AT_THE_END)
    assert program.exit_code() == 0
    assert program.lines in (["True"], ["False"])


def test_what_else_fails_is_raised() -> None:
    thread = threading.Thread(target=threading.get_ident)
    assert start(thread)
    with pytest.raises(RuntimeError, match="once"):
        start(thread)
    thread.join()
