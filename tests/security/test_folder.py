from __future__ import annotations

import datetime as dt
import os
import ssl
from contextlib import suppress
from pathlib import Path

import pytest
from cli.command import rosz

from rosz.errors import UsageError, YamlError
from rosz.security import Authority, KeyFolder, review_keys
from rosz.wire import Endpoint


def test_only_their_owner_may_read_the_files(authority: Authority) -> None:
    home = authority.add("robot")
    for name in ("key", "certificate", "authority"):
        assert (home / f"{name}.pem").stat().st_mode & 0o777 == 0o600
    assert home.stat().st_mode & 0o777 == 0o700
    assert (authority.folder / "authority" / "key.pem").stat().st_mode & 0o777 == 0o600


def test_strict_tls_clients_accept_the_keys(authority: Authority) -> None:
    """Python's own clients are strict from 3.13 on (RFC 5280, 4.2.1)."""
    keys = KeyFolder.find(authority.add("robot"), "robot")
    here = ssl.create_default_context(cafile=keys.authority)
    here.verify_flags |= ssl.VERIFY_X509_STRICT
    there = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    there.load_cert_chain(keys.certificate, keys.key)
    up, down = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = here.wrap_bio(down, up, server_hostname="robot")
    server = there.wrap_bio(up, down, server_side=True)
    for end in (client, server):
        with suppress(ssl.SSLWantReadError):
            end.do_handshake()
    client.do_handshake()
    assert client.getpeercert()


def test_found_by_host_name_or_directly(authority: Authority) -> None:
    home = authority.add("robot")
    assert KeyFolder.find(authority.folder, "robot").path == home
    assert KeyFolder.find(home, "other").path == home


def test_a_key_that_others_can_read_is_refused(authority: Authority) -> None:
    home = authority.add("robot")
    (home / "key.pem").chmod(0o640)
    with pytest.raises(UsageError, match=r"others may read '.*key.pem' \(mode 0640, expected 0600"):
        KeyFolder.find(home, "robot")
    (authority.folder / "authority" / "key.pem").chmod(0o644)
    with pytest.raises(UsageError, match="others may read"):
        Authority(authority.folder)


@pytest.mark.parametrize("name", ["authority.pem", "rules.yaml"])
def test_files_that_anybody_may_write_are_refused(authority: Authority, name: str) -> None:
    """Whoever may write these files decides who is trusted, and what each may do."""
    home = authority.add("robot")
    (home / "rules.yaml").write_text("a: all\n")
    assert KeyFolder.find(home, "robot").rules is not None
    (home / name).chmod(0o666)
    with pytest.raises(UsageError, match=rf"anybody may write '.*{name}' \(mode 0666\)"):
        KeyFolder.find(home, "robot")
    assert any("anybody may write" in line for line in review_keys(authority.folder).wrong)


@pytest.mark.parametrize("kind", ["pipe", "folder", "loose link", "no text", "deep"])
def test_rules_that_cannot_be_read(authority: Authority, kind: str) -> None:
    home = authority.add("robot")
    file = home / "rules.yaml"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    elif kind == "loose link":
        file.symlink_to("nothing")
    else:
        file.write_bytes(b"\xff\xfe" if kind == "no text" else b"[" * 9999)
    with pytest.raises((UsageError, YamlError), match=r"rules\.yaml"):
        KeyFolder.find(home, "robot")
    assert any("rules.yaml" in line for line in review_keys(authority.folder).wrong)


def test_impossible_lifetimes(authority: Authority) -> None:
    with pytest.raises(UsageError, match=r"1e\+07 days from now is not a date"):
        authority.add("robot", days=1e7)
    assert not (authority.folder / "robot").exists()


@pytest.mark.parametrize("command", ["init", "add"])
def test_keys_are_made_for_a_day_at_least(
    authority: Authority, tmp_path: Path, command: str
) -> None:
    words = ("init", "new") if command == "init" else ("add", "robot", "-d", str(authority.folder))
    done = rosz(tmp_path, "keys", *words, "--days", "0")
    assert done.returncode == 2
    assert "--days is 0; expected 1 or more days" in done.stderr


