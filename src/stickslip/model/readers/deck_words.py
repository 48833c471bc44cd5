"""Keywords of CalculiX and Abaqus decks: read, ignored, or reported.

Any other keyword or parameter is refused by line: it may change mass, stiffness, supports, damping or rotation.
"""

# Parameters of the keywords that are read. The second row has harmless parameters: names, outputs, tolerances of a tie that is
# made anew here, amplitudes of a zero displacement, thicknesses of shells, options of rate-dependent materials.
PARAMETERS: dict[str, frozenset[str]] = {
    keyword: frozenset([*read, *harmless])
    for keyword, read, harmless in (
        ("INCLUDE", ["INPUT"], []),
        ("NODE", ["NSET", "INPUT", "SYSTEM"], []),
        ("ELEMENT", ["TYPE", "ELSET", "INPUT"], []),
        ("NSET", ["NSET", "ELSET", "GENERATE", "INPUT"], ["INSTANCE", "INTERNAL", "UNSORTED"]),
        ("ELSET", ["ELSET", "GENERATE", "INPUT"], ["INSTANCE", "INTERNAL", "UNSORTED"]),
        ("SURFACE", ["NAME", "TYPE", "INPUT"], ["INTERNAL", "INSTANCE", "TRIM", "NO OFFSET", "NO THICK", "MAX RATIO"]),
        ("MATERIAL", ["NAME"], ["RTOL", "SRATE FACTOR", "SRATE TYPE"]),
        ("ELASTIC", ["TYPE", "INPUT"], ["MODULI"]),
        ("DENSITY", ["INPUT"], []),
        ("SOLID SECTION", ["ELSET", "MATERIAL", "ORIENTATION"], ["CONTROLS", "NODAL THICKNESS"]),
        ("BOUNDARY", ["OP", "TYPE", "INPUT"], ["AMPLITUDE", "TIME DELAY", "LOAD CASE", "FIXED"]),
        ("DLOAD", ["OP", "AMPLITUDE", "INPUT"], ["TIME DELAY", "LOAD CASE"]),
        (
            "STEP",
            ["NLGEOM"],
            ["NAME", "PERTURBATION", "INC", "INCF", "AMPLITUDE", "EXTRAPOLATION", "SOLVER", "UNSYMM", "CONVERT SDI"],
        ),
        ("TIE", ["CYCLIC SYMMETRY"], ["NAME", "POSITION TOLERANCE", "ADJUST", "TYPE", "NO ROTATION", "NO THICKNESS"]),
        ("CYCLIC SYMMETRY MODEL", ["N", "ELSET", "INPUT"], ["NGRAPH", "TIE", "CHECK"]),
        ("INSTANCE", ["NAME", "PART"], []),
        ("INITIAL CONDITIONS", ["TYPE"], ["INPUT", "USER", "FILE", "STEP", "INC", "INSTANCE"]),
    )
}

# Keywords that are skipped, as they do not affect mass, stiffness, supports or damping: names, procedures, output, and
# properties of contacts and shells (contacts and shells themselves are refused)
SILENT = frozenset(
    {
        "HEADING",
        "PREPRINT",
        "PART",
        "END PART",
        "ASSEMBLY",
        "END ASSEMBLY",
        "END INSTANCE",
        "PARAMETER",
        "PHYSICAL CONSTANTS",
        "END STEP",
        "STATIC",
        "FREQUENCY",
        "COMPLEX FREQUENCY",
        "BUCKLE",
        "STEADY STATE DYNAMICS",
        "MODAL DYNAMIC",
        "DYNAMIC",
        "VISCO",
        "HEAT TRANSFER",
        "COUPLED TEMPERATURE-DISPLACEMENT",
        "UNCOUPLED TEMPERATURE-DISPLACEMENT",
        "GREEN",
        "SELECT CYCLIC SYMMETRY MODES",
        "SELECT EIGENMODES",
        "NO ANALYSIS",
        "CONTROLS",
        "SOLUTION TECHNIQUE",
        "DIAGNOSTICS",
        "NODE PRINT",
        "NODE FILE",
        "NODE OUTPUT",
        "EL PRINT",
        "EL FILE",
        "ELEMENT OUTPUT",
        "ENERGY OUTPUT",
        "ENERGY PRINT",
        "ENERGY FILE",
        "MODAL OUTPUT",
        "MODAL FILE",
        "MODAL PRINT",
        "CONTACT FILE",
        "CONTACT PRINT",
        "CONTACT OUTPUT",
        "SECTION PRINT",
        "SECTION FILE",
        "INTEGRATED OUTPUT",
        "INTEGRATED OUTPUT SECTION",
        "OUTPUT",
        "USER OUTPUT",
        "PRINT",
        "RESTART",
        "MONITOR",
        "FILE FORMAT",
        "FILTER",
        "TIME POINTS",
        "AMPLITUDE",
        "MATRIX GENERATE",
        "MATRIX OUTPUT",
        "SUBSTRUCTURE GENERATE",
        "SUBSTRUCTURE MATRIX OUTPUT",
        "RETAINED NODAL DOFS",
        "COORDINATE SYSTEM",
        "SURFACE INTERACTION",
        "SURFACE BEHAVIOR",
        "FRICTION",
        "GAP CONDUCTANCE",
        "GAP HEAT GENERATION",
        "NODAL THICKNESS",
        "NORMAL",
        "SECTION CONTROLS",
        "HOURGLASS STIFFNESS",
        "CONDUCTIVITY",
        "SPECIFIC HEAT",
        "LATENT HEAT",
        "ELECTRICAL CONDUCTIVITY",
    }
)

