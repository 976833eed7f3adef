"""``rosz turtlesim``: save pictures of turtlesims."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import write_file
from rosz.cli.declare import Argument, Option
from rosz.errors import UsageError

__all__ = ("app",)

app = new_group("Save pictures of turtlesims; 'rosz run turtlesim turtlesim_node' starts one.")


@app.command("snapshot")
def snapshot(
    call: Call,
    file: Annotated[str, Argument("FILE.png", "The file; '-' is standard output.", suggest.files)],
    *,
    node: Annotated[str, Option("--node NODE", "Turtlesim, if several run.", suggest.nodes)] = "",
) -> None:
    """Save a picture of the field with its turtles."""
    from rosz.turtlesim import fetch

    if file != "-" and Path(file).suffix.lower() != ".png":
        raise UsageError(f"'{file}' does not end in .png; the picture is written as PNG")
    with call.session() as session:
        picture = fetch(session, call.domain, call.resolve(node) if node else "")
    if file == "-":
        sys.stdout.buffer.write(picture.png)
    else:
        write_file(file, picture.png)
