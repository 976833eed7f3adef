"""Exceptions of rosbag, and its names of compressions."""

from __future__ import annotations

__all__ = (
    "Compression",
    "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
)


class ROSBagException(Exception):
    """A bag cannot be read or written.

    Attributes:
        value: The reason.
    """

    def __init__(self, value: str | None = None) -> None:
        super().__init__(value)
        self.value = value

    def __str__(self) -> str:
        return str(self.value)


class ROSBagFormatException(ROSBagException):
    """A bag is damaged."""


class ROSBagUnindexedException(ROSBagException):
    """A bag has no index."""

    def __init__(self, *_args: object) -> None:
        super().__init__("Unindexed bag")


class ROSBagEncryptNotSupportedException(ROSBagException):
    """A bag is encrypted, or should be; rosz has no encryption."""


class ROSBagEncryptException(ROSBagException):
    """A bag could not be encrypted or decrypted."""


class Compression:
    """Names of compressions."""

    NONE = "none"
    BZ2 = "bz2"
    LZ4 = "lz4"
