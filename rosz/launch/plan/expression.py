"""The expressions of ``$(eval …)``: Python's, less everything that is no value.

The text is parsed as Python and walked here; nothing is ever handed to the interpreter. Names mean
what they mean to roslaunch: ``arg``, ``env``, ``optenv``, ``find``, ``anon``, ``dirname``, all of
``math``, ``true`` and ``false``, then the args of the file by name, then those functions of Python
that do nothing but compute.
"""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from rosz.errors import near_miss
from rosz.launch.plan.bounds import Budget, ExpressionError, Method, check_pattern, functions, power
from rosz.launch.plan.fault import TextFault

__all__ = ("evaluate",)

_MAX_LENGTH = 10_000
_MAX_DEPTH = 80
_BUDGET = 100_000

_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.LShift: operator.lshift,
    ast.Mod: operator.mod,
    ast.Mult: operator.mul,
    ast.RShift: operator.rshift,
    ast.Sub: operator.sub,
}
_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.Invert: operator.invert,
    ast.Not: operator.not_,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
_COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
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
_VALUES = (bool, int, float, complex, str, list, tuple, dict, set, frozenset, range, type(None))


def evaluate(
    text: str,
    own: Mapping[str, Callable[..., Any]],
    arg: Callable[[str], Any | None],
    args: Iterable[str] = (),
) -> str:
    """Evaluate an expression and write the result as ``str`` does.

    Args:
        text: The expression.
        own: The functions of launch files: ``arg``, ``env``, ``find`` …
        arg: Returns the value of an arg by its name, None where there is none.
        args: Names of the args, to suggest where a name is unknown.

    Raises:
        TextFault: It is no expression, reaches for something forbidden, takes too much, or fails.
    """
    if len(text) > _MAX_LENGTH:
        raise TextFault(f"the expression is longer than {_MAX_LENGTH} characters")
    if "__" in text:
        raise TextFault("an expression may not contain '__'", text.index("__"))
    stripped = text.lstrip(" \t")
    shift = len(text) - len(stripped)
    try:
        with warnings.catch_warnings(action="ignore"):  # of escapes, which are harmless here
            tree = ast.parse(stripped, mode="eval")
    except SyntaxError as error:
        raise TextFault(f"no expression: {error.msg}", (error.offset or 1) - 1 + shift) from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise TextFault(f"no expression: {error or 'nested too deep'}") from None
    walk = _Walk(own, arg, args)
    try:
        value = walk.value(tree.body)
        if not isinstance(value, _VALUES):
            raise ExpressionError("the result is a function; expected a value")  # noqa: TRY301
        return str(value)
    except ExpressionError as error:
        raise TextFault(str(error), walk.column + shift) from None
    except RecursionError:
        raise TextFault("it calls itself without end", walk.column + shift) from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise TextFault(f"the expression fails: {reason}", walk.column + shift) from None


