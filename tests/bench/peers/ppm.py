"""Reads linear 16-bit PPM images, which both peers write, and writes sRGB PNGs, which `whittle diff` reads."""
import re
import struct
import zlib
from typing import NamedTuple


class Image(NamedTuple):
    width: int
    height: int
    samples: list  # linear RGB from 0 to 1, interleaved, row 0 is the top


HEAD = re.compile(rb"P6\s(?:#.*\n)*(\d+)\s+(\d+)\s+65535\s")


def read(path):
    """A 16-bit PPM; comments may follow its first line."""
    data = path.read_bytes()
    head = HEAD.match(data)
    if not head:
        raise ValueError(f"{path} is not a 16-bit PPM")
    width, height = int(head[1]), int(head[2])
    codes = struct.unpack_from(f">{3 * width * height}H", data, head.end())
    return Image(width, height, [code / 65535 for code in codes])


def encode_srgb(linear):
    """IEC 61966-2-1"""
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def write_png(image, path):
    """Encodes the image as sRGB with 16 bits per channel."""
    row = 3 * image.width
    codes = [round(65535 * encode_srgb(value)) for value in image.samples]
    rows = b"".join(b"\0" + struct.pack(f">{row}H", *codes[row * y:row * (y + 1)]) for y in range(image.height))
    chunk = lambda kind, content: (struct.pack(">I", len(content)) + kind + content
                                   + struct.pack(">I", zlib.crc32(kind + content)))
    head = struct.pack(">IIBBBBB", image.width, image.height, 16, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 1))
                     + chunk(b"IEND", b""))
