"""rclpy.exceptions: rclpy's exceptions."""

from __future__ import annotations

from rosz.errors import InvalidName, RoszError

InvalidServiceNameException = InvalidTopicNameException = NameValidationException = InvalidName
RCLError = RoszError


class NotInitializedException(RoszError):
    """``rclpy.init`` has not been called, or it has been shut down since."""

    def __init__(self, *args: str) -> None:
        super().__init__(", ".join(("rclpy.init() has not been called", *args)))


class InvalidHandle(RoszError):
    """The object was used after it was destroyed."""


class ROSInterruptException(RoszError):
    """The context was shut down during a wait."""

    def __init__(self) -> None:
        super().__init__("rclpy.shutdown() has been called")


class ParameterException(RoszError):
    """Base class of exceptions about parameters.

    Attributes:
        parameters: Name of the parameter, or a list of names.
    """

    def __init__(self, reason: str, parameters: str | list[str]) -> None:
        self.parameters: str | list[str] = parameters
        names = parameters if isinstance(parameters, str) else ", ".join(parameters)
        super().__init__(f"{reason}: {names}")


class ParameterNotDeclaredException(ParameterException):
    """The node has not declared the parameter."""

    def __init__(self, parameters: str | list[str]) -> None:
        super().__init__("Invalid access to undeclared parameter(s)", parameters)


class ParameterAlreadyDeclaredException(ParameterException):
    """The node has already declared the parameter."""

    def __init__(self, parameters: str | list[str]) -> None:
        super().__init__("Parameter(s) already declared", parameters)


class ParameterUninitializedException(ParameterException):
    """The parameter was declared by type only, and has no value yet."""

    def __init__(self, parameters: str | list[str]) -> None:
        super().__init__("The parameter is not initialized", parameters)


class InvalidParameterValueException(ParameterException):
    """The parameter cannot have the value."""

    def __init__(self, parameter: str, value: object, reason: str) -> None:
        self.value: object = value
        super().__init__(f"Invalid parameter value ({value}), {reason}", parameter)


class InvalidParameterTypeException(ParameterException):
    """The value has another type than the parameter."""

    def __init__(self, parameter: str, expected: str, found: str) -> None:
        super().__init__(
            f"Trying to set a parameter of type {expected} to one of {found}", parameter
        )
