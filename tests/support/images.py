"""Readers for the image files that Whittle writes, independent of the libraries that wrote them.

PNG (ISO/IEC 15948): 8- or 16-bit RGB or RGBA, not interlaced. EXR (OpenEXR file layout, 2.0): single-part scan lines,
float channels, ZIP compression. TIFF (Adobe 1992, Revision 6.0): one strip of 16 bits, not compressed. Any other variant
is rejected, so a test that reads an image also checks its format. All return numpy arrays of shape (height, width,
channels), row 0 on top.
"""
import struct
import zlib

import numpy

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def srgb_curve(linear):
    value = numpy.clip(linear.astype(numpy.float64), 0, 1)
    return numpy.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def srgb_codes(linear, most=255):
    return numpy.floor(most * srgb_curve(linear) + 0.5).astype(numpy.uint8 if most == 255 else numpy.uint16)


def write_png(chunks):
    """A PNG of [(type, content)]."""
    return PNG_SIGNATURE + b"".join(struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
                                    for kind, content in chunks)


def png_chunks(data):
    """Returns [(type, content)]. Checks every CRC, and that nothing follows IEND."""
    if data[:8] != PNG_SIGNATURE:
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
            predicted = left
        elif kind == 3:
            predicted = (left + up) // 2
        elif kind == 4:
            p = left + up - corner
            predicted = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))[2]
        else:
            raise ValueError(f"filter {kind}")
        out[i] = (int(line[i]) + predicted) & 255
    return out


def read_png(data):
    chunks = png_chunks(data)
    width, height, bits, color, compression, filters, interlace = struct.unpack(">IIBBBBB", chunks[0][1])
    if bits not in (8, 16) or color not in (2, 3, 6) or (compression, filters, interlace) != (0, 0, 0):
        raise ValueError(f"not plain RGB, RGBA or indexed: {chunks[0][1]}")
    channels = {2: 3, 3: 1, 6: 4}[color]
    step = channels * bits // 8
    packed = zlib.decompress(b"".join(content for kind, content in chunks if kind == b"IDAT"))
    lines = numpy.frombuffer(packed, numpy.uint8).reshape(height, 1 + step * width)
    image = numpy.zeros((height, step * width), numpy.uint8)
    above = numpy.zeros(step * width, numpy.uint8)
    for y in range(height):
        above = image[y] = _unfilter(lines[y, 0], lines[y, 1:], above, step)
    image = image if bits == 8 else image.view(">u2").astype(numpy.uint16)
    if color == 3:
        return numpy.frombuffer(dict(chunks)[b"PLTE"], numpy.uint8).reshape(-1, 3)[image]
    return image.reshape(height, width, channels)


def exr_header(data):
    """Returns {name: (type, bytes)} and the offset of the byte after the header."""
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
        names.append((content[at:end].decode(), ("<u4", "<f2", "<f4")[pixel_type]))
        at = end + 17
    return names


def _undo_zip(packed, size):
    if len(packed) == size:  # a block that compression would enlarge is stored uncompressed
        return packed
    deltas = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).astype(numpy.int64)
    deltas[1:] -= 128
    halves = (numpy.cumsum(deltas) & 255).astype(numpy.uint8)
    out = numpy.empty(size, numpy.uint8)
    out[0::2], out[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return out.tobytes()


def read_exr_channels(data):
    """Returns {name: (height, width) array of float16, float32 or uint32}."""
    attributes, at = exr_header(data)
    if attributes["compression"][1] != b"\x03":
        raise ValueError("not ZIP compressed")
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    if (x0, y0) != (0, 0) or attributes["displayWindow"] != attributes["dataWindow"]:
        raise ValueError("windows differ or do not start at 0,0")
    names, width, height = _exr_channels(attributes["channels"][1]), x1 + 1, y1 + 1
    blocks = (height + 15) // 16
    channels = {name: numpy.empty((height, width), kind) for name, kind in names}
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        rows = min(16, height - y)
        row = numpy.dtype([(name, kind, (width,)) for name, kind in names])
        block = numpy.frombuffer(_undo_zip(data[offset + 8 : offset + 8 + size], rows * row.itemsize), row)
        for name, _ in names:
            channels[name][y : y + rows] = block[name]
    return channels


def read_exr(data):
    channels = read_exr_channels(data)
    if sorted(channels) != ["B", "G", "R"]:
        raise ValueError(f"channels {sorted(channels)}")
    return numpy.stack([channels[name] for name in "RGB"], axis=-1)


def read_hdr(data):
    """Radiance RGBE, run-length coded (Ward 1991, "Real Pixels") or flat. Returns the image and its quantisation steps."""
    head, _, body = data.partition(b"\n\n")
    size, _, body = body.partition(b"\n")
    words = size.split()
    if not head.startswith(b"#?R") or words[0] != b"-Y" or words[2] != b"+X":
        raise ValueError("not a Radiance image with row 0 on top")
    height, width, at = int(words[1]), int(words[3]), 0
    codes = numpy.empty((height, 4, width), numpy.uint8)
    for y in range(height):
        if body[at : at + 2] != b"\2\2":
            codes[y] = numpy.frombuffer(body, numpy.uint8, 4 * width, at).reshape(width, 4).T
            at += 4 * width
            continue
        at += 4
        for channel in range(4):
            x = 0
            while x < width:
                count = body[at]
                if count > 128:
                    codes[y, channel, x : x + count - 128] = body[at + 1]
                    x, at = x + count - 128, at + 2
                else:
                    codes[y, channel, x : x + count] = numpy.frombuffer(body, numpy.uint8, count, at + 1)
                    x, at = x + count, at + 1 + count
    if at != len(body):
        raise ValueError("bytes after the last row")
    scale = numpy.ldexp(1.0, codes[:, 3].astype(int) - 136)
    return numpy.moveaxis(codes[:, :3] * scale[:, None], 1, 2), scale


def tiff_tags(data):
    """Returns {tag: values} of the first directory of a little-endian file."""
    assert data[:4] == b"II*\0"
    start = struct.unpack_from("<I", data, 4)[0]
    tags = {}
    for entry in range(struct.unpack_from("<H", data, start)[0]):
        tag, kind, count, value = struct.unpack_from("<HHI4s", data, start + 2 + 12 * entry)
        code, size = {3: ("H", 2), 4: ("I", 4), 5: ("II", 8)}[kind]
        field = value if size * count <= 4 else data[struct.unpack("<I", value)[0]:]
        tags[tag] = struct.unpack_from("<" + code * count, field)
    return tags


def read_tiff(data):
    """Uncompressed RGB or RGBA with 16 bits in a channel and straight alpha."""
    tags = tiff_tags(data)
    (width,), (height,), (channels,) = tags[256], tags[257], tags[277]
    assert list(tags) == sorted(tags), "entries must ascend"
    assert tags[258] == (16,) * channels and tags[259] == (1,) and tags[262] == (2,) and tags[284] == (1,)
    assert tags.get(338, ()) == (2,) * (channels - 3), "straight alpha"
    assert tags[278] == (height,) and tags[279] == (2 * width * height * channels,)
    return numpy.frombuffer(data, "<u2", width * height * channels, tags[273][0]).reshape(height, width, channels)
