"""Names at the top of the package, written once: type checkers read them here, lazy_loader when one is first used."""

from . import assembly as assembly
from . import contact as contact
from . import harmonic as harmonic
from . import model as model
from . import reduction as reduction
from . import response as response
from . import solve as solve
from .assembly.contact import Contact as Contact
from .assembly.contact import Join as Join
from .assembly.load import Load as Load
from .assembly.load import Output as Output
from .assembly.model import Model as Model
from .contact.interface import Interface as Interface
from .contact.laws.bonded import Bonded as Bonded
from .contact.laws.bouc_wen import BoucWen as BoucWen
from .contact.laws.coupled_coulomb import CoupledCoulomb as CoupledCoulomb
from .contact.laws.cubic_spring import CubicSpring as CubicSpring
from .contact.laws.dahl import Dahl as Dahl
from .contact.laws.elastic_coulomb import ElasticCoulomb as ElasticCoulomb
from .contact.laws.iwan import Iwan as Iwan
from .contact.laws.jenkins import Jenkins as Jenkins
from .contact.laws.polynomial_spring import PolynomialSpring as PolynomialSpring
from .contact.laws.regularised_coulomb import RegularisedCoulomb as RegularisedCoulomb
from .contact.laws.rigid_coulomb import RigidCoulomb as RigidCoulomb
from .contact.laws.unilateral_spring import UnilateralSpring as UnilateralSpring
from .errors import InputError as InputError
from .errors import SingularError as SingularError
from .errors import StickslipError as StickslipError
from .harmonic.excitation import HarmonicLoad as HarmonicLoad
from .model.fe.solid import Material as Material
from .model.mesh.blade_pair import BladePair as BladePair
from .model.mesh.sector import BladedSector as BladedSector
from .model.part import Part as Part
from .model.readers.open_model import read_model as read_model
from .model.readers.units import Units as Units
from .model.rigid.body import RigidBody as RigidBody
from .model.rigid.damper import FlatCurvedDamper as FlatCurvedDamper
from .model.structure import Structure as Structure
from .reduction.fixed_interface import craig_bampton as craig_bampton
from .response.equilibrium import preload as preload
from .response.forced.response import forced_response as forced_response
from .response.forced.sweep import Sweep as Sweep
from .response.system import System as System
from .study.schema import Study as Study

__version__: str
