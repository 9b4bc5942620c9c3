#pragma once
/// The files of the page, embedded in the daemon by server/web/build.py: bundled modules, style, icon and licences.

#include <span>
#include <string_view>

namespace web {

struct File {
  std::string_view name;    ///< "main.js"
  std::string_view type;    ///< Content-Type
  std::string_view sha256;  ///< SHA-256 of `raw`, 64 hexadecimal digits
  std::string_view raw;     ///< the bytes
  std::string_view gzip;    ///< `raw` compressed (RFC 1952), without a time
};

/// 16 hexadecimal digits that change with every file: a directory whose files never change.
std::string_view tree();
/// All files, sorted by name. "index.html" is the page itself and the only one outside of the tree.
std::span<const File> files();

}  // namespace web
