"""Evaluate the expressions of ``$(eval …)`` by walking Python's syntax tree.

Nothing is passed to Python's own ``eval``. An expression may use constants, operators, lists,
tuples, sets, dicts, f-strings, and call the functions and methods listed here; anything else is
refused by name. Names are looked up in roslaunch's order: the functions of launch files and of
`math`, the args of the file, then those functions of Python that only compute.

An expression may be untrusted. Its only loops are those of functions that call another one, such
as `map`, and each of their steps is charged, so the number of its operations is limited. The total
size of all values is limited too: each value is charged when it is computed, and the operations
whose result may be huge are charged before they run.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import string
import warnings
from collections.abc import Callable, ItemsView, Iterable, KeysView, Mapping, ValuesView
from typing import Any

import msgspec

from rosz.errors import near_miss
from rosz.launch.plan.document import TextError

# An expression may come from a file that nobody has read, so neither its time nor its memory may
# grow without limit: numbers double their digits with each multiplication, and fields are padded.
_MAX_LENGTH = 10_000
_MAX_DEPTH = 150
_MAX_BITS = 4096
_MAX_WIDTH = 9_999
_MAX_DIGITS = 400
_MAX_RANGE = 2**60
_MAX_SIZE = 100_000
_CHARACTERS_PER_UNIT = 64

_WIDE = re.compile(r"\d{5,}")
_WIDE_PERCENT = re.compile(r"%(\([^)]*\))?[^a-zA-Z%]*?(\d{5,}|\*)")

_VALUES = (bool, int, float, complex, str, list, tuple, dict, set, range, type(None))
_ITERATORS = (enumerate, filter, map, reversed, zip, KeysView, ValuesView, ItemsView)

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.LShift: operator.lshift,
    ast.Mod: operator.mod,
    ast.Mult: operator.mul,
    ast.Pow: operator.pow,
    ast.RShift: operator.rshift,
    ast.Sub: operator.sub,
    ast.Invert: operator.invert,
    ast.Not: operator.not_,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Eq: operator.eq,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda item, container: item in container,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.NotEq: operator.ne,
    ast.NotIn: lambda item, container: item not in container,
}

_NOT_FOR_TEXT = {"encode", "expandtabs", "format_map", "maketrans", "translate"}
_METHODS: Mapping[type, set[str]] = {
    str: {name for name in dir(str) if not name.startswith("_")} - _NOT_FOR_TEXT,
    list: {"copy", "count", "index"},
    tuple: {"count", "index"},
    range: {"count", "index"},
    dict: {"copy", "get", "items", "keys", "values"},
    set: {"difference", "intersection", "issubset", "issuperset", "union"},
    float: {"hex", "is_integer"},
}

_MATH: Mapping[str, Any] = {
    "true": True,
    "false": False,
    **{
        name: value
        for name, value in vars(math).items()
        if not name.startswith("_") and name not in {"prod", "sumprod"}  # they multiply anything
    },
}

_BUILTINS: Mapping[str, Callable[..., Any]] = {
    function.__name__: function
    for function in (
        *(abs, all, any, bin, bool, chr, dict, divmod, enumerate, filter, float, format, hex, int),
        *(len, list, map, max, min, oct, ord, range, repr, reversed, round, set, sorted, str, sum),
        *(tuple, zip),
    )
}

_REFUSED: Mapping[type[ast.expr], str] = {
    ast.DictComp: "a dict comprehension",
    ast.GeneratorExp: "a generator expression",
    ast.Lambda: "a lambda",
    ast.ListComp: "a list comprehension",
    ast.NamedExpr: "':='",
    ast.SetComp: "a set comprehension",
    ast.Starred: "'*'",
}


def evaluate(
    text: str,
    functions: Mapping[str, Callable[..., Any]],
    arg: Callable[[str], Any | None],
    args: Iterable[str] = (),
) -> str:
    """Evaluate an expression and return the result as text.

    Args:
        text: The expression.
        functions: The functions of launch files by name: ``arg``, ``env``, ``find`` …
        arg: Function that returns the value of an arg by name, or None if there is none.
        args: Names of the args, for suggestions.

    Raises:
        TextError: If the text is not an expression, uses something that is not allowed, makes
            too large values, or fails.
    """
    if len(text) > _MAX_LENGTH:
        raise TextError(f"the expression is longer than {_MAX_LENGTH} characters")
    if "__" in text:
        raise TextError("an expression may not contain '__'", text.index("__"))
    stripped = text.lstrip(" \t")
    shift = len(text) - len(stripped)
    try:
        with warnings.catch_warnings(action="ignore"):  # invalid escapes are harmless here
            tree = ast.parse(stripped, mode="eval")
    except SyntaxError as error:
        index = (error.offset or 1) - 1 + shift
        raise TextError(f"not an expression: {error.msg}", index) from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise TextError(f"not an expression: {error or 'nested too deep'}") from None
    evaluation = _Evaluation(functions, arg, args)
    try:
        return str(evaluation.value(tree.body))
    except _Refused as error:
        raise TextError(str(error), max(evaluation.column, 0) + shift) from None
    except _PYTHON_ERRORS as error:
        reason = f"the expression fails: {type(error).__name__}: {error}"
        raise TextError(reason, max(evaluation.column, 0) + shift) from None


class _Refused(Exception):
    """An expression that is not allowed, or whose values are too large."""


_PYTHON_ERRORS = (ArithmeticError, LookupError, RecursionError, TypeError, ValueError)


class _Evaluation(msgspec.Struct, eq=False):
    """The evaluation of one expression."""

    _functions: Mapping[str, Callable[..., Any]]
    _arg: Callable[[str], Any | None]
    _args: Iterable[str]
    _left: float = _MAX_SIZE
    _depth: int = 0
    column: int = -1  # or that of the innermost part that failed

    def value(self, node: ast.expr) -> Any:
        if self._depth >= _MAX_DEPTH:
            raise _Refused(f"it nests deeper than {_MAX_DEPTH}")
        self._depth += 1
        try:
            return self._charged(self._evaluate(node))
        except (_Refused, TextError, *_PYTHON_ERRORS):
            if self.column < 0:
                self.column = node.col_offset
            raise
        finally:
            self._depth -= 1

    def _charge(self, size: float) -> None:
        self._left -= size
        if self._left < 0:
            raise _Refused(f"it takes more than {_MAX_SIZE} steps or elements")

    def _charged(self, value: Any) -> Any:
        self._charge(_size(value, self._left))
        return value

    def _evaluate(self, node: ast.expr) -> Any:  # noqa: C901, PLR0911  # a list
        match node:
            case ast.Constant(value) if isinstance(value, _VALUES):
                return value
            case ast.Name(name):
                value = self._name(name)
                if callable(value):
                    raise _Refused(f"'{name}' is a function; it can only be called: {name}(…)")
                return value
            case ast.BinOp(left, op, right):
                return self._operate(op, self.value(left), self.value(right))
            case ast.UnaryOp(op, operand):
                return self._operate(op, self.value(operand))
            case ast.BoolOp(op, parts):
                return self._either(parts, stop=isinstance(op, ast.Or))
            case ast.Compare():
                return self._compare(node)
            case ast.IfExp(test, body, orelse):
                return self.value(body if self.value(test) else orelse)
            case ast.List() | ast.Tuple() | ast.Set() | ast.Dict():
                return self._collect(node)
            case ast.Subscript() | ast.Attribute() | ast.Call():
                return self._access(node)
            case ast.JoinedStr() | ast.FormattedValue():
                return self._format(node)
        name = repr(node.value) if isinstance(node, ast.Constant) else type(node).__name__
        raise _Refused(f"{_REFUSED.get(type(node), name)} is not available in expressions")

    def _collect(self, node: ast.List | ast.Tuple | ast.Set | ast.Dict) -> Any:
        if isinstance(node, ast.Dict):
            pairs = zip(node.keys, node.values, strict=True)
            return {self._key(key): self.value(part) for key, part in pairs}
        values = [self.value(part) for part in node.elts]
        if isinstance(node, ast.List):
            return values
        return tuple(values) if isinstance(node, ast.Tuple) else set(values)

    def _access(self, node: ast.Subscript | ast.Attribute | ast.Call) -> Any:
        match node:
            case ast.Subscript(owner, ast.Slice(lower, upper, step)):
                bounds = [part and self.value(part) for part in (lower, upper, step)]
                return self.value(owner)[slice(*bounds)]
            case ast.Subscript(owner, index):
                return self.value(owner)[self.value(index)]
            case ast.Call(ast.Name(name)):
                return self._call(node, name, self._name(name))
            case ast.Call(ast.Attribute(owner, name) as method):
                receiver = self.value(owner)
                self._check_method(receiver, name, method.end_col_offset)
                return self._call(node, f".{name}", getattr(type(receiver), name), receiver)
            case ast.Call(function):
                raise _Refused(f"{self.value(function)!r} is not a function")
            case ast.Attribute(owner, name):
                self._check_method(self.value(owner), name, node.end_col_offset)
                raise _Refused(f"'.{name}' is a method; it can only be called: .{name}(…)")

    def _format(self, node: ast.JoinedStr | ast.FormattedValue) -> Any:
        if isinstance(node, ast.JoinedStr):
            return "".join([self.value(part) for part in node.values])
        shown = self.value(node.value)
        if node.conversion in {ord("r"), ord("a")}:
            shown = repr(shown)
        spec = self.value(node.format_spec) if node.format_spec else ""
        return self._run("format", format, shown, spec)

    def _name(self, name: str) -> Any:
        if name in self._functions:
            return self._functions[name]
        value = _MATH[name] if name in _MATH else self._arg(name)
        if value is None:
            value = _BUILTINS.get(name)
        if value is not None:
            return value
        available = [*_MATH, *self._functions, *_BUILTINS]
        hint = near_miss(name, self._args) or near_miss(name, available)
        if name == "math":
            hint = "; use the names of math alone: write 'pi', not 'math.pi'"
        raise _Refused(f"'{name}' is not an arg of this file and not a function{hint}")

    def _key(self, node: ast.expr | None) -> Any:
        if node is None:
            raise _Refused("'**' is not available in expressions")
        return self.value(node)

    def _operate(self, op: ast.AST, *operands: Any) -> Any:
        if type(op) not in _OPERATORS:
            raise _Refused("'@' is not available in expressions")
        return self._run(type(op).__name__, _OPERATORS[type(op)], *operands)

    def _either(self, parts: Iterable[ast.expr], *, stop: bool) -> Any:
        result: Any = None
        for part in parts:
            result = self.value(part)
            if bool(result) is stop:
                break
        return result

    def _compare(self, node: ast.Compare) -> Any:
        left = self.value(node.left)
        result: Any = True
        for op, comparator in zip(node.ops, node.comparators, strict=True):
            right = self.value(comparator)
            result = self._operate(op, left, right)
            if not result:
                break
            left = right
        return result

    def _check_method(self, owner: Any, name: str, column: int | None) -> None:
        allowed = _METHODS.get(type(owner), set())
        if name not in allowed:
            self.column = column or 0
            listing = f"; it has {', '.join(sorted(allowed))}" if allowed else ""
            raise _Refused(f"'.{name}' of a {type(owner).__name__} is not available{listing}")

    def _call(self, node: ast.Call, name: str, function: Any, *owner: Any) -> Any:
        if not callable(function):
            raise _Refused(f"{function!r} is not a function")
        taken = node.args[:1] if function in (filter, map) else ()
        args = [
            *owner,
            *(self._function(arg) if arg in taken else self.value(arg) for arg in node.args),
        ]
        if any(keyword.arg is None for keyword in node.keywords):
            raise _Refused("'**' is not available in expressions")
        kwargs = {
            str(given.arg): self._function(given.value)
            if given.arg == "key" and function in (max, min, sorted)
            else self.value(given.value)
            for given in node.keywords
        }
        return self._run(name, function, *args, **kwargs)

    def _function(self, node: ast.expr) -> Any:
        """Return the function that another one gets as an argument, within the limits."""
        if not isinstance(node, ast.Name):
            return self.value(node)
        name = node.id
        try:
            function = self._name(name)
        except _Refused:
            self.column = node.col_offset
            raise
        if not callable(function):
            return self.value(node)
        return lambda *args: self._charged(self._run(name, function, *args))

    def _run(self, name: str, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Run an operation, a function or a method within the limits."""
        if _bits(name, args) > _MAX_BITS:
            raise _Refused(f"it makes a number of more than {_MAX_BITS} bits")
        _check_width(name, args)
        digits = args[1] if len(args) > 1 else kwargs.get("ndigits")
        if name == "round" and abs(digits or 0) > _MAX_DIGITS:
            raise _Refused(f"it rounds to more than {_MAX_DIGITS} digits")
        self._charge(_growth(name, args, kwargs))
        result = function(*args, **kwargs)
        return list(result) if isinstance(result, _ITERATORS) else result


