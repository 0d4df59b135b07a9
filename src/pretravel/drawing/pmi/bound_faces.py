"""To which faces a shape aspect of PMI is bound, by each of the ways in which files state it."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from functools import cached_property
from typing import Any

from pretravel.base import PretravelError
from pretravel.drawing.pmi.items import Place, Triple
from pretravel.drawing.pmi.model_faces import (
    FACE_ENTITIES,
    SHELL_ENTITIES,
    SOLID_ENTITIES,
    edges_of_face,
    face_values,
    length_factor,
    triple,
)
from pretravel.drawing.pmi.part21 import Instance, Part21, TextRecord, TextReference, Word

OF_PMI = re.compile(
    r"(?!DIMENSIONAL_EXPONENTS|UNCERTAINTY_)\w*(?:TOLERANCE|DATUM|DIMENSION|LIMITS_AND_FITS|"
    r"ANGULAR_SIZE|ANGULAR_LOCATION|ZONE_DEFINITION|RUNOUT_ZONE|HOLE_DEFINITION|"
    r"HOLE_OCCURRENCE|SPOTFACE|COUNTERBORE|COUNTERSINK|COUNTERDRILL|SURFACE_TEXTURE|"
    r"THREAD|ROUND_HOLE)\w*$"
)
"""Entities of PMI: each instance of them is read, or listed."""
LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION", "DIRECTED_DIMENSIONAL_LOCATION",
             "DIMENSIONAL_LOCATION_WITH_PATH",
             "DIMENSIONAL_LOCATION_WITH_DATUM_FEATURE")  # fmt: skip
SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE", "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE",
         "DIMENSIONAL_SIZE_WITH_PATH")  # fmt: skip
_RELATIONS = re.compile(
    r"\w*SHAPE_ASPECT_(?:DERIVING_)?RELATIONSHIP|SHAPE_ASPECT_ASSOCIATIVITY|"
    r"FEATURE_FOR_DATUM_TARGET_RELATIONSHIP|FEATURE_COMPONENT_RELATIONSHIP"
)
TARGETS = ("PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET")
_USAGES = {
    "GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE",
    "CHAIN_BASED_GEOMETRIC_ITEM_SPECIFIC_USAGE",
    "CHAIN_BASED_ITEM_IDENTIFIED_REPRESENTATION_USAGE",
}  # fmt: skip
_SETS = {"SET_REPRESENTATION_ITEM", "LIST_REPRESENTATION_ITEM", "COMPOUND_REPRESENTATION_ITEM"}
_MALFORMED = (PretravelError, ValueError, TypeError, IndexError, AttributeError)


class BoundFaces:
    """Shape aspects, what they consist of and are derived from, and their geometry.

    Attributes
    ----------
    part21 : Part21
    used : set of int
        Instances of PMI that were read.
    above, below : mapping of int to list of Instance
        Aspects by the aspects to which others relate them.
    """

    def __init__(self, part21: Part21, used: set[int]) -> None:
        self.part21, self.used = part21, used
        self.above: dict[int, list[Instance]] = defaultdict(list)
        self.below: dict[int, list[Instance]] = defaultdict(list)
        self.geometry: dict[int, list[int]] = defaultdict(list)
        for each in part21.instances.values():
            names = each.names
            try:
                if any(map(_RELATIONS.fullmatch, names)) and not names & set(LOCATIONS):
                    self._relate(each)
                elif names & _USAGES and not names - _USAGES:
                    self._bind(each)
            except _MALFORMED:
                continue  # what it should bind has no face then, which is said there

    def _relate(self, each: Instance) -> None:
        above, below = each.values("SHAPE_ASPECT_RELATIONSHIP")[2:4]
        self.below[above.number].append(self.part21[below])
        self.above[below.number].append(self.part21[above])
        if "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP" in each.names:
            self.used.add(each.number)

    def _bind(self, each: Instance) -> None:
        values = each.values("ITEM_IDENTIFIED_REPRESENTATION_USAGE", *sorted(_USAGES))
        if isinstance(values[2], TextReference):
            self.geometry[values[2].number] += numbers_in(values[4])

    def place(self, aspect: Any) -> Place:
        """The faces of a shape aspect, of what it consists of and of what it is derived from."""
        faces: dict[int, None] = {}
        others: dict[int, None] = {}
        start = self.part21[aspect]
        whole = "PRODUCT_DEFINITION_SHAPE" in start.names
        waiting, seen = [start], set[int]()
        while waiting:
            own = waiting.pop(0)
            if own.number in seen:
                continue
            seen.add(own.number)
            if any(map(OF_PMI.match, own.names)) and "DATUM" not in own.names:
                self.used.add(own.number)
            for number in self.geometry[own.number]:
                found = self.faces_of(number)
                faces |= dict.fromkeys(found)
                whole = whole or bool(found and self.part21[number].names & set(SOLID_ENTITIES))
                if not found:
                    others[number] = None
            waiting += self._parts(own)
        edges = {edge for face in faces for edge in self.edges[face]}
        left = [self.part21[number] for number in others if number not in edges]
        whole = whole or (not faces and not left and _says_all_over(start))
        every = set(faces) >= set(self.edges)
        return Place(
            () if whole and every else tuple(faces),
            tuple(f"#{item.number} {' '.join(sorted(item.names))}" for item in left),
            "ALL_AROUND_SHAPE_ASPECT" in start.names,
            "BETWEEN_SHAPE_ASPECT" in start.names,
            whole and (every or not faces),
            self.beside(left) if left and not faces else (),
        )

    def beside(self, edges: list[Instance]) -> tuple[int, ...]:
        """The faces that have one of some edges; none where one of these is not an edge."""
        numbers = {edge.number for edge in edges if "EDGE_CURVE" in edge.names}
        if len(numbers) < len(edges):
            return ()
        return tuple(face for face, own in self.edges.items() if own & numbers)

    def _parts(self, own: Instance) -> list[Instance]:
        """What an aspect consists of; of a dimension what it is of; of a datum its features."""
        found = [each for each in self.below[own.number] if "DATUM" not in each.names]
        if "DATUM" in own.names:
            features = [each for each in found if not each.names & set(TARGETS)]
            above = self.above[own.number]
            found = features + [each for each in above if not each.names & {"DATUM", *TARGETS}]
        elif own.names & set(SIZES):
            found.append(self.part21[own.values("DIMENSIONAL_SIZE")[0]])
        elif own.names & set(LOCATIONS):
            ends = own.values("SHAPE_ASPECT_RELATIONSHIP")[2:4]
            found += [self.part21[end] for end in ends]
        return found

    def faces_of(self, number: int, depth: int = 0) -> tuple[int, ...]:
        """The faces of an item: itself, of a set, a solid or a shell; those on a surface."""
        item = self.part21[number]
        if item.names & set(FACE_ENTITIES):
            return (number,)
        if number in self.on_surface:
            return tuple(self.on_surface[number])
        inner = item.names & {*_SETS, *SOLID_ENTITIES, *SHELL_ENTITIES}
        if depth < 9 and (inner or any("TRIANGULATED_FACE" in name for name in item.names)):
            # The face of a tessellated face is its geometric link.
            return tuple(f for n in item.references for f in self.faces_of(n, depth + 1))
        return ()

    @cached_property
    def on_surface(self) -> dict[int, list[int]]:
        """Faces by the instances of their surfaces."""
        found: dict[int, list[int]] = defaultdict(list)
        for face in self.part21.named(*FACE_ENTITIES):
            values = face_values(face)
            if len(values) > 2 and isinstance(values[2], TextReference):
                found[values[2].number].append(face.number)
        return dict(found)

    @cached_property
    def edges(self) -> dict[int, frozenset[int]]:
        """The edges of each face."""
        return {
            face.number: frozenset(edges_of_face(self.part21, face))
            for face in self.part21.named(*FACE_ENTITIES)
        }

    def round_faces(self, place: Place) -> Place:
        """Of a size that is bound to circles alone: the one cylinder or sphere that they bound."""
        own = [int(word[1:].partition(" ")[0]) for word in place.others]
        if place.faces or not own or not all(map(self._is_circle, own)):
            return place
        found: dict[int, None] = {}
        for edge in own:
            beside = [face for face, edges in self.edges.items() if edge in edges]
            rounds = [face for face in beside if self._is_round(face)]
            if len(rounds) != 1:
                return place
            found[rounds[0]] = None
        return Place(tuple(found))

    def ends(self, other: str) -> tuple[Triple, ...]:
        """Of other geometry (``#12 EDGE_CURVE``): a point, or the ends of a straight edge. [mm]"""
        item = self.part21[int(other[1:].partition(" ")[0])]
        if "EDGE_CURVE" in item.names:
            curve = self.part21[item.values("EDGE", "EDGE_CURVE")[3]]
            if any("SURFACE_CURVE" in name or "SEAM_CURVE" in name for name in curve.names):
                curve = self.part21[curve.values("CURVE", "SURFACE_CURVE")[1]]
            corners = item.values("EDGE", "EDGE_CURVE")[1:3] if "LINE" in curve.names else ()
            return tuple(self._point(self.part21[each]) for each in corners)
        return (self._point(item),) if item.names & {"VERTEX_POINT", "CARTESIAN_POINT"} else ()

    def _point(self, item: Instance) -> Triple:
        own = self.part21[item.values()[1]] if "VERTEX_POINT" in item.names else item
        return triple(length_factor(self.part21) * value for value in own.values()[1])

    def _is_circle(self, number: int) -> bool:
        item = self.part21[number]
        if "EDGE_CURVE" not in item.names:
            return False
        curve = self.part21[item.values("EDGE", "EDGE_CURVE")[3]]
        if any("SURFACE_CURVE" in name or "SEAM_CURVE" in name for name in curve.names):
            curve = self.part21[curve.values("CURVE", "SURFACE_CURVE")[1]]
        return "CIRCLE" in curve.names

    def _is_round(self, face: int) -> bool:
        surface = self.part21[face_values(self.part21[face])[2]]
        return bool(surface.names & {"CYLINDRICAL_SURFACE", "SPHERICAL_SURFACE"})


def _says_all_over(aspect: Instance) -> bool:
    words = " ".join(str(each) for each in aspect.values("SHAPE_ASPECT")[:2] if each)
    return "all over" in words.lower() or "ALL_OVER" in "".join(aspect.names)


def numbers_in(values: Any) -> list[int]:
    """Numbers of the instances in a value or in a list of them."""
    if isinstance(values, TextReference):
        return [values.number]
    if isinstance(values, TextRecord):
        return numbers_in(values.values)
    if isinstance(values, Iterable) and not isinstance(values, Word | str):
        return [number for each in values for number in numbers_in(each)]
    return []
