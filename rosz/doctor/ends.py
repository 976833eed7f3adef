"""What the tokens of topics, services and nodes show by themselves."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator

from rosz.doctor.finding import Finding, error, warning
from rosz.errors import RoszError, TypeNotFound, near_miss
from rosz.introspect.survey import Survey
from rosz.names import short_type
from rosz.wire import NO_HASH, Kind, Token

__all__ = (
    "check_clock",
    "check_duplicates",
    "check_hashes",
    "check_hashless",
    "check_one_sided",
    "check_packages",
    "check_types",
    "check_unreadable",
)

_BOTH_SIDES = ((Kind.PUBLISHER, Kind.SUBSCRIPTION), (Kind.SERVICE, Kind.CLIENT))
_HASH_SHOWN = 15
_CLOCK = "/clock"
# What a node offers whether or not anybody wants it.
_OFFERED = frozenset({"/rosout", "/rosout_agg", "/parameter_events", _CLOCK, "/diagnostics"})


def _by_name(survey: Survey) -> Iterator[tuple[str, str, list[Token]]]:
    """Yield what it is, the name, and the ends, of every topic and service."""
    for word, kinds in zip(("topic", "service"), _BOTH_SIDES, strict=True):
        groups: defaultdict[str, list[Token]] = defaultdict(list)
        for token in survey.view.entities(*kinds):
            groups[token.name].append(token)
        for name, tokens in sorted(groups.items()):
            yield word, name, tokens


def _end(survey: Survey, token: Token) -> str:
    verb = {
        Kind.PUBLISHER: "publishes",
        Kind.SUBSCRIPTION: "subscribes",
        Kind.SERVICE: "serves",
        Kind.CLIENT: "calls",
    }[token.kind]
    return f"{token.node_name} ({survey.address(token)}) {verb}"


def check_types(survey: Survey) -> Iterator[Finding]:
    """Find topics and services that have more than one type."""
    for word, name, tokens in _by_name(survey):
        if len({token.type_name for token in tokens}) > 1:
            yield error(
                "type-mismatch",
                f"{word} {name} has several types: those of different types do not reach each"
                " other",
                sorted(f"{_end(survey, t)} {short_type(t.type_name)}" for t in tokens),
                "give all sides one type, or one side another name (remap it)",
            )


def check_hashes(survey: Survey) -> Iterator[Finding]:
    """Find topics and services of one type of which sides have different definitions."""
    for word, name, tokens in _by_name(survey):
        for type_name in sorted({token.type_name for token in tokens}):
            same = [t for t in tokens if t.type_name == type_name and t.type_hash != NO_HASH]
            if len({token.type_hash for token in same}) > 1:
                yield error(
                    "hash-mismatch",
                    f"{word} {name}: its sides have different definitions of"
                    f" {short_type(type_name)}, and do not reach each other",
                    sorted(f"{_end(survey, t)} {t.type_hash[:_HASH_SHOWN]}…" for t in same),
                    f"bring the package '{type_name.partition('/')[0]}' to one version on all"
                    " sides, and start again what uses it",
                )


def check_hashless(survey: Survey, distro: str) -> Iterator[Finding]:
    """Find nodes of an rmw_zenoh that is too old to tell type hashes.

    Args:
        survey: Who is there.
        distro: ``ROS_DISTRO`` here.
    """
    old = [token for token in survey.view.entities() if token.type_hash == NO_HASH]
    if old and distro != "humble":
        yield error(
            "old-rmw-zenoh",
            "nodes come from an rmw_zenoh without type hashes, that of ROS 2 Humble: they do not"
            " reach those that have them",
            sorted({f"{token.node_name} ({survey.address(token)})" for token in old}),
            "update them to ROS 2 Jazzy or later, or set ROS_DISTRO=humble for all of rosz",
        )


def check_unreadable(survey: Survey) -> Iterator[Finding]:
    """Find tokens that have another form than those of rmw_zenoh today."""
    if survey.damaged:
        yield error(
            "unreadable-tokens",
            "something makes itself known in a form that is not rmw_zenoh's",
            survey.damaged,
            "update the rmw_zenoh of whoever does, or keep it off this network",
        )


def check_duplicates(survey: Survey) -> Iterator[Finding]:
    """Find nodes of one name."""
    found: defaultdict[str, set[str]] = defaultdict(set)
    for token in survey.view.tokens:
        found[token.node_name].add(f"{survey.address(token)}, node {token.node_id}")
    for name, places in sorted(found.items()):
        if len(places) > 1:
            yield error(
                "duplicate-node",
                f"{len(places)} nodes are called {name}",
                sorted(places),
                "start all but one with another name (__name:=, name= in a launch file) or in"
                " another namespace",
            )


def check_one_sided(survey: Survey) -> Iterator[Finding]:
    """Find topics where one side waits for the other, and services that nobody serves."""
    unheard: list[Token] = []
    unsaid: list[Token] = []
    for _, name, tokens in _by_name(survey):
        kinds = {token.kind for token in tokens}
        if len(kinds) > 1 or name in _OFFERED:
            continue
        if kinds == {Kind.PUBLISHER}:
            unheard += tokens
        elif kinds != {Kind.SERVICE}:
            unsaid += tokens
    if unsaid:
        yield warning(
            "no-publisher",
            "nodes wait for what nobody publishes or serves",
            _alone(survey, unsaid, unheard),
            "start who is missing, or correct the name or the remapping",
        )
    if unheard:
        yield warning(
            "no-subscriber",
            "nodes publish what nobody subscribes to",
            _alone(survey, unheard, unsaid),
            "nothing, if that is meant; else start who is missing, or correct the name",
        )


def check_clock(survey: Survey) -> Iterator[Finding]:
    """Find nodes whose time stands still: they wait for a /clock that nobody publishes."""
    ends = [end for end in survey.view.entities(*_BOTH_SIDES[0]) if end.name == _CLOCK]
    if ends and all(end.kind is Kind.SUBSCRIPTION for end in ends):
        yield error(
            "no-clock",
            "nodes live in simulated time and nobody publishes /clock: their time stands still",
            sorted(_end(survey, end) for end in ends),
            "start the simulator; or, to live in real time, run"
            " 'rosz param set /use_sim_time false' and start them again",
        )


def _alone(survey: Survey, lonely: Iterable[Token], others: list[Token]) -> list[str]:
    """Say what each waits for, and what on the other side it may have meant."""
    lines = set()
    for token in lonely:
        kin = [other.name for other in others if other.type_name == token.type_name]
        hint = near_miss(token.name, kin).replace("did you mean", "is it meant for")
        lines.add(f"{token.name} [{short_type(token.type_name)}]: {_end(survey, token)}{hint}")
    return sorted(lines)


def check_packages(
    survey: Survey, hash_of: Callable[[Kind, str], str], distro: str = ""
) -> Iterator[Finding]:
    """Find types that are not known here, or known by another definition.

    Args:
        survey: Who is there.
        hash_of: Returns the hash of a type by what uses it and its full name, or raises
            `TypeNotFound`.
        distro: ``ROS_DISTRO`` here.
    """
    users: defaultdict[tuple[str, str], list[Token]] = defaultdict(list)
    for token in survey.view.entities():
        if "/action/" not in token.type_name:
            users[token.type_name, token.type_hash].append(token)
    for (type_name, type_hash), tokens in sorted(users.items()):
        ends = sorted({f"{token.name}: {_end(survey, token)}" for token in tokens})
        package = type_name.partition("/")[0]
        try:
            known = hash_of(tokens[0].kind, type_name)
        except TypeNotFound as fault:
            yield error(
                "missing-package",
                f"the type {short_type(type_name)} is not known here: {fault}",
                ends,
                f"put the package '{package}' on the package path (ROSZ_PACKAGE_PATH); its"
                " package.xml and .msg files are enough",
            )
        except RoszError as fault:
            yield error(
                "bad-definition",
                f"the type {short_type(type_name)} cannot be used here: {fault}",
                ends,
                "correct the definition: 'rosz pkg check' shows all that is wrong",
            )
        else:
            if type_hash not in {known, NO_HASH} and distro != "humble":
                yield warning(
                    "other-definition",
                    f"{short_type(type_name)} has another definition here: commands and nodes of"
                    " this machine do not reach those",
                    [
                        f"{end} {type_hash[:_HASH_SHOWN]}…, here {known[:_HASH_SHOWN]}…"
                        for end in ends
                    ],
                    f"bring the package '{package}' to the version that they have",
                )
