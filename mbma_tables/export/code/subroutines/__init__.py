"""User subroutines of solvers in C, which call a law: a file a solver, with their templates beside it.

A file of this folder has `LANGUAGES`, by the names of their targets, as those of `languages`.
"""
