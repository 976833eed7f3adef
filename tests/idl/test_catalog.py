from __future__ import annotations

import pytest

from rosz.errors import DefinitionError, TypeNotFound

from .definitions import catalog_of


def failure(texts: dict[str, str], name: str = "p/msg/A") -> str:
    with pytest.raises(DefinitionError) as caught:
        catalog_of(texts).message(name)
    return str(caught.value)


def test_types_are_found_across_packages() -> None:
    catalog = catalog_of(
        {"p/msg/A": "q/B b\nC[] c", "q/msg/B": "C c", "p/msg/C": "", "q/msg/C": ""}
    )
    spec = catalog.message("p/msg/A")
    assert sorted(catalog.below(spec)) == ["p/msg/C", "q/msg/B", "q/msg/C"]
    assert [nested.name for nested in catalog.nested(spec)] == ["q/msg/B", "p/msg/C"]


def test_a_missing_type_is_shown_where_it_is_used() -> None:
    assert failure({"p/msg/A": "\n  B b"}) == (
        "p/A.msg:2:3: type 'B' of field 'b': type 'p/msg/B' is not known: nobody wrote it"
    )
    assert "p/C.msg:1:1: type 'q/D' of field 'd'" in failure({"p/msg/A": "C c", "p/msg/C": "q/D d"})


@pytest.mark.parametrize(
    ("written", "hint"),
    [
        ("float", "; did you mean 'float64'?"),
        ("Int32", "; did you mean 'int32'?"),
        ("strin", "; did you mean 'string'?"),
        ("Gripper", ""),
        ("q/float", ""),
    ],
)
def test_a_misspelt_primitive_is_suggested(written: str, hint: str) -> None:
    assert failure({"p/msg/A": f"{written} x"}).endswith(f"is not known: nobody wrote it{hint}")


def test_a_message_cannot_hold_itself() -> None:
    assert failure({"p/msg/A": "A[] a"}).endswith(
        "A.msg:1:1: a message cannot hold itself: p/msg/A → p/msg/A"
    )
    texts = {"p/msg/A": "B b", "p/msg/B": "int32 x\nC c", "p/msg/C": "B b"}
    assert failure(texts).endswith(
        "C.msg:1:1: a message cannot hold itself: p/msg/B → p/msg/C → p/msg/B"
    )


def test_an_unknown_name_is_no_definition_error() -> None:
    with pytest.raises(TypeNotFound, match=r"'p/msg/X' is not known"):
        catalog_of({}).message("p/msg/X")


def test_services() -> None:
    catalog = catalog_of({"p/srv/S": "A a\n---\nB b", "p/msg/A": ""})
    with pytest.raises(DefinitionError, match=r"3:1: type 'B' of field 'b'"):
        catalog.service("p/srv/S")
    whole = catalog_of({"p/srv/S": "A a\n---\n", "p/msg/A": ""})
    assert whole.service("p/srv/S") is whole.service("p/srv/S")
