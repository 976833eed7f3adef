"""All checks in order, from the machine to the nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec

from rosz.doctor import frames, machine, replies, tokens
from rosz.doctor.machine import Finding, warning
from rosz.environment import Environment, package_index
from rosz.errors import TransportError
from rosz.introspect import open_session, take_survey
from rosz.session import SEGMENTS, Session
from rosz.typestore import TypeStore
from rosz.wire import Kind


class Examination(msgspec.Struct, kw_only=True):
    """The settings and the size of an examination.

    Attributes:
        environment: Settings of this machine.
        listen: Time limit for samples of ROS 2 nodes, and time for transforms, in seconds.
        memory: Folder of shared memory.
        least_free: Number of bytes of it that must be free.
        nodes: Number of nodes found.
    """

    environment: Environment
    listen: float = 1.0
    memory: Path = SEGMENTS
    least_free: int = machine.LEAST_FREE
    nodes: int = 0


def examine(examination: Examination) -> Iterator[Finding]:
    """Yield findings as the checks find them."""
    environment = examination.environment
    yield from machine.check_shared_memory(examination.memory, examination.least_free)
    yield from machine.check_segments(examination.memory)
    yield from machine.check_socket_files(environment)
    yield from machine.check_package_path(environment)
    yield from machine.check_namespace(environment)
    yield from machine.check_connect(environment)
    stopped = list(machine.check_stopped(environment))
    yield from stopped
    taken = [] if stopped else list(machine.check_rendezvous(environment))
    yield from taken
    if taken:
        return
    try:
        session = open_session(environment)
    except TransportError as fault:
        yield from warning(
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
    survey = take_survey(session, environment.domain, processes=True, looks=3)
    examination.nodes = len(survey.view.nodes())
    yield from replies.check_waiting(session)
    yield from tokens.check_domains(session, survey)
    yield from replies.check_versions(session)
    yield from tokens.check_unreadable(survey)
    yield from tokens.check_names(survey)
    yield from tokens.check_duplicates(survey)
    yield from tokens.check_hashless(survey, environment.distro)
    yield from tokens.check_types(survey)
    yield from tokens.check_hashes(survey)
    yield from tokens.check_packages(survey, _type_hashes(environment), environment.distro)
    yield from tokens.check_clock(survey)
    yield from tokens.check_one_sided(survey)
    answers = replies.query_nodes(session, environment.domain) if survey.processes else {}
    yield from replies.check_silent(session, survey, answers)
    yield from replies.check_visibility(session, survey, answers)
    yield from replies.check_clocks(survey, answers)
    yield from replies.check_replicas(session, environment.domain)
    yield from replies.check_stamps(session, survey, examination.listen)
    yield from frames.check_frames(session, survey, examination.listen)


def _type_hashes(environment: Environment) -> Callable[[Kind, str], str]:
    """Return a function that looks up the hash of a type known here; see `check_packages`."""
    types = TypeStore(package_index(environment), environment.home / "rosz")

    def find(kind: Kind, type_name: str) -> str:
        is_topic = kind in {Kind.PUBLISHER, Kind.SUBSCRIPTION}
        cls = types.message(type_name) if is_topic else types.service(type_name)
        return cls._type_hash

    return find
