"""Linear pictures of 16 bits (PPM), which both peers write, and PNGs of sRGB, which `whittle diff` reads."""
import re
import struct
import zlib
from typing import NamedTuple


class Picture(NamedTuple):
    width: int
    height: int
    samples: list  # linear RGB from 0 to 1, interleaved, row 0 on top


HEAD = re.compile(rb"P6\s(?:#.*\n)*(\d+)\s+(\d+)\s+65535\s")


def read(path):
    """A PPM of 16 bits, with comments after its first line or none."""
    data = path.read_bytes()
    head = HEAD.match(data)
    if not head:
        raise ValueError(f"{path} is no PPM of 16 bits")
    width, height = int(head[1]), int(head[2])
    codes = struct.unpack_from(f">{3 * width * height}H", data, head.end())
    return Picture(width, height, [code / 65535 for code in codes])


def shrunk(picture, factor):
    """Each pixel the mean of factor x factor."""
    width, height, row = picture.width // factor, picture.height // factor, 3 * picture.width
    samples = []
    for y in range(height):
        lines = [picture.samples[(factor * y + i) * row:(factor * y + i + 1) * row] for i in range(factor)]
        column = [sum(values) for values in zip(*lines)]
        for x in range(width):
            first = 3 * factor * x
            samples += [sum(column[first + c:first + 3 * factor:3]) / factor**2 for c in range(3)]
    return Picture(width, height, samples)


def encoded(linear):
    """IEC 61966-2-1"""
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def write_png(picture, path):
    """As sRGB codes of 16 bits."""
    row = 3 * picture.width
    codes = [round(65535 * encoded(value)) for value in picture.samples]
    rows = b"".join(b"\0" + struct.pack(f">{row}H", *codes[row * y:row * (y + 1)]) for y in range(picture.height))
    chunk = lambda kind, content: (struct.pack(">I", len(content)) + kind + content
                                   + struct.pack(">I", zlib.crc32(kind + content)))
    head = struct.pack(">IIBBBBB", picture.width, picture.height, 16, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 1))
                     + chunk(b"IEND", b""))
