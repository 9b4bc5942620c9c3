#pragma once
/// A copy of a data directory from which a daemon can start, made while another one goes on with the directory itself.

#include <string>

/// Writes `into`, which must not exist yet: under another name (`into`.part), then renamed, so that it appears whole
/// and durable or not at all. The jobs are those of one moment; images and uploads are copied after it and checked
/// against their sha256, so only of a job that was removed meanwhile can an image be missing. Throws
/// queue::StoreFailure or std::filesystem::filesystem_error with what is wrong: no data, no room, a damaged file.
void back_up(const std::string& data, const std::string& into);
