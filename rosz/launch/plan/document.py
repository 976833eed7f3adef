"""XML with places: a tree of tags that know their line and column.

The tree is made for launch files: attributes are text, text is kept only where a tag gives it a
meaning (``<rosparam>``), comments are dropped. Columns of attributes are worked out when somebody
asks, from the bytes of the tag.
"""

from __future__ import annotations

import re
from xml.parsers import expat

from rosz.errors import LaunchFileError, near_miss
from rosz.launch.plan.tags import TAGS

__all__ = ("Document", "Element", "parse")

_TEXT_TAGS = frozenset({"rosparam"})
_MAX_ENTITY = 4096
_ATTRIBUTE = re.compile(r"""([^\s=/<>"']+)\s*=\s*("[^"]*"|'[^']*')""")
_REFERENCE = re.compile(r"&[^;\s]+;")
_NESTED_ENTITY = re.compile(r"&(?!amp;|lt;|gt;|quot;|apos;)[^;]*;")
_CURLY_QUOTES = frozenset("\u2018\u2019\u201a\u201b\u201c\u201d\u201e\u201f")
_CLOSING_TAG = re.compile(rb"</\s*([^\s>]+)")

_HINTS = {
    expat.errors.codes[
        expat.errors.XML_ERROR_INVALID_TOKEN
    ]: "; attributes need quotes, and in values '&' is written '&amp;' and '<' is written '&lt;'",
    expat.errors.codes[expat.errors.XML_ERROR_SYNTAX]: "; a launch file begins with <launch>",
    expat.errors.codes[
        expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT
    ]: "; everything must stand inside one <launch> tag",
    expat.errors.codes[expat.errors.XML_ERROR_UNDEFINED_ENTITY]: "; write '&amp;' for '&'",
    expat.errors.codes[
        expat.errors.XML_ERROR_UNBOUND_PREFIX
    ]: "; a prefix needs an xmlns declaration, and launch tags have none",
}


class Element:
    """A tag.

    Attributes:
        tag: Its name as written.
        attributes: Name to value, references resolved.
        children: The tags inside it, in order.
        line: 1-based line of its ``<``.
        column: 1-based column of its ``<``.
        chunks: (text, line, column) of its own text, for tags whose text means something.
    """

    __slots__ = (
        "_document",
        "_offset",
        "attributes",
        "children",
        "chunks",
        "column",
        "line",
        "tag",
    )

    def __init__(
        self, document: Document, tag: str, attributes: dict[str, str], place: tuple[int, int, int]
    ) -> None:
        self.tag = tag
        self.attributes = attributes
        self.children: list[Element] = []
        self.chunks: list[tuple[str, int, int]] = []
        self.line, self.column, self._offset = place
        self._document = document

    @property
    def file(self) -> str:
        """What its file is called."""
        return self._document.path

    @property
    def text(self) -> str:
        """Its own text, without that of tags inside it."""
        return "".join(chunk for chunk, _, _ in self.chunks)

    def locate(self, attribute: str | None = None, index: int = 0) -> tuple[int, int]:
        """Return line and column of the tag, or of a character in the value of an attribute."""
        if attribute is None or attribute not in self.attributes:
            return self.line, self.column
        source = self._document.source(self._offset)
        for match in _ATTRIBUTE.finditer(source):
            if match[1] == attribute:
                inside = _raw_index(match[2][1:-1], index)
                return self._advance(source[: match.start(2) + 1 + inside])
        return self.line, self.column

    def locate_text(self, line: int, column: int) -> tuple[int, int]:
        """Return where a line and column (both 0-based) of its text stand in the file."""
        at_line, at_column = 0, 0
        place = (self.line, self.column)
        for chunk, chunk_line, chunk_column in self.chunks:
            if (at_line, at_column) > (line, column):
                break
            if at_line == line:
                place = (chunk_line, chunk_column + column - at_column)
            rows = chunk.count("\n")
            if rows and at_line + rows >= line > at_line:
                place = (chunk_line + line - at_line, column + 1)
            at_line += rows
            at_column = len(chunk) - chunk.rfind("\n") - 1 if rows else at_column + len(chunk)
        return place

    def _advance(self, text: str) -> tuple[int, int]:
        rows = text.count("\n")
        if rows:
            return self.line + rows, len(text) - text.rfind("\n")
        return self.line, self.column + len(text)


class Document:
    """A parsed file.

    Attributes:
        path: What it is called in messages.
        data: Its bytes.
    """

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self.launch = Element(self, "launch", {}, (0, 0, 0))

    def source(self, offset: int) -> str:
        """Return the text of the tag that starts at a byte offset; empty where unknown."""
        if (
            self.data.startswith((b"\xff\xfe", b"\xfe\xff"))
            or self.data[offset : offset + 1] != b"<"
        ):
            return ""
        end = offset
        quote = 0
        for end in range(offset, len(self.data)):
            byte = self.data[end]
            if quote:
                quote = 0 if byte == quote else quote
            elif byte in b"\"'":
                quote = byte
            elif byte == ord(">"):
                break
        return self.data[offset : end + 1].decode("utf-8", "replace")


