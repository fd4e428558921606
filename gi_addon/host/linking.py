# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's light linking: which objects a lamp lights, and which shade it."""

from __future__ import annotations

import bpy

from ..scene import EVERY_SET, LIGHT_SETS, set_bits


class Linking:
    """Sets of objects that all lamps treat alike, for the lamps of a view layer.

    A lamp's collection names objects and collections to include or to exclude. Without one that is included, everything is
    but what is excluded; what is both is excluded, as in Cycles.
    """

    def __init__(self, depsgraph: bpy.types.Depsgraph, notes: list[str]) -> None:
        self._notes = notes
        self._told = False
        # By the collection of each kind that some lamp uses: (objects included, or None for all; objects excluded).
        self._rules: dict[str, dict[int, tuple[set[int] | None, set[int]]]] = {"receiver": {}, "blocker": {}}
        # By kind, what tells an object's set from others, and the number of each.
        self._sets: dict[str, dict[tuple[bool, ...], int]] = {"receiver": {}, "blocker": {}}
        for obj in depsgraph.objects:
            linking = getattr(obj, "light_linking", None)
            if linking is None:
                continue
            used = [linking.receiver_collection, linking.blocker_collection]
            if obj.type != "LIGHT" and any(used):
                notes.append(f"the light of {obj.name} is linked to some objects; only lamps are here, so it lights all")
                continue
            for kind, collection in zip(self._rules, used, strict=True):
                if collection is not None and _uid(collection) not in self._rules[kind]:
                    self._rules[kind][_uid(collection)] = _rule(collection)
        self.used = any(self._rules.values())

    def bits(self, obj: bpy.types.Object) -> int:
        """Visibility bits of an object's sets."""
        if not self.used:
            return 0
        return set_bits(self._set("receiver", obj), self._set("blocker", obj))

    def _set(self, kind: str, obj: bpy.types.Object) -> int:
        uid = _uid(obj)
        member = tuple((names is None or uid in names) and uid not in without for names, without in self._rules[kind].values())
        sets = self._sets[kind]
        if member not in sets and len(sets) == LIGHT_SETS:
            if not self._told:
                self._notes.append(f"light linking has more than {LIGHT_SETS} kinds of objects; {obj.name} and others count as "
                                   "the first kind")  # fmt: skip
                self._told = True
            return 0
        return sets.setdefault(member, len(sets))

    def masks(self, obj: bpy.types.Object) -> tuple[int, int]:
        """(receivers, blockers) of a lamp, a bit for each set. Good once :meth:`bits` has seen every object."""
        linking = getattr(obj, "light_linking", None)
        if linking is None or not self.used:
            return EVERY_SET, EVERY_SET
        return (self._mask("receiver", linking.receiver_collection), self._mask("blocker", linking.blocker_collection))

    def _mask(self, kind: str, collection: bpy.types.Collection | None) -> int:
        if collection is None:
            return EVERY_SET
        column = list(self._rules[kind]).index(_uid(collection))
        return sum(1 << number for member, number in self._sets[kind].items() if member[column])


def _uid(data: bpy.types.ID) -> int:
    return data.original.session_uid


def _rule(collection: bpy.types.Collection) -> tuple[set[int] | None, set[int]]:
    """(objects included, None for all; objects excluded): a collection inside counts as all its objects."""
    members = [({_uid(o)}, link) for o, link in zip(collection.objects, collection.collection_objects, strict=True)]
    members += [({_uid(o) for o in inner.all_objects}, link)
                for inner, link in zip(collection.children, collection.collection_children, strict=True)]  # fmt: skip
    kept: dict[str, set[int]] = {"INCLUDE": set(), "EXCLUDE": set()}
    for uids, link in members:
        kept[link.light_linking.link_state] |= uids
    included = any(link.light_linking.link_state == "INCLUDE" for _, link in members)
    return (kept["INCLUDE"] if included else None, kept["EXCLUDE"])