def test_no_key(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no key in '.*' \(ROSZ_KEYS\): expected 'key.pem' there"):
        KeyFolder.find(tmp_path, "robot")


def test_half_a_copy(authority: Authority) -> None:
    home = authority.add("robot")
    (home / "authority.pem").unlink()
    with pytest.raises(
        UsageError, match=r"has a key but no 'authority.pem'; copy the whole folder"
    ):
        KeyFolder.find(home, "robot")


def test_invalid_rules_prevent_the_start(authority: Authority) -> None:
    home = authority.add("robot")
    (home / "rules.yaml").write_text("a: {drive: true}\n")
    with pytest.raises(YamlError, match=r"rules.yaml:1:5: 'drive' is not a permission"):
        KeyFolder.find(home, "robot")


def test_nothing_is_overwritten(authority: Authority) -> None:
    key = (authority.add("robot") / "key.pem").read_bytes()
    with pytest.raises(UsageError, match="'robot' has keys already"):
        authority.add("robot")
    with pytest.raises(UsageError, match="has an authority already"):
        Authority.create(authority.folder)
    assert (authority.folder / "robot" / "key.pem").read_bytes() == key


@pytest.mark.parametrize("name", ["../up", "", "authority", "revoked", "a b", "-x", "a" * 65])
def test_names_of_holders(authority: Authority, name: str) -> None:
    with pytest.raises(UsageError, match="is not a name for a holder of keys"):
        authority.add(name)


def test_review_of_a_good_folder(authority: Authority) -> None:
    authority.add("robot", ["10.0.0.5"])
    (authority.folder / "rules.yaml").write_text("robot: {publish: [/a], set: [/b]}\n")
    found = review_keys(authority.folder)
    assert [(holder.name, holder.places) for holder in found.holders] == [("robot", ("10.0.0.5",))]
    assert found.rules[0].allowed == {"robot": ["publish /a", "set /b"]}
    assert found.wrong == []


def test_review_of_mistakes(authority: Authority, tmp_path: Path) -> None:
    authority.add("late", days=10)
    authority.add("gone", days=-1)
    (authority.add("open") / "key.pem").chmod(0o644)
    strange = Authority.create(tmp_path / "other").add("strange")
    strange.rename(authority.folder / "strange")
    own = (authority.folder / "authority" / "certificate.pem").read_bytes()
    (authority.folder / "strange" / "authority.pem").write_bytes(own)
    (authority.folder / "rules.yaml").write_text("nobody: all\n")
    wrong = "\n".join(review_keys(authority.folder).wrong)
    for part in (
        "'late' ends on",
        "'gone' ended on",
        "others may read",
        "is not signed by",
        "allows 'nobody' something, who has no keys",
    ):
        assert part in wrong


def test_review_takes_its_date_from_the_caller(authority: Authority) -> None:
    authority.add("robot", days=100)
    then = dt.datetime.now(dt.UTC) + dt.timedelta(days=101)
    assert any("'robot' ended on" in line for line in review_keys(authority.folder, then).wrong)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("tcp/robot:7447", "tls/robot:7447"),
        ("tcp/[2001:db8::1]:7447", "tls/[2001:db8::1]:7447"),
        ("tcp/localhost:7447", "tcp/localhost:7447"),
        ("tcp/127.0.0.1:0", "tcp/127.0.0.1:0"),
        ("tcp/[::1]:7447", "tcp/[::1]:7447"),
        ("unixsock-stream//run/z.sock", "unixsock-stream//run/z.sock"),
        ("tls/robot:7447", "tls/robot:7447"),
    ],
)
def test_secured_endpoints(given: str, expected: str) -> None:
    assert str(Endpoint(given).secured()) == expected


@pytest.mark.parametrize("endpoint", ["udp/robot:7447", "ws/robot:80", "quic/robot:7447"])
def test_endpoints_that_cannot_be_secured(endpoint: str) -> None:
    with pytest.raises(UsageError, match="links beyond this machine are tls"):
        Endpoint(endpoint).secured()
