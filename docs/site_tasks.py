"""Public names by what they are for, and demos by subject: what reference and gallery list."""

# heading: a sentence about it, and the names, in the order in which they are met
TASKS: dict[str, tuple[str, str]] = {
    "Move": (
        "Bodies, joints, forces and controllers become a mechanism, which moves.",
        """Mechanism read_mechanism mbs.Part mbs.Marker mbs.Impact mbs.Pulley mbs.BallBearing
        mbs.JournalBearing mbs.Groove mbs.multilobe mbs.Oil mbs.iso_vg
        mbs.RollerBearing mbs.hertz_stiffness
        surface_load mass_load SpreadLoad simulate Stepper release Keeping save_state load_state
        mbs.State mbs.Instant mbs.Family mbs.Signal mbs.Elements mbs.Frames""",
    ),
    "From geometry to matrices": (
        "A STEP file, a geometry or a mesh becomes stiffness and mass.",
        """Material Orthotropic Layered example fe.model fe.pieces fe.assemble fe.by_mumps
        read_component Region Interface Attachment SurfaceMesh FEModel mass_properties modes Modes
        eigen.substructured_modes""",
    ),
    "Reduce": (
        "A method and kinds of interfaces make a small body of a large model.",
        """reduce CraigBampton Guyan Rubin Herting FreeFree AssumedModes EnhancedCraigBampton
        BalancedTruncation MomentMatching WithLoads reduction.Method Polynomial FourierLegendre
        Characteristic Snapshots Geometric Rayleigh ModalDamping FlexibleBody Basis craig_bampton
        second_order_balanced_truncation body.Marker body.Surface body.InertiaIntegrals""",
    ),
    "Parameters": (
        "One reduction for all variants of a body, to compare or to optimise.",
        """reduce_parametric parametric.Parameter YoungsModulus Density Thickness BodyFamily
        parametric.FamilyAssembly""",
    ),
    "Update": (
        "A family of bodies corrected by measured responses, and what the data can say.",
        """update updating.Updated updating.Responses updating.Channels updating.GroundSpring
        updating.AddedMass updating.MeasuredModes updating.Plan updating.place
        updating.candidates updating.independent updating.tracker updating.Tracker
        updating.Sensors updating.Track updating.Observer io.write_observer_fmu
        updating.parameter_tracker updating.ParameterTracker updating.Drift updating.compare
        updating.Comparison updating.JointSpring""",
    ),
    "Study": (
        "The same at many samples of its parameters, on all cores or a cluster.",
        """study Study""",
    ),
    "Fit": (
        "Parameters of a mechanism from measured histories.",
        """fit Fitted""",
    ),
    "Check": (
        "How far a model, a body, a motion or a law can be trusted.",
        """check Report audit certify_motion check_law eigen.mac eigen.residual_errors
        io.check_sid""",
    ),
    "Assemble": (
        "Bodies put together before any motion.",
        """Assembly assembly.CondensedAssembly substructure FreeSubstructure
        assembly.free_substructure DualAssembly reduce_pieces Pieces
        certify_pieces""",
    ),
    "Wheels": (
        "Equal sectors, at rest and in rotation, with blades that are alike or not.",
        """CyclicSector cyclic_modes CyclicModes wheel_modes reduce_sector cyclic.ReducedSector
        supported_sector rotating_sector travelling_modes TravellingModes wheel_campbell
        WheelCampbell wheel_body mistuned_wheel MistunedWheel cyclic.whitehead substructured_sector
        cyclic.SubstructuredSector reduced_blade ReducedBlade bladed_wheel BladedWheel
        cyclic.gyroscopic_modes cyclic.GyroscopicModes cyclic.divergence_speed
        cyclic.centrifugal_displacement cyclic.rotation_matrices""",
    ),
    "Rotation and heat": (
        "States about which a solid vibrates: turning fast, or heated.",
        """held_solid spin_up SpinUp ReducedSpinUp prestress.SteadyRotation Heat heated
        heated_sector thermal_buckling body.rotating_frequencies""",
    ),
    "Results": (
        "What is known without a simulation, what a motion holds, and sensitivities.",
        """mbs.Solution mbs.Energy mbs.Occurrences mbs.ToothLoads mbs.tooth_loads
        mbs.film_pressures snapshot equilibrium continuation mbs.EquilibriumPath inverse_dynamics
        linearize mbs.Linearization campbell mbs.Campbell
        frequency_response transmissibility mbs.FrequencyResponse steady_motion SteadyMotion
        periodic_motion mbs.PeriodicMotion periodic_path mbs.PeriodicPath mbs.CriticalMotion
        equilibrium_sensitivity frequency_sensitivity motion_sensitivity mbs.Sensitivity
        body.von_mises""",
    ),
    "Pictures": (
        "Drawings, films and pages.",
        """view.mesh view.mode_shapes view.start view.animate view.instants view.wheel_modes
        view.frequencies view.convergence view.campbell view.history view.Panel view.panels
        view.Drawing view.plane view.Shape view.deformed view.flow view.updating view.channels
        view.faces view.Thing view.Scene view.meshed view.wheel view.plates view.film view.posed
        view.Film view.plotter view.bar view.box view.cylinder view.ring view.tube view.coil
        view.wound view.ellipsoid view.extruded view.gear view.joined view.sleeves
        view.toothed_shaft view.tooth_walls view.film_wall
        write_animation write_report""",
    ),
    "Files": (
        "Bodies and motions written and read, for this toolkit and for others.",
        """save load export io.read_body write_history write_stress write_stress_history
        io.write_vtu io.write_vtkhdf io.write_glb io.MovingMesh write_fmu write_mechanism_fmu
        write_body_fmu read_sid io.write_sid io.sid_body io.standard_input io.StandardInput
        io.write_mbdyn io.write_exudyn io.write_openfast io.read_openfast io.Superelement
        io.write_simscape io.write_radioss io.interface_form io.InterfaceForm io.read_universal
        io.read_responses io.read_modes io.write_responses""",
    ),
    "Matrices of other programs": (
        "Stiffness and mass from files, to be reduced here, and back.",
        """read_model io.read_matrix io.read_market io.read_op4 io.write_op4 io.read_dmig
        io.write_dmig io.read_stored_matrix io.write_abaqus_matrix io.read_user_element
        io.write_user_element io.read_nodes io.read_node_sets io.read_grids""",
    ),
    "Components": (
        "Fields of engineering, each a package of its own.",
        """components.cosserat components.assumed_strain components.masonry components.rockfall
        components.hand components.linkages components.wind components.gear_mesh
        components.journal_bearing components.transmission components.updating
        components.best_matching components.studies""",
    ),
    "Rotations and units": (
        "Quaternions, and quantities as text.",
        """rotation.skew rotation.axial rotation.matrix rotation.quaternion rotation.multiply
        rotation.continuous rotation.crossed rotation.skew_tensor rotation.spatial_tangent
        rotation.exp rotation.log units.in_si units.unit units.Unit units.unit_system
        units.UnitSystem units.fits units.dimension_name""",
    ),
    "Verbs on matrices": (
        "What a reduction asks of a model, for methods and formats of your own.",
        """eigen.Operators eigen.Held eigen.Mass eigen.Weighted eigen.rigid_motions
        eigen.given_rigid_motions eigen.mean_motion eigen.dofs_of eigen.orthonormal
        eigen.orthonormal_in eigen.canonical_signs eigen.count_shift eigen.whole_clusters""",
    ),
    "Exceptions": (
        "What is raised on purpose.",
        """RomError ConfigError UnknownNameError FileFormatError UnsafeFileError MeshError TagError
        MaterialError InterfaceError ParameterError ModelError SolverError ModesMissedError
        QualityGateError ResourceError ParallelError InterruptedRun RomWarning""",
    ),
}

NAMES = [f"rom.{name}" for _, listed in TASKS.values() for name in listed.split()]
CLASSES = {name.lower() for name in NAMES if not name.islower()}
# {function whose name is a class's in small letters: file name of its page}, as some file systems
# do not tell capitals
FILE_NAMES = {name: f"{name}-function" for name in NAMES if name in CLASSES}

SUBJECTS = {
    "Reduce a body": """beam assembly compressor_blade reference_conditions parameters large_mesh
    exchange superelement""",
    "Mechanisms": """slider_crank robot_arm flexible_arm satellite pendulum_chain hand rolling_wheel
    periodic isotropy best_matching study""",
    "Large deflection and metal forming": """large_deflection flexure snap_through spin_up sheet
    forming""",
    "Rotating blades, wheels and rotors": """rotating_blade bladed_disk bladed_rotor mistuning
    lost_tip bent_blade rotor""",
    "Gears and bearings": "planetary transmission two_stage oil_inlet",
    "Wind turbines": "wind_turbine whole_turbine wind_power",
    "Models and measurements": """updating bolted_frame virtual_sensing measured_rods
    measured_frames barc garteur""",
    "Stones and rocks": "masonry measured_arches rockfall",
}
