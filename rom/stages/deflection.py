"""The stages of a reduction for large deflection, and those of them that differ."""

from dataclasses import replace

from rom.body.frame import at_large_deflection
from rom.body.nonlinear.cauchy import refuse_many
from rom.body.nonlinear.geometric import Bent, enriched
from rom.body.nonlinear.sampled import sampled_energy
from rom.body.projection import cauchy_recovery, stressed_nodes
from rom.checks.certificate import certify
from rom.checks.deflection import compare_deflections
from rom.checks.draft import Draft, Stage, wanted
from rom.errors import ConfigError
from rom.reduction.interfaces.characteristic import Characteristic
from rom.stages import bodies


def stages(draft: Draft) -> list[Stage]:
    """What `rom.reduce` does for large deflection, in its order."""
    sampled = draft.nonlinear.sampling is not None
    if draft.stiffening:
        raise ConfigError(
            "stiffening is that of small deflection; nonlinear has the stiffening of loads in its "
            "energy.",
            hint="Leave stiffening out.",
        )
    if sampled and draft.stress:
        raise ConfigError(
            "stress and sampling do not go together: most elements are left out.",
            hint="Leave stress out, or sampling for St. Venant-Kirchhoff material.",
        )
    return wanted(
        (draft.open_orders, bodies.choose_orders),
        (True, bodies.connect),
        (isinstance(draft.method, Characteristic), bodies.few_functions),
        (True, bodies.basis),
        (True, enrich),
        (True, bodies.project),
        (True, bodies.make_body),
        (True, place_frame),
        (draft.stress, recover),
        (sampled, sample),
        (draft.damping is not None, bodies.damp),
        (draft.certify, compare_deflections),
        (draft.certify, certify),
    )


def enrich(draft: Draft) -> None:
    """Add the shapes that the range of loads asks for."""
    draft.watch.begin("derivatives of shapes")
    body = draft.model, draft.ops, draft.connection, draft.basis
    draft.basis = enriched(Bent(draft.nonlinear, *body, draft.reference))
    if draft.stress:
        refuse_many(stressed_nodes(draft.model).size, draft.basis.Psi.shape[1] - 6)


def place_frame(draft: Draft) -> None:
    """See the body from its reference interface, and give it its energy at finite strain there."""
    draft.body, draft.E = at_large_deflection(
        draft.body, draft.reference, draft.E, draft.model, draft.bare
    )


def recover(draft: Draft) -> None:
    """Make the stress in the deformed body recoverable."""
    draft.body = replace(draft.body, stress=cauchy_recovery(draft.model, draft.E))


def sample(draft: Draft) -> None:
    """Give the body the energy of a few weighted elements of neo-Hookean material."""
    strain = draft.model.stresses.large_strain()
    energy, training = sampled_energy(draft.body, draft.nonlinear, strain, draft.E)
    draft.body.provenance["sampling"] = training
    draft.body = replace(draft.body, quartic=energy)
