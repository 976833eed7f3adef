"""rclpy.exceptions: what goes wrong, under rclpy's names."""

from __future__ import annotations

from rosz.errors import InvalidName, RoszError

__all__ = (
    "InvalidHandle",
    "InvalidParameterTypeException",
    "InvalidParameterValueException",
    "NameValidationException",
    "NotInitializedException",
    "ParameterAlreadyDeclaredException",
    "ParameterException",
    "ParameterNotDeclaredException",
    "ParameterUninitializedException",
    "ROSInterruptException",
)

NameValidationException = InvalidName


class NotInitializedException(RoszError):
    """``rclpy.init`` has not been called, or it has been shut down since."""

    def __init__(self, *args: str) -> None:
        super().__init__(", ".join(("rclpy.init() has not been called", *args)))


class InvalidHandle(RoszError):
    """The thing used has been destroyed."""


class ROSInterruptException(RoszError):
    """The context was shut down during a wait."""

    def __init__(self) -> None:
        super().__init__("rclpy.shutdown() has been called")


class ParameterException(RoszError):
    """Root of what goes wrong with parameters.

    Attributes:
        parameters: The names, or a name.
    """

    def __init__(self, reason: str, parameters: str | list[str]) -> None:
        self.parameters = parameters
        names = parameters if isinstance(parameters, str) else ", ".join(parameters)
        super().__init__(f"{reason}: {names}")


class ParameterNotDeclaredException(ParameterException):
    """A parameter that the node has not declared."""

    def __init__(self, parameters: str | list[str]) -> None:
        super().__init__("Invalid access to undeclared parameter(s)", parameters)


class ParameterAlreadyDeclaredException(ParameterException):
    """A parameter that the node has declared before."""

    def __init__(self, parameters: str | list[str]) -> None:
        super().__init__("Parameter(s) already declared", parameters)


class ParameterUninitializedException(ParameterException):
    """A parameter that is declared by type, and has no value yet."""

    def __init__(self, parameters: str | list[str]) -> None:
        super().__init__("The parameter is not initialized", parameters)


class InvalidParameterValueException(ParameterException):
    """A value that a parameter may not have."""

    def __init__(self, parameter: str, value: object, reason: str) -> None:
        self.value = value
        super().__init__(f"Invalid parameter value ({value}), {reason}", parameter)


class InvalidParameterTypeException(ParameterException):
    """A value of another type than that of the parameter."""

    def __init__(self, parameter: str, expected: str, found: str) -> None:
        super().__init__(
            f"Trying to set a parameter of type {expected} to one of {found}", parameter
        )
