"""``rosz keys``: make keys for machines and people, and check them and the rules beside them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rosz.security.review import Review

__all__ = ("app",)

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    help="Make and check the keys that links between machines need (ROSZ_KEYS).",
)

_Folder = Annotated[
    str, typer.Option("--dir", "-d", metavar="DIR", help="Folder of all keys; ROSZ_KEYS, or here.")
]


@app.command("init")
def init_keys(
    folder: Annotated[str, typer.Argument(metavar="DIR")],
    *,
    name: Annotated[str, typer.Option(help="What certificates call the authority.")] = "rosz",
    days: Annotated[int, typer.Option(min=1, help="How long it is good for.")] = 3650,
) -> None:
    """Make a folder of keys, with an authority that signs them."""
    from rosz.security.authority import Authority

    authority = Authority.create(Path(folder).absolute(), name, days)
    sys.stdout.write(
        f"made the authority in {authority.folder}\n"
        "its key is what all trust hangs on: keep the folder 'authority' on this machine alone\n"
        f"next: rosz keys add HOST --dir {folder}\n"
    )


@app.command("add")
def add_keys(
    names: Annotated[list[str], typer.Argument(metavar="HOST|USER...")],
    *,
    address: Annotated[
        list[str] | None,
        typer.Option(help="An address or further name that others reach the host at; repeatable."),
    ] = None,
    days: Annotated[int, typer.Option(min=1, help="How long they are good for.")] = 825,
    folder: _Folder = "",
) -> None:
    """Make keys for machines or people."""
    from rosz.errors import UsageError
    from rosz.security.authority import Authority

    if address and len(names) > 1:
        raise UsageError("--address is of one host; expected a single HOST with it")
    authority = Authority(_folder(folder))
    for name in names:
        made = authority.add(name, address or (), days)
        sys.stdout.write(f"made {made}; copy it to {name}, and set ROSZ_KEYS to the copy there\n")


@app.command("list")
def list_keys(
    *,
    json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
    folder: _Folder = "",
) -> None:
    """List who has keys, until when, and what for."""
    from rosz.security.review import review

    found = review(_folder(folder))
    if json:
        _print_json(found)
        return
    for one in found.holders:
        places = f" ({', '.join(one.places)})" if one.places else ""
        sys.stdout.write(f"{one.name}{places}: until {one.until:%Y-%m-%d}\n")


@app.command("check")
def check_keys(
    folder: Annotated[str, typer.Argument(metavar="[DIR]")] = "",
    *,
    json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
) -> None:
    """Check certificates, access to key files, and rules; exit 1 if something is wrong."""
    from rosz.security.review import review

    found = review(_folder(folder))
    if json:
        _print_json(found)
    else:
        for one in found.holders:
            sys.stdout.write(f"{one.name}: until {one.until:%Y-%m-%d}\n")
        for place in found.rules:
            sys.stdout.write(f"{place.file}\n")
            for who, allowed in place.allowed.items():
                sys.stdout.writelines(f"  {who}: {line}\n" for line in allowed)
        sys.stdout.writelines(f"WRONG: {line}\n" for line in found.wrong)
        sys.stdout.write(f"{len(found.holders)} holders of keys, {len(found.wrong)} wrong\n")
    if found.wrong:
        raise typer.Exit(1)


def _folder(given: str) -> Path:
    return Path(given or os.environ.get("ROSZ_KEYS") or ".").expanduser().absolute()


def _print_json(found: Review) -> None:
    import msgspec

    sys.stdout.write(msgspec.json.format(msgspec.json.encode(found)).decode() + "\n")