class _Walk:
    """One evaluation."""

    def __init__(
        self,
        own: Mapping[str, Callable[..., Any]],
        arg: Callable[[str], Any | None],
        args: Iterable[str],
    ) -> None:
        self._budget = Budget(_BUDGET)
        before, self._after = functions(self._budget)
        self._before = {**before, **own}
        self._arg = arg
        self._args = args
        self._locals: list[dict[str, Any]] = []
        self._depth = 0
        self.column = 0

    def value(self, node: ast.expr) -> Any:
        handler = getattr(self, "_" + type(node).__name__.lower(), None)
        if handler is None:
            self.column = node.col_offset
            raise ExpressionError(f"{_word(node)} is not available in expressions")
        if self._depth >= _MAX_DEPTH:
            raise ExpressionError(f"it nests deeper than {_MAX_DEPTH}")
        self._depth += 1
        try:
            return self._budget.settle(handler(node))
        finally:
            self._depth -= 1

    def _constant(self, node: ast.Constant) -> Any:
        if not isinstance(node.value, _VALUES):
            self.column = node.col_offset
            raise ExpressionError(f"{node.value!r} is not available in expressions")
        return node.value

    def _name(self, node: ast.Name) -> Any:
        for frame in reversed(self._locals):
            if node.id in frame:
                return frame[node.id]
        if node.id in self._before:
            return self._before[node.id]
        value = self._arg(node.id)
        if value is not None:
            return value
        if node.id in self._after:
            return self._after[node.id]
        self.column = node.col_offset
        hint = near_miss(node.id, self._args) or near_miss(node.id, [*self._before, *self._after])
        if node.id == "math":
            hint = "; the names of math stand alone: write 'pi', not 'math.pi'"
        raise ExpressionError(f"'{node.id}' is no arg of this file and no function{hint}")

    def _binop(self, node: ast.BinOp) -> Any:
        spine: list[ast.BinOp] = [node]
        while isinstance(spine[-1].left, ast.BinOp):
            spine.append(spine[-1].left)
        result = self.value(spine[-1].left)
        for step in reversed(spine):
            right = self.value(step.right)
            self.column = step.col_offset
            result = self._budget.settle(self._operate(step.op, result, right))
        return result

    def _operate(self, op: ast.operator, left: Any, right: Any) -> Any:
        budget = self._budget
        if isinstance(op, ast.Pow):
            return power(budget, left, right)
        if isinstance(left, int) and isinstance(right, int):
            if isinstance(op, ast.LShift):
                budget.bits(left.bit_length() + right)
            elif isinstance(op, ast.Mult):
                budget.bits(left.bit_length() + right.bit_length())
        elif isinstance(op, ast.Mult):
            for sequence, times in ((left, right), (right, left)):
                if isinstance(sequence, str | list | tuple) and isinstance(times, int):
                    budget.repeat(sequence, times)
        elif isinstance(op, ast.Mod) and isinstance(left, str):
            check_pattern(left)
        if type(op) not in _BINARY:
            raise ExpressionError("'@' is not available in expressions")
        return _BINARY[type(op)](left, right)

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        operand = self.value(node.operand)
        self.column = node.col_offset
        return _UNARY[type(node.op)](operand)

    def _boolop(self, node: ast.BoolOp) -> Any:
        stop = isinstance(node.op, ast.Or)
        result: Any = None
        for part in node.values:
            result = self.value(part)
            if bool(result) is stop:
                break
        return result

    def _compare(self, node: ast.Compare) -> Any:
        left = self.value(node.left)
        result: Any = True
        for op, comparator in zip(node.ops, node.comparators, strict=True):
            right = self.value(comparator)
            self.column = node.col_offset
            self._budget.settle((left, right))
            result = _COMPARE[type(op)](left, right)
            if not result:
                break
            left = right
        return result

    def _ifexp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _list(self, node: ast.List) -> list[Any]:
        return self._elements(node.elts)

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self._elements(node.elts))

    def _set(self, node: ast.Set) -> set[Any]:
        return set(self._elements(node.elts))

    def _elements(self, nodes: list[ast.expr]) -> list[Any]:
        elements: list[Any] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                elements += self.value(node.value)
            else:
                elements.append(self.value(node))
        return elements

    def _dict(self, node: ast.Dict) -> dict[Any, Any]:
        result: dict[Any, Any] = {}
        for key, value in zip(node.keys, node.values, strict=True):
            if key is None:
                result.update(self.value(value))
            else:
                result[self.value(key)] = self.value(value)
        return result

    def _subscript(self, node: ast.Subscript) -> Any:
        owner, index = self.value(node.value), self.value(node.slice)
        self.column = node.col_offset
        return owner[index]

    def _slice(self, node: ast.Slice) -> slice:
        parts = (node.lower, node.upper, node.step)
        return slice(*(None if part is None else self.value(part) for part in parts))

    def _attribute(self, node: ast.Attribute) -> Method:
        owner = self.value(node.value)
        self.column = node.end_col_offset or node.col_offset
        return Method(owner, node.attr, self._budget)

    def _call(self, node: ast.Call) -> Any:
        function = self.value(node.func)
        args = self._elements(node.args)
        kwargs: dict[str, Any] = {}
        for keyword in node.keywords:
            value = self.value(keyword.value)
            kwargs.update(value if keyword.arg is None else {keyword.arg: value})
        self.column = node.col_offset
        if not callable(function):
            raise ExpressionError(f"{function!r} is no function")
        self._budget.settle(args)
        return function(*args, **kwargs)

    def _lambda(self, node: ast.Lambda) -> Callable[..., Any]:
        spec = node.args
        if spec.vararg or spec.kwarg or spec.kwonlyargs or spec.defaults:
            raise ExpressionError("a lambda takes plain parameters only")
        names = [parameter.arg for parameter in (*spec.posonlyargs, *spec.args)]
        frames = list(self._locals)

        def call(*values: Any) -> Any:
            if len(values) != len(names):
                raise ExpressionError(f"a lambda of {len(names)} parameters got {len(values)}")
            kept = self._locals
            self._locals = [*frames, dict(zip(names, values, strict=True))]
            try:
                return self.value(node.body)
            finally:
                self._locals = kept

        return call

    def _listcomp(self, node: ast.ListComp) -> list[Any]:
        return self._gather(node.generators, lambda: self.value(node.elt))

    def _generatorexp(self, node: ast.GeneratorExp) -> list[Any]:
        return self._gather(node.generators, lambda: self.value(node.elt))

    def _setcomp(self, node: ast.SetComp) -> set[Any]:
        return set(self._gather(node.generators, lambda: self.value(node.elt)))

    def _dictcomp(self, node: ast.DictComp) -> dict[Any, Any]:
        pair = lambda: (self.value(node.key), self.value(node.value))  # noqa: E731  # two lines less
        return dict(self._gather(node.generators, pair))

    def _gather(self, generators: list[ast.comprehension], element: Callable[[], Any]) -> list[Any]:
        self._locals.append({})
        try:
            return [element() for _ in self._loop(generators)]
        finally:
            self._locals.pop()

    def _loop(self, generators: list[ast.comprehension]) -> Iterator[None]:
        if not generators:
            yield
            return
        first, *others = generators
        for item in self.value(first.iter):
            self._budget.charge(1)
            self._assign(first.target, item)
            if all(self.value(test) for test in first.ifs):
                yield from self._loop(others)

    def _assign(self, target: ast.expr, item: Any) -> None:
        if isinstance(target, ast.Name):
            self._locals[-1][target.id] = item
            return
        if not isinstance(target, ast.Tuple | ast.List):
            raise ExpressionError("a loop assigns to names only")
        items = list(item)
        if len(items) != len(target.elts):
            raise ExpressionError(f"expected {len(target.elts)} values in a loop, got {len(items)}")
        for part, value in zip(target.elts, items, strict=True):
            self._assign(part, value)

    def _joinedstr(self, node: ast.JoinedStr) -> str:
        return "".join(str(self.value(part)) for part in node.values)

    def _formattedvalue(self, node: ast.FormattedValue) -> str:
        value = self.value(node.value)
        if node.conversion in {ord("r"), ord("a")}:
            value = repr(value)
        spec = self.value(node.format_spec) if node.format_spec is not None else ""
        text: str = self._after["format"](value, spec)
        return text


def _word(node: ast.expr) -> str:
    words = {
        "await": "'await'",
        "namedexpr": "':='",
        "yield": "'yield'",
        "yieldfrom": "'yield'",
        "starred": "'*'",
    }
    return words.get(type(node).__name__.lower(), type(node).__name__)
