"""Runs some of the cases of a unittest file, or all others:
python -m tests.support.cases FILE --only NAME... | --except NAME...

A NAME is that of a test function or of a class. Each must exist, so that the two lists of a file stay complements.
"""
import argparse
import importlib
import pathlib
import sys
import unittest


def flatten(suite):
    return [case for part in suite for case in (flatten(part) if isinstance(part, unittest.TestSuite) else [part])]


def select(cases, names, only):
    """The cases that `names` name if `only`, else all others; LookupError for a name of none."""
    parts = [(case, set(case.id().split("."))) for case in cases]
    unknown = [name for name in names if not any(name in found for _, found in parts)]
    if unknown:
        raise LookupError(f"no case is named {', '.join(unknown)}")
    return [case for case, found in parts if bool(found & set(names)) == only]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=pathlib.Path)
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--only", nargs="+")
    which.add_argument("--except", nargs="+", dest="excepted")
    options = parser.parse_args()
    module = importlib.import_module(".".join(options.file.with_suffix("").parts))
    cases = flatten(unittest.defaultTestLoader.loadTestsFromModule(module))
    chosen = select(cases, options.only or options.excepted, only=options.only is not None)
    done = unittest.TextTestRunner(verbosity=2).run(unittest.TestSuite(chosen))
    return 0 if done.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
