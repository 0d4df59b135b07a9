"""Parts from STEP files: every face as a surface, with its edges and its outside."""

from __future__ import annotations

import json
import logging
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.errors import InputError, PretravelError
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse, SurfaceRecord, parse_brep
from pretravel.surface.cad.trim import Trim
from pretravel.surface.contact import ball_center, solve_contact
from pretravel.surface.curves import polyline
from pretravel.surface.local_geometry import Domain, LocalGeometry, Surface
from pretravel.surface.parametric import Parametric
from pretravel.surface.shapes import Torus
from pretravel.surface.swept import Offset, Placed

_logger = logging.getLogger("pretravel")

_CHORD = 1e-4
"""Chords leave an edge by no more than this. [mm]"""
_OPEN = 1e-2
"""A boundary with a gap above this share of its size does not close."""
_MOST_SAMPLES = 250_000
"""Of one face."""
_MOST_ON_EDGE = 100_000
"""Of one piece of an edge."""
_MOST_POINTS = 2_000_000
"""Of all faces, about."""


@dataclass(frozen=True, eq=False)
class Face:
    """A face of a part: a piece of a surface, with the part on one side of it.

    Attributes
    ----------
    number : int
        Counted from 1, in the file's order.
    name : str
        From the file, often empty.
    kind : str
        plane, cylinder, cone, sphere, torus, extrusion, revolution, B-spline, Bézier, offset.
    base : Surface
        Untrimmed.
    trim : Trim or None
        None for a surface that closes upon itself.
    flips : bool
        The part's outside is against the surface's own normal.
    borders : tuple of (m, 2) float
        Its edges in the surface's parameters; seams and poles are none.
    """

    number: int
    name: str
    kind: str
    base: Surface
    trim: Trim | None
    flips: bool
    borders: tuple[FloatArray, ...] = ()

    @cached_property
    def domain(self) -> Domain:
        return self.base.domain if self.trim is None else self.trim.domain(self.base.domain)

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.base.derivatives(uv)

    def local(self, uv: FloatArray) -> LocalGeometry:
        geometry = self.base.local(uv)
        return geometry.flipped() if self.flips else geometry

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        return self.base.moved(uv, displacement)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.base.inside(uv) if self.trim is None else self.trim.inside(uv)

    def nearest(self, points: FloatArray) -> FloatArray:
        if not _needs_seeds(self.base):
            return self.domain.confined(self.base.nearest(points))
        uv, tree = self._seeds
        _, index = tree.query(points)
        return solve_contact(self, uv[index], points, None, ball_center(0.0)).uv

    @cached_property
    def has_poles(self) -> bool:
        """Whether an edge of the parameters is a single point."""
        if not _needs_seeds(self.base):
            return False
        low, high = self.box
        ends = np.linspace(0.0, 1.0, 5)[:, None]
        for axis in (0, 1):
            for end in (low, high):
                line = low + ends * (high - low)
                line[:, axis] = end[axis]
                points = self.derivatives(line)[0]
                if np.ptp(points, axis=0).max() < 1e-9 * max(1.0, float(np.abs(points).max())):
                    return True
        return False

    def starts_near(self, points: FloatArray, count: int) -> Iterator[FloatArray]:
        """Parameters of samples near points, the nearest first: (n, 2) each time."""
        uv, tree = self._seeds
        count = min(count, len(uv))
        _, index = tree.query(points, k=count)
        for rank in range(count):
            yield uv[index.reshape(len(points), count)[:, rank]]

    @cached_property
    def _seeds(self) -> tuple[FloatArray, Any]:
        from scipy.spatial import cKDTree

        uv = self.samples(np.inf)
        return uv, cKDTree(self.derivatives(uv)[0])

    def samples(self, spacing: float) -> FloatArray:
        """Parameters of points all over the face, its edges included.

        Parameters
        ----------
        spacing : float
            Largest distance between neighbours; infinity: as few as show its shape. [mm]

        Returns
        -------
        (m, 2) float
        """
        return self.sampled(spacing)[0]

    def sampled(self, spacing: float) -> tuple[FloatArray, float]:
        """The same, and the distance of neighbours that it came to: there is a most of points."""
        low, high = self.box
        counts = np.array([25, 25])
        probe = _lattice(low, high, np.array([9, 9]))
        _, du, dv = self.derivatives(probe)
        longest = [float(np.nanmax(np.linalg.norm(d, axis=1))) for d in (du, dv)]
        lengths = (high - low) * np.array(longest)
        if np.isfinite(spacing):
            counts = np.maximum(np.ceil(lengths / spacing).astype(int) + 1, 9)
            while counts[0] * counts[1] > _MOST_SAMPLES:
                counts = np.maximum(counts * 3 // 4, 9)
        lattice = _lattice(low, high, counts)
        lattice = lattice[self.inside(lattice)]
        gap = float(np.max(lengths / (counts - 1)))
        return np.concatenate([lattice, self.edge_samples(spacing)]), gap

    @cached_property
    def sharpest(self) -> float:
        """Largest curvature of its convex parts. [1/mm]"""
        local = self.local(_lattice(*self.box, np.array([9, 9])))
        bends = local.principal_curvatures
        return max(float(np.nanmax(bends)) if np.isfinite(bends).any() else 0.0, 0.0)

    def distance(self, points: FloatArray, resolution: float) -> FloatArray:
        """Distance of points from the face itself, not from where it would go on.

        Parameters
        ----------
        points : (n, 3) float
            [mm]
        resolution : float
            Of its edges. [mm]

        Returns
        -------
        (n,) float
            [mm]
        """
        uv = self.nearest(points)
        foot = np.linalg.norm(self.local(uv).point - points, axis=1)
        result = np.where(self.inside(uv), foot, np.inf)
        if self.borders:
            result = np.minimum(result, self._edge_tree(resolution).query(points)[0])
        return np.asarray(result)

    def _edge_tree(self, resolution: float) -> Any:
        from scipy.spatial import cKDTree

        key = f"_edge_tree_{resolution:.3g}"
        if key not in self.__dict__:
            edge = self.derivatives(self.edge_samples(resolution))[0]
            self.__dict__[key] = cKDTree(edge)
        return self.__dict__[key]

    def edge_lines(self, spacing: float) -> list[FloatArray]:
        """Parameters along each edge, neighbours no further apart than the spacing.

        Parameters
        ----------
        spacing : float
            Infinity: as many as show its shape. [mm]

        Returns
        -------
        list of (m, 2) float
        """
        return [self._along(border, spacing) for border in self.borders]

    def edge_samples(self, spacing: float) -> FloatArray:
        """The same as one array, (m, 2)."""
        return np.concatenate([np.empty((0, 2)), *self.edge_lines(spacing)])

    def _along(self, ring: FloatArray, spacing: float) -> FloatArray:
        pieces = max(1, 200 // len(ring))
        counts = np.full(len(ring) - 1, pieces)
        if np.isfinite(spacing):
            # Straight in the parameters need not be straight in space: measured in pieces.
            share = np.arange(pieces)[:, None, None] / pieces
            fine = ring[:-1] + share * (ring[1:] - ring[:-1])
            line = np.concatenate([np.swapaxes(fine, 0, 1).reshape(-1, 2), ring[-1:]])
            steps = np.linalg.norm(np.diff(self.derivatives(line)[0], axis=0), axis=1)
            length = steps.reshape(-1, pieces).sum(axis=1)
            counts = np.clip(np.ceil(length / spacing).astype(int), 1, _MOST_ON_EDGE)
        start = np.repeat(np.arange(len(counts)), counts)
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        share = (np.arange(len(start)) - first[start]) / counts[start]
        along = ring[start] + share[:, None] * (ring[start + 1] - ring[start])
        return np.concatenate([along, ring[-1:]])

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest parameters of the face, (2,) each."""
        domain = self.domain
        if self.trim is None:
            return np.array(domain.lower), np.array(domain.upper)
        return np.array(self.trim.lower), np.array(self.trim.upper)


def _needs_seeds(surface: Surface) -> bool:
    while isinstance(surface, Placed):
        surface = surface.surface
    return isinstance(surface, Parametric) or hasattr(surface, "basis")


def _lattice(low: FloatArray, high: FloatArray, counts: FloatArray) -> FloatArray:
    u, v = np.meshgrid(*(np.linspace(low[k], high[k], int(counts[k])) for k in (0, 1)))
    return np.column_stack([u.ravel(), v.ravel()])


@dataclass(frozen=True, eq=False)
class Part:
    """The faces of a part.

    Attributes
    ----------
    name : str
        Of the file.
    faces : tuple of Face
    chosen : tuple of int
        Indices of the faces that are to be touched; all others are in the way.
    unreadable : mapping of int to str
        Numbers of faces that could not be read, and why.
    """

    name: str
    faces: tuple[Face, ...]
    chosen: tuple[int, ...]
    unreadable: dict[int, str] = field(default_factory=dict)

    def select(self, word: str) -> Part:
        """The part with one face to touch, by number or by name.

        Raises
        ------
        PretravelError
            No such face; one that could not be read; a name that several have.
        """
        numbers = [face.number for face in self.faces]
        if word.isdecimal():
            number = int(word)
            if number in self.unreadable:
                raise PretravelError(
                    f"{self.name}: face {number} cannot be used: {self.unreadable[number]}"
                )
            if number not in numbers:
                raise PretravelError(
                    f"{self.name} has no face {number}; it has {len(numbers)}, counted from 1 "
                    f"(pretravel faces {self.name} lists them)"
                )
            return self._choosing([numbers.index(number)])
        found = [i for i, face in enumerate(self.faces) if face.name and face.name == word]
        if not found:
            raise PretravelError(
                f"{self.name} has no face named '{word}' (pretravel faces {self.name} lists them)"
            )
        return self._choosing(found)

    def _choosing(self, indices: Sequence[int]) -> Part:
        return Part(self.name, self.faces, tuple(indices), self.unreadable)

    @cached_property
    def box(self) -> FloatArray:
        """Smallest and largest coordinates, (2, 3). [mm]"""
        points = np.concatenate([face.derivatives(face.samples(np.inf))[0] for face in self.faces])
        return np.stack([np.nanmin(points, axis=0), np.nanmax(points, axis=0)])

    @cached_property
    def size(self) -> float:
        """Diagonal of the box around it. [mm]"""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @cached_property
    def cloud(self) -> Cloud:
        """Points all over it, to find what is near."""
        return self.cloud_of_spacing(math.inf)

    def cloud_of_spacing(self, spacing: float) -> Cloud:
        """Points no further apart than the spacing, or than 1/150 of the part's size; coarser only
        where they would be too many. [mm]
        """
        a, b, c = np.maximum(self.box[1] - self.box[0], 1e-6)
        finest = math.sqrt(2.0 * (a * b + b * c + c * a) / _MOST_POINTS)
        wanted = max(min(spacing, self.size / 150.0), finest, 1e-3)
        # A few steps only, so that probes of nearly the same size share them.
        wanted = float(2.0 ** (math.floor(2.0 * math.log2(wanted)) / 2.0))
        key = f"_cloud_{wanted:.6g}"
        if key not in self.__dict__:
            self.__dict__[key] = Cloud.of(self.faces, wanted)
        cloud: Cloud = self.__dict__[key]
        return cloud

    @cached_property
    def cloud_of_chosen(self) -> Cloud:
        """Those of them that are on the faces to touch."""
        if len(self.chosen) == len(self.faces):
            return self.cloud
        return self.cloud.on(self.chosen)


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points of several faces, to find the one that is near.

    Attributes
    ----------
    points : (m, 3) float
        [mm]
    face : (m,) int
        Index of the face each is from.
    uv : (m, 2) float
    gaps : (k,) float
        Distance of neighbours on each of the faces. [mm]
    tree : KD-tree of the points
    """

    points: FloatArray
    face: IntArray
    uv: FloatArray
    gaps: FloatArray
    tree: Any

    def on(self, faces: Sequence[int]) -> Cloud:
        """The points of some faces."""
        from scipy.spatial import cKDTree

        mine = np.isin(self.face, faces)
        points = self.points[mine]
        return Cloud(points, self.face[mine], self.uv[mine], self.gaps, cKDTree(points))

    @classmethod
    def of(cls, faces: Sequence[Face], spacing: float) -> Cloud:
        """Sample faces so that neighbours are no further apart than the spacing. [mm]"""
        from scipy.spatial import cKDTree

        _logger.info("sampling %d faces", len(faces))
        sampled = [face.sampled(spacing) for face in faces]
        uv = [own for own, _ in sampled]
        points = [face.derivatives(own)[0] for face, own in zip(faces, uv, strict=True)]
        index = np.repeat(np.arange(len(faces)), [len(own) for own in uv])
        cloud, parameters = np.concatenate(points), np.concatenate(uv)
        usable = np.isfinite(cloud).all(axis=1)
        cloud, index, parameters = cloud[usable], index[usable], parameters[usable]
        gaps = np.array([max(gap, spacing) for _, gap in sampled])
        return cls(cloud, index, parameters, gaps, cKDTree(cloud))


def read_step_part(path: str | Path) -> Part:
    """All faces of a STEP file.

    Parameters
    ----------
    path : str or Path
        AP203, AP214 or AP242, in any unit of length.

    Returns
    -------
    Part
        In mm. Faces that cannot be read are in `Part.unreadable`, with the reason.

    Raises
    ------
    InputError
        No STEP file, or none with faces.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputError(f"cannot be opened: {error.strerror}", path=path) from None
    if b"ISO-10303-21" not in head:
        raise InputError(
            "is not a STEP file: it does not begin with ISO-10303-21; export the part as STEP "
            "(AP214 or AP242)",
            path=path,
        )
    _logger.info("reading %s", path.name)
    with tempfile.TemporaryDirectory() as folder:
        # A process of its own: the CAD kernel prints, and some files make it crash.
        kernel = subprocess.run(
            [
                sys.executable,
                "-m",
                "pretravel.surface.cad.step_to_brep",
                str(path.resolve()),
                folder,
            ],
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        if kernel.returncode != 0:
            raise InputError(
                f"{_reason(path, kernel)}. Export it anew as AP214 or AP242, with exact geometry",
                path=path,
            )
        brep = parse_brep((Path(folder) / "part.brep").read_text("ascii", errors="replace"))
        names = json.loads((Path(folder) / "names.json").read_text("utf-8"))
    return _part(path.name, brep, names, path)


_SCANNED = 50_000_000
"""Of a file that the kernel cannot read, so much is looked at for why. [bytes]"""


def _reason(path: Path, kernel: subprocess.CompletedProcess[str]) -> str:
    """Why a file cannot be read, from what it holds rather than from what the kernel says."""
    with path.open("rb") as file:
        text = file.read(_SCANNED).upper()
    if re.search(rb"FILE_SCHEMA\s*\(\s*\(\s*'IFC", text):
        return "is a building model (IFC), not a part"
    if b"END-ISO-10303-21" not in text[-2000:] and len(text) < _SCANNED:
        return f"is not complete: it does not end with END-ISO-10303-21 ({_last_words(kernel)})"
    if not re.search(rb"ADVANCED_FACE|FACE_SURFACE", text):
        if re.search(rb"TRIANGULATED|TESSELLATED", text):
            return "holds triangles only, no exact geometry"
        if b"DOCUMENT_FILE" in text:
            return "holds references to other files only; the parts are in those"
        return "holds no faces"
    return f"the CAD kernel cannot read it: {_last_words(kernel)}"


def _last_words(kernel: subprocess.CompletedProcess[str]) -> str:
    if kernel.returncode < 0:
        return f"it crashed (signal {-kernel.returncode})"
    lines = [line for line in (kernel.stdout + kernel.stderr).splitlines() if line.strip()]
    telling = [line for line in lines if "ERR" in line] or lines
    plain = re.sub(r"\x1b\[[0-9;]*m|\*{4}", "", " ".join(telling[-1:])).strip()
    return " ".join(plain.split())[:200] or "it does not say why"


def _part(name: str, brep: Brep, names: list[str], path: Path) -> Part:
    uses = list(_face_uses(brep))
    if not uses:
        raise InputError(
            "has no faces: it holds wires, points or triangles only; export the part as a solid "
            "or surface (AP214 or AP242 with exact geometry)",
            path=path,
        )
    if len(names) != len(uses):
        names = [""] * len(uses)
    faces, unreadable = [], {}
    for number, (use, label) in enumerate(zip(uses, names, strict=True), start=1):
        try:
            faces.append(_face(brep, use, number, label))
        except (PretravelError, ValueError, FloatingPointError) as error:
            unreadable[number] = str(error)
    if not faces:
        number, reason = next(iter(unreadable.items()))
        raise InputError(
            f"none of its {len(uses)} faces can be used; face {number}: {reason}", path=path
        )
    return Part(name, tuple(faces), tuple(range(len(faces))), unreadable)


def _face_uses(brep: Brep) -> Iterator[ShapeUse]:
    """Every face once, in the kernel's order, with its placement and sense in the part."""
    seen: set[tuple[int, bytes]] = set()
    stack = [ShapeUse(use.index, use.reverses, use.placement) for use in reversed(brep.roots)]
    while stack:
        use = stack.pop()
        shape = brep.shapes[use.index]
        if shape.kind == "Fa":
            key = (use.index, np.round(use.placement, 9).tobytes())
            if key not in seen:
                seen.add(key)
                yield use
            continue
        if shape.kind in ("Wi", "Ed", "Ve"):
            continue
        stack.extend(
            ShapeUse(part.index, use.reverses != part.reverses, use.placement @ part.placement)
            for part in reversed(shape.parts)
        )


def _face(brep: Brep, use: ShapeUse, number: int, name: str) -> Face:
    shape = brep.shapes[use.index]
    record = brep.surfaces[shape.surface - 1]
    if record.surface is None:
        raise PretravelError(f"{record.kind}: {record.problem}")
    placement = use.placement @ shape.placement
    turn = placement[:3, :3]
    if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-6:
        raise PretravelError("it is placed in the part with a change of scale")
    if float(np.linalg.det(turn)) < 0.0:
        raise PretravelError("it is placed in the part as its own mirror image")
    rings, borders = _rings(brep, shape, record.surface)
    trim = Trim(rings, record.surface.domain.period) if rings else None
    if trim is not None and not borders and trim.covers(record.surface.domain):
        trim = None  # a whole sphere, torus or the like: its rings are seams
    record = _one_side(record, trim)
    assert record.surface is not None  # refused above
    surface: Surface = record.surface
    if np.abs(placement - np.eye(4)).max() > 0.0:
        surface = Placed(surface, turn, placement[:3, 3])
    if trim is None and not np.all(np.isfinite([*surface.domain.lower, *surface.domain.upper])):
        raise PretravelError(f"{record.kind} without edges, which has no end")
    against = record.along_parameters < 0
    flips = use.reverses ^ against
    return Face(number, name, record.kind, surface, trim, flips, tuple(borders))


def _one_side(record: SurfaceRecord, trim: Trim | None) -> SurfaceRecord:
    """The surface on the side that the face has of it, where it runs through itself; there the
    outside changes.

    Raises
    ------
    PretravelError
        A face that has both sides, an offset beyond its centre of curvature.
    """
    surface = record.surface
    if isinstance(surface, Torus) and surface.radius < surface.tube_radius:
        v = np.linspace(0.0, 2.0 * np.pi, 721) if trim is None else trim.rings[0][:, 1]
        from_axis = surface.radius + surface.tube_radius * np.cos(v)
        slack = 1e-6 * surface.tube_radius
        if from_axis.max() <= slack:
            barrel = Torus(
                surface.origin, surface.radius, surface.tube_radius, surface.axes, inner=True
            )
            return replace(record, surface=barrel, along_parameters=-record.along_parameters)
        if from_axis.min() < -slack:
            raise PretravelError("torus whose tube crosses its own axis, on both sides of it")
    if isinstance(surface, Offset):
        domain = surface.domain if trim is None else trim.domain(surface.domain)
        lattice = _lattice(np.array(domain.lower), np.array(domain.upper), np.array([15, 15]))
        bends = surface.basis.local(lattice).principal_curvatures
        if np.nanmin(1.0 + surface.distance * bends) <= 0.0:
            raise PretravelError(
                f"{record.kind} by {surface.distance:g} mm, beyond its centre of curvature"
            )
    return record


def _rings(
    brep: Brep, face: ShapeRecord, surface: Surface
) -> tuple[list[FloatArray], list[FloatArray]]:
    """The face's boundary as closed polylines in the surface's parameters, and its real edges."""
    rings: list[FloatArray] = []
    borders: list[FloatArray] = []
    open_chains: list[FloatArray] = []
    for wire in (part for part in face.parts if part.bounds):
        pieces = []
        for edge in (part for part in brep.shapes[wire.index].parts if part.bounds):
            backwards = wire.reverses != edge.reverses
            piece = _edge_in_parameters(brep, face, wire, edge, backwards, surface)
            pieces.append(piece[::-1] if backwards else piece)
            if not _is_seam(brep.shapes[edge.index], face):
                borders.append(piece)
        if not pieces:
            continue
        chain = _chained(pieces)
        size = float(np.max(np.ptp(chain, axis=0)))
        if np.abs(chain[0] - chain[-1]).max() <= _OPEN * size:
            rings.append(_closed(chain, 1e-9 * size))
        else:
            open_chains.append(chain)
    if open_chains:
        rings.append(_band(open_chains, surface.domain))
    return rings, borders


def _is_seam(edge: ShapeRecord, face: ShapeRecord) -> bool:
    """Where a surface meets itself, or an edge that is a single point: a pole."""
    if edge.curve is None:
        return True
    return any(of == face.surface and other for of, _, other, _, _ in edge.parameter_curves)


def _edge_in_parameters(
    brep: Brep,
    face: ShapeRecord,
    wire: ShapeUse,
    edge: ShapeUse,
    backwards: bool,
    surface: Surface,
) -> FloatArray:
    record = brep.shapes[edge.index]
    for of_surface, curve, other_side, first, last in record.parameter_curves:
        if of_surface == face.surface:
            which = other_side if backwards and other_side else curve
            shape = brep.plane_curves[which - 1]
            _, du, dv = surface.derivatives(shape.value(np.linspace(first, last, 9)))
            lengths = np.array([np.nanmax(np.linalg.norm(d, axis=1)) for d in (du, dv)])
            return polyline(shape, first, last, _CHORD, np.maximum(lengths, 1e-9))
    if record.curve is None:
        raise PretravelError("one of its edges has no curve")
    index, placement, first, last = record.curve
    shape = brep.space_curves[index - 1]
    points = polyline(shape, first, last, _CHORD)
    into_face = np.linalg.inv(face.placement) @ wire.placement @ edge.placement @ placement
    return surface.nearest(points @ into_face[:3, :3].T + into_face[:3, 3])


def _closed(chain: FloatArray, distinct: float) -> FloatArray:
    """A ring that ends where it starts, without points that repeat the one before."""
    steps = np.abs(np.diff(chain, axis=0)).max(axis=1)
    ring = chain[np.concatenate([[True], steps > distinct])]
    if np.abs(ring[-1] - ring[0]).max() <= distinct:
        ring = ring[:-1]
    return np.concatenate([ring, ring[:1]])


def _chained(pieces: list[FloatArray]) -> FloatArray:
    """Pieces of a boundary one after the other, whatever order the file has them in."""
    chain, waiting = [pieces[0]], list(pieces[1:])
    while waiting:
        end = chain[-1][-1]
        gaps = [float(np.abs(piece[0] - end).max()) for piece in waiting]
        # The file's own next piece, unless another fits much better.
        best = int(np.argmin(gaps))
        size = float(np.max(np.ptp(np.concatenate([*chain, *waiting]), axis=0)))
        chain.append(waiting.pop(0 if gaps[0] <= gaps[best] + 1e-6 * size else best))
    return np.concatenate(chain)


def _band(chains: list[FloatArray], domain: Domain) -> FloatArray:
    """Two boundaries that each go once around a periodic surface, joined into one ring."""
    if len(chains) == 2:
        first, second = chains
        for axis in (0, 1):
            period = domain.period[axis]
            if not np.isfinite(period):
                continue
            turns = [float((c[-1] - c[0])[axis]) / period for c in chains]
            if all(abs(abs(turn) - 1.0) < _OPEN for turn in turns):
                if turns[0] * turns[1] > 0.0:
                    second = second[::-1]
                shift = np.zeros(2)
                shift[axis] = np.round((first[-1] - second[0])[axis] / period) * period
                return np.concatenate([first, second + shift, first[:1]])
    raise PretravelError("its boundary does not close in the surface's parameters")
