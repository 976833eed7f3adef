"""Bags made of bags: filtered, converted, divided, repaired. May import the formats."""

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosz.bags.edit.editing import Transfer, divide, merged
    from rosz.bags.edit.repair import (
        Copied,
        TypeDifference,
        check_bag,
        find_differences,
        recover,
        rewrite,
    )
else:
    __getattr__ = exports_of(__name__)
