"""Contact of rough surfaces by the magnification-based multi-asperity (MBMA) model.

The public names load what they need when first used, so that importing the package is fast.
"""

import importlib
from typing import TYPE_CHECKING, Any

from mbma_tables.common.errors import ConvergenceError as ConvergenceError
from mbma_tables.common.errors import InputError as InputError
from mbma_tables.common.errors import MbmaError as MbmaError
from mbma_tables.common.errors import NotSelfAffineError as NotSelfAffineError
from mbma_tables.common.errors import OutOfRangeError as OutOfRangeError
from mbma_tables.common.errors import TableFileError as TableFileError

if TYPE_CHECKING:
    from mbma_tables import theories as theories
    from mbma_tables.bodies import materials as materials
    from mbma_tables.bodies.adhesion import Adhesion as Adhesion
    from mbma_tables.bodies.bodies import Bodies as Bodies
    from mbma_tables.common.chunks import in_chunks as in_chunks
    from mbma_tables.contacts.contact import contact as contact
    from mbma_tables.contacts.law.law import ContactLaw as ContactLaw
    from mbma_tables.contacts.law.make import contact_law as contact_law
    from mbma_tables.contacts.quantities.interface import Gas as Gas
    from mbma_tables.contacts.resolution import ResolutionStudy as ResolutionStudy
    from mbma_tables.contacts.resolution import last_octave as last_octave
    from mbma_tables.contacts.resolution import resolution_study as resolution_study
    from mbma_tables.contacts.result import Contact as Contact
    from mbma_tables.contacts.sealing import sealing_pressure as sealing_pressure
    from mbma_tables.design.functions import contact_function as contact_function
    from mbma_tables.design.joint import Joint as Joint
    from mbma_tables.design.scenes.scene import Scene as Scene
    from mbma_tables.design.sensitivity import sensitivity as sensitivity
    from mbma_tables.design.uncertainty import uncertainty as uncertainty
    from mbma_tables.effects.film import FlowFactors as FlowFactors
    from mbma_tables.effects.film import flow_factors as flow_factors
    from mbma_tables.effects.rough_contact import RoughContact as RoughContact
    from mbma_tables.effects.rough_contact import rough_contact as rough_contact
    from mbma_tables.islands import greenwood_tripp as greenwood_tripp
    from mbma_tables.surfaces.surface import Surface as Surface
    from mbma_tables.tables.open import open_table as open_table
    from mbma_tables.theories.mbma.island import Island as Island
    from mbma_tables.theories.mbma.island import island as island

__version__ = "0.2.0"

_ERRORS = tuple(name for name in globals() if name.endswith("Error"))
_HOMES = {
    "Adhesion": "mbma_tables.bodies.adhesion",
    "Bodies": "mbma_tables.bodies.bodies",
    "Contact": "mbma_tables.contacts.result",
    "FlowFactors": "mbma_tables.effects.film",
    "Gas": "mbma_tables.contacts.quantities.interface",
    "Island": "mbma_tables.theories.mbma.island",
    "Joint": "mbma_tables.design.joint",
    "ResolutionStudy": "mbma_tables.contacts.resolution",
    "RoughContact": "mbma_tables.effects.rough_contact",
    "Surface": "mbma_tables.surfaces.surface",
    "ContactLaw": "mbma_tables.contacts.law.law",
    "Scene": "mbma_tables.design.scenes.scene",
    "contact": "mbma_tables.contacts.contact",
    "contact_function": "mbma_tables.design.functions",
    "contact_law": "mbma_tables.contacts.law.make",
    "flow_factors": "mbma_tables.effects.film",
    "in_chunks": "mbma_tables.common.chunks",
    "island": "mbma_tables.theories.mbma.island",
    "open_table": "mbma_tables.tables.open",
    "last_octave": "mbma_tables.contacts.resolution",
    "resolution_study": "mbma_tables.contacts.resolution",
    "rough_contact": "mbma_tables.effects.rough_contact",
    "sealing_pressure": "mbma_tables.contacts.sealing",
    "sensitivity": "mbma_tables.design.sensitivity",
    "uncertainty": "mbma_tables.design.uncertainty",
    # modules
    "greenwood_tripp": "mbma_tables.islands.greenwood_tripp",
    "materials": "mbma_tables.bodies.materials",
    "theories": "mbma_tables.theories",
}

__all__ = sorted([*_ERRORS, *_HOMES])


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mbma_tables' has no attribute {name!r}")
    module = importlib.import_module(_HOMES[name])
    return getattr(module, name, module)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
