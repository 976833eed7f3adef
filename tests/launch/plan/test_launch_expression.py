"""Expressions: what is allowed, what is refused, and that evaluation always ends."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosz.launch.plan.document import TextError
from rosz.launch.plan.expression import evaluate

ARGS: dict[str, Any] = {"n": 3, "rate": 0.5, "flag": True, "name": "Marvin", "max": 7}
OWN: dict[str, Callable[..., Any]] = {"arg": ARGS.__getitem__, "env": lambda name: f"<{name}>"}


def run(text: str) -> str:
    return evaluate(text, OWN, ARGS.get, ARGS)


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("  1 + 2", "3"),
        ("n", "3"),
        ("arg('rate') * 2", "1.0"),
        ("env('X') + name", "<X>Marvin"),
        ("pi", str(math.pi)),
        ("e > 2.7 and e < 2.8", "True"),
        ("max", "7"),
        ("min(n, 2)", "2"),
        ("true and not false", "True"),
        ("1 if flag else 2", "1"),
        ("1 < n <= 3", "True"),
        ("1 < n < 3", "False"),
        ("0 or name", "Marvin"),
        ("n and 0", "0"),
        ("~n, +n, -n", "(-4, 3, -3)"),
        ("5 % 3, 7 // 2, 2 ** 3, 1 << 4", "(2, 3, 8, 16)"),
        ("16 >> 2, 6 & 3, 6 | 3, 6 ^ 3", "(4, 2, 7, 5)"),
        ("name[0] + name[-1] + name[1:3] + name[::-1]", "MnarnivraM"),
        ("{'a': 1, 'b': 2}['b']", "2"),
        ("sorted({3, 1})", "[1, 3]"),
        ("'%s is %5.1f%%' % (name, rate)", "Marvin is   0.5%"),
        ("'{:>8}|{0}'.replace('0', '').format(name, n)", "  Marvin|3"),
        ("f'{name!r:>10}{rate:.2f}'", "  'Marvin'0.50"),
        ("name.upper().startswith('MAR')", "True"),
        ("'a,b'.split(',')", "['a', 'b']"),
        ("{'a': 1}.get('b', 5)", "5"),
        ("list({'a': 1}.items())", "[('a', 1)]"),
        ("sum([1, 2], 10), factorial(5), comb(5, 2), lcm(4, 6)", "(13, 120, 10, 12)"),
        ("int('0x1f', 16), float('1e3'), bool(''), str(None)", "(31, 1000.0, False, 'None')"),
        ("dict(a=1)", "{'a': 1}"),
        ("round(2.567, 2), round(2.5), abs(-1), divmod(7, 2)", "(2.57, 2, 1, (3, 1))"),
        ("pow(2, 10), 2 ** -1", "(1024.0, 0.5)"),
        ("list(zip('ab', [1, 2])), list(enumerate('a')), list(reversed([1, 2]))",
         "([('a', 1), ('b', 2)], [(0, 'a')], [2, 1])"),
        ("'%s 123456' % n", "3 123456"),
        ("None", "None"),
        ("1 is not None", "True"),
        ("''.join(map(str, [4, 2]))", "42"),
        ("sum(map(int, '1,2'.split(','))), list(filter(None, [0, 1]))", "(3, [1])"),
        ("list(map(arg, ['n'])), list(map(min, [1, 5], [4, 2]))", "([3], [1, 2])"),
        ("sorted(['bb', 'a'], key=len), min(-3, 2, key=abs)", "(['a', 'bb'], 2)"),
        ("'x' not in name", "True"),
    ],
)  # fmt: skip
def test_values_equal_those_of_python(text: str, result: str) -> None:
    assert run(text) == result


@pytest.mark.parametrize(
    ("text", "reason", "index"),
    [
        ("", "not an expression", 0),
        ("1 +", "not an expression", None),
        ("x = 1", "not an expression", None),
        ("import os", "not an expression", None),
        ("1\n2", "not an expression", None),
        ("\0", "not an expression", None),
        ("().__class__", "may not contain '__'", 3),
        ("nam", "'nam' is not an arg of this file and not a function; did you mean 'name'", 0),
        ("1 + math.pi", "the names of math alone", 4),
        ("open('/etc/passwd')", "'open' is not an arg", 0),
        ("eval('1')", "'eval' is not an arg", 0),
        ("getattr(n, 'real')", "'getattr' is not an arg", 0),
        ("type(n)", "'type' is not an arg", 0),
        ("globals()", "'globals' is not an arg", 0),
        ("n.real", "'.real' of a int is not available", None),
        ("name.encode()", "'.encode' of a str is not available", None),
        ("'{0.x}'.format(n)", "accesses an attribute", None),
        ("'{0[a].b}'.format(n)", "accesses an attribute", None),
        ("name.format_map({})", "'.format_map' of a str is not available", None),
        ("abs.name", "'abs' is a function; it can only be called", 0),
        ("name.upper", "'.upper' is a method; it can only be called", 0),
        ("[abs][0]", "'abs' is a function", 1),
        ("dict(key=len)", "'len' is a function", 9),
        ("sorted([n], key=len)", "TypeError", 0),
        ("list(map(nope, [1]))", "'nope' is not an arg", 9),
        ("list(map(4, [1]))", "TypeError", 5),
        ("list(map([abs], [1]))", "'abs' is a function", 10),
        ("map(getattr, ['a'], ['real'])", "'getattr' is not an arg", 4),
        ("n(1)", "3 is not a function", 0),
        ("[1](1)", "[1] is not a function", 0),
        ("[i for i in [1]]", "a list comprehension is not available", 0),
        ("1 + sum(i for i in [1])", "a generator expression is not available", None),
        ("{i for i in [1]}", "a set comprehension is not available", 0),
        ("{i: i for i in [1]}", "a dict comprehension is not available", 0),
        ("(lambda: 1)()", "a lambda is not available", None),
        ("min([1], key=lambda i: i)", "a lambda is not available", 13),
        ("[*[1]]", "'*' is not available", 1),
        ("min(*[1])", "'*' is not available", 4),
        ("{**{}}", "'**' is not available", 0),
        ("dict(**{})", "'**' is not available", 0),
        ("'{:{w}}'.format(1, w=9)", "whose width is computed", None),
        ("'%*d' % (9, 1)", "whose width is computed", 0),
        ("(y := 1)", "':=' is not available", 1),
        ("b'x'", "b'x' is not available", 0),
        ("...", "Ellipsis is not available", 0),
        ("[1] @ [2]", "'@' is not available", 0),
        ("1 / 0", "ZeroDivisionError", 0),
        ("'a' + 1", "TypeError", 0),
        ("[1][5]", "IndexError", 0),
        ("arg('nope')", "KeyError", 0),
        ("sqrt(-1)", "ValueError", 0),
        ("exp(1000)", "OverflowError", 0),
        ("n" * 10_001, "longer than 10000", 0),
    ],
)
def test_other_expressions_are_refused(text: str, reason: str, index: int | None) -> None:
    with pytest.raises(TextError) as caught:
        run(text)
    assert reason in caught.value.reason
    if index is not None:
        assert caught.value.index == index


@pytest.mark.parametrize(
    "text",
    [
        "9 ** 9 ** 9",
        "1 << 10 ** 9",
        "2 ** 4000 * 2 ** 4000",
        "'a' * 10 ** 9",
        "[0] * 10 ** 9",
        "10 ** 9 * (0,)",
        "range(10 ** 12)",
        "range(10 ** 30)",
        "list(range(10 ** 6))",
        "factorial(10 ** 6)",
        "comb(10 ** 7, 5 * 10 ** 6)",
        "perm(10 ** 6)",
        "sorted([10 ** 7], key=factorial)",
        "list(map(factorial, [10 ** 7]))",
        "list(map(range, [10 ** 5] * 10))",
        "'a'.join(map(str, range(10 ** 6)))",
        "list(map(format, [1] * 9, ['1000000000'] * 9))",
        "list(map(int, ['9' * 4000] * 60000))",
        "'%(a)s' * 10000 % {'a': 'x' * 600000}",
        "gcd(int('f' * 600000, 16), int('e' * 600000, 16))",
        "sum([2 ** 4000] * 3, 2 ** 4095) * 2 ** 4000",
        "round(ndigits=-10 ** 9, number=5)",
        "'{:{w}}'.format(1, w='1000000000')",
        "'{0:{1}}'.format('a', 10 ** 10)",
        "round(5, -10 ** 9)",
        "sum([[1] * 1000] * 1000, [])",
        "name.ljust(10 ** 9)",
        "'%1000000d' % 1",
        "'%(a)1000000d' % {'a': 1}",
        "'%*d' % (10 ** 9, 1)",
        "f'{1:1000000000}'",
        "'{:1000000000}'.format(1)",
        "'{:{w}}'.format(1, w=10 ** 9)",
        "format(1, '1000000000')",
        "'a'.replace('a', 'b' * 60000).replace('b', 'c' * 60000)",
        "('x' * 60000).join(['y'] * 60000)",
        "[" * 160 + "]" * 160,
        "(" * 300 + "1" + ")" * 300,
        "-" * 3000 + "1",
        "not " * 2000 + "1",
        "lcm(" + ",".join(str(n) for n in range(10**9, 10**9 + 500)) + ")",
        "set(range(0, (2 ** 61 - 1) * 50000, 2 ** 61 - 1))",
        "str([2 ** 4000] * 90000)",
        "sum([[1] * 9] * 10000, [])",
        "+".join(["len([0] * 9999)"] * 600),
        "+".join(["len('a' * 600000)"] * 500),
        "(" * 149 + "[" + "[1] * 9)" * 149,
        "+".join("1" * 200),
    ],
)
def test_expensive_expressions_are_refused_at_once(text: str) -> None:
    start = time.process_time()
    with pytest.raises(TextError):
        run(text)
    assert time.process_time() - start < 2


_ATOMS = ["1", "2.5", "n", "name", "'a'", "[1, 2]", "{'k': 1}", "pi", "range(3)", "(1, 2)", "None"]
_FORMS = [
    "({0} + {1})", "({0} * {1})", "({0} ** {1})", "({0} - {1})", "({0} % {1})", "({0} < {1})",
    "({0} == {1})", "({0} if {1} else {0})", "[{0}, {1}]", "str({0})", "len({0})", "{0}[{1}]",
    "({0} or {1})", "list({0})", "'%s' % {0}", "{0}.upper()", "tuple({0})", "max({0}, {1})",
    "(f'{{{0}}}')", "{{'x': {0}}}", "({0} << {1})", "(not {0})", "{0}.count({1})",
]  # fmt: skip
_expressions = st.recursive(
    st.sampled_from(_ATOMS),
    lambda inner: st.builds(str.format, st.sampled_from(_FORMS), inner, inner),
    max_leaves=8,
)


@given(text=_expressions)
@settings(max_examples=300)
def test_random_expressions_agree_with_python(text: str) -> None:
    names: dict[str, Any] = {**vars(math), **ARGS}
    names.pop("max")
    try:
        with warnings.catch_warnings(action="ignore"):  # of calls that cannot work
            wanted = str(eval(text, {}, names))
    except Exception:  # noqa: BLE001  # Python's errors are of every kind
        wanted = "error"
    try:
        found = evaluate(text, OWN, names.get)
    except TextError as error:
        found = wanted if " than " in error.reason else "error"  # the bounds are not Python's
    assert found == wanted


@given(
    text=st.text(max_size=60) | st.lists(st.sampled_from([*_ATOMS, *"()[]{}.,:+*'"])).map("".join)
)
@settings(max_examples=300)
def test_any_text_is_a_value_or_an_error(text: str) -> None:
    try:
        index = len(run(text)) * 0
    except TextError as error:
        index = error.index
    assert 0 <= index <= len(text) + 1
