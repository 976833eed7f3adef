"""Definitions that no ROS reads, each with the error that it must give."""

from __future__ import annotations

MESSAGES: list[tuple[str, str]] = [
    (
        "float32 X=\u0131nf",
        "bad.msg:1:11: constant 'X': expected a number of type float32, got '\u0131nf'",
    ),
    ("float64 x 1e999", "bad.msg:1:11: field 'x': 1e999 is outside the range of float64"),
    ("float32[] x [inf, -1e39]", "bad.msg:1:19: field 'x': -1e39 is outside the range of float32"),
    ("@keyboard int32 x", "bad.msg:1:1: expected a type, got '@keyboard'"),
    ("string[] x [", "bad.msg:1:13: field 'x': the list is not closed; expected ']'"),
    ("int32 a\n  a a", "bad.msg:2:5: 'a' is already declared in line 1"),
    ("int32", "bad.msg:1:6: expected a name after type 'int32'"),
    (
        "string a 'x\\ud800'",
        "bad.msg:1:10: field 'a': '\\ud800' is half a character, which no string holds",
    ),
    (
        "string<=8 a \ud800",
        "bad.msg:1:13: field 'a': '\\ud800' is half a character, which no string holds",
    ),
    (
        "string A=\udfff",
        "bad.msg:1:10: constant 'A': '\\udfff' is half a character, which no string holds",
    ),
    ("int32 ", "bad.msg:1:7: expected a name after type 'int32'"),
    ("int33x", "bad.msg:1:7: expected a name after type 'int33x'"),
    (" int32 7seas", "bad.msg:1:8: expected a name that begins with a letter, got '7seas'"),
    ("int32 _hidden", "bad.msg:1:7: expected a name that begins with a letter, got '_hidden'"),
    ("int32 a-b", "bad.msg:1:8: character '-' in name 'a-b'; expected letters, digits or '_'"),
    ("int32 a.b", "bad.msg:1:8: character '.' in name 'a.b'; expected letters, digits or '_'"),
    (
        "int32 a b c",
        (
            "bad.msg:1:9: field 'a': expected a default of type int32, or a comment after"
            " '#', got 'b'"
        ),
    ),
    ("int32 a,b", "bad.msg:1:8: character ',' in name 'a,b'; expected letters, digits or '_'"),
    ("int32 é", "bad.msg:1:7: expected a name that begins with a letter, got 'é'"),
    (
        "int32\tx[3]",
        (
            "bad.msg:1:8: character '[' in name 'x[3]'; expected letters, digits or '_'; the"
            " array part belongs to the type"
        ),
    ),
    ("int32[ x", "bad.msg:1:7: type 'int32[' of 'x': expected a number as size of an array"),
    (
        "int32[3 x",
        "bad.msg:1:6: type 'int32[3' of 'x': the array's '[' is not closed; expected ']'",
    ),
    ("int32[x] y", "bad.msg:1:7: type 'int32[x]' of 'y': expected a number as size of an array"),
    ("int32[-1] y", "bad.msg:1:7: type 'int32[-1]' of 'y': expected a number as size of an array"),
    (
        "int32[0] y",
        (
            "bad.msg:1:7: type 'int32[0]' of 'y': expected a size of an array from 1 to"
            " 4294967295, got 0"
        ),
    ),
    (
        "int32[4294967296] y",
        (
            "bad.msg:1:7: type 'int32[4294967296]' of 'y': expected a size of an array from"
            " 1 to 4294967295, got 4294967296"
        ),
    ),
    ("int32[<] y", "bad.msg:1:7: type 'int32[<]' of 'y': expected a number as size of an array"),
    (
        "int32[<=] y",
        "bad.msg:1:9: type 'int32[<=]' of 'y': expected a number as bound of a sequence",
    ),
    (
        "int32[<=0] y",
        (
            "bad.msg:1:9: type 'int32[<=0]' of 'y': expected a bound of a sequence from 1 to"
            " 4294967295, got 0"
        ),
    ),
    (
        "int32[<=3 y",
        "bad.msg:1:6: type 'int32[<=3' of 'y': the array's '[' is not closed; expected ']'",
    ),
    (
        "int32[3][4] y",
        (
            "bad.msg:1:9: type 'int32[3][4]' of 'y': arrays have one dimension; wrap the"
            " inner one in a message"
        ),
    ),
    ("int32[] [] y", "bad.msg:1:9: expected a name that begins with a letter, got '[]'"),
    (
        "int32<=3 x",
        (
            "bad.msg:1:6: type 'int32<=3' of 'x': only strings have a bound '<=N'; write"
            " 'int32[<=N]' for a sequence"
        ),
    ),
    ("string< x", "bad.msg:1:7: type 'string<' of 'x': expected '<=' and a number as bound"),
    ("string<= x", "bad.msg:1:9: type 'string<=' of 'x': expected a number as bound of a string"),
    (
        "string<=0 x",
        (
            "bad.msg:1:9: type 'string<=0' of 'x': expected a bound of a string from 1 to"
            " 4294967295, got 0"
        ),
    ),
    ("string<=x y", "bad.msg:1:9: type 'string<=x' of 'y': expected a number as bound of a string"),
    ("string<5 x", "bad.msg:1:7: type 'string<5' of 'x': expected '<=' and a number as bound"),
    ("/Foo x", "bad.msg:1:1: expected a type, got '/Foo'"),
    ("foo/ x", "bad.msg:1:5: type 'foo/' of 'x': expected a type's name after 'foo/'"),
    ("foo//Bar x", "bad.msg:1:5: type 'foo//Bar' of 'x': expected a type's name after 'foo/'"),
    (
        "foo/bar/Baz x",
        (
            "bad.msg:1:1: type 'foo/bar/Baz' of 'x': expected a type such as 'pkg/Name' or"
            " 'pkg/msg/Name'"
        ),
    ),
    (
        "foo/msg/Bar/Qux x",
        (
            "bad.msg:1:1: type 'foo/msg/Bar/Qux' of 'x': expected a type such as 'pkg/Name'"
            " or 'pkg/msg/Name'"
        ),
    ),
    ("9Foo x", "bad.msg:1:1: expected a type, got '9Foo'"),
    (
        "Foo-Bar x",
        ("bad.msg:1:4: type 'Foo-Bar' of 'x': expected a blank between type and name, got '-Bar'"),
    ),
    ("= 5", "bad.msg:1:1: expected a type, got '='"),
    ("int32 =5", "bad.msg:1:7: expected a name that begins with a letter, got '='"),
    ("int32 X=", "bad.msg:1:9: constant 'X': expected a value of type int32"),
    ("int32 X= # nothing", "bad.msg:1:10: constant 'X': expected a value of type int32"),
    ("int32 X=five", "bad.msg:1:9: constant 'X': expected an integer of type int32, got 'five'"),
    ("int32 X=1.5", "bad.msg:1:9: constant 'X': expected an integer of type int32, got '1.5'"),
    ("int32 X=0x", "bad.msg:1:9: constant 'X': expected an integer of type int32, got '0x'"),
    ("uint8 X=256", "bad.msg:1:9: constant 'X': 256 is outside the range of uint8 (0 to 255)"),
    ("uint8 X=-1", "bad.msg:1:9: constant 'X': -1 is outside the range of uint8 (0 to 255)"),
    ("int8 X=128", "bad.msg:1:8: constant 'X': 128 is outside the range of int8 (-128 to 127)"),
    ("byte X=300", "bad.msg:1:8: constant 'X': 300 is outside the range of byte (-128 to 255)"),
    ("char X=a", "bad.msg:1:8: constant 'X': expected an integer of type char, got 'a'"),
    ("char X=-1", "bad.msg:1:8: constant 'X': -1 is outside the range of char (0 to 255)"),
    (
        "int64 X=9223372036854775808",
        (
            "bad.msg:1:9: constant 'X': 9223372036854775808 is outside the range of int64"
            " (-9223372036854775808 to 9223372036854775807)"
        ),
    ),
    ("bool X=maybe", "bad.msg:1:8: constant 'X': expected true or false, got 'maybe'"),
    ("bool X=2", "bad.msg:1:8: constant 'X': expected true or false, got '2'"),
    ("float32 X=1,5", "bad.msg:1:11: constant 'X': expected a number of type float32, got '1,5'"),
    ("float64 X=one", "bad.msg:1:11: constant 'X': expected a number of type float64, got 'one'"),
    ("float64 X=", "bad.msg:1:11: constant 'X': expected a value of type float64"),
    (
        "int32[] X=[1, 2]",
        "bad.msg:1:1: constant 'X': its type has to be a primitive one; 'int32[]' is not",
    ),
    (
        "string<=5 NAME=abc",
        (
            "bad.msg:1:1: constant 'NAME': only fields have bounded strings; write 'string'"
            " for 'string<=5'"
        ),
    ),
    (
        "wstring<=5 NAME='abc'",
        (
            "bad.msg:1:1: constant 'NAME': only fields have bounded strings; write 'wstring'"
            " for 'wstring<=5'"
        ),
    ),
    (
        "int32[]] x",
        ("bad.msg:1:8: type 'int32[]]' of 'x': expected a blank between type and name, got ']'"),
    ),
    ("int32[] x [1, 23 45]", "bad.msg:1:18: field 'x': expected ',' or ']' in the list, got '45'"),
    ("Foo X=1", "bad.msg:1:1: constant 'X': its type has to be a primitive one; 'Foo' is not"),
    ("time X=0", "bad.msg:1:1: constant 'X': its type has to be a primitive one; 'time' is not"),
    (
        "int32 x 1 2",
        "bad.msg:1:11: field 'x': expected the end of the line after the default, got '2'",
    ),
    (
        "int32 x one",
        (
            "bad.msg:1:9: field 'x': expected a default of type int32, or a comment after"
            " '#', got 'one'"
        ),
    ),
    (
        "int32 x 1.5",
        (
            "bad.msg:1:9: field 'x': expected a default of type int32, or a comment after"
            " '#', got '1.5'"
        ),
    ),
    ("uint8 x 300", "bad.msg:1:9: field 'x': 300 is outside the range of uint8 (0 to 255)"),
    (
        "bool x yes",
        (
            "bad.msg:1:8: field 'x': expected a default of type bool, or a comment after"
            " '#', got 'yes'"
        ),
    ),
    (
        "float64 x 1.0.0",
        (
            "bad.msg:1:11: field 'x': expected a default of type float64, or a comment after"
            " '#', got '1.0.0'"
        ),
    ),
    ('string s "open', "bad.msg:1:10: field 's': the string is not closed; expected \""),
    ("string s 'open", "bad.msg:1:10: field 's': the string is not closed; expected '"),
    (
        'string s "a" b',
        "bad.msg:1:14: field 's': expected the end of the line after the default, got 'b'",
    ),
    (
        'string<=3 s "abcd"',
        "bad.msg:1:13: field 's': 'abcd' is longer than the 3 bytes of its type",
    ),
    (
        "int32[] x 1",
        "bad.msg:1:11: field 'x': expected a list '[…]' as default of an array, got '1'",
    ),
    ("int32[] x [1, 2", "bad.msg:1:11: field 'x': the list is not closed; expected ']'"),
    ("int32[] x [1 2]", "bad.msg:1:14: field 'x': expected ',' or ']' in the list, got '2'"),
    ("int32[] x [1, two]", "bad.msg:1:15: field 'x': expected an integer of type int32, got 'two'"),
    ("int32[] x [,]", "bad.msg:1:12: field 'x': expected a value of type int32, got ','"),
    ("int32[3] x [1, 2]", "bad.msg:1:12: field 'x': expected 3 elements, got 2"),
    ("int32[<=2] x [1, 2, 3]", "bad.msg:1:14: field 'x': expected at most 2 elements, got 3"),
    (
        'string[] s ["a" "b"]',
        "bad.msg:1:17: field 's': expected ',' or ']' in the list, got '\"b\"'",
    ),
    ('string[] s ["a]', "bad.msg:1:13: field 's': the string is not closed; expected \""),
    (
        'string<=1[] s ["ab"]',
        "bad.msg:1:16: field 's': 'ab' is longer than the 1 bytes of its type",
    ),
    (
        "Foo x 1",
        (
            "bad.msg:1:7: field 'x': only fields of primitive types have defaults; 'Foo' is"
            " a message"
        ),
    ),
    (
        "time t 0",
        (
            "bad.msg:1:8: field 't': only fields of primitive types have defaults; 'time' is"
            " a message"
        ),
    ),
    ("int32 x\nint32 x", "bad.msg:2:7: 'x' is already declared in line 1"),
    ("int32 X=1\nint32 X=2", "bad.msg:2:7: 'X' is already declared in line 1"),
    ("int32 x\nint32 x=2", "bad.msg:2:7: 'x' is already declared in line 1"),
    ("int32 x\n\n\n  float64 x", "bad.msg:4:11: 'x' is already declared in line 1"),
    (
        "int32 a\n---\nint32 b",
        "bad.msg:2:1: '---' has no meaning in a message; a service belongs in a .srv file",
    ),
    ("@optional int32 x", "bad.msg:1:1: expected a type, got '@optional'"),
    (
        "int32 x @key",
        (
            "bad.msg:1:9: field 'x': expected a default of type int32, or a comment after"
            " '#', got '@key'"
        ),
    ),
    ("$ x", "bad.msg:1:1: expected a type, got '$'"),
    ("int32 x;", "bad.msg:1:8: character ';' in name 'x;'; expected letters, digits or '_'"),
    (
        "uint8[16]data",
        ("bad.msg:1:10: type 'uint8[16]data': expected a blank between type and name, got 'data'"),
    ),
    ("float64[9]", "bad.msg:1:11: expected a name after type 'float64[9]'"),
    (
        " # ok\n\n   int32   y   z   # c",
        (
            "bad.msg:3:16: field 'y': expected a default of type int32, or a comment after"
            " '#', got 'z'"
        ),
    ),
]

