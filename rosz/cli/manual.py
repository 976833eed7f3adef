"""``rosz help``: list and print the pages of the manual."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from rosz.cli.commands import COMMANDS, format_rows
from rosz.cli.declare import App, Argument
from rosz.errors import NotFoundError, near_miss

_FOLDER = Path(__file__).parents[1] / "share" / "manual"

app = App()


def pages() -> dict[str, Path]:
    """Return the pages of the manual by topic."""
    return {path.stem: path for path in sorted(_FOLDER.glob("*.md"))}


def topics() -> dict[str, str]:
    """Return the title of each page of the manual, which is its first heading, by topic."""
    titles = {}
    for topic, path in pages().items():
        lines = path.read_text(encoding="utf-8").splitlines()
        headings = (line for line in lines if line.startswith("#"))
        titles[topic] = next(headings, topic).lstrip("# ")
    return titles


@app.command()
def help_command(
    topic: Annotated[
        str, Argument("TOPIC", "A page of the manual, or a command; lists the pages if empty.")
    ] = "",
) -> None:
    """Print a page of the manual, or list the pages.

    'rosz help COMMAND' prints what 'rosz COMMAND --help' prints, unless a page has that name.
    """
    paths = pages()
    if not topic:
        sys.stdout.write(f"Usage: rosz help TOPIC\n\nTopics:\n{format_rows(topics().items())}")
    elif topic in paths:
        sys.stdout.write(paths[topic].read_text(encoding="utf-8"))
    else:
        hint = near_miss(topic, [*paths, *COMMANDS]) or "; 'rosz help' lists the topics"
        raise NotFoundError(f"no page of the manual is called '{topic}'{hint}")
