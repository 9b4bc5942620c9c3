"""The parts of whittle-submit, in the order of its data:

    arguments -> frames (documents, sweeps, files) -> run (server, state) -> pictures, progress

Python 3 alone, no packages.
"""
