"""The manual and README: what they name exists, and what they show runs."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from textwrap import dedent

import pytest

ROOT = Path(__file__).parent.parent
PAGES = sorted((ROOT / "rosz" / "share" / "manual").glob("*.md"))
README = ROOT / "README.md"
_BLOCK = re.compile(r"(?:^    .*\n|^\n(?=    ))+", re.MULTILINE)


def blocks(page: Path) -> list[str]:
    return [dedent(found.group()) for found in _BLOCK.finditer(page.read_text() + "\n")]


def test_readme_is_a_first_page() -> None:
    assert len(README.read_text().splitlines()) <= 150


def test_readme_links_to_every_page() -> None:
    linked = set(re.findall(r"\]\((rosz/share/manual/\w+\.md)\)", README.read_text()))
    assert linked == {str(page.relative_to(ROOT)) for page in PAGES}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_pages_begin_with_a_title_and_refer_to_topics_that_exist(page: Path) -> None:
    text = page.read_text()
    assert re.match(r"# \S.*\n\n", text)
    topics = {topic for topic in re.findall(r"rosz help (\w+)", text) if topic != "TOPIC"}
    assert topics <= {other.stem for other in PAGES}


def test_pictures_are_there_and_small() -> None:
    folder = ROOT / "rosz" / "share" / "manual"
    named = {
        found for page in PAGES for found in re.findall(r"!\[.*?\]\((.+?)\)", page.read_text())
    }
    there = {str(file.relative_to(folder)) for file in folder.rglob("*.webp")}
    assert named == there
    assert sum((folder / name).stat().st_size for name in there) < 400_000


@pytest.mark.parametrize("page", [README, *PAGES], ids=lambda page: page.stem)
def test_python_in_pages_is_valid(page: Path) -> None:
    for block in blocks(page):
        if re.search(r"^\s*(import|from) \w", block, re.MULTILINE):
            ast.parse(block)
