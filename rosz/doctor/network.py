"""What the network as a whole shows: other domains, replicas, and the releases of Zenoh."""

from __future__ import annotations

import json
import re
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress

from rosz.doctor.finding import Finding, error, warning
from rosz.errors import DecodeError
from rosz.introspect.survey import Survey
from rosz.params.keys import Keys, Member
from rosz.params.wire import Sync, SyncAnswer, decode, encode
from rosz.session import Session
from rosz.wire import Kind, Token, parse_token, tokens_key

__all__ = ("OLDEST_ZENOH", "check_domains", "check_replicas", "check_versions")

OLDEST_ZENOH = (1, 4)
"""What rmw_zenoh of ROS 2 Humble and Jazzy came with since it has today's form."""

_SECONDS = 1.0
_ADMIN_SECONDS = 0.5
_LOOKS = 4
_PAUSE = 0.25
_BUCKET = 8
_VERSION = re.compile(r"v?(\d+)\.(\d+)")
_OTHER = {
    Kind.PUBLISHER: Kind.SUBSCRIPTION,
    Kind.SUBSCRIPTION: Kind.PUBLISHER,
    Kind.SERVICE: Kind.CLIENT,
    Kind.CLIENT: Kind.SERVICE,
}


def check_domains(session: Session, survey: Survey) -> Iterator[Finding]:
    """Find nodes in other domains that seem to be meant for this one."""
    others: list[Token] = []
    for key in session.live_tokens(tokens_key("*"), _SECONDS):
        with suppress(DecodeError):  # told of by the check of this domain's tokens
            token = parse_token(key)
            if token.domain != survey.domain:
                others.append(token)
    if not others:
        return
    remedy = (
        f"set ROS_DOMAIN_ID to one number for all that belong together; here it is {survey.domain}"
    )
    if not survey.view.tokens:
        yield error(
            "wrong-domain",
            f"nobody is in domain {survey.domain}, but there are nodes in others",
            _by_domain(others),
            remedy,
        )
        return
    lines = [
        f"{token.name}: {token.node_name} of domain {token.domain} is what"
        f" {mate.node_name} of domain {survey.domain} lacks"
        for token in others
        if token.qos is not None
        for mate in _lacking(survey, token)
    ]
    if lines:
        yield error(
            "wrong-domain",
            "nodes of another domain are what nodes of this one wait for",
            sorted(set(lines)),
            remedy,
        )


def _by_domain(tokens: list[Token]) -> list[str]:
    names: dict[int, set[str]] = {}
    for token in tokens:
        names.setdefault(token.domain, set()).add(token.node_name)
    return [f"domain {domain}: {', '.join(sorted(names[domain]))}" for domain in sorted(names)]


def _lacking(survey: Survey, token: Token) -> list[Token]:
    """Return the ends here that a token of another domain would be the missing other side of."""
    if survey.view.entities(token.kind, name=token.name):
        return []
    found = survey.view.entities(_OTHER[token.kind], name=token.name)
    return [mate for mate in found if mate.type_name == token.type_name]


def check_replicas(session: Session, domain: int) -> Iterator[Finding]:
    """Find replicas of the parameters that are not like the others, or do not answer."""
    keys = Keys(domain)
    for look in range(_LOOKS):
        if look:
            time.sleep(_PAUSE)  # a write on its way reaches all meanwhile
        members = [keys.member(token) for token in session.live_tokens(keys.tokens, _SECONDS)]
        digests = _digests(session, keys, members)
        if len(members) == len(digests) and len(set(digests.values())) <= 1:
            return
    silent = [member for member in members if member.zid not in digests]
    if silent:
        yield error(
            "replica-silent",
            "replicas of the parameters do not answer: a write waits for them in vain",
            sorted(f"{member.label} (session {member.zid})" for member in silent),
            "they hang or are stopped: let them go on, or end them",
        )
    counts = Counter(digests.values())
    if len(counts) > 1:
        usual = counts.most_common(1)[0][0]
        yield error(
            "replica-out-of-step",
            "replicas of the parameters differ, and stay so",
            sorted(
                f"{member.label} (session {member.zid}): other writes in"
                f" {_differing(usual, digests[member.zid])} of {len(usual) // _BUCKET} buckets"
                for member in members
                if digests.get(member.zid, usual) != usual
            ),
            "it does not hear what the others write, or they do not hear it: check the link to its"
            " machine, then start it again",
        )


def _digests(session: Session, keys: Keys, members: list[Member]) -> dict[str, bytes]:
    """Return the digest of every replica that answers, by session; all are asked at once."""
    question = encode(Sync())
    asked = [
        (member.zid, session.query(keys.sync(member.zid), timeout=_SECONDS, payload=question))
        for member in members
    ]
    return {
        zid: decode(reply.payload, SyncAnswer).digest
        for zid, answers in asked
        for reply in answers
        if reply.ok
    }


def _differing(one: bytes, other: bytes) -> int:
    return sum(
        one[start : start + _BUCKET] != other[start : start + _BUCKET]
        for start in range(0, max(len(one), len(other)), _BUCKET)
    )


def check_versions(session: Session) -> Iterator[Finding]:
    """Find routers and peers of a Zenoh that is too old; those without an admin space tell none."""
    old: list[str] = []
    for reply in session.get("@/*/*", timeout=_ADMIN_SECONDS):
        _, zid, *kind = reply.key.split("/") if reply.ok else ("", "")
        if kind not in (["router"], ["peer"]):
            continue
        with suppress(ValueError, AttributeError):  # no JSON, or none with a version
            version = str(json.loads(reply.payload).get("version"))
            match = _VERSION.match(version)
            if match and (int(match[1]), int(match[2])) < OLDEST_ZENOH:
                old.append(f"{kind[0]} {zid}: Zenoh {version}")
    if old:
        oldest = ".".join(map(str, OLDEST_ZENOH))
        yield warning(
            "old-zenoh",
            f"parts of the network have a Zenoh before {oldest}",
            sorted(old),
            "update them: latched topics and the presence of nodes rely on what came since",
        )