def _bits(name: str, args: tuple[Any, ...]) -> float:
    """Return the largest number of bits that the result of an operation on numbers may have."""
    match name, args:
        case "Pow", (int(base), int(exponent)):
            return base.bit_length() * exponent
        case "LShift", (int(number), int(places)):
            return number.bit_length() + places
        case "Mult", (int(left), int(right)):
            return left.bit_length() + right.bit_length()
        case "factorial" | "comb" | "perm", (int(number), *_):
            return number * math.log2(max(number, 2))
        case "lcm", numbers:
            return float(sum(number.bit_length() for number in numbers))
    return 0


def _check_width(name: str, args: tuple[Any, ...]) -> None:
    """Refuse an operation that makes a field of great or unknown width."""
    wide = False
    match name, args:
        case "Mod", (str(pattern), _):
            wide = bool(_WIDE_PERCENT.search(pattern))
        case "format", (_, str(spec)):
            wide = bool(_WIDE.search(spec))
        case ".format", (str(template), *_):
            for _, field, form, _ in string.Formatter().parse(template):
                if "." in (field or ""):
                    raise _Refused(f"'{{{field}}}' accesses an attribute")
                wide = wide or "{" in (form or "") or bool(_WIDE.search(form or ""))
        case ".center" | ".ljust" | ".rjust" | ".zfill", (_, int(width), *_):
            wide = width > _MAX_WIDTH
    if wide:
        raise _Refused(f"it makes a field wider than {_MAX_WIDTH}, or one whose width is computed")


