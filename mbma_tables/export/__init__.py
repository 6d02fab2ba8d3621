"""The model, its tables and its laws written for other programs."""

# the targets, in the order in which help lists them
SOLVERS = ("calculix", "abaqus", "lsdyna", "optistruct", "comsol", "moose", "modelica")  # functions of `solvers`
DATA = ("csv", "json", "matlab", "netcdf", "hdf5", "parquet")  # functions of `data`, named to_csv and so on
SUBROUTINES = ("abaqus-uinter", "abaqus-gapcon", "calculix-gapcon")
# keys of `law_code.LANGUAGES`
LAWS = ("c-law", "fortran-law", "javascript-law", "python-law", "jax-law", "matlab-law", "modelica-law", *SUBROUTINES)
FMUS = ("fmu", "fmu3")  # of FMI 2.0 and 3.0, keys of `fmu.STANDARDS`
GRAPHS = ("onnx",)
CODE = ("c", "fortran", "javascript")  # keys of `code.LANGUAGES`
