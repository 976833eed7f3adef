"""All checks in order, from the machine to the nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec

from rosz.doctor.finding import Finding, warning
from rosz.doctor.machine import (
    LEAST_FREE,
    check_connect,
    check_rendezvous,
    check_segments,
    check_shared_memory,
    check_socket_files,
    check_stopped,
)
from rosz.doctor.replies import (
    check_clocks,
    check_replicas,
    check_silent,
    check_stamps,
    check_versions,
    check_visibility,
    check_waiting,
    query_nodes,
)
from rosz.doctor.tokens import (
    check_clock,
    check_domains,
    check_duplicates,
    check_hashes,
    check_hashless,
    check_one_sided,
    check_packages,
    check_types,
    check_unreadable,
)
from rosz.environment import Environment, package_index
from rosz.errors import TransportError
from rosz.introspect.connect import open_session
from rosz.introspect.survey import take_survey
from rosz.session import SEGMENTS, Session
from rosz.typestore import TypeStore
from rosz.wire import Kind

__all__ = ("Examination", "examine")


class Examination(msgspec.Struct, kw_only=True):
    """The settings and the size of an examination.

    Attributes:
        environment: Settings of this machine.
        listen: Time limit for samples of ROS 2 nodes, in seconds.
        memory: Folder of shared memory.
        least_free: Number of bytes of it that must be free.
        nodes: Number of nodes found.
    """

    environment: Environment
    listen: float = 1.0
    memory: Path = SEGMENTS
    least_free: int = LEAST_FREE
    nodes: int = 0


def examine(examination: Examination) -> Iterator[Finding]:
    """Yield findings as the checks find them."""
    environment = examination.environment
    yield from check_shared_memory(examination.memory, examination.least_free)
    yield from check_segments(examination.memory)
    yield from check_socket_files(environment)
    yield from check_connect(environment)
    stopped = list(check_stopped(environment))
    yield from stopped
    held = [] if stopped else list(check_rendezvous(environment))
    yield from held
    if held:
        return
    try:
        session = open_session(environment)
    except TransportError as fault:
        yield warning(
            "nobody-there",
            "no process is on this network: there are no nodes to examine",
            [str(fault)],
            "nothing, if nothing is meant to run; else start a launch, a node or 'rosz core'",
        )
        return
    with session:
        yield from _examine_network(session, examination)


def _examine_network(session: Session, examination: Examination) -> Iterator[Finding]:
    environment = examination.environment
    survey = take_survey(session, environment.domain, processes=True)
    examination.nodes = len(survey.view.nodes())
    yield from check_waiting(session)
    yield from check_domains(session, survey)
    yield from check_versions(session)
    yield from check_unreadable(survey)
    yield from check_duplicates(survey)
    yield from check_hashless(survey, environment.distro)
    yield from check_types(survey)
    yield from check_hashes(survey)
    yield from check_packages(survey, _type_hashes(environment), environment.distro)
    yield from check_clock(survey)
    yield from check_one_sided(survey)
    replies = query_nodes(session, environment.domain) if survey.processes else {}
    yield from check_silent(session, survey, replies)
    yield from check_visibility(session, survey, replies)
    yield from check_clocks(survey, replies)
    yield from check_replicas(session, environment.domain)
    yield from check_stamps(session, survey, examination.listen)


def _type_hashes(environment: Environment) -> Callable[[Kind, str], str]:
    """Return a function that looks up the hash of a type known here; see `check_packages`."""
    types = TypeStore(package_index(environment), environment.home / "rosz")

    def find(kind: Kind, type_name: str) -> str:
        is_topic = kind in {Kind.PUBLISHER, Kind.SUBSCRIPTION}
        cls = types.message(type_name) if is_topic else types.service(type_name)
        return cls._type_hash

    return find
