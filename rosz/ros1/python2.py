"""Explains the errors of Python 2 scripts under Python 3."""

from __future__ import annotations

import re

from rosz.errors import SourceError

_CONVERT = "convert the file with: 2to3 -w {path} (or futurize -w {path})"

# Errors of Python 3's parser and the Python 2 syntax that causes them. For "invalid syntax" the
# line itself is matched.
_MESSAGES = (
    (re.compile(r"Missing parentheses in call to 'print'"), "print without parentheses"),
    (re.compile(r"Missing parentheses in call to 'exec'"), "exec without parentheses"),
    (re.compile(r"multiple exception types must be parenthesized"), "'except Error, name'"),
    (re.compile(r"leading zeros in decimal integer literals"), "an octal number such as 0777"),
    (re.compile(r"parameters cannot be parenthesized"), "a tuple among the parameters"),
)
_LINES = (
    (re.compile(r"^\s*print\s+[^(=\s]"), "print without parentheses"),
    (re.compile(r"^\s*raise\s+[\w.]+\s*,"), "'raise Error, text'"),
    (re.compile(r"^\s*except\s+[^:]+,\s*\w+\s*:"), "'except Error, name'"),
    (re.compile(r"<>"), "'<>' for '!='"),
    (re.compile(r"`[^`]*`"), "backticks for repr()"),
    (re.compile(r"\b\d+[lL]\b"), "a long number such as 10L"),
    (re.compile(r"\b[uU][rR]['\"]"), "a text such as ur''"),
)
_NAMES = {
    "basestring": "str",
    "cmp": "(a > b) - (a < b)",
    "execfile": "exec(open(path).read())",
    "long": "int",
    "raw_input": "input",
    "reduce": "functools.reduce",
    "reload": "importlib.reload",
    "unichr": "chr",
    "unicode": "str",
    "xrange": "range",
}
_MODULES = {
    "ConfigParser": "configparser",
    "Queue": "queue",
    "SocketServer": "socketserver",
    "StringIO": "io",
    "Tkinter": "tkinter",
    "__builtin__": "builtins",
    "cPickle": "pickle",
    "commands": "subprocess",
    "cookielib": "http.cookiejar",
    "httplib": "http.client",
    "thread": "_thread",
    "tkMessageBox": "tkinter.messagebox",
    "urllib2": "urllib.request",
    "urlparse": "urllib.parse",
}
_METHODS = {
    "has_key": "'key in dict'",
    "iteritems": "items()",
    "iterkeys": "keys()",
    "itervalues": "values()",
}


def explain(error: SyntaxError, path: str) -> SourceError | None:
    """Return an error that explains Python 2 syntax, or None if that is not the cause."""
    line, column = error.lineno or 0, error.offset or 0
    if isinstance(error, TabError):
        reason = (
            "indented by tabs and spaces in turn, as Python 2 allowed; write 8 columns for each"
            f" tab with: expand -i -t 8 {path}"
        )
        return SourceError(reason, path, line, column)
    what = _match(error)
    if what is None:
        return None
    return SourceError(
        f"this is Python 2 ({what}); {_CONVERT.format(path=path)}", path, line, column
    )


def _match(error: SyntaxError) -> str | None:
    for table, text in ((_MESSAGES, error.msg), (_LINES, error.text or "")):
        for pattern, what in table:
            if pattern.search(text):
                return what
    return None


def hint(error: BaseException) -> str:
    """Return the replacement of a name that only Python 2 has; empty for other errors."""
    name = getattr(error, "name", None) or ""
    if isinstance(error, ModuleNotFoundError) and name in _MODULES:
        return f"module '{name}' is Python 2; Python 3 has '{_MODULES[name]}'"
    if isinstance(error, NameError) and name in _NAMES:
        return f"'{name}' is Python 2; Python 3 has '{_NAMES[name]}'"
    if isinstance(error, AttributeError) and name in _METHODS:
        return f"'{name}' is Python 2; Python 3 has {_METHODS[name]}"
    return ""
