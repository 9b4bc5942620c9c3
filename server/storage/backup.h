#pragma once
/// A copy of a data directory that a daemon can start from, made while another daemon uses the directory.

#include <string>

namespace storage {

/// Writes `into`, which must not exist: first as `into`.part, then renamed, so that it appears whole and durable or not
/// at all. The jobs are those of one moment; images and uploads are copied after it and checked against their sha256.
/// Throws queue::StoreFailure or std::filesystem::filesystem_error with the reason: no data, no space, a damaged or
/// missing file.
void back_up(const std::string& data, const std::string& into);

}  // namespace storage
