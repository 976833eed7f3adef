from __future__ import annotations

import datetime as dt
import os
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path
from queue import SimpleQueue

import pytest
from hypothesis import given
from network import TIMEOUT, eventually

from rosz.errors import PartlyWritten, StoreError
from rosz.params.history import History
from rosz.params.replica import Replica
from rosz.params.replica.core.effects import Compact, Save
from rosz.params.replica.core.events import Saved
from rosz.params.replica.storage import Storage, StoreFile
from rosz.params.writes import DELETED, Write, put

from .network import Network
from .strategies import writes
from .test_replica import Mute

WRITER = """
import sys
from pathlib import Path
from rosz.params.replica import Replica
from rosz.params.replica.core.effects import Compact, Save
from rosz.params.replica.core.events import Saved
from rosz.params.replica.storage import StoreFile
from rosz.params.writes import put
store = StoreFile(Path(sys.argv[1]))
for number in range(1, 1_000_000):
    store.save([put(("n", str(number % 50)), (number, "c"), number)])
    print(number, flush=True)
"""


def saved(path: Path, *batches: list[Write]) -> History:
    store = StoreFile(path)
    for batch in batches:
        store.save(batch)
    store.close()
    return loaded(path)


def loaded(path: Path) -> History:
    history = History()
    with closing(StoreFile(path)) as store:
        history.apply(store.load()[0])
    return history


@given(writes())
def test_what_is_saved_comes_back(
    tmp_path_factory: pytest.TempPathFactory, batch: list[Write]
) -> None:
    history = History()
    news = [write for one in batch for write in history.apply([one])]
    path = tmp_path_factory.mktemp("store") / "params"
    again = saved(path, news)
    assert again.root == history.root
    assert again.digest() == history.digest()
    assert {write.origin for write in again.writes()} == {
        write.origin for write in history.writes()
    }


def test_what_is_hidden_leaves_the_file(tmp_path: Path) -> None:
    path = tmp_path / "params"
    saved(
        path,
        [
            put(("a", "b"), (1, "c"), 1),
            put(("a b",), (1, "c"), 1),
            put(("a", "c"), (9, "c"), 1),
        ],
        [put(("a",), (5, "c"), DELETED)],
    )
    base = sqlite3.connect(path)
    assert base.execute("SELECT path FROM writes ORDER BY path").fetchall() == [
        ("a",),
        ("a b",),
        ("a/c",),
    ]
    base.close()
    saved(path, [put((), (20, "c"), {})])
    assert len(loaded(path)) == 1


def test_replacing_drops_all_else(tmp_path: Path) -> None:
    store = StoreFile(tmp_path / "params")
    store.save([put(("a",), (1, "c"), 1), put(("b",), (2, "c"), DELETED)])
    moment = dt.datetime(2024, 1, 2, tzinfo=dt.UTC)
    store.replace([put(("c",), (3, "c"), {"when": moment, "raw": b"\x00"})])
    assert [(write.path, write.value) for write in store.load()[0]] == [
        (("c",), {"when": moment, "raw": b"\x00"})
    ]
    store.close()
    store.close()


def test_a_file_in_use_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "params"
    store = StoreFile(path)
    with pytest.raises(StoreError, match=f"'{path}' is in use by another process"):
        StoreFile(path)
    store.close()
    StoreFile(path).close()


def test_another_programs_database_is_refused_and_left(tmp_path: Path) -> None:
    path = tmp_path / "other"
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE t (x)")
    base.commit()
    base.close()
    before = path.read_bytes()
    with pytest.raises(StoreError, match=f"'{path}' is a database, but not of parameters"):
        StoreFile(path)
    assert path.read_bytes() == before


def test_another_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "params"
    saved(path, [])
    base = sqlite3.connect(path)
    base.execute("PRAGMA user_version = 7")
    base.close()
    with pytest.raises(StoreError, match="is of version 7, expected 2"):
        StoreFile(path)


@pytest.mark.parametrize("offset", [0, 20, 40, 4096, 4100, 8192])
def test_a_damaged_file_is_refused_by_name_and_left(tmp_path: Path, offset: int) -> None:
    path = tmp_path / "params"
    batch = [put(("n", str(number)), (number + 1, "c"), "x" * 50) for number in range(200)]
    saved(path, batch)
    content = bytearray(path.read_bytes())
    content[offset : offset + 64] = b"\xa5" * 64
    path.write_bytes(content)
    with pytest.raises(StoreError, match=str(path)):
        StoreFile(path)
    assert path.read_bytes() == content


@pytest.mark.parametrize("place", [0, 0.3, 0.6, 0.9])
def test_one_wrong_byte_in_a_value_is_noticed(tmp_path: Path, place: float) -> None:
    path = tmp_path / "params"
    saved(path, [put(("n", str(n)), (n + 1, "c"), "x" * 50) for n in range(200)])
    content = bytearray(path.read_bytes())
    at = content.index(b"x" * 50, int(len(content) * place)) + 25
    content[at] = ord("y")
    path.write_bytes(content)
    with pytest.raises(StoreError, match=f"'{path}' is damaged .*the checksum of '/n/"):
        loaded(path)
    assert path.read_bytes() == content


