"""``rosz keys``: from nothing to keys for two machines, and what is said of mistakes."""

from __future__ import annotations

import json
from pathlib import Path

from .command import rosz


def test_keys_are_made_and_checked(tmp_path: Path) -> None:
    keys = str(tmp_path / "keys")
    assert rosz(tmp_path, "keys", "init", keys).stdout.startswith("made the authority in ")
    added = rosz(tmp_path, "keys", "add", "robot", "--address", "10.0.0.5", "--dir", keys)
    assert added.stdout.startswith(f"made {keys}/robot; copy it to robot")
    rosz(tmp_path, "keys", "add", "laptop", "anna", variables={"ROSZ_KEYS": keys})
    listed = rosz(tmp_path, "keys", "list", "--dir", keys).stdout.splitlines()
    assert [line.split(":")[0] for line in listed] == ["anna", "laptop", "robot (10.0.0.5)"]
    (tmp_path / "keys" / "rules.yaml").write_text("laptop: {publish: [/cmd_vel]}\n")
    checked = rosz(tmp_path, "keys", "check", keys)
    assert checked.returncode == 0
    assert "  laptop: publish /cmd_vel" in checked.stdout.splitlines()
    as_json = json.loads(rosz(tmp_path, "keys", "check", "--json", keys).stdout)
    assert [holder["name"] for holder in as_json["holders"]] == ["anna", "laptop", "robot"]


def test_keys_are_revoked(tmp_path: Path) -> None:
    keys = str(tmp_path / "keys")
    rosz(tmp_path, "keys", "init", keys)
    rosz(tmp_path, "keys", "add", "robot", "laptop", "--dir", keys)
    revoked = rosz(tmp_path, "keys", "revoke", "robot", "--dir", keys).stdout.splitlines()
    assert revoked[0].startswith(f"revoked the keys of robot, which are in {keys}/revoked/robot-")
    assert revoked[1].startswith(f"next: copy {keys}/authority/certificate.pem to all other ")
    assert rosz(tmp_path, "keys", "list", "--dir", keys).stdout.startswith("laptop: until ")
    assert rosz(tmp_path, "keys", "check", keys).returncode == 0
    unknown = rosz(tmp_path, "keys", "revoke", "laptp", "--dir", keys)
    assert unknown.returncode == 2
    assert f"'laptp' has no keys in '{keys}'; did you mean 'laptop'?" in unknown.stderr
    assert rosz(tmp_path, "keys", "add", "robot", "--dir", keys).returncode == 0


def test_check_reports_what_is_wrong(tmp_path: Path) -> None:
    keys = tmp_path / "keys"
    rosz(tmp_path, "keys", "init", str(keys))
    rosz(tmp_path, "keys", "add", "robot", "--dir", str(keys))
    (keys / "rules.yaml").write_text("robot: {fly: true}\n")
    (keys / "robot" / "key.pem").chmod(0o644)
    checked = rosz(tmp_path, "keys", "check", str(keys))
    assert checked.returncode == 1
    assert f"WRONG: {keys}/rules.yaml:1:9: 'fly' is not a permission" in checked.stdout
    assert "WRONG: others may read" in checked.stdout
    started = rosz(tmp_path, "topic", "list", variables={"ROSZ_KEYS": str(keys / "robot")})
    assert started.returncode == 2
    assert started.stderr.startswith("ERROR: others may read ")


def test_mistakes(tmp_path: Path) -> None:
    none = rosz(tmp_path, "keys", "add", "robot", "--dir", str(tmp_path))
    assert none.returncode == 2
    assert (
        none.stderr
        == f"ERROR: no authority in '{tmp_path}': 'rosz keys init {tmp_path}' makes one\n"
    )
    two = rosz(tmp_path, "keys", "add", "a", "b", "--address", "10.0.0.1", "--dir", str(tmp_path))
    assert two.returncode == 2
    assert "--address is of one host" in two.stderr


def test_keys_in_the_folder_keys_are_suggested(tmp_path: Path) -> None:
    rosz(tmp_path, "keys", "init", "keys")
    for words, meant in (
        (["list"], "rosz keys list --dir keys"),
        (["check"], "rosz keys check keys"),
        (["add", "robot"], "rosz keys add robot --dir keys"),
    ):
        done = rosz(tmp_path, "keys", *words)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr == (
            f"ERROR: no keys in '{tmp_path}', but in './keys': '{meant}', or set ROSZ_KEYS\n"
        )
        assert rosz(tmp_path, *meant.split()[1:]).returncode == 0
    done = rosz(tmp_path, "keys", "list", variables={"ROSZ_KEYS": str(tmp_path / "none")})
    assert f"no keys in '{tmp_path}/none': " in done.stderr
