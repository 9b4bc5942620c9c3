"""Reads linear 16-bit PPM images, which the peers write.

Images are arrays of (height, width, 3), row 0 on top, from 0 to 1.
"""
import re

import numpy

HEAD = re.compile(rb"P6\s(?:#.*\n)*(\d+)\s+(\d+)\s+65535\s")


def read(path, factor=1):
    """A 16-bit PPM; comments may follow its first line. Each block of `factor` x `factor` pixels becomes their mean."""
    with open(path, "rb") as file:
        head = HEAD.match(file.read(4096))
    if not head:
        raise ValueError(f"{path} is not a 16-bit PPM")
    width, height = int(head[1]), int(head[2])
    codes = numpy.memmap(path, ">u2", "r", head.end(), (height, width, 3))
    rows = [codes[y:y + factor].reshape(factor, width // factor, factor, 3).mean((0, 2), dtype=float)
            for y in range(0, height, factor)]
    return numpy.stack(rows) / 65535


def encode_srgb(linear):
    """IEC 61966-2-1"""
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * numpy.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
