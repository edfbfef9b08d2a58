"""Does to a network what was decided by hand: uses of observations, roles of points."""

from __future__ import annotations

from tribrach.errors import InputError, UnknownName
from tribrach.network.network import Edit, Network
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.project.edits import Edits, PickEdit, TargetEdit
from tribrach.sentences import Sentence, joined


def obeyed(network: Network, edits: Edits, *, whole: bool = True) -> Network:
    """Give observations the uses and points the roles that were decided by hand."""
    if whole:
        network = network.noting(_told(target) for target in edits.target)
        network = network.noting(_picked(pick) for pick in edits.pick)
    for number, role in enumerate(edits.role):
        try:
            network = network.with_role(
                role.point, role.role, reason=role.reason, by=role.by, at=role.when
            )
        except UnknownName as error:
            if whole:
                raise edits.error("role", number, error.what, error.cure) from error
        except InputError as error:
            raise edits.error("role", number, error.what, error.cure) from error
    for number, edit in enumerate(edits.edit):
        use = Use[edit.use.upper()]
        try:
            network = network.with_use(
                edit.observation, use, reason=edit.reason, by=edit.by, at=edit.when
            )
        except UnknownName as error:
            if whole:
                raise edits.error("edit", number, error.what, error.cure) from error
        except InputError as error:
            raise edits.error("edit", number, error.what, error.cure) from error
    return network


def decided_marks(survey: Survey, edits: Edits) -> Survey:
    """Survey of marks alone, with the uses and roles decided by hand.

    Decided is before the part is taken: given coordinates of a check point become control, and what
    a file switched off comes back.
    """
    every = survey.of_marks(active=False)
    if not (edits.edit or edits.role) or not every.tables():
        return survey.of_marks()
    return every.used_as_in(obeyed(every.network(), edits, whole=False)).of_marks()


def _picked(pick: PickEdit) -> Edit:
    """A pick among the decisions of the network."""
    place = joined(", ", (Sentence("{x:3}", x=x) for x in pick.place))
    what = Sentence("{pick.scan}: {pick.kind} at {place}", pick=pick, place=place)
    action = f"{pick.use} as {pick.name}"
    return Edit(what, action, pick.reason, pick.by, pick.when)


def _told(target: TargetEdit) -> Edit:
    """A decision about a target among those of the network."""
    place = joined(", ", (Sentence("{x:3}", x=x) for x in target.center))
    action = f"name {target.name}" if target.accept else "rejected"
    return Edit(
        Sentence("{target.scan}: target at {place}", target=target, place=place),
        action,
        target.reason,
        target.by,
        target.when,
    )