class _Reader:
    """The handlers of one parse."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.open: list[Element] = []
        self.root: Element | None = None
        self.launches: list[Element] = []
        self.parser = parser = expat.ParserCreate(namespace_separator=" ")
        parser.namespace_prefixes = True
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.text
        parser.EntityDeclHandler = self.entity

    def start(self, name: str, attributes: dict[str, str]) -> None:
        parser = self.parser
        place = (
            parser.CurrentLineNumber,
            parser.CurrentColumnNumber + 1,
            parser.CurrentByteIndex,
        )
        if " " in name:
            name = _qualified(name)
        element = Element(
            self.document,
            name,
            {_qualified(key): value for key, value in attributes.items()},
            place,
        )
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        if name == "launch":
            self.launches.append(element)
        self.open.append(element)

    def end(self, _name: str) -> None:
        self.open.pop()

    def text(self, text: str) -> None:
        if self.open and self.open[-1].tag.lower() in _TEXT_TAGS:
            parser = self.parser
            self.open[-1].chunks.append(
                (text, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
            )

    def entity(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        _base: str | None,
        _system: str | None,
        _public: str | None,
        _notation: str | None,
    ) -> None:
        if is_parameter or value is None:
            self.refuse(f"entity '{name}' is external; launch files read others by <include>")
        elif len(value) > _MAX_ENTITY:
            self.refuse(f"entity '{name}' is longer than {_MAX_ENTITY} characters")
        elif nested := _NESTED_ENTITY.search(value):
            self.refuse(f"entity '{name}' refers to entity '{nested[0][1:-1]}'; that may explode")

    def refuse(self, reason: str) -> None:
        parser = self.parser
        raise LaunchFileError(
            reason, self.document.path, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        )

    def damaged(self, error: expat.ExpatError) -> LaunchFileError:
        """Say what is not well-formed, with the tag that it concerns."""
        reason = expat.errors.messages.get(error.code, str(error))
        if error.code == expat.errors.codes[expat.errors.XML_ERROR_TAG_MISMATCH] and self.open:
            closing = _CLOSING_TAG.search(self.document.data, self.parser.ErrorByteIndex - 2)
            found = closing[1].decode("utf-8", "replace") if closing else "?"
            opened = self.open[-1]
            hint = "" if opened.tag in TAGS else near_miss(opened.tag, TAGS)
            hint = hint or f"; expected </{opened.tag}>{_slash(opened.tag)}"
            reason = f"</{found}> closes <{opened.tag}> of line {opened.line}{hint}"
        elif error.code == expat.errors.codes[expat.errors.XML_ERROR_NO_ELEMENTS]:
            reason = "the file ends before any tag"
            if self.open:
                opened = self.open[-1]
                reason = f"the file ends inside <{opened.tag}> of line {opened.line}"
        else:
            reason += self._quotes(error) or _HINTS.get(error.code, "")
        return LaunchFileError(
            f"not well-formed XML: {reason}", self.document.path, error.lineno, error.offset + 1
        )

    def _quotes(self, error: expat.ExpatError) -> str:
        """Recognise quotes that a word processor has put in place of those of XML."""
        if error.code != expat.errors.codes[expat.errors.XML_ERROR_INVALID_TOKEN]:
            return ""
        start = self.parser.ErrorByteIndex
        found = self.document.data[start : start + 3].decode("utf-8", "replace")
        return f'; {found} is no quote of XML: write "' if found in _CURLY_QUOTES else ""


def parse(path: str, data: bytes) -> Document:
    """Read a launch file.

    Args:
        path: What to call it in messages.
        data: Its bytes, in any encoding that XML can declare.

    Raises:
        LaunchFileError: It is not well-formed, declares entities that are refused, or has not
            exactly one ``<launch>``.
    """
    document = Document(path, data)
    reader = _Reader(document)
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        raise reader.damaged(error) from None
    except (LookupError, UnicodeError, ValueError) as error:
        raise LaunchFileError(f"the declared encoding fails: {error}", path, 1, 1) from error
    if len(reader.launches) == 1:
        document.launch = reader.launches[0]
        return document
    if reader.launches:
        second = reader.launches[1]
        reason = "a second <launch>; a file has one, and <include> brings in others"
        raise LaunchFileError(reason, path, second.line, second.column)
    root = reader.root or document.launch
    reason = f"the file has no <launch>, its outermost tag is <{root.tag}>"
    raise LaunchFileError(reason + near_miss(root.tag, ["launch"]), path, root.line, root.column)


def _qualified(name: str) -> str:
    """Turn expat's ``uri local prefix`` into the name as written."""
    match name.split(" "):
        case [_uri, local, prefix]:
            return f"{prefix}:{local}"
        case [*_, local]:
            return local
    return name


def _raw_index(raw: str, index: int) -> int:
    """Return where the character of that index in the value starts in its source text."""
    at = 0
    for _ in range(index):
        reference = _REFERENCE.match(raw, at)
        at = reference.end() if reference else at + 1
    return min(at, len(raw))


def _slash(tag: str) -> str:
    """Say how a tag that holds nothing is closed at once."""
    holds = tag in TAGS and (TAGS[tag].holds or tag in _TEXT_TAGS)
    return "" if holds or tag not in TAGS else ", or '/>' in place of its '>'"