# Keywords that are skipped and reported by line: loads of the deck's own analyses, which a study defines itself, and material
# behaviour beyond small vibration
TOLD = frozenset(
    {
        "CLOAD",
        "DSLOAD",
        "DFLUX",
        "CFLUX",
        "DSFLUX",
        "FILM",
        "SFILM",
        "RADIATE",
        "SRADIATE",
        "TEMPERATURE",
        "FIELD",
        "BASE MOTION",
        "LOAD CASE",
        "END LOAD CASE",
        "EXPANSION",
        "PLASTIC",
        "CREEP",
        "CYCLIC HARDENING",
        "DEPVAR",
    }
)

# Initial conditions without effect on mass and stiffness
PASSING_CONDITIONS = frozenset({"TEMPERATURE", "DISPLACEMENT", "VELOCITY", "FIELD", "ROTATING VELOCITY"})

# Damping, which a study defines in its own table
DAMPING = frozenset({"DAMPING", "MODAL DAMPING", "GLOBAL DAMPING", "DAMPING CONTROLS"})
# Keywords that are known to change the matrices
REFUSED = frozenset(
    {
        "MPC",
        "EQUATION",
        "RIGID BODY",
        "COUPLING",
        "KINEMATIC",
        "DISTRIBUTING",
        "DISTRIBUTING COUPLING",
        "CONTACT PAIR",
        "CONTACT",
        "SHELL SECTION",
        "BEAM SECTION",
        "BEAM GENERAL SECTION",
        "MEMBRANE SECTION",
        "SPRING",
        "DASHPOT",
        "MASS",
        "ROTARY INERTIA",
        "NONSTRUCTURAL MASS",
        "GAP",
        "SUBMODEL",
        "MODEL CHANGE",
        "ORIENTATION",
        "PRE-TENSION SECTION",
        "USER ELEMENT",
        "MATRIX INPUT",
        "MATRIX ASSEMBLE",
        "NCOPY",
        "NGEN",
        "NFILL",
        "NMAP",
        "ELGEN",
        "ELCOPY",
        "SYSTEM",
        "TRANSFORM",
        "DISTRIBUTION",
        "FOUNDATION",
        "EMBEDDED ELEMENT",
        "CONNECTOR SECTION",
        "SUPER ELEMENT",
        "SUBSTRUCTURE",
        "HYPERELASTIC",
        "HYPERFOAM",
        "VISCOELASTIC",
        "USER MATERIAL",
        "SUBSTRUCTURE PROPERTY",
        "SHELL TO SOLID COUPLING",
        "PHYSICAL",
        "IMPERFECTION",
        "CHANGE MATERIAL",
        "CHANGE SOLID SECTION",
        "INITIAL STRAIN INCREASE",
    }
)
# Bricks with other matrices than a plain solid: their difference, and the remedy
OTHER_BRICKS = {
    "C3D8I": ("incompatible modes", "Mesh with C3D20R, C3D20 or C3D10."),
    "C3D8R": (
        "one integration point and hourglass control",
        "Mesh with C3D20R, C3D20 or C3D10, or let the solver write its matrices and read these.",
    ),
}
