"""Validation of a robot's parts as a whole, and joint properties brought together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import (
    Body,
    Chain,
    Contact,
    Drive,
    Joint,
    WheelRadius,
    joint_of,
    joint_properties,
)

RESERVED = ("base", "world")


def assemble(
    name: object, chains: Iterable[Chain], contacts: Iterable[Contact], base_body: object
) -> tuple[tuple[Chain, ...], tuple[Contact, ...]]:
    """Checked chains and contacts; every drive carries all that is known of its joint, so that equal robots
    have equal chains. Raises InputError or UnknownNameError."""
    if not isinstance(name, str) or not name.strip():
        raise InputError(f"Robot.name: must be a non-empty text, got {name!r}.")
    if base_body is not None and not isinstance(base_body, Body):
        raise InputError(f"Robot.base_body: expected a Body or None, got {base_body!r}.")
    chains = _all_of(Chain, chains, "Robot.chains")
    contacts = _all_of(Contact, contacts, "Robot.contacts")
    if not chains:
        raise InputError("Robot.chains: a robot needs at least one chain.")
    _check_names(chains)
    frames = {"base"} | {chain.frame_name(i) for chain in chains for i in range(len(chain.elements))}
    ends = {chain.name for chain in chains}
    seen: set[str] = set()
    for contact in contacts:
        if contact.name in seen:
            raise InputError(f"Robot.contacts: two contacts are named {contact.name!r}.")
        seen.add(contact.name)
        if contact.frame not in frames | ends:
            raise UnknownNameError("frame", contact.frame, frames, where=f"Contact({contact.name!r}).frame")
        if contact.frame not in frames:
            raise InputError(f"Contact({contact.name!r}).frame: {contact.frame!r} is a chain; name one of its frames.")
    joints = dict(joint_properties(chains))
    for name in _wheel_joints(chains):
        # the default of WheelRadius, now that nothing else can say otherwise
        if joints[name].limits is None:
            joints[name] = replace(joints[name], limits=(0.0, math.pi))
    return _with_properties(chains, joints), tuple(_followed(contact, joints) for contact in contacts)


def declare(chains: tuple[Chain, ...], joints: Sequence[Joint | str]) -> tuple[Chain, ...]:
    """Chains whose joints have the declared properties as well.

    Raises InputError for a joint declared twice, one that drives nothing, or one that is used but not
    declared.
    """
    declared: dict[str, Joint] = {}
    for item in joints:
        joint = Joint(item) if isinstance(item, str) else item
        if not isinstance(joint, Joint):
            raise InputError(f"joints: expected a Joint or a name, got {item!r}.")
        if (joint.offset, joint.scale) != (0.0, 1.0):
            raise InputError(f"joints: {joint.name!r} is declared with an offset or a scale; those belong to a row.")
        if joint.name in declared:
            raise InputError(f"joints: {joint.name!r} is declared twice.")
        declared[joint.name] = joint
    used = joint_properties(chains)
    for name in used:
        if name not in declared:
            raise UnknownNameError("joint", name, declared, where="rows")
    for name in declared:
        if name not in used:
            raise InputError(f"joints: {name!r} drives nothing; joints that do: {', '.join(used) or '(none)'}.")
    # a plain name declares the joint and says nothing else about it
    told = {j.name: j for j in joints if isinstance(j, Joint)}
    for name, joint in told.items():
        for prop in ("limits", "rate", "effort"):
            old, new = getattr(used[name], prop), getattr(joint, prop)
            if old is not None and new is not None and old != new:
                raise InputError(f"joints: {name!r} has {prop} {new!r} here and {old!r} in the rows.")
    merged = {
        name: replace(
            told[name],
            **{
                prop: getattr(told[name], prop) if getattr(told[name], prop) is not None else getattr(joint, prop)
                for prop in ("limits", "rate", "effort")
            },
            actuated=told[name].actuated and joint.actuated,
        )
        if name in told
        else joint
        for name, joint in used.items()
    }
    return _with_properties(chains, merged)


def _all_of(kind: type[Any], items: Any, field: str) -> tuple[Any, ...]:
    try:
        checked = tuple(items)
    except TypeError as error:
        raise InputError(f"{field}: expected a sequence of {kind.__name__}, got {items!r}.") from error
    for item in checked:
        if not isinstance(item, kind):
            raise InputError(f"{field}: expected {kind.__name__}, got {item!r}.")
    return checked


def _check_names(chains: tuple[Chain, ...]) -> None:
    chain_names: set[str] = set()
    frames: set[str] = {"base"}
    owner: dict[str, str] = {}
    for chain in chains:
        if chain.name in RESERVED:
            raise InputError(f"chain {chain.name!r}: this name is reserved.")
        if chain.name in chain_names:
            raise InputError(f"Robot.chains: two chains are named {chain.name!r}.")
        chain_names.add(chain.name)
        if chain.parent not in frames:
            raise UnknownNameError(
                "frame",
                chain.parent,
                frames,
                where=f"chain {chain.name!r}.parent (chains must start at the base or at a frame of an earlier chain)",
            )
        last = len(chain.elements) - 1
        for i in range(len(chain.elements)):
            frame = chain.frame_name(i)
            if frame in RESERVED:
                raise InputError(f"chain {chain.name!r}, element {i + 1}: the frame name {frame!r} is reserved.")
            if frame in frames:
                raise InputError(f"chain {chain.name!r}, element {i + 1}: a frame {frame!r} exists already.")
            frames.add(frame)
            if not (frame == chain.name and i == last):
                owner[frame] = chain.name
    for name in chain_names & owner.keys():
        raise InputError(
            f"chain {name!r}: frame {name!r} of chain {owner[name]!r} has the same name and is not its end."
        )


def _wheel_joints(chains: tuple[Chain, ...]) -> set[str]:
    return {
        value.joint.name
        for chain in chains
        for element in chain.elements
        for field in element.VARIABLES
        if isinstance(value := getattr(element, field), WheelRadius)
    }


def _followed(contact: Contact, joints: Mapping[str, Joint]) -> Contact:
    """The contact, its drive with all that is known of the joint."""
    if contact.drive is None:
        return contact
    name = contact.drive.joint.name
    if name not in joints:
        raise UnknownNameError("joint", name, joints, where=f"Contact({contact.name!r}).drive")
    return replace(contact, drive=replace(contact.drive, joint=joints[name]))


def _with_properties(chains: tuple[Chain, ...], joints: Mapping[str, Joint]) -> tuple[Chain, ...]:
    def known(drive: Drive) -> Drive:
        joint = joints[joint_of(drive).name]
        if isinstance(drive, WheelRadius):
            return replace(drive, joint=joint)
        return replace(joint, offset=drive.offset, scale=drive.scale)

    return tuple(replace(chain, elements=tuple(_mapped(e, known) for e in chain.elements)) for chain in chains)


def _mapped(element: Any, change: Callable[[Drive], Drive]) -> Any:
    changes = {f: change(v) for f in element.VARIABLES if isinstance(v := getattr(element, f), (Joint, WheelRadius))}
    return replace(element, **changes) if changes else element
