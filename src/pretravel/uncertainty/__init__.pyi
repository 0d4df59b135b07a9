"""What other rooms use of this one."""

from .covariance import Correlation as Correlation
from .covariance import Covariance as Covariance
from .covariance import SharedCovariance as SharedCovariance
from .fitting.circle import fit_circle as fit_circle
from .fitting.cone import fit_cone as fit_cone
from .fitting.cylinder import fit_cylinder as fit_cylinder
from .fitting.feature import FLAT as FLAT
from .fitting.feature import about_axis as about_axis
from .fitting.feature import across as across
from .fitting.feature import checked_points as checked_points
from .fitting.plane import fit_plane as fit_plane
from .fitting.sphere import SphereFit as SphereFit
from .fitting.sphere import algebraic_sphere as algebraic_sphere
from .fitting.sphere import fit_sphere as fit_sphere
from .fitting.torus import TorusParameters as TorusParameters
from .fitting.torus import fit_torus as fit_torus
from .gum import COVERAGE as COVERAGE
from .gum import COVERAGE_FACTOR as COVERAGE_FACTOR
from .gum import EXPANDED_COVERAGE as EXPANDED_COVERAGE
from .gum import Budget as Budget
from .gum import Component as Component
from .gum import coverage_factor as coverage_factor
from .row_reduction import ReducedRows as ReducedRows
from .row_reduction import classes_of as classes_of
from .row_reduction import reduced_rows as reduced_rows
