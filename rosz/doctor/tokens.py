"""Checks on the liveliness tokens of nodes, topics and services."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

from rosz.doctor.machine import Finding, error, warning
from rosz.errors import DecodeError, InvalidName, RoszError, TypeNotFound, near_miss
from rosz.introspect import Survey
from rosz.names import check, short_type
from rosz.session import Session
from rosz.wire import NO_HASH, Kind, Token, parse_token, tokens_key

_BOTH_SIDES = ((Kind.PUBLISHER, Kind.SUBSCRIPTION), (Kind.SERVICE, Kind.CLIENT))
_HASH_SHOWN = 15  # "RIHS01_" and eight digits
_REPLY_TIMEOUT = 1.0
_OTHER = {one: other for pair in _BOTH_SIDES for one, other in (pair, pair[::-1])}
_VERBS = {
    Kind.PUBLISHER: "publishes",
    Kind.SUBSCRIPTION: "subscribes",
    Kind.SERVICE: "serves",
    Kind.CLIENT: "calls",
}
_CLOCK = "/clock"
# Topics that nodes publish whether or not anybody subscribes.
_OFFERED = frozenset({"/rosout", "/rosout_agg", "/parameter_events", _CLOCK, "/diagnostics"})
# Each action server publishes these; its clients subscribe to them, and they come and go.
_OF_ACTIONS = ("/_action/feedback", "/_action/status")


def _by_name(survey: Survey) -> Iterator[tuple[str, str, list[Token]]]:
    """Yield the kind, the name and the tokens of every topic and service."""
    for word, kinds in zip(("topic", "service"), _BOTH_SIDES, strict=True):
        groups: defaultdict[str, list[Token]] = defaultdict(list)
        for token in survey.view.entities(*kinds):
            groups[token.name].append(token)
        for name, tokens in sorted(groups.items()):
            yield word, name, tokens


def _end(survey: Survey, token: Token) -> str:
    return f"{token.node_name} ({survey.address(token)}) {_VERBS[token.kind]}"


def check_types(survey: Survey) -> Iterator[Finding]:
    """Find topics and services that have more than one type."""
    for word, name, tokens in _by_name(survey):
        if len({token.type_name for token in tokens}) > 1:
            yield from error(
                "type-mismatch",
                f"{word} {name} has several types: those of different types do not reach each"
                " other",
                sorted(f"{_end(survey, t)} {short_type(t.type_name)}" for t in tokens),
                "give all sides one type, or one side another name (remap it)",
            )


def check_hashes(survey: Survey) -> Iterator[Finding]:
    """Find topics and services whose sides have different definitions of one type."""
    for word, name, tokens in _by_name(survey):
        for type_name in sorted({token.type_name for token in tokens}):
            same = [t for t in tokens if t.type_name == type_name and t.type_hash != NO_HASH]
            if len({token.type_hash for token in same}) > 1:
                yield from error(
                    "hash-mismatch",
                    f"{word} {name}: its sides have different definitions of"
                    f" {short_type(type_name)}, and do not reach each other",
                    sorted(f"{_end(survey, t)} {t.type_hash[:_HASH_SHOWN]}…" for t in same),
                    f"bring the package '{type_name.partition('/')[0]}' to one version on all"
                    " sides, and start again what uses it",
                )


def check_hashless(survey: Survey, distro: str) -> Iterator[Finding]:
    """Find nodes of an old rmw_zenoh, whose tokens have no type hashes; Humble's have none."""
    old = [token for token in survey.view.entities() if token.type_hash == NO_HASH]
    if old and distro != "humble":
        yield from error(
            "old-rmw-zenoh",
            "nodes come from an rmw_zenoh without type hashes, that of ROS 2 Humble: they do not"
            " reach those that have them",
            sorted({f"{token.node_name} ({survey.address(token)})" for token in old}),
            "update them to ROS 2 Jazzy or later, or set ROS_DISTRO=humble for all of rosz",
        )


def check_unreadable(survey: Survey) -> Iterator[Finding]:
    """Find tokens whose form is not rmw_zenoh's present one."""
    yield from error(
        "unreadable-tokens",
        "liveliness tokens have a form that is not rmw_zenoh's",
        survey.damaged,
        "update rmw_zenoh where they come from, or keep that off this network",
    )


def check_names(survey: Survey) -> Iterator[Finding]:
    """Find names of nodes, topics and services that ROS's rules do not allow."""
    refused: set[str] = set()
    for token in survey.view.tokens:
        for name in (token.node_name, token.name):
            try:
                check(name)
            except InvalidName as fault:
                refused.add(f"{token.node_name} ({survey.address(token)}): {fault}")
    yield from error(
        "refused-name",
        "nodes use names that others refuse: these can neither subscribe nor call",
        sorted(refused),
        "start them with legal names: letters, digits, '_' and '/'",
    )


def check_duplicates(survey: Survey) -> Iterator[Finding]:
    """Find several nodes of one name."""
    places_of: defaultdict[str, set[str]] = defaultdict(set)
    for token in survey.view.tokens:
        places_of[token.node_name].add(f"{survey.address(token)}, node {token.node_id}")
    for name, places in sorted(places_of.items()):
        if len(places) > 1:
            yield from error(
                "duplicate-node",
                f"{len(places)} nodes are called {name}",
                sorted(places),
                "start all but one with another name (__name:=, name= in a launch file) or in"
                " another namespace",
            )


