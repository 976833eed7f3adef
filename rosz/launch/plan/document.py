"""The XML of launch files: the tags, and a tree of elements that know their line and column.

Attributes are plain text. Text between tags is kept only inside ``<rosparam>``, and comments are
dropped. The column of an attribute is computed only when a message needs it, from the bytes of its
tag.

The two exceptions here carry an error up to the loader. Code below the loader knows only a
text or an element; the loader also knows the chain of includes and raises `LaunchFileError`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.parsers import expat

from rosz.errors import LaunchFileError, near_miss

_TEXT_TAGS = frozenset({"rosparam"})
_MAX_ENTITY = 4096  # a file may refer to an entity any number of times
_ATTRIBUTE = re.compile(r"""([^\s=/<>"']+)\s*=\s*("[^"]*"|'[^']*')""")
_REFERENCE = re.compile(r"&[^;\s]+;")
_NESTED_ENTITY = re.compile(r"&(?!amp;|lt;|gt;|quot;|apos;)[^;]*;")
_CURLY_QUOTES = frozenset("\u2018\u2019\u201a\u201b\u201c\u201d\u201e\u201f")
_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*""")
_CLOSING_TAG = re.compile(rb"</\s*([^\s>]+)")

_ERRORS = expat.errors
_HINTS = {
    _ERRORS.XML_ERROR_INVALID_TOKEN: "; attributes need quotes, and in values '&' is written"
    " '&amp;' and '<' is written '&lt;'",
    _ERRORS.XML_ERROR_SYNTAX: "; a launch file begins with <launch>",
    _ERRORS.XML_ERROR_JUNK_AFTER_DOC_ELEMENT: "; everything must stand inside one <launch> tag",
    _ERRORS.XML_ERROR_UNDEFINED_ENTITY: "; write '&amp;' for '&'",
    _ERRORS.XML_ERROR_UNBOUND_PREFIX: "; a prefix needs an xmlns declaration, and launch tags have"
    " none",
}


class TagRule:
    """The attributes and children that a tag may have.

    Args:
        attributes: Names of roslaunch's attributes, separated by spaces.
        more: Names of attributes that only rosz understands: ROS 2's names for the same thing, and
            rosz's own additions. roslaunch ignores them with a warning.
        holds: Names of the tags allowed inside.

    Attributes:
        attributes: All attribute names, including ``if`` and ``unless``.
        holds: Names of the tags allowed inside.
    """

    def __init__(self, attributes: str, more: str = "", holds: str = "") -> None:
        self.attributes: frozenset[str] = frozenset(f"{attributes} {more} if unless".split())
        self.holds: frozenset[str] = frozenset(holds.split())


_BODY = (
    "arg env executable group include let machine node param push-ros-namespace push_ros_namespace"
    " remap rosparam set_env test"
)
_NODE = "args clear_params cwd launch-prefix machine name ns output pkg required type"
_NODE_BODY = "env param remap rosparam"
_WAIT = "wait_for wait_timeout"
_START = f"respawn_max spawn_delay {_WAIT}"

TAGS = {
    "arg": TagRule("default doc name value", "description"),
    "env": TagRule("name value"),
    "executable": TagRule(
        "", f"args cmd cwd launch-prefix name output required respawn respawn_delay {_START}", "env"
    ),
    "group": TagRule("clear_params ns", f"by_reference container namespace {_WAIT}", _BODY),
    "include": TagRule("clear_params file ns pass_all_args", "namespace", "arg env"),
    "launch": TagRule("deprecated", "version", _BODY),
    "let": TagRule("", "name value"),
    "machine": TagRule("address default env-loader name password ssh-port timeout user"),
    "node": TagRule(f"{_NODE} respawn respawn_delay", f"exec namespace {_START}", f"{_NODE_BODY}"),
    "param": TagRule("binfile command name textfile type value"),
    "push-ros-namespace": TagRule("", "namespace"),
    "push_ros_namespace": TagRule("", "namespace"),
    "remap": TagRule("from to"),
    "rosparam": TagRule("command file ns param subst_value"),
    "set_env": TagRule("", "name value"),
    "test": TagRule(f"{_NODE} retry test-name time-limit", "exec namespace", f"{_NODE_BODY}"),
}
"""The rules of all tags by name."""


def misplaced(tag: str, parent: str) -> str:
    """Return the warning about a tag that has no meaning inside another."""
    holds = TAGS[parent].holds
    if not holds:
        return f"<{tag}> means nothing in <{parent}>, which holds no tags"
    hint = near_miss(tag, holds)
    if not hint and tag in TAGS:
        parents = [name for name, rule in TAGS.items() if tag in rule.holds]
        hint = f"; it is allowed in {_listing(parents)}"
    return (
        f"<{tag}> means nothing in <{parent}>{hint}"
        if hint
        else f"<{tag}> is not a launch file tag; <{parent}> may hold {_listing(holds)}"
    )


def unknown_attribute(tag: str, attribute: str) -> str:
    """Return the warning about an attribute that a tag does not have."""
    allowed = TAGS[tag].attributes
    hint = near_miss(attribute, allowed) or f"; it has {', '.join(sorted(allowed))}"
    return f"<{tag}> has no attribute '{attribute}'{hint}"


def _listing(names: Iterable[str]) -> str:
    return ", ".join(f"<{name}>" for name in sorted(names))


class TextError(Exception):
    """An error in a text, such as the value of an attribute, at the character of an index.

    Attributes:
        reason: Description of the error, the expected value, and the remedy.
    """

    def __init__(self, reason: str, index: int = 0) -> None:
        self.reason = reason
        self.index = index
        super().__init__(reason)


class TagError(Exception):
    """An error in an element.

    Attributes:
        attribute: Name of the wrong attribute, or None for the element itself.
        index: 0-based index in the value of the attribute.
        place: Path, line and column of the error if it is outside the tag.
    """

    def __init__(
        self,
        element: Element,
        reason: str,
        attribute: str | None = None,
        index: int = 0,
        *,
        place: tuple[str, int, int] | None = None,
    ) -> None:
        self.element = element
        self.reason = reason
        self.attribute = attribute
        self.index = index
        self.place = place
        super().__init__(reason)


class Element:
    """One XML element.

    Attributes:
        line: 1-based line of the ``<``.
        column: 1-based column of the ``<``.
        chunks: (text, line, column) of each piece of text, for elements whose text is kept.
    """

    def __init__(
        self, document: Document, tag: str, attributes: dict[str, str], place: tuple[int, int, int]
    ) -> None:
        self.tag: str = tag
        self.attributes: dict[str, str] = attributes
        self.children: list[Element] = []
        self.chunks: list[tuple[str, int, int]] = []
        self.line: int
        self.column: int
        self.line, self.column, self._offset = place
        self._document = document

    @property
    def file(self) -> str:
        """Path of the file, as messages show it."""
        return self._document.path

    @property
    def text(self) -> str:
        """Text of this element, without the text of its children."""
        return "".join(chunk for chunk, _, _ in self.chunks)

    def locate(self, attribute: str | None = None, index: int = 0) -> tuple[int, int]:
        """Return the line and column of the tag, or of a character in an attribute's value."""
        if attribute is None or attribute not in self.attributes:
            return self.line, self.column
        source = self._document.source(self._offset)
        for match in _ATTRIBUTE.finditer(source):
            if match[1] == attribute:
                inside = _raw_index(match[2][1:-1], index)
                return self._advance(source[: match.start(2) + 1 + inside])
        return self.line, self.column

    def locate_text(self, line: int, column: int) -> tuple[int, int]:
        """Return the file position of a 0-based line and column of the text."""
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
    """A parsed launch file."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self.launch: Element = Element(self, "launch", {}, (0, 0, 0))

    def source(self, offset: int) -> str:
        """Return the source of the tag at a byte offset, or "" if it cannot be read.

        That is the case for UTF-16, whose bytes are not searched here.
        """
        if self.data.startswith((b"\xff\xfe", b"\xfe\xff")):
            return ""
        tag = _TAG.match(self.data, offset)
        return tag[0].decode("utf-8", "replace") if tag else ""


class _Handlers:
    """The handlers that expat calls during one parse."""

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
        place = (parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, parser.CurrentByteIndex)
        name = _qualified(name)
        values = {_qualified(key): value for key, value in attributes.items()}
        element = Element(self.document, name, values, place)
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

    def entity(self, name: str, is_parameter: bool, value: str | None, *_: str | None) -> None:
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

    def explain(self, error: expat.ExpatError) -> LaunchFileError:
        """Return the error for XML that is not well-formed, naming the tag concerned."""
        reason = _ERRORS.messages.get(error.code, str(error))
        if reason == _ERRORS.XML_ERROR_TAG_MISMATCH and self.open:
            closing = _CLOSING_TAG.search(self.document.data, self.parser.ErrorByteIndex - 2)
            closed = closing[1].decode("utf-8", "replace") if closing else "?"
            opened = self.open[-1]
            hint = "" if opened.tag in TAGS else near_miss(opened.tag, TAGS)
            hint = hint or f"; expected </{opened.tag}>{_slash(opened.tag)}"
            reason = f"</{closed}> closes <{opened.tag}> of line {opened.line}{hint}"
        elif reason == _ERRORS.XML_ERROR_NO_ELEMENTS:
            reason = "the file ends before any tag"
            if self.open:
                opened = self.open[-1]
                reason = f"the file ends inside <{opened.tag}> of line {opened.line}"
        else:
            reason += self._curly_quote(reason) or _HINTS.get(reason, "")
        return LaunchFileError(
            f"not well-formed XML: {reason}", self.document.path, error.lineno, error.offset + 1
        )

    def _curly_quote(self, reason: str) -> str:
        """Return a hint if the error is a curly quote from a word processor."""
        if reason != _ERRORS.XML_ERROR_INVALID_TOKEN:
            return ""
        start = self.parser.ErrorByteIndex
        character = self.document.data[start : start + 3].decode("utf-8", "replace")
        return f'; {character} is not an XML quote: write "' if character in _CURLY_QUOTES else ""


def parse(path: str, data: bytes) -> Document:
    """Parse a launch file, in any encoding that XML can declare.

    Raises:
        LaunchFileError: If the XML is not well-formed, declares an entity that is refused, or
            does not contain exactly one ``<launch>``.
    """
    document = Document(path, data)
    reader = _Handlers(document)
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        raise reader.explain(error) from None
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
    """Return the name as written for expat's ``uri local prefix``."""
    match name.split(" "):
        case [_uri, local, prefix]:
            return f"{prefix}:{local}"
        case [*_, local]:
            return local
    return name


def _raw_index(raw: str, index: int) -> int:
    """Return the position in the source text of the value's character at an index."""
    at = 0
    for _ in range(index):
        reference = _REFERENCE.match(raw, at)
        at = reference.end() if reference else at + 1
    return min(at, len(raw))


def _slash(tag: str) -> str:
    """Return the hint that a tag without children may end with ``/>``."""
    holds = tag in TAGS and (TAGS[tag].holds or tag in _TEXT_TAGS)
    return "" if holds or tag not in TAGS else ", or '/>' in place of its '>'"
