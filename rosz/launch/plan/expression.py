"""Evaluate the expressions of ``$(eval …)`` by walking Python's syntax tree.

Nothing is passed to Python's own ``eval``. An expression may use constants, operators,
comprehensions, plain lambdas, and the names and methods listed here; anything else is refused by
name. Names are looked up in roslaunch's order: the functions of launch files and of `math`, the
args of the file, then those functions of Python that only compute.

An expression may come from a stranger, so it has a budget of steps and elements. Every value that
is computed is charged for its size, and `_Evaluation._check_size` charges the operations that can
explode before they run.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import string
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from rosz.errors import near_miss
from rosz.launch.plan.document import TextError

__all__ = ("evaluate",)

_MAX_LENGTH = 10_000
_MAX_DEPTH = 80
_MAX_BITS = 4096
_MAX_WIDTH = 9_999
_MAX_DIGITS = 400
_BUDGET = 100_000
_CHARACTERS_PER_UNIT = 64

_WIDE = re.compile(r"\d{5,}")
_WIDE_PERCENT = re.compile(r"%(\([^)]*\))?[^a-zA-Z%]*?\d{5,}")
_STAR_PERCENT = re.compile(r"%(\([^)]*\))?[^a-zA-Z%]*\*")

_VALUES = (bool, int, float, complex, str, list, tuple, dict, set, frozenset, range, type(None))
_FORMATTED = (bool, int, float, complex, str, type(None))

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

_METHODS: Mapping[type, frozenset[str]] = {
    str: frozenset(
        name
        for name in dir(str)
        if not name.startswith("_")
        and name not in {"encode", "expandtabs", "format_map", "maketrans", "translate"}
    ),
    list: frozenset({"copy", "count", "index"}),
    tuple: frozenset({"count", "index"}),
    dict: frozenset({"copy", "get", "items", "keys", "values"}),
    range: frozenset({"count", "index"}),
    set: frozenset({"difference", "intersection", "issubset", "issuperset", "union"}),
    int: frozenset({"bit_length", "conjugate"}),
    float: frozenset({"hex", "is_integer"}),
}

_MATH: Mapping[str, Any] = {
    "true": True,
    "false": False,
    **{name: value for name, value in vars(math).items() if not name.startswith("_")},
}

_BUILTINS: Mapping[str, Callable[..., Any]] = {
    function.__name__: function
    for function in (
        *(abs, all, any, bin, bool, chr, complex, dict, divmod, enumerate, filter, float),
        *(format, frozenset, hex, int, isinstance, len, list, map, max, min, oct, ord, range),
        *(repr, reversed, round, set, slice, sorted, str, sum, tuple, zip),
    )
}
_ITERATORS = (enumerate, filter, map, reversed, zip)


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
        TextError: If the text is not an expression, uses something that is not allowed, takes too
            many steps, or fails.
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
        value = evaluation.value(tree.body)
        if not isinstance(value, _VALUES):
            raise _Refused("the result is a function; expected a value")  # noqa: TRY301
        return str(value)
    except _Refused as error:
        raise TextError(str(error), max(evaluation.column, 0) + shift) from None
    except RecursionError:
        raise TextError("it calls itself without end", max(evaluation.column, 0) + shift) from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        reason = f"the expression fails: {type(error).__name__}: {error}"
        raise TextError(reason, max(evaluation.column, 0) + shift) from None


class _Refused(Exception):
    """An expression that is not allowed or takes too much."""


_FAILURES = (
    *(_Refused, TextError, ArithmeticError, AttributeError, LookupError, RecursionError),
    *(TypeError, ValueError),
)


class _Evaluation(string.Formatter):
    """The evaluation of one expression; as a formatter, it does the work of ``str.format``."""

    def __init__(
        self,
        functions: Mapping[str, Callable[..., Any]],
        arg: Callable[[str], Any | None],
        args: Iterable[str],
    ) -> None:
        self._functions = functions
        self._arg = arg
        self._args = args
        self._locals: list[dict[str, Any]] = []
        self._left = _BUDGET
        self._depth = 0
        self.column = -1

    def _charge(self, units: float) -> None:
        self._left -= int(min(units, 2 * _BUDGET))
        if self._left < 0:
            raise _Refused(f"it takes more than {_BUDGET} steps or elements")

    def _settle(self, value: Any) -> Any:
        """Charge a value for its size, and return it."""
        self._charge(1 + _size(value, self._left + 1))
        return value

    def _check_size(self, operation: str, *operands: Any) -> None:  # noqa: C901, PLR0912  # a list
        """Charge an operation whose result may be large, before it runs."""
        match operation, operands:
            case "Pow", (int(base), int(exponent)):
                self._check_bits(base.bit_length() * exponent)
            case "LShift", (int(number), int(places)):
                self._check_bits(number.bit_length() + places)
            case "Mult", (int(left), int(right)):
                self._check_bits(left.bit_length() + right.bit_length())
            case "Mult", ((str() | list() | tuple()) as sequence, int(times)):
                unit = _CHARACTERS_PER_UNIT if isinstance(sequence, str) else 1
                self._charge(len(sequence) * max(times, 0) // unit)
            case "Mult", (int(times), (str() | list() | tuple()) as sequence):
                self._check_size("Mult", sequence, times)
            case "Mod", (str(pattern), values):
                _check_width(_MAX_WIDTH + 1 if _WIDE_PERCENT.search(pattern) else 0)
                if _STAR_PERCENT.search(pattern):
                    raise _Refused("a field width from a value ('*') is not available")
                self._charge(pattern.count("%") * _size(values, self._left + 1))
            case "format", (str(spec),):
                _check_width(_MAX_WIDTH + 1 if _WIDE.search(spec) else 0)
            case "center" | "ljust" | "rjust" | "zfill", (_, int(width), *_):
                _check_width(width)
            case "join", (str(separator), list(parts)):
                self._check_size("Mult", separator, len(parts))
            case "replace", (str(text), str(_), str(new), *_):
                self._check_size("Mult", new, len(text) + 1)
            case "factorial" | "comb" | "perm", (int(number), *_):
                self._check_bits(number * math.log2(max(number, 2)))
            case "lcm", numbers:
                self._check_bits(sum(number.bit_length() for number in numbers))
            case "round", (int(digits),):
                if abs(digits) > _MAX_DIGITS:
                    raise _Refused(f"it rounds to more than {_MAX_DIGITS} digits")
            case "range", (range() as numbers,):
                span = abs(numbers.stop - numbers.start)
                self._charge(span // abs(numbers.step))

    def _check_bits(self, bits: float) -> None:
        if bits > _MAX_BITS:
            raise _Refused(f"it makes a number of more than {_MAX_BITS} bits")
        self._charge(bits // 256)

    def value(self, node: ast.expr) -> Any:
        """Return the value of a node of the syntax tree."""
        if self._depth >= _MAX_DEPTH:
            raise _Refused(f"it nests deeper than {_MAX_DEPTH}")
        self._depth += 1
        try:
            return self._settle(self._evaluate(node))
        except _FAILURES:
            if self.column < 0:  # the innermost node that failed
                self.column = node.col_offset
            raise
        finally:
            self._depth -= 1

    def _evaluate(self, node: ast.expr) -> Any:  # noqa: C901, PLR0911, PLR0912  # a list
        match node:
            case ast.Constant(value) if isinstance(value, _VALUES):
                return value
            case ast.Name(name):
                return self._name(name)
            case ast.BinOp():
                return self._binary(node)
            case ast.UnaryOp(op, operand):
                return self._operate(type(op), self.value(operand))
            case ast.BoolOp(op, values):
                return self._either(values, stop=isinstance(op, ast.Or))
            case ast.Compare(left, ops, comparators):
                return self._compare(self.value(left), zip(ops, comparators, strict=True))
            case ast.IfExp(test, body, orelse):
                return self.value(body if self.value(test) else orelse)
            case ast.List(elements):
                return self._elements(elements)
            case ast.Tuple(elements):
                return tuple(self._elements(elements))
            case ast.Set(elements):
                return set(self._elements(elements))
            case ast.Dict(keys, values):
                return self._dict(zip(keys, values, strict=True))
            case ast.Subscript(owner, index):
                return self.value(owner)[self.value(index)]
            case ast.Slice(lower, upper, step):
                return slice(*(part and self.value(part) for part in (lower, upper, step)))
            case ast.Attribute(owner, name):
                return self._method(self.value(owner), name, node.end_col_offset)
            case ast.Call(function, args, keywords):
                return self._call(self.value(function), self._elements(args), keywords)
            case ast.Lambda(spec, body):
                return self._lambda(spec, body)
            case ast.ListComp(element, loops) | ast.GeneratorExp(element, loops):
                return self._comprehend(loops, element)
            case ast.SetComp(element, loops):
                return set(self._comprehend(loops, element))
            case ast.DictComp(key, value, loops):
                return dict(self._comprehend(loops, key, value))
            case ast.JoinedStr(values):
                return "".join(str(self.value(part)) for part in values)
            case ast.FormattedValue(value, conversion, spec):
                shown = self.value(value)
                shown = repr(shown) if conversion in {ord("r"), ord("a")} else shown
                return self.format_field(shown, self.value(spec) if spec else "")
        raise _Refused(f"{_describe(node)} is not available in expressions")

    def _name(self, name: str) -> Any:
        for names in (*reversed(self._locals), self._functions):
            if name in names:
                return names[name]
        value = _MATH[name] if name in _MATH else self._arg(name)
        if value is None:
            value = _BUILTINS.get(name)
        if callable(value) and not isinstance(value, type):
            return partial(self._run, value)  # checked also when Python calls it, as in map
        if value is not None:
            return value
        known = [*_MATH, *self._functions, *_BUILTINS]
        hint = near_miss(name, self._args) or near_miss(name, known)
        if name == "math":
            hint = "; use the names of math alone: write 'pi', not 'math.pi'"
        raise _Refused(f"'{name}' is not an arg of this file and not a function{hint}")

    def _binary(self, node: ast.BinOp) -> Any:
        chain = [node]  # a long sum nests deeply to the left, so it is not evaluated recursively
        while isinstance(chain[-1].left, ast.BinOp):
            chain.append(chain[-1].left)
        result = self.value(chain[-1].left)
        for step in reversed(chain):
            result = self._operate(type(step.op), result, self.value(step.right))
        return result

    def _operate(self, kind: type[ast.AST], *operands: Any) -> Any:
        if kind not in _OPERATORS:
            raise _Refused("'@' is not available in expressions")
        self._check_size(kind.__name__, *operands)
        return self._settle(_OPERATORS[kind](*operands))

    def _either(self, parts: Iterable[ast.expr], *, stop: bool) -> Any:
        result: Any = None
        for part in parts:
            result = self.value(part)
            if bool(result) is stop:
                break
        return result

    def _compare(self, left: Any, rest: Iterable[tuple[ast.cmpop, ast.expr]]) -> Any:
        result: Any = True
        for op, comparator in rest:
            right = self.value(comparator)
            self._settle((left, right))  # comparing long values takes time
            result = self._operate(type(op), left, right)
            if not result:
                break
            left = right
        return result

    def _elements(self, nodes: Iterable[ast.expr]) -> list[Any]:
        elements: list[Any] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                elements += self.value(node.value)
            else:
                elements.append(self.value(node))
        return elements

    def _dict(self, items: Iterable[tuple[ast.expr | None, ast.expr]]) -> dict[Any, Any]:
        result: dict[Any, Any] = {}
        for key, value in items:
            if key is None:
                result.update(self.value(value))
            else:
                result[self.value(key)] = self.value(value)
        return result

    def _method(self, owner: Any, name: str, column: int | None) -> Callable[..., Any]:
        allowed = _METHODS.get(type(owner), frozenset())
        if name not in allowed:
            self.column = column or 0
            known = f"; it has {', '.join(sorted(allowed))}" if allowed else ""
            kind = "function" if callable(owner) else type(owner).__name__
            raise _Refused(f"'.{name}' of a {kind} is not available{known}")

        def call(*args: Any, **kwargs: Any) -> Any:
            self._settle((owner, args))
            if name == "format":
                return self.vformat(owner, args, kwargs)
            if name == "join":
                args = tuple(list(arg) for arg in args)
            self._check_size(name, owner, *args)
            result = getattr(owner, name)(*args, **kwargs)
            return list(result) if name in {"items", "keys", "values"} else result

        return call

    def _call(self, function: Any, args: list[Any], keywords: Iterable[ast.keyword]) -> Any:
        kwargs: dict[str, Any] = {}
        for keyword in keywords:
            value = self.value(keyword.value)
            kwargs.update(value if keyword.arg is None else {keyword.arg: value})
        if not callable(function):
            raise _Refused(f"{function!r} is not a function")
        self._settle(args)
        result = function(*args, **kwargs)
        if isinstance(result, range):
            self._check_size("range", result)
        return list(result) if function in _ITERATORS else result

    def _run(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Call a function of Python or `math` within the limits."""
        if function is sum:
            return self._fold(ast.Add, 0, *args, **kwargs)
        if function is math.prod:
            return self._fold(ast.Mult, 1, *args, **kwargs)
        if function is format:
            return self.format_field(*args, **kwargs)
        if function is round:
            return self._round(*args, **kwargs)
        self._check_size(function.__name__, *args)
        return function(*args, **kwargs)

    def _round(self, number: Any, ndigits: Any = None) -> Any:
        self._check_size("round", ndigits)
        return round(number, ndigits)

    def _fold(
        self, kind: type[ast.operator], neutral: Any, items: Iterable[Any], start: Any = None
    ) -> Any:
        """Return the ``sum`` or ``prod`` of values, with each step within the limits."""
        result = neutral if start is None else start
        for item in items:
            result = self._operate(kind, result, item)
        return result

    def get_field(
        self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> tuple[Any, Any]:
        """Return the value of a replacement field, which may not name an attribute."""
        if "." in field_name:
            raise _Refused(f"'{{{field_name}}}' reaches for an attribute")
        found: tuple[Any, Any] = super().get_field(field_name, args, kwargs)
        return found

    def format_field(self, value: Any, format_spec: str = "") -> str:
        """Return a formatted value of limited width."""
        self._check_size("format", format_spec)
        if not isinstance(value, _FORMATTED):
            return str(value)
        text: str = self._settle(format(value, format_spec))
        return text

    def _lambda(self, spec: ast.arguments, body: ast.expr) -> Callable[..., Any]:
        if spec.vararg or spec.kwarg or spec.kwonlyargs or spec.defaults:
            raise _Refused("a lambda takes plain parameters only")
        names = [parameter.arg for parameter in (*spec.posonlyargs, *spec.args)]
        outer = list(self._locals)

        def call(*values: Any) -> Any:
            if len(values) != len(names):
                raise _Refused(f"a lambda of {len(names)} parameters got {len(values)}")
            caller = self._locals
            self._locals = [*outer, dict(zip(names, values, strict=True))]
            try:
                return self.value(body)
            finally:
                self._locals = caller

        return call

    def _comprehend(self, loops: list[ast.comprehension], *element: ast.expr) -> list[Any]:
        """Return the elements of a comprehension, which are pairs for a dict."""
        self._locals.append({})
        try:
            rounds = self._loop(loops)
            if len(element) == 1:
                return [self.value(element[0]) for _ in rounds]
            return [tuple(self.value(part) for part in element) for _ in rounds]
        finally:
            self._locals.pop()

    def _loop(self, loops: list[ast.comprehension]) -> Iterator[None]:
        if not loops:
            yield
            return
        first, *others = loops
        for item in self.value(first.iter):
            self._charge(1)
            self._assign(first.target, item)
            if all(self.value(test) for test in first.ifs):
                yield from self._loop(others)

    def _assign(self, target: ast.expr, item: Any) -> None:
        if isinstance(target, ast.Name):
            self._locals[-1][target.id] = item
            return
        if not isinstance(target, ast.Tuple | ast.List):
            raise _Refused("a loop assigns to names only")
        items = list(item)
        if len(items) != len(target.elts):
            raise _Refused(f"expected {len(target.elts)} values in a loop, got {len(items)}")
        for part, value in zip(target.elts, items, strict=True):
            self._assign(part, value)


def _describe(node: ast.expr) -> str:
    if isinstance(node, ast.Constant):
        return repr(node.value)
    name = type(node).__name__
    return {"NamedExpr": "':='", "Starred": "'*'"}.get(name, name)


def _check_width(width: int) -> None:
    if width > _MAX_WIDTH:
        raise _Refused(f"it makes a field wider than {_MAX_WIDTH}")


def _size(value: Any, limit: int) -> int:
    """Return the number of elements of a value at any depth, counted up to a limit."""
    total = 0
    stack = [value]
    while stack and total <= limit:
        item = stack.pop()
        if isinstance(item, str):
            total += len(item) // _CHARACTERS_PER_UNIT
        elif isinstance(item, int) and item.bit_length() > _MAX_BITS:
            total += _BUDGET
        elif isinstance(item, range):
            total += len(item)
        elif isinstance(item, dict):
            total += len(item)
            stack += item.keys()
            stack += item.values()
        elif isinstance(item, list | tuple | set | frozenset):
            total += len(item)
            stack += item
    return total