SERVICES: list[tuple[str, str]] = [
    (
        "int32 a\n---\nint32 b\n---\nint32 c",
        "bad.srv:4:1: one '---' too many: a service has a request and a response",
    ),
    (
        "int32 a\n---\nint32 b c",
        (
            "bad.srv:3:9: field 'b': expected a default of type int32, or a comment after"
            " '#', got 'c'"
        ),
    ),
    ("---\nfoo", "bad.srv:2:4: expected a name after type 'foo'"),
    ("a\n---", "bad.srv:1:2: expected a name after type 'a'"),
    ("int32 x\nint32 x\n---\n", "bad.srv:2:7: 'x' is already declared in line 1"),
    ("---\nint32 x\nint32 x\n", "bad.srv:3:7: 'x' is already declared in line 2"),
]

ACTIONS: list[tuple[str, str]] = [
    ("int32 a", "bad.action:1:1: expected '---': an action has a goal, a result and a feedback"),
    (
        "int32 a\n---\nint32 b",
        "bad.action:3:1: expected '---': an action has a goal, a result and a feedback",
    ),
    (
        "int32 a\n---\nint32 b\n---\nint32 c\n---\n",
        "bad.action:6:1: one '---' too many: an action has a goal, a result and a feedback",
    ),
    ("int32 a\n---\nint32 b\n---\nint32", "bad.action:5:6: expected a name after type 'int32'"),
]
