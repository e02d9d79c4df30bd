"""How things touch: over areas, so that a box stands on its face and a pile holds; or at points.

Point contact gives a pair of shapes one point to touch at: a flat box rocks about it, two faces laid together
are driven apart, a pile never comes to rest. Hydroelastic contact (Elandt et al., IROS 2019) integrates a
pressure over the whole area. A shape whose model says how it is to be touched is taken at its word: the
built-in toys say point contact, by a stiffness, and stand on small balls for it.
"""

from collections.abc import Iterable

from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    GeometryId,
    Mesh,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    SceneGraphInspector,
)
from pydrake.multibody.plant import ContactModel, DiscreteContactApproximation, MultibodyPlant

MODULUS = 1e6
"""Hydroelastic modulus, Pa: soft rubber. What stands on a face sinks in by less than 0.1 mm."""
DISSIPATION = 500.0
"""Hunt and Crossley's, s/m: what was let go does not bounce, and what rolls comes to rest."""
STICTION = 1e-5
"""m/s; what friction holds on a slope creeps by less."""
RESOLUTION = 0.02
"""m; how finely curved shapes are divided."""


def set_contact_model(plant: MultibodyPlant, over_areas: bool) -> None:
    """Choose how a plant that is not finalized computes contact; with time steps of 1 to 4 ms.

    Args:
        plant: the plant.
        over_areas: whether anything in it touches over areas.
    """
    if over_areas:
        # Not kSap: what is thin and lands on an edge sinks in by half its thickness within a step, and
        # leaves with a multiple of its energy (drake issue 18241).
        plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSimilar)
        plant.set_stiction_tolerance(STICTION)
    else:
        # With these two, pushes of 2 cm end within a millimetre and things lie still on a flat table.
        plant.set_contact_model(ContactModel.kPoint)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)


def touches_over_area(inspector: SceneGraphInspector, geometry: GeometryId) -> bool:
    """Whether a collision shape is to touch others over areas: its model says so, or says nothing."""
    said = inspector.GetProximityProperties(geometry)
    if said.HasGroup("hydroelastic"):
        return True
    if said.HasProperty("material", "point_contact_stiffness"):
        return False
    # Of a surface that is not convex Drake makes no solid: its convex hull touches, at points.
    return not isinstance(inspector.GetShape(geometry), Mesh)


def let_touch(
    plant: MultibodyPlant, scene_graph: SceneGraph, geometries: Iterable[GeometryId], *, rigid: bool = False
) -> None:
    """Give collision shapes what contact over areas needs, where their model does not say how they touch.

    `rigid` is for what things stand on or are pushed by; two rigid shapes touch at points.
    """
    inspector = scene_graph.model_inspector()
    for geometry in geometries:
        said = inspector.GetProximityProperties(geometry)
        if said.HasGroup("hydroelastic") or not touches_over_area(inspector, geometry):
            continue
        properties = ProximityProperties(said)
        if rigid:
            AddRigidHydroelasticProperties(RESOLUTION, properties)
        else:
            AddCompliantHydroelasticProperties(RESOLUTION, MODULUS, properties)
            if not properties.HasProperty("material", "hunt_crossley_dissipation"):
                AddContactMaterial(dissipation=DISSIPATION, properties=properties)
        scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)
