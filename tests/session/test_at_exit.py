"""A program does not end while a thread of it is inside Zenoh."""

from __future__ import annotations

from network import Network


def test_a_thread_that_leaves_late_is_waited_for(network: Network) -> None:
    """On a busy machine, it takes seconds; the Python runtime would abort the program."""
    program = network.program(
        """
        import threading
        from pathlib import Path
        import rosz.session

        inside = threading.Event()
        text = "def call():\\n inside.set()\\n pause.wait(2)\\n print('has left')"
        names = {"inside": inside, "pause": threading.Event(), "print": print}
        exec(compile(text, str(Path(rosz.session.__file__).with_name("call.py")), "exec"), names)
        threading.Thread(target=names["call"], daemon=True).start()
        inside.wait()
        """
    )
    assert program.exit_code() == 0
    assert program.lines == ["has left"]
