"""``rosz keys``: make keys for machines and people, and check them and the rules beside them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rosz.cli.declare import App, Argument, Option
from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.security.review import Review

__all__ = ("app",)

app = App("Make and check the keys that links between machines need (ROSZ_KEYS).")

_Folder = Annotated[
    str, Option("--dir", "-d", metavar="DIR", help="Folder of all keys; ROSZ_KEYS, or here.")
]


@app.command("init")
def init_keys(
    folder: Annotated[str, Argument(metavar="DIR")],
    *,
    name: Annotated[
        str, Option(metavar="NAME", help="What certificates call the authority.")
    ] = "rosz",
    days: Annotated[int, Option(metavar="DAYS", help="How long it is good for.")] = 3650,
) -> None:
    """Make a folder of keys, with an authority that signs them."""
    from rosz.cli.bounds import at_least
    from rosz.security.authority import Authority

    at_least("--days", days, 1, "days")
    authority = Authority.create(Path(folder).absolute(), name, days)
    sys.stdout.write(
        f"made the authority in {authority.folder}\n"
        "its key is what all trust hangs on: keep the folder 'authority' on this machine alone\n"
        f"next: rosz keys add HOST --dir {folder}\n"
    )


@app.command("add")
def add_keys(
    names: Annotated[list[str], Argument(metavar="HOST|USER...")],
    *,
    address: Annotated[
        list[str] | None,
        Option(
            metavar="ADDRESS",
            help="An address or further name that others reach the host at; repeatable.",
        ),
    ] = None,
    days: Annotated[int, Option(metavar="DAYS", help="How long they are good for.")] = 825,
    folder: _Folder = "",
) -> None:
    """Make keys for machines or people."""
    from rosz.cli.bounds import at_least
    from rosz.security.authority import Authority

    at_least("--days", days, 1, "days")
    if address and len(names) > 1:
        raise UsageError("--address is of one host; expected a single HOST with it")
    authority = Authority(_folder(folder, f"add {' '.join(names)} --dir"))
    for name in names:
        made = authority.add(name, address or (), days)
        sys.stdout.write(f"made {made}; copy it to {name}, and set ROSZ_KEYS to the copy there\n")


@app.command("list")
def list_keys(
    *,
    json: Annotated[bool, Option("--json", help="As JSON.")] = False,
    folder: _Folder = "",
) -> None:
    """List who has keys, until when, and what for."""
    from rosz.security.review import review

    found = review(_folder(folder, "list --dir"))
    if json:
        _print_json(found)
        return
    for one in found.holders:
        places = f" ({', '.join(one.places)})" if one.places else ""
        sys.stdout.write(f"{one.name}{places}: until {one.until:%Y-%m-%d}\n")


@app.command("check")
def check_keys(
    folder: Annotated[str, Argument(metavar="[DIR]")] = "",
    *,
    json: Annotated[bool, Option("--json", help="As JSON.")] = False,
) -> int:
    """Check certificates, access to key files, and rules; exit 1 if something is wrong."""
    from rosz.security.review import review

    found = review(_folder(folder, "check"))
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
        count = len(found.holders)
        holders = "1 holder" if count == 1 else f"{count} holders"
        sys.stdout.write(f"{holders} of keys, {len(found.wrong)} wrong\n")
    return int(bool(found.wrong))


def _folder(given: str, command: str) -> Path:
    """Return the folder of keys that is meant.

    Args:
        given: On the command line.
        command: What takes a folder at its end.

    Raises:
        UsageError: None is given, and the keys are not here but in a folder beside.
    """
    named = given or os.environ.get("ROSZ_KEYS")
    here = Path.cwd()
    if not named and not _has_keys(here) and _has_keys(here / "keys"):
        raise UsageError(
            f"no keys in '{here}', but in './keys': 'rosz keys {command} keys', or set ROSZ_KEYS"
        )
    return Path(named or here).expanduser().absolute()


def _has_keys(folder: Path) -> bool:
    from rosz.security import CERTIFICATE

    return (folder / CERTIFICATE).is_file() or any(folder.glob(f"*/{CERTIFICATE}"))


def _print_json(found: Review) -> None:
    import msgspec

    sys.stdout.write(msgspec.json.format(msgspec.json.encode(found)).decode() + "\n")
