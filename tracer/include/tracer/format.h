#pragma once
/// The formats of image files, a row of a table each. Everything else about them is derived: the words of documents,
/// the names and media types of artifacts, the negotiation of POST /v1/render, and the extensions of the command line.

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>

#include "tracer/document_fields.h"

namespace tracer {

// ---- formats that can be read, see compare.h -----------------------------------------------------------------------

enum class ImageFormat { png, jpeg, tiff, webp, openexr, hdr };

struct ImageFormatRow {
  const char* name;        ///< for people
  const char* codec;       ///< name in OpenImageIO
  bool linear;             ///< files store linear radiance instead of sRGB codes
  std::string_view magic;  ///< the first bytes of a file, where '.' is any byte
  std::string_view other_magic = magic;
};

/// In the order of ImageFormat.
inline constexpr ImageFormatRow image_format_rows[] = {
    {"PNG", "png", false, "\x89PNG\r\n\x1a\n"},          {"JPEG", "jpeg", false, "\xff\xd8\xff"},
    {"TIFF", "tiff", false, {"II*\0", 4}, {"MM\0*", 4}}, {"WebP", "webp", false, "RIFF....WEBP"},
    {"OpenEXR", "openexr", true, "\x76\x2f\x31\x01"},    {"Radiance HDR", "hdr", true, "#?RADIANCE", "#?RGBE"},
};

constexpr const ImageFormatRow& row(ImageFormat kind) { return image_format_rows[static_cast<std::size_t>(kind)]; }
constexpr bool is_linear(ImageFormat kind) { return row(kind).linear; }

// ---- formats that can be written, see encode.h ---------------------------------------------------------------------

enum class Format { png, png16, exr, jpg, hdr, webp, tiff };

struct FormatRow {
  std::string_view name;       ///< in documents
  std::string_view extension;  ///< without a dot in front
  std::string_view media_type;
  ImageFormat kind;                                                    ///< in which files are read
  std::uint32_t side_max = std::numeric_limits<std::uint32_t>::max();  ///< the most pixels on a side
};

/// In the order of Format. For display:
///   png: 8 bits, no dithering, `sRGB` chunk; indexed with a palette, unless there is alpha. png16: 16 bits, no
///   palette. tiff: as png16, not compressed. jpg: 8 bits, no palette, composited over black; JPEG_MAX_DIMENSION of
///   libjpeg limits its sides. webp: as jpg, with chroma at half the resolution; frames have 14 bits for a side (RFC
///   6386, section 9.1).
/// Linear radiance:
///   exr: 32-bit float, with `half` 16-bit up to 65504, ZIP compressed; layers are channels Z, normal.X .Y .Z,
///   albedo.R .G .B, object_id and samples (both 32-bit integers). hdr: 8-bit mantissas with a common exponent,
///   composited over black.
/// Alpha is straight, except in EXR, whose colors are premultiplied.
inline constexpr FormatRow format_rows[] = {
    {"png", "png", "image/png", ImageFormat::png},          {"png16", "16.png", "image/png", ImageFormat::png},
    {"exr", "exr", "image/x-exr", ImageFormat::openexr},    {"jpg", "jpg", "image/jpeg", ImageFormat::jpeg, 65'500},
    {"hdr", "hdr", "image/vnd.radiance", ImageFormat::hdr}, {"webp", "webp", "image/webp", ImageFormat::webp, 16'383},
    {"tiff", "tiff", "image/tiff", ImageFormat::tiff},
};

/// Every format, most common first.
inline constexpr Format all_formats[] = {Format::png,   Format::exr,  Format::jpg, Format::hdr,
                                         Format::png16, Format::webp, Format::tiff};
static_assert(std::size(all_formats) == std::size(format_rows));

constexpr const FormatRow& row(Format format) { return format_rows[static_cast<std::size_t>(format)]; }
constexpr std::string_view name(Format format) { return row(format).name; }
constexpr auto words_of(Format) {
  std::array<Word<Format>, std::size(format_rows)> all;
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = {format_rows[i].name, static_cast<Format>(i)};
  return all;
}

/// Name of the artifact of a render: "image.16.png".
inline std::string file_name(Format format) { return "image." + std::string(row(format).extension); }

/// A column of a table as text, with `prefix` before each word: ".png, .exr or .tiff".
template <class Row, std::size_t rows, class Word>
std::string alternatives(const Row (&table)[rows], Word Row::*column, const char* prefix = "") {
  std::string text;
  for (const Row& row : table)
    text.append(text.empty() ? "" : &row == &table[rows - 1] ? " or " : ", ").append(prefix).append(row.*column);
  return text;
}

}  // namespace tracer