def test_a_damaged_value_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "params"
    saved(path, [put(("a",), (1, "c"), 1)])
    base = sqlite3.connect(path)
    base.execute("UPDATE writes SET value = x'c1'")
    base.commit()
    base.close()
    store = StoreFile(path)
    with pytest.raises(StoreError, match=f"'{path}' is damaged"):
        store.load()
    store.close()


@pytest.mark.parametrize("content", [b"no database at all, but text" * 40, b"x"])
def test_a_file_that_is_no_database_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "params"
    path.write_bytes(content)
    with pytest.raises(StoreError, match=f"'{path}' is damaged"):
        StoreFile(path)
    assert path.read_bytes() == content


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none" / "params"
    with pytest.raises(StoreError, match=f"cannot open '{path}': unable to open database file"):
        StoreFile(path)


def test_a_kill_loses_nothing_that_was_saved(tmp_path: Path) -> None:
    path = tmp_path / "params"
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None
    told = 0
    while told < 30:
        told = int(writer.stdout.readline())
    os.kill(writer.pid, signal.SIGKILL)
    rest = writer.stdout.read().split()
    writer.stdout.close()
    writer.wait(TIMEOUT)
    told = max([told, *map(int, rest)])
    history = loaded(path)
    assert told <= history.latest <= told + 1
    assert len(history) == min(history.latest, 50)


def test_a_replica_comes_back_with_its_file(network: Network, tmp_path: Path) -> None:
    path = tmp_path / "params"
    keeper = network.replica(storage=Storage(StoreFile(path)))
    other = network.replica()
    eventually(lambda: len(keeper.members()) == 1)
    other.set("/a", {"b": 1, "c": 2})
    keeper.delete("/a/b")
    other.set("/late", 5)
    assert loaded_while_open(path) == {"a": {"c": 2}, "late": 5}
    keeper.close()
    other.close()
    again = network.replica(storage=Storage(StoreFile(path)))
    assert again.root == {"a": {"c": 2}, "late": 5}
    newer = again.set("/a", 1)
    assert newer.time > 0
    again.close()
    assert loaded(path).root == {"a": 1, "late": 5}


def forget_all(replica: Replica) -> int:
    """Have a replica forget all deletions."""
    with replica._runner as history:
        return history.forget(0)


def test_a_store_that_was_away_brings_nothing_back(network: Network, tmp_path: Path) -> None:
    path = tmp_path / "params"
    keeper = network.replica(storage=Storage(StoreFile(path)))
    other = network.replica()
    eventually(lambda: len(keeper.members()) == 1)
    other.set("/gone", 1)
    other.set("/kept", 1)
    keeper.close()
    eventually(lambda: other.members() == [])
    other.delete("/gone")
    assert forget_all(other) == 1
    with closing(StoreFile(path)) as store:
        store.save([put(("mine",), (time.time_ns(), "c0"), "written while away")])
    again = network.replica(storage=Storage(StoreFile(path)))
    expected = {"kept": 1, "mine": "written while away"}
    eventually(lambda: again.root == other.root == expected)
    assert again.digest() == other.digest()
    other.close()
    again.close()
    with closing(StoreFile(path)) as store:
        writes, horizon = store.load()
    assert sorted(write.path for write in writes) == [("kept",), ("mine",)]
    assert horizon > 0


def test_who_remembers_less_learns_what_others_have_forgotten(network: Network) -> None:
    one, other = network.replicas(2)
    one.set("/gone", 1)
    one.delete("/gone")
    assert forget_all(one) == 1
    assert other.compare(10)
    late = network.replica()
    assert one.digest() == other.digest() == late.digest()
    for replica in (one, other, late):
        with replica._runner as history:
            history.apply([put(("gone",), (1, "c0"), 1)])
            assert history.root == {}


def test_a_file_of_the_earlier_form_is_read(tmp_path: Path) -> None:
    path = tmp_path / "params"
    saved(path, [put(("a",), (1, "c"), {"b": 1}), put(("a", "c"), (2, "c"), DELETED)])
    base = sqlite3.connect(path)
    base.execute("DROP TABLE horizon")
    base.execute("PRAGMA user_version = 1")
    base.close()
    for _ in range(2):
        with closing(StoreFile(path)) as store:
            writes, horizon = store.load()
            assert (len(writes), horizon) == (2, 0)
    with closing(StoreFile(path)) as store:
        store.replace(writes, 7)
        assert store.load()[1] == 7


class Disk(StoreFile):
    """Keeps writes, unless it is full."""

    def __init__(self, *, full: bool = False) -> None:
        self.full = full
        self.kept: list[Write] = []

    def load(self) -> tuple[list[Write], int]:
        return [], 0

    def save(self, writes: list[Write]) -> None:
        if self.full:
            raise StoreError("no space left")
        self.kept += writes

    def replace(self, writes: list[Write], horizon: int = 0) -> None:  # noqa: ARG002  # no need
        self.kept = writes

    def close(self) -> None:
        self.full = True