def _growth(name: str, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> float:
    """Return the size that the result of an operation on sequences may have."""
    match name, args:
        case "Mult", (((str() | list() | tuple()) as sequence), int(times)) | (
            int(times),
            ((str() | list() | tuple()) as sequence),
        ):
            return _size(sequence) * max(times, 0)
        case "Mod", (str(pattern), values):
            return pattern.count("%") * _size(values)
        case ".format", (str(template), *values):
            return template.count("{") * _size([*values, *kwargs.values()])
        case ".join", (str(separator), (str() | list() | tuple() | set() | dict()) as parts):
            return len(separator) * len(parts) / _CHARACTERS_PER_UNIT
        case ".replace", (str(text), _, str(new), *_):
            return len(new) * (len(text) + 1) / _CHARACTERS_PER_UNIT
    return 0


def _size(value: Any, limit: float = _MAX_SIZE) -> float:
    """Return the size of a value with its elements at any depth, counted up to a limit."""
    total = 0.0
    stack = [value]
    while stack and total <= limit:
        item = stack.pop()
        total += 1
        if isinstance(item, str):
            total += len(item) / _CHARACTERS_PER_UNIT
        elif isinstance(item, int):
            total += _MAX_SIZE if item.bit_length() > _MAX_BITS else item.bit_length() / 256
        elif isinstance(item, range):
            # Whole numbers above 2 ** 61 may have equal hashes, which makes a set of them slow.
            large = max(abs(item.start), abs(item.stop)) > _MAX_RANGE
            total += _MAX_SIZE if large else len(item)
        elif isinstance(item, dict):
            stack += item.keys()
            stack += item.values()
        elif isinstance(item, list | tuple | set):
            stack += item
    return total
