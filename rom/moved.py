"""Old import paths of modules that have moved: they work until version 0.2 and say what is new."""

import sys

TYPE_CHECKING = False  # the package comes by here first: nothing is loaded that is not needed
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

ROWS = (  # old package, new package, modules; old=new where the name differs
    ("rom", "rom.bench", "bench_loops=loops bench_models=models bench_wheel=wheel peers"),
    ("rom", "rom.checks", "certificate"),
    ("rom", "rom.eigen", "attachment=attachments scipy_operators=scipy"),
    ("rom.fe", "rom.eigen", "lanczos"),
    ("rom.fe.operators", "rom.eigen", "lanczos"),
    ("rom", "rom.parametric", "parameters"),
    ("rom", "rom.process", "child interruption launcher memory"),
    ("rom.body", "rom.assembly", "assembly condensed coupling"),
    ("rom.body", "rom.parametric", "family stretch=layers"),
    ("rom.components", "rom.components", "frf_updating=updating"),
    ("rom.components", "rom.components.cosserat", "helical_spring linear_pieces"),
    ("rom.components", "rom.components.hand",
     "cable compliant_hand control_chart grasp solid_finger"),
    ("rom.components", "rom.components.linkages", "dynamic_isotropy two_dof_linkages"),
    ("rom.components", "rom.components.masonry",
     "block_contact discontinuous_deformation masonry_limits=limits"),
    ("rom.components", "rom.components.updating", "airframe"),
    ("rom.components", "rom.updating", "frf_data"),
    ("rom.components.updating", "rom.updating", "frf_data methods models"),
    ("rom.components", "rom.components.wind",
     "blade_element drivetrain whole_turbine wind_turbine"),
    ("rom.components.cosserat", "rom.mbs.elements.rods",
     "elements=energy multibody=bodies shape=shapes"),
    ("rom.components.gear_mesh", "rom.mbs.elements.gears", "geometry"),
    ("rom.components.journal_bearing", "rom.mbs.elements.films",
     "band bearing film_kernel=pressure"),
    ("rom.components.frf_updating", "rom.updating", "methods models"),
    ("rom.config", "rom.report", "reporting=pages run"),
    ("rom.cyclic", "rom.cyclic", "springs=supports"),
    ("rom.cyclic", "rom.cyclic.blades",
     "bladed_wheel bladeless_disk=disk mistuning substructures=substructured_sector"),
    ("rom.fe", "rom.fe.forms", "finite_strain material nodes region stress"),
    ("rom.fe", "rom.fe.mesh",
     "child distribute elements=cell_types input_deck quality repair solid summary topology "
     "validate"),
    ("rom.fe", "rom.fe.mesh.sources",
     "abaqus builder deck gmsh_groups gmsh_session nastran readers step"),
    ("rom.fe", "rom.fe.operators",
     "aij counting factor held iterative krylov_schur memory petsc solver spectrum "
     "tied=petsc"),
    ("rom.fe.operators", "rom.fe.operators", "tied=petsc"),
    ("rom.io", "rom.io.fields", "gltf universal vtkhdf vtu"),
    ("rom.io", "rom.io.matrices",
     "calculix dmig foreign_model=read_model market matrix_files node_files op4 user_element"),
    ("rom.io", "rom.io.programs",
     "exudyn interface_form mbdyn openfast openfast_reading radioss simscape"),
    ("rom.io", "rom.io.sid", "sid_body=body sid_dialect=dialect sid_reading=reading"),
    ("rom.mbs", "rom.mbs.analysis",
     "campbell equilibrium inverse=inverse_dynamics linearize modes=quadratic_eigen response "
     "sensitivity steady=steady_motion tangent variation=local_equations"),
    ("rom.mbs", "rom.mbs.analysis.rotors", "frames=moving_axes"),
    ("rom.mbs.analysis", "rom.mbs.analysis.rotors", "moving_axes"),
    ("rom.mbs.analysis.continuation", "rom.paths", "arc_length"),
    ("rom.mbs", "rom.mbs.elements",
     "nonlinear spread=spread_loads"),
    ("rom.mbs", "rom.mbs.elements.contact", "contact=points impact surface_contact=surfaces"),
    ("rom.mbs.elements", "rom.mbs.elements.contact", "impact surface_contact=surfaces"),
    ("rom.mbs", "rom.mbs.equations",
     "bordered=linear_solve elimination graph "
     "motion=equations ordering packing user=python_laws"),
    ("rom.mbs", "rom.mbs.integrate",
     "alpha=generalized_alpha ending=event_end events explicit=dop853 first_steps=radau_start "
     "implicit=fixed_step multistep=bdf record=run release=simulation stabilised=index2 "
     "starting=step_memory state=consistent_start variable=adaptive_step"),
    ("rom.mbs", "rom.mbs.kernels",
     "algebra arrays=system compiled constraints coordinates dynamics=inertia integrals "
     "kinematics=markers layout=plan rolling stiffening=second_order"),
    ("rom.mbs", "rom.mbs.parts", "joints signals"),
    ("rom.mbs", "rom.mbs.results",
     "audit checkpoint dense=interpolation interface_loads solution tracks=recomputed validity"),
    ("rom.peers", "rom.bench.peers",
     "beams compare craig_bampton ffrf films mechanisms motion ours reference rods ross_films"),
    ("rom.prestress", "rom.prestress", "states=speed_table steady=steady_rotation"),
    ("rom.reduction", "rom.assembly", "dual"),
    ("rom.reduction", "rom.parametric", "samples=common_basis"),
    ("rom.reduction", "rom.reduction.bases",
     "balanced enhanced fixed_interface free_interface krylov loads method selection"),
    ("rom.reduction", "rom.reduction.interfaces",
     "characteristic interface=connection kinds order polynomial snapshots"),
    ("rom.view", "rom.view.canvas", "draw offscreen page scene solids"),
    ("rom.view", "rom.view.figures", "curves panels plane=sheets planes=fields spectra=updating"),
    ("rom.view", "rom.view.scenes",
     "film motion=animation_files part=meshes rods shapes=mode_shapes start=mechanisms wheels "
     "window"),
)  # fmt: skip


def _paths() -> dict[str, str]:
    found = {}
    for old, new, modules in ROWS:
        for one in modules.split():
            before, _, now = one.partition("=")
            found[f"{old}.{before}"] = f"{new}.{now or before}"
    return found


NEW_PATHS = _paths()


class OldPaths:
    """Finds moved modules under their old names: the same modules, not copies."""

    def find_spec(
        self, name: str, path: "Sequence[str] | None" = None, target: "ModuleType | None" = None
    ) -> "ModuleSpec | None":
        """This, for an old name."""
        if name not in NEW_PATHS:
            return None
        from importlib.machinery import ModuleSpec

        return ModuleSpec(name, self)  # type: ignore[arg-type]

    def create_module(self, spec: "ModuleSpec") -> None:
        """An empty module, which `exec_module` replaces."""

    def exec_module(self, module: "ModuleType") -> None:
        """Put the moved module in the place of the empty one."""
        import importlib
        import warnings

        old, new = module.__name__, NEW_PATHS[module.__name__]
        text = f"{old} is {new} now; the old path goes with version 0.2."
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        sys.modules[old] = importlib.import_module(new)


sys.meta_path.insert(0, OldPaths())  # before the folders: a moved package has its modules with it
