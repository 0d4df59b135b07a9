"""The ball of a seat as a finite body: its deflection, compared with Hertz's half-space."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pretravel.base import IntArray
from pretravel.design.fem.elasticity import element_stiffness, upper_stiffness
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.interface_loads import half_space_compliance, hertz_pressure
from pretravel.design.fem.linear_solvers import factorise
from pretravel.design.fem.mesh import numbered
from pretravel.design.fem.regions import PATCH
from pretravel.prediction import Material, Probe

CONTACT = "contact"
"""Name of the face that carries the force."""


def ball_mesh(radius: float, patch: float, element: float) -> FiniteElementMesh:
    """A ball below the origin that is touched from above, with a fine mesh at the contact.

    Parameters
    ----------
    radius : float
        [mm]
    patch : float
        Radius of the face `CONTACT` around the origin. [mm]
    element : float
        Element size on it. [mm]

    Returns
    -------
    FiniteElementMesh
        One region, ``ball``.

    >>> mesh = ball_mesh(2.0, 0.25, 0.12)
    >>> mesh.region_names, bool(abs(mesh.points[:, 2].min() + 4.0) < 0.01)
    (('ball',), True)
    """
    from netgen.occ import Cylinder, Glue, OCCGeometry, Pnt, Sphere, Z

    ball = Sphere(Pnt(0, 0, -radius), radius)
    tool = Cylinder(Pnt(0, 0, -1.5 * patch), Z, r=patch, h=3.0 * patch)
    plug, rest = ball * tool, ball - tool
    plug.faces.Nearest(Pnt(0, 0, 0)).name = CONTACT
    shape = Glue([rest, plug])
    shape.solids.name = "ball"
    for face in shape.faces:
        if face.name == CONTACT:
            face.maxh = element
            face.edges.maxh = element
    mesh = OCCGeometry(shape).GenerateMesh(maxh=0.3 * radius, grading=0.5, parallel_meshing=False)
    mesh.SecondOrder()
    return numbered(mesh, [CONTACT])


def ball_held(radius: float, ball: FiniteElementMesh) -> IntArray:
    """Nodes at which the plate holds a ball: the surface of its lower half."""
    surface = np.unique(ball.boundary)
    return np.asarray(surface[ball.points[surface, 2] < -radius])


def ball_correction(probe: Probe, solver: str = "auto") -> float:
    """Deflection of a seat's ball less that of a half-space, per newton. [mm/N]

    The ball is held at its lower half. Hertz's approach contains an infinite half-space, but a
    ball is finite. The difference is negative and about a hundredth of the contact's deflection.
    Zero for seats described as rigid.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> -1e-6 < ball_correction(load_probe("omp40-2")) < 0.0
    True
    """
    if probe.seats.contact == "rigid":
        return 0.0
    return _excess_over_half_space(probe.seats.ball_radius, probe.seats.material, solver)


@lru_cache(maxsize=16)
def _excess_over_half_space(radius: float, material: Material, solver: str) -> float:
    """Kept: probes that differ in stylus or hub have the same ball."""
    patch = PATCH * radius
    mesh = ball_mesh(radius, patch, 0.4 * patch)
    down = np.array([0.0, 0.0, -1.0])
    nodal = hertz_pressure(mesh, CONTACT, np.zeros(3), (np.eye(3)[0], np.eye(3)[1]), patch)
    load = (nodal[:, None] * down).ravel()
    stiffness = upper_stiffness(mesh, element_stiffness(mesh, {"ball": material}))
    held = (3 * ball_held(radius, mesh)[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(mesh.unknowns), held)
    solution = factorise(stiffness[free][:, free].tocsr(), solver)(load[free, None])
    return float(load[free] @ solution[:, 0] - half_space_compliance(material, patch))
