"""``rosz keys``: make and check keys for machines and people, and the rules beside them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

from rosz.cli.console import count, print_json
from rosz.cli.declare import App, Argument, Json, Option, at_least
from rosz.errors import UsageError

app = App("Make and check the keys that links between machines need (ROSZ_KEYS).")

_Folder = Annotated[
    str, Option("--dir -d DIR", "Folder of all keys; ROSZ_KEYS or the working folder if omitted.")
]


@app.command("init")
def init_keys(
    folder: Annotated[str, Argument("DIR")],
    *,
    name: Annotated[str, Option("--name NAME", "Name of the authority in certificates.")] = "rosz",
    days: Annotated[int, Option("--days DAYS", "Time until the authority expires.")] = 3650,
) -> None:
    """Make a folder for keys, with an authority that signs them."""
    from rosz.security import Authority

    at_least("--days", days, 1, "days")
    authority = Authority.create(Path(folder).absolute(), name, days)
    sys.stdout.write(
        f"made the authority in {authority.folder}\n"
        "its key is what all trust hangs on: keep the folder 'authority' on this machine alone\n"
        f"next: rosz keys add HOST --dir {folder}\n"
    )


@app.command("add")
def add_keys(
    names: Annotated[list[str], Argument("HOST|USER")],
    *,
    address: Annotated[
        list[str] | None,
        Option("--address ADDRESS", "An address or another name of the host; repeatable."),
    ] = None,
    days: Annotated[int, Option("--days DAYS", "Time until the keys expire.")] = 825,
    folder: _Folder = "",
) -> None:
    """Make keys for machines or people."""
    from rosz.security import Authority

    at_least("--days", days, 1, "days")
    if address and len(names) > 1:
        raise UsageError("--address is of one host; expected a single HOST with it")
    authority = Authority(_folder(folder, f"add {' '.join(names)} --dir"))
    for name in names:
        made = authority.add(name, address or (), days)
        sys.stdout.write(f"made {made}; copy it to {name}, and set ROSZ_KEYS to the copy there\n")


@app.command("revoke")
def revoke_keys(
    names: Annotated[list[str], Argument("HOST|USER")], *, folder: _Folder = ""
) -> None:
    """Revoke the keys of machines or people, such as of a robot that was stolen.

    Every machine has to get the new certificate of the authority. Running cores notice it.
    """
    from rosz.security import Authority

    authority = Authority(_folder(folder, f"revoke {' '.join(names)} --dir"))
    for name in names:
        gone = authority.revoke(name)
        sys.stdout.write(f"revoked the keys of {name}, which are in {gone} now\n")
    sys.stdout.write(
        f"next: copy {authority.folder}/authority/certificate.pem to all other machines, as the"
        " file authority.pem of their keys; each refuses the revoked keys from then on\n"
    )


@app.command("list")
def list_keys(*, json: Json = False, folder: _Folder = "") -> None:
    """List the holders of keys, with their addresses and the dates on which the keys expire."""
    from rosz.security import review_keys

    review = review_keys(_folder(folder, "list --dir"))
    if json:
        print_json(review)
        return
    for holder in review.holders:
        places = f" ({', '.join(holder.places)})" if holder.places else ""
        sys.stdout.write(f"{holder.name}{places}: until {holder.until:%Y-%m-%d}\n")


@app.command("check")
def check_keys(
    folder: Annotated[str, Argument("DIR", "ROSZ_KEYS or the working folder if omitted.")] = "",
    *,
    json: Json = False,
) -> int:
    """Check certificates, access to key files, and rules; exit code 1 if something is wrong."""
    from rosz.security import review_keys

    review = review_keys(_folder(folder, "check"))
    if json:
        print_json(review)
    else:
        for holder in review.holders:
            sys.stdout.write(f"{holder.name}: until {holder.until:%Y-%m-%d}\n")
        for place in review.rules:
            sys.stdout.write(f"{place.file}\n")
            for who, allowed in place.allowed.items():
                sys.stdout.writelines(f"  {who}: {line}\n" for line in allowed)
        sys.stdout.writelines(f"WRONG: {line}\n" for line in review.wrong)
        holders = count(len(review.holders), "holder")
        sys.stdout.write(f"{holders} of keys, {len(review.wrong)} wrong\n")
    return int(bool(review.wrong))


def _folder(given: str, command: str) -> Path:
    """Return the folder of keys to use."""
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