def check_one_sided(survey: Survey) -> Iterator[Finding]:
    """Find topics with one side only, and services that no node serves."""
    unheard: list[Token] = []
    unsaid: list[Token] = []
    for _, name, tokens in _by_name(survey):
        kinds = {token.kind for token in tokens}
        if len(kinds) > 1 or name in _OFFERED:
            continue
        if kinds == {Kind.PUBLISHER}:
            unheard += () if name.endswith(_OF_ACTIONS) else tokens
        elif kinds != {Kind.SERVICE}:
            unsaid += tokens
    yield from warning(
        "no-publisher",
        "nodes wait for topics or services that no node publishes or serves",
        _alone(survey, unsaid, unheard),
        "start who is missing, or correct the name or the remapping",
    )
    yield from warning(
        "no-subscriber",
        "nodes publish topics that no node subscribes to",
        _alone(survey, unheard, unsaid),
        "nothing, if that is meant; else start who is missing, or correct the name",
    )


def check_clock(survey: Survey) -> Iterator[Finding]:
    """Find nodes whose time stands still, since no node publishes /clock."""
    ends = [end for end in survey.view.entities(*_BOTH_SIDES[0]) if end.name == _CLOCK]
    if ends and all(end.kind is Kind.SUBSCRIPTION for end in ends):
        yield from error(
            "no-clock",
            "nodes use simulated time and no node publishes /clock: their time stands still",
            sorted(_end(survey, end) for end in ends),
            "start the simulator; or, to live in real time, run"
            " 'rosz param set /use_sim_time false' and start them again",
        )


def _alone(survey: Survey, lonely: Iterable[Token], others: list[Token]) -> list[str]:
    """Return a line for each token, with a similar name that was perhaps meant."""
    lines = set()
    for token in lonely:
        kin = [other.name for other in others if other.type_name == token.type_name]
        hint = near_miss(token.name, kin).replace("did you mean", "is it meant for")
        lines.add(f"{token.name} [{short_type(token.type_name)}]: {_end(survey, token)}{hint}")
    return sorted(lines)


def check_packages(
    survey: Survey, hash_of: Callable[[Kind, str], str], distro: str = ""
) -> Iterator[Finding]:
    """Find types that are not known here, or have another definition here.

    Args:
        survey: The nodes that are running.
        hash_of: Function that returns the hash of a type by the kind of a token that uses it and
            its full name, or raises `TypeNotFound`.
        distro: Value of ``ROS_DISTRO`` here.
    """
    users: defaultdict[tuple[str, str], list[Token]] = defaultdict(list)
    for token in survey.view.entities():
        if "/action/" not in token.type_name:
            users[token.type_name, token.type_hash].append(token)
    for (type_name, type_hash), tokens in sorted(users.items()):
        ends = sorted({f"{token.name}: {_end(survey, token)}" for token in tokens})
        package = type_name.partition("/")[0]
        try:
            hash_here = hash_of(tokens[0].kind, type_name)
        except TypeNotFound as fault:
            yield from error(
                "missing-package",
                f"the type {short_type(type_name)} is not known here: {fault}",
                ends,
                f"put the package '{package}' on the package path (ROSZ_PACKAGE_PATH); its"
                " package.xml and .msg files are enough",
            )
        except RoszError as fault:
            yield from error(
                "bad-definition",
                f"the type {short_type(type_name)} cannot be used here: {fault}",
                ends,
                "correct the definition: 'rosz pkg check' shows all that is wrong",
            )
        else:
            if type_hash not in {hash_here, NO_HASH} and distro != "humble":
                yield from warning(
                    "other-definition",
                    f"{short_type(type_name)} has another definition here: commands and nodes of"
                    " this machine do not reach those",
                    [
                        f"{end} {type_hash[:_HASH_SHOWN]}…, here {hash_here[:_HASH_SHOWN]}…"
                        for end in ends
                    ],
                    f"bring the package '{package}' to the version that they have",
                )


def check_domains(session: Session, survey: Survey) -> Iterator[Finding]:
    """Find nodes in other domains that seem to belong to this one."""
    others: list[Token] = []
    for key in session.live_tokens(tokens_key("*"), _REPLY_TIMEOUT):
        with suppress(DecodeError):  # check_unreadable reports those of this domain
            token = parse_token(key)
            if token.domain != survey.domain:
                others.append(token)
    if not others:
        return
    remedy = (
        f"set ROS_DOMAIN_ID to one number for all that belong together; here it is {survey.domain}"
    )
    if not survey.view.tokens:
        text = f"no node is in domain {survey.domain}, but there are nodes in others"
        names: defaultdict[int, set[str]] = defaultdict(set)
        for token in others:
            names[token.domain].add(token.node_name)
        lines = [f"domain {domain}: {', '.join(sorted(names[domain]))}" for domain in sorted(names)]
        yield from error("wrong-domain", text, lines, remedy)
        return
    text = "nodes of another domain are what nodes of this one wait for"
    lines = [
        f"{token.name}: {token.node_name} of domain {token.domain} is what"
        f" {mate.node_name} of domain {survey.domain} lacks"
        for token in others
        if token.qos is not None
        for mate in _lacking(survey, token)
    ]
    yield from error("wrong-domain", text, sorted(set(lines)), remedy)


def _lacking(survey: Survey, token: Token) -> list[Token]:
    """Return the tokens here for which one of another domain is the missing other side."""
    if survey.view.entities(token.kind, name=token.name):
        return []
    mates = survey.view.entities(_OTHER[token.kind], name=token.name)
    return [mate for mate in mates if mate.type_name == token.type_name]
