"""``rosz launch --keys``: the launch and its nodes use the keys of a folder."""

from __future__ import annotations

from pathlib import Path

from rosz.security import Authority

from .command import free_endpoint, package, rosz

SHOW = '<launch><node pkg="demo" type="show" name="show" output="screen"/></launch>'


def workspace(folder: Path) -> None:
    package(folder / "src", "demo", show='#!/bin/sh\necho "keys in $ROSZ_KEYS"\n')
    (folder / "show.launch").write_text(SHOW)


def test_nodes_get_the_keys_of_the_option(tmp_path: Path) -> None:
    workspace(tmp_path)
    home = Authority.create(tmp_path / "keys").add("robot")
    variables = {"ROSZ_RENDEZVOUS": free_endpoint(), "ROSZ_KEYS": "/nowhere"}
    done = rosz(tmp_path, "launch", "show.launch", "--keys", "keys/robot", variables=variables)
    assert done.returncode == 0, done.stderr
    assert f"keys in {home}\n" in done.stdout


def test_a_folder_without_keys_starts_nothing(tmp_path: Path) -> None:
    workspace(tmp_path)
    done = rosz(tmp_path, "launch", "show.launch", "--keys", "src")
    assert done.returncode == 2
    assert done.stderr.startswith(f"ERROR: no key in '{tmp_path}/src'")
    assert done.stderr.count("\n") == 1
    assert "process[" not in done.stdout
