"""Parts of output: what is kept of it, and how bytes become text."""

from __future__ import annotations

from pathlib import Path

from rosz.launch.run.excerpt import make_excerpt, read_file
from rosz.launch.run.relay import MAX_KEPT, Newest


def test_a_character_that_is_cut_off_waits() -> None:
    data = "größe".encode()
    first = make_excerpt((0, b""), (0, data[:3]), None)
    assert (first.text, first.position) == ("gr", (0, 2))
    rest = make_excerpt((0, b""), (2, data[2:]), first.position)
    assert (rest.text, rest.position, rest.skipped) == ("öße", (0, len(data)), 0)


def test_text_after_a_gap_begins_with_a_whole_line() -> None:
    found = make_excerpt((0, b""), (100, b"lf a line\nwhole\r\n\x1b[1mbold\x1b[0m\x07\n"), (0, 90))
    assert (found.text, found.skipped) == ("whole\nbold\n", 10)


def test_the_newest_output_is_kept() -> None:
    newest = Newest()
    for number in range(MAX_KEPT // 50):
        newest.add(b"%099d\n" % number)
        assert len(newest.data) <= 2 * MAX_KEPT
    assert newest.after(newest.end) == (newest.end, b"")
    assert newest.after(newest.end - 100)[1] == b"%099d\n" % (MAX_KEPT // 50 - 1)
    begin, data = newest.after(0)
    assert (begin, len(data)) == (newest.end - MAX_KEPT, MAX_KEPT)
    assert newest.after(newest.end + 1) == (begin, data)
    newest.add(b"x" * 3 * MAX_KEPT)
    assert newest.after(-1) == (newest.end - MAX_KEPT, b"x" * MAX_KEPT)


def test_a_file_that_became_shorter_is_read_afresh(tmp_path: Path) -> None:
    file = tmp_path / "log"
    assert read_file(file, 0) == (0, b"")
    file.write_bytes(b"one\ntwo\n")
    assert read_file(file, 4) == (4, b"two\n")
    assert read_file(file, 100) == (0, b"one\ntwo\n")
    assert read_file(None, 100) == (0, b"")
