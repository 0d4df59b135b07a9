"""What other rooms use of this one."""

from .cone_fit import fit_cone as fit_cone
from .covariance import Correlation as Correlation
from .covariance import Covariance as Covariance
from .covariance import ReducedRows as ReducedRows
from .covariance import SharedCovariance as SharedCovariance
from .covariance import classes_of as classes_of
from .covariance import reduced_rows as reduced_rows
from .cylinder_fit import fit_cylinder as fit_cylinder
from .feature_fit import FLAT as FLAT
from .feature_fit import about_axis as about_axis
from .feature_fit import across as across
from .feature_fit import checked_points as checked_points
from .gum import COVERAGE as COVERAGE
from .gum import COVERAGE_FACTOR as COVERAGE_FACTOR
from .gum import EXPANDED_COVERAGE as EXPANDED_COVERAGE
from .gum import Budget as Budget
from .gum import Component as Component
from .gum import coverage_factor as coverage_factor
from .gum import outlier_factor as outlier_factor
from .plane_fit import fit_plane as fit_plane
from .sphere_fit import SphereFit as SphereFit
from .sphere_fit import algebraic_sphere as algebraic_sphere
from .sphere_fit import fit_sphere as fit_sphere
from .torus_fit import TorusParameters as TorusParameters
from .torus_fit import fit_torus as fit_torus
