"""``rosz turtlesim``: pictures of running turtlesims."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from rosz.cli.declare import Argument, Context, Option
from rosz.cli.group import call_of, new_group, write_file
from rosz.errors import UsageError

__all__ = ("app",)

app = new_group("Look at turtlesims; 'rosz run turtlesim turtlesim_node' starts one.")


@app.command("snapshot")
def snapshot(
    context: Context,
    file: Annotated[str, Argument(metavar="FILE.png", help="Where to; '-' is stdout.")],
    *,
    node: Annotated[
        str, Option("--node", metavar="NODE", help="Which one, if several are running.")
    ] = "",
) -> None:
    """Save a picture of the field with its turtles."""
    from rosz.turtlesim.snapshot import fetch

    if file != "-" and Path(file).suffix.lower() != ".png":
        raise UsageError(f"'{file}' does not end in .png: that is what is written")
    call = call_of(context)
    with call.session() as session:
        picture = fetch(session, call.domain, call.resolve(node) if node else "")
    if file == "-":
        sys.stdout.buffer.write(picture.png)
    else:
        write_file(file, picture.png)
