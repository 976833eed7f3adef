"""The examination: every check once, from the machine to the nodes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec

from rosz.doctor.endpoints import check_connect, check_rendezvous, check_socket_files
from rosz.doctor.ends import (
    check_clock,
    check_duplicates,
    check_hashes,
    check_hashless,
    check_one_sided,
    check_packages,
    check_types,
    check_unreadable,
)
from rosz.doctor.finding import Finding, warning
from rosz.doctor.interview import check_answers, check_clocks, check_sight, interview
from rosz.doctor.memory import LEAST_FREE, check_room, check_segments
from rosz.doctor.network import check_domains, check_replicas, check_versions
from rosz.doctor.stamps import check_stamps
from rosz.doctor.stopped import check_stopped
from rosz.environment import Environment, package_index
from rosz.errors import TransportError
from rosz.introspect.connect import open_session
from rosz.introspect.survey import take_survey
from rosz.session import SEGMENTS, Session
from rosz.typestore import TypeStore
from rosz.wire import Kind

__all__ = ("Examination", "examine")

LISTEN_SECONDS = 1.0


class Examination(msgspec.Struct, kw_only=True):
    """What is looked at, and what came out.

    Attributes:
        environment: Settings.
        listen: Seconds to listen to samples of ROS 2 nodes for, at most.
        memory: Where shared memory is.
        least_free: Bytes of it that must be free.
        nodes: How many nodes were found.
    """

    environment: Environment
    listen: float = LISTEN_SECONDS
    memory: Path = SEGMENTS
    least_free: int = LEAST_FREE
    nodes: int = 0


def examine(examination: Examination) -> Iterator[Finding]:
    """Yield what is found, as it is found."""
    environment = examination.environment
    yield from check_room(examination.memory, examination.least_free)
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
            "nobody is on this network: there are no nodes to look at",
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
    yield from check_domains(session, survey)
    yield from check_versions(session)
    yield from check_unreadable(survey)
    yield from check_duplicates(survey)
    yield from check_hashless(survey, environment.distro)
    yield from check_types(survey)
    yield from check_hashes(survey)
    yield from check_packages(survey, _Hashes(environment).find, environment.distro)
    yield from check_clock(survey)
    yield from check_one_sided(survey)
    answers = interview(session, environment.domain) if survey.processes else {}
    yield from check_answers(session, survey, answers)
    yield from check_sight(session, survey, answers)
    yield from check_clocks(survey, answers)
    yield from check_replicas(session, environment.domain)
    yield from check_stamps(session, survey, examination.listen)


class _Hashes:
    """The hashes of the types known here.

    Args:
        environment: Where packages are.
    """

    def __init__(self, environment: Environment) -> None:
        self._types = TypeStore(package_index(environment), environment.home / "rosz")

    def find(self, kind: Kind, type_name: str) -> str:
        """Return the hash of a type.

        Raises:
            TypeNotFound: It is not known.
            DefinitionError: Its package has a definition that is not well-formed.
        """
        if kind in {Kind.PUBLISHER, Kind.SUBSCRIPTION}:
            return self._types.message(type_name)._type_hash
        return self._types.service(type_name)._type_hash