def held(storage: Storage) -> threading.Event:
    """Have a storage wait, so that what comes is there at once when it goes on."""
    go_on = threading.Event()

    def wait() -> None:
        assert go_on.wait(TIMEOUT)

    storage._worker.submit(wait)
    return go_on


def test_a_file_with_stamps_years_ahead_is_read_and_mended(
    network: Network, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "params"
    with closing(StoreFile(path)) as store:
        store.save([put(("a",), (time, "f0"), "kept") for time in ((1 << 62) - 1, (1 << 62) + 1)])
        store.save([put(("b",), (5, "f0"), 1)])
    for _ in range(2):
        replica = network.replica(storage=Storage(StoreFile(path)))
        assert replica.root["a"] in {"kept", "new"}
        assert replica.set("/a", "new").slow == ()
        replica.close()
    assert caplog.text.count("years ahead") == 1
    with closing(StoreFile(path)) as store:
        found = {write.path: write for write in store.load()[0]}
    assert found[("a",)].value == "new"
    assert found[("a",)].time < time.time_ns() + 10**9
    assert found[("b",)].time == 5


def test_what_comes_right_before_the_end_is_saved() -> None:
    disk = Disk()
    storage = Storage(disk)
    go_on = held(storage)
    storage.save(Save(1, [put(("n",), (1, "c"), 1)]))
    end = threading.Thread(target=storage.close)
    end.start()
    eventually(lambda: storage._worker.closed)
    go_on.set()
    end.join()
    assert [write.path for write in disk.kept] == [("n",)]


def test_what_is_done_is_told_in_order() -> None:
    disk = Disk()
    storage = Storage(disk)
    told: SimpleQueue[Saved] = SimpleQueue()
    storage.on_saved = told.put
    go_on = held(storage)
    for number in (1, 2):
        storage.save(Save(number, [put(("n",), (number, "c"), number)]))
    storage.save(Compact(3, [put(("m",), (3, "c"), 3)], 0))
    storage.save(Save(4, [put(("n",), (4, "c"), 4)]))
    go_on.set()
    assert [told.get(timeout=TIMEOUT).number for _ in range(3)] == [2, 3, 4]
    assert [write.time for write in disk.kept] == [3, 4]
    disk.full = True
    storage.save(Save(5, [put(("n",), (5, "c"), 5)]))
    assert told.get(timeout=TIMEOUT) == Saved(5, "no space left")
    storage.close()


def test_a_full_disk_is_told_to_every_writer(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    disk = Disk()
    keeper = network.replica(storage=Storage(disk), label="keeper")
    other = network.replica(label="other")
    eventually(lambda: len(keeper.members()) == 1)
    other.set("/a", 1)
    disk.full = True
    for number, replica in enumerate((keeper, other, keeper, other)):
        with pytest.raises(PartlyWritten) as caught:
            replica.set("/a", number, timeout=TIMEOUT)
        assert str(caught.value) == "'/a' is written, but not kept at keeper: no space left"
        assert keeper.root == other.root == {"a": number}
    assert caplog.text.count("parameters cannot be saved") == 1
    disk.full = False
    eventually(lambda: "parameters are saved again" in caplog.text)
    other.set("/b", 2)
    history = History()
    history.apply(disk.kept)
    assert history.root == keeper.root == other.root == {"a": 3, "b": 2}


def test_a_file_that_cannot_grow_keeps_what_it_has(network: Network, tmp_path: Path) -> None:
    path = tmp_path / "params"
    store = StoreFile(path)
    replica = network.replica(storage=Storage(store))
    replica.set("/a", 1)
    store._base.execute("PRAGMA max_page_count = 1")
    with pytest.raises(PartlyWritten, match=f"cannot write '{path}': database or disk is full"):
        replica.set("/large", "x" * 100_000, timeout=TIMEOUT)
    assert sorted(replica.root) == ["a", "large"]
    replica.set("/large", 1, timeout=0)
    store._base.execute("PRAGMA max_page_count = 10000")
    replica.set("/b", 2, timeout=TIMEOUT)
    replica.close()
    assert loaded(path).root == {"a": 1, "large": 1, "b": 2}


def test_a_set_waits_for_replicas_and_the_disk_within_one_time(network: Network) -> None:
    storage = Storage(Disk())
    replica = network.replica(storage=storage, label="me")
    Mute(network)
    eventually(lambda: len(replica.members()) == 1)
    go_on = held(storage)
    begun = time.monotonic()
    outcome = replica.set("/a", 1, timeout=4)
    taken = time.monotonic() - begun
    go_on.set()
    assert outcome.slow == ("mute program (pid 7 on elsewhere)", "the file of me")
    assert taken < 8  # each by itself waits for 4 s


def loaded_while_open(path: Path) -> dict[str, object]:
    """Read a copy of the file as a power cut would have left it."""
    copy = path.with_name("copy")
    for suffix in ("", "-wal"):
        source = path.with_name(path.name + suffix)
        if source.exists():
            copy.with_name(copy.name + suffix).write_bytes(source.read_bytes())
    return loaded(copy).root
