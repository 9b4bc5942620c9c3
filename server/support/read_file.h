#pragma once
/// Reads small files that an operator wrote.

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <ios>
#include <stdexcept>
#include <string>

namespace support {

/// A mistyped name must not read a whole disk.
inline constexpr std::size_t file_bytes_max = 1u << 20;

/// The content of the file. Throws std::runtime_error with a sentence if it cannot be read or is longer than 1 MiB.
inline std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(file_bytes_max + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  if (!file.is_open() || file.bad() || (text.empty() && !file.eof())) {
    throw std::runtime_error("cannot read \"" + path + "\"");
  }
  if (text.size() > file_bytes_max) throw std::runtime_error("\"" + path + "\" is longer than 1 MiB");
  return text;
}

}  // namespace support
