"""How large the benchmarks are."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Sizes:
    """Sizes of the jobs; the small ones show in seconds that everything works.

    Attributes
    ----------
    directions, touches, surface_touches, trials, long_touches, designs, element_designs : int
    looped, stepped : int
        Points of the alternatives that take them one by one; their time is scaled up.
    repeats : int
        Runs of which the shortest counts, at most.
    growing_touches, growing_directions, growing_designs, growing_features, growing_days : int
        The largest of three sizes, each ten times the one before.
    growing_faces : tuple of int
    refinements : tuple of float
        Of the meshes.
    kinds : tuple of str
        Of maps, whose qualification grows with the touches; empty: all.
    calculix : int
        Directions that CalculiX solves; 0: none.
    holes : pair of int
        Of a part, across and along: 31 × 32 make 998 faces.
    sets : int
        Of `check-budget`.
    placed : int
        Touches on a part that is placed from nothing.
    """

    directions: int = 100_000
    touches: int = 1_000_000
    surface_touches: int = 100_000
    trials: int = 100_000
    long_touches: int = 10_000_000
    designs: int = 20_000
    element_designs: int = 50
    looped: int = 2_000
    stepped: int = 40
    repeats: int = 5
    growing_touches: int = 1_000_000
    growing_directions: int = 1_000_000
    growing_designs: int = 4_000
    growing_features: int = 200
    growing_days: int = 1_000
    growing_faces: tuple[int, ...] = (10, 106, 998, 1_986)
    refinements: tuple[float, ...] = (0.7, 1.0, 1.4)
    kinds: tuple[str, ...] = ()
    calculix: int = 1
    holes: tuple[int, int] = (31, 32)
    sets: int = 60
    placed: int = 1_000


FULL = Sizes()
SMALL = Sizes(
    directions=200,
    touches=200,
    surface_touches=60,
    trials=10_000,
    long_touches=2_000,
    designs=8,
    element_designs=1,
    looped=50,
    stepped=1,
    repeats=1,
    growing_touches=10_000,
    growing_directions=20_000,
    growing_designs=100,
    growing_features=200,
    growing_days=300,
    growing_faces=(10, 22),
    refinements=(0.3, 0.4, 0.5),
    kinds=("mean",),
    calculix=0,
    holes=(2, 2),
    sets=20,
    placed=30,
)
