"""The parts of whittle-submit, in the order of its data:

    arguments -> frames (documents, sweeps, files) -> run -> pictures, progress
                                                    |-> submit (batches) -> state, server
                                                    |-> watch (events) -> server

Python 3 alone, no packages.
"""
