"""Readers for the picture files Whittle writes, independent of the libraries that wrote them.

PNG (ISO/IEC 15948): 8-bit RGB, not interlaced. EXR (OpenEXR file layout, 2.0): single-part scan lines, float channels,
ZIP compression. Whatever else a file holds is refused with ValueError, so a test that reads a picture also checks its
kind. Both return numpy arrays of shape (height, width, 3), row 0 on top.
"""
import struct
import zlib

import numpy


def png_chunks(data):
    """[(type, content)] with every CRC checked and nothing after IEND."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("not a PNG signature")
    chunks, at = [], 8
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8 : at + 8 + size]
        (crc,) = struct.unpack_from(">I", data, at + 8 + size)
        if crc != zlib.crc32(kind + content):
            raise ValueError(f"bad CRC in {kind}")
        chunks.append((kind, content))
        at += 12 + size
    if chunks[0][0] != b"IHDR" or chunks[-1] != (b"IEND", b""):
        raise ValueError("IHDR must come first and IEND last")
    return chunks


def _unfilter(kind, line, above, step):
    if kind == 0:
        return line
    if kind == 2:
        return line + above
    out = numpy.zeros_like(line)
    for i in range(len(line)):
        left = int(out[i - step]) if i >= step else 0
        corner = int(above[i - step]) if i >= step else 0
        up = int(above[i])
        if kind == 1:
            guess = left
        elif kind == 3:
            guess = (left + up) // 2
        elif kind == 4:
            p = left + up - corner
            guess = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))[2]
        else:
            raise ValueError(f"filter {kind}")
        out[i] = (int(line[i]) + guess) & 255
    return out


def read_png(data):
    chunks = png_chunks(data)
    width, height, bits, color, compression, filters, interlace = struct.unpack(">IIBBBBB", chunks[0][1])
    if (bits, color, compression, filters, interlace) != (8, 2, 0, 0, 0):
        raise ValueError(f"not plain 8-bit RGB: {chunks[0][1]}")
    packed = zlib.decompress(b"".join(content for kind, content in chunks if kind == b"IDAT"))
    lines = numpy.frombuffer(packed, numpy.uint8).reshape(height, 1 + 3 * width)
    picture = numpy.zeros((height, 3 * width), numpy.uint8)
    above = numpy.zeros(3 * width, numpy.uint8)
    for y in range(height):
        above = picture[y] = _unfilter(lines[y, 0], lines[y, 1:], above, 3)
    return picture.reshape(height, width, 3)


def exr_header(data):
    """{name: (type, bytes)} and the offset of what follows it."""
    if struct.unpack_from("<II", data) != (20000630, 2):
        raise ValueError("not a single-part scan line EXR")
    attributes, at = {}, 8
    while data[at]:
        name_end = data.index(0, at)
        type_end = data.index(0, name_end + 1)
        (size,) = struct.unpack_from("<i", data, type_end + 1)
        content = data[type_end + 5 : type_end + 5 + size]
        attributes[data[at:name_end].decode()] = (data[name_end + 1 : type_end].decode(), content)
        at = type_end + 5 + size
    return attributes, at + 1


def _exr_channels(content):
    names, at = [], 0
    while content[at]:
        end = content.index(0, at)
        (pixel_type,) = struct.unpack_from("<i", content, end + 1)
        if pixel_type != 2:
            raise ValueError("channel is not 32-bit float")
        names.append(content[at:end].decode())
        at = end + 17
    return names


def _undo_zip(packed, size):
    if len(packed) == size:  # a block that would grow is kept as it is
        return packed
    deltas = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).astype(numpy.int64)
    deltas[1:] -= 128
    halves = (numpy.cumsum(deltas) & 255).astype(numpy.uint8)
    out = numpy.empty(size, numpy.uint8)
    out[0::2], out[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return out.tobytes()


def read_exr(data):
    attributes, at = exr_header(data)
    if attributes["compression"][1] != b"\x03":
        raise ValueError("not ZIP compressed")
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    if (x0, y0) != (0, 0) or attributes["displayWindow"] != attributes["dataWindow"]:
        raise ValueError("windows differ or do not start at 0,0")
    names, width, height = _exr_channels(attributes["channels"][1]), x1 + 1, y1 + 1
    blocks = (height + 15) // 16
    picture = numpy.empty((height, width, 3), numpy.float32)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        rows = min(16, height - y)
        raw = _undo_zip(data[offset + 8 : offset + 8 + size], rows * width * len(names) * 4)
        block = numpy.frombuffer(raw, "<f4").reshape(rows, len(names), width)
        for channel, name in enumerate("RGB"):
            picture[y : y + rows, :, channel] = block[:, names.index(name), :]
    if sorted(names) != ["B", "G", "R"]:
        raise ValueError(f"channels {names}")
    return picture
