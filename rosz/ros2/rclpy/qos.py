"""rclpy.qos: quality of service profiles."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from enum import Enum, IntEnum
from typing import Any, Self

from rosz.errors import RoszError, UsageError
from rosz.msgs.rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rosz.qos import FOREVER as _FOREVER
from rosz.qos import QoS
from rosz.ros2.rclpy.time import Duration, Infinite
from rosz.wire import Token, format_token, gid


class HistoryPolicy(IntEnum):
    """Number of samples that are kept."""

    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3


class ReliabilityPolicy(IntEnum):
    """Whether samples may be lost."""

    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4


class DurabilityPolicy(IntEnum):
    """Whether late subscriptions get earlier samples."""

    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4


class LivelinessPolicy(IntEnum):
    """The liveliness policy of a publisher; for information only."""

    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    UNKNOWN = 4
    BEST_AVAILABLE = 5


QoSHistoryPolicy = HistoryPolicy
QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSLivelinessPolicy = LivelinessPolicy

_POLICIES: dict[str, tuple[type[IntEnum], IntEnum]] = {
    "history": (HistoryPolicy, HistoryPolicy.KEEP_LAST),
    "reliability": (ReliabilityPolicy, ReliabilityPolicy.RELIABLE),
    "durability": (DurabilityPolicy, DurabilityPolicy.VOLATILE),
    "liveliness": (LivelinessPolicy, LivelinessPolicy.SYSTEM_DEFAULT),
}
for _policy_type, _ in _POLICIES.values():
    for _member in tuple(_policy_type):  # the older names
        _kind = _policy_type.__name__.removesuffix("Policy").upper()
        setattr(_policy_type, f"RMW_QOS_POLICY_{_kind}_{_member.name}", _member)
_SPANS = ("lifespan", "deadline", "liveliness_lease_duration")


class QoSPolicyKind(IntEnum):
    """The policies of a profile."""

    DURABILITY = 1 << 0
    DEADLINE = 1 << 1
    LIVELINESS = 1 << 2
    RELIABILITY = 1 << 3
    HISTORY = 1 << 4
    LIFESPAN = 1 << 5
    DEPTH = 1 << 6
    LIVELINESS_LEASE_DURATION = 1 << 7


class QoSProfile:
    """The quality of service that an entity offers or requests; see REP 2003.

    Args:
        policies: Any of ``history``, ``depth``, ``reliability``, ``durability``, ``lifespan``,
            ``deadline``, ``liveliness`` and ``liveliness_lease_duration``; the others keep their
            defaults.

    Raises:
        UsageError: The policy does not exist, or neither history nor depth is given.
    """

    depth: int
    history: HistoryPolicy
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    liveliness: LivelinessPolicy
    lifespan: Duration
    deadline: Duration
    liveliness_lease_duration: Duration

    def __init__(self, **policies: Any) -> None:
        if "history" not in policies and "depth" not in policies:
            raise UsageError("a QoSProfile needs a history or a depth; give depth=10, for example")
        policies.pop("avoid_ros_namespace_conventions", None)
        self.depth = int(policies.pop("depth", 0))
        for name, (kind, default) in _POLICIES.items():
            setattr(self, name, kind(policies.pop(name, default)))
        for name in _SPANS:
            setattr(self, name, policies.pop(name, Infinite))
        if policies:
            raise UsageError(f"a QoSProfile has no '{next(iter(policies))}'")

    def _values(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("depth", *_POLICIES, *_SPANS)}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, QoSProfile) and self._values() == other._values()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        texts = (
            f"{name}={value.name if isinstance(value, IntEnum) else value}"
            for name, value in self._values().items()
        )
        return f"QoSProfile({', '.join(texts)})"


def to_qos(profile: QoSProfile | int) -> QoS:
    """Convert a profile, or the depth of a queue, to rosz's QoS.

    Raises:
        UsageError: The argument is neither.
    """
    if isinstance(profile, int):
        if profile < 0:
            raise UsageError(f"the depth of a queue is {profile}; expected 0 or more")
        return QoS(depth=profile)
    if not isinstance(profile, QoSProfile):
        raise UsageError(f"expected a QoSProfile or a depth, got {type(profile).__name__}")
    best_effort = profile.reliability is ReliabilityPolicy.BEST_EFFORT
    transient = profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    manual = profile.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
    return QoS(
        depth=profile.depth,
        reliability="best_effort" if best_effort else "reliable",
        durability="transient_local" if transient else "volatile",
        history="keep_all" if profile.history is HistoryPolicy.KEEP_ALL else "keep_last",
        deadline=_span(profile.deadline),
        lifespan=_span(profile.lifespan),
        liveliness="manual_by_topic" if manual else "automatic",
        lease=_span(profile.liveliness_lease_duration),
    )


TopicEndpointTypeEnum = IntEnum("TopicEndpointTypeEnum", "INVALID PUBLISHER SUBSCRIPTION", start=0)


class TopicEndpointInfo:
    """A publisher or subscription of a topic: its node, type, GID and profile."""

    def __init__(self, token: Token) -> None:
        qos = token.qos or QoS()
        self.node_name: str = token.node
        self.node_namespace: str = token.namespace
        self.topic_type: str = token.type_name
        self.topic_type_hash: str = token.type_hash
        self.endpoint_type: IntEnum = TopicEndpointTypeEnum[token.kind.name]
        self.endpoint_gid: list[int] = list(gid(format_token(token)))
        self.qos_profile: QoSProfile = QoSProfile(
            depth=qos.depth,
            lifespan=Duration(nanoseconds=qos.lifespan),
            deadline=Duration(nanoseconds=qos.deadline),
            liveliness_lease_duration=Duration(nanoseconds=qos.lease),
            **{name: kind[getattr(qos, name).upper()] for name, (kind, _) in _POLICIES.items()},
        )


class InvalidQosOverridesError(RoszError):
    """A parameter sets a policy to what it cannot be, or a program refuses the profile."""


class QoSOverridingOptions:
    """The policies of a publisher or subscription that parameters may override.

    Args:
        policy_kinds: The policies; each becomes the read-only parameter
            ``qos_overrides.TOPIC.publisher.POLICY`` or ``….subscription.POLICY``.
        callback: Function that gets the profile, and returns a result that may refuse it.
        entity_id: Suffix that tells entities of one topic apart.
    """

    def __init__(
        self,
        policy_kinds: Iterable[QoSPolicyKind],
        *,
        callback: Callable[[QoSProfile], SetParametersResult] | None = None,
        entity_id: str | None = None,
    ) -> None:
        self.policy_kinds: tuple[QoSPolicyKind, ...] = tuple(policy_kinds)
        self.callback: Callable[[QoSProfile], SetParametersResult] | None = callback
        self.entity_id: str | None = entity_id

    @classmethod
    def with_default_policies(cls, **options: Any) -> Self:
        """Return options for history, depth and reliability; see the class."""
        kinds = QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY
        return cls(kinds, **options)


def override_qos(
    node: Any, kind: str, topic: str, qos: QoSProfile | int, options: QoSOverridingOptions
) -> QoSProfile:
    """Declare the parameters of a profile's policies, and return the profile that they make.

    Args:
        node: Node of rclpy that the entity belongs to.
        kind: ``publisher`` or ``subscription``.
        topic: Full name of the topic.
        qos: Profile, or depth of the queue, that holds without parameters.
        options: Policies that may be overridden.

    Raises:
        InvalidQosOverridesError: A value is not one of the policy, or the callback refuses.
    """
    profile = QoSProfile(depth=qos) if isinstance(qos, int) else copy(qos)
    suffix = f"_{options.entity_id}" if options.entity_id is not None else ""
    for policy in options.policy_kinds:
        if policy is QoSPolicyKind.LIFESPAN and kind == "subscription":
            continue
        name = policy.name.lower()
        parameter = f"qos_overrides.{topic}.{kind}{suffix}.{name}"
        if not node.has_parameter(parameter):
            description = ParameterDescriptor(
                name=parameter, description=f"{name} of the {kind} of {topic}", read_only=True
            )
            node.declare_parameter(parameter, _policy_value(getattr(profile, name)), description)
        value = node.get_parameter(parameter).value
        try:
            setattr(profile, name, _policy(name, value))
        except KeyError:
            expected = ", ".join(member.name.lower() for member in _POLICIES[name][0])
            raise InvalidQosOverridesError(
                f"parameter '{parameter}' is '{value}'; expected one of {expected}"
            ) from None
    if options.callback is not None:
        result = options.callback(profile)
        if not result.successful:
            raise InvalidQosOverridesError(f"the QoS of '{topic}' is refused: {result.reason}")
    return profile


def _policy_value(value: Any) -> Any:
    """Return a policy as the value of a parameter: a name, a depth, or nanoseconds."""
    if isinstance(value, Duration):
        return value.nanoseconds
    return value.name.lower() if isinstance(value, IntEnum) else value


def _policy(name: str, value: Any) -> Any:
    if name in _SPANS:
        return Duration(nanoseconds=value)
    return _POLICIES[name][0][value.upper()] if name in _POLICIES else value


def _span(duration: Duration) -> int:
    return duration.nanoseconds or _FOREVER


qos_profile_system_default = QoSProfile(history=HistoryPolicy.SYSTEM_DEFAULT, depth=10)
qos_profile_sensor_data = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default = QoSProfile(depth=10)
qos_profile_parameters = QoSProfile(depth=1000)
qos_profile_parameter_events = QoSProfile(depth=1000)
qos_profile_action_status_default = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class QoSPresetProfiles(Enum):
    """The named profiles of ROS 2; ``.value`` is the profile."""

    DEFAULT = QoSProfile(depth=10)
    SYSTEM_DEFAULT = qos_profile_system_default
    SENSOR_DATA = qos_profile_sensor_data
    SERVICES_DEFAULT = qos_profile_services_default
    PARAMETERS = qos_profile_parameters
    PARAMETER_EVENTS = qos_profile_parameter_events
    ACTION_STATUS_DEFAULT = qos_profile_action_status_default
