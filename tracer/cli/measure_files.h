#pragma once
/// The files of `whittle measure`: what it came to, and what it goes on from.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/assets.h"
#include "tracer/cli/files.h"
#include "tracer/cli/measure_options.h"
#include "tracer/measure.h"

namespace cli {

/// Equal for equal document, files, build and everything that changes a point's figures, the threads included; else
/// different, but for chance (FNV-1a, 64 bits: Fowler, Noll and Vo 1991). Hexadecimal.
std::string fingerprint(std::string_view document, const tracer::Assets& assets, const MeasureOptions& options);

/// What an earlier run left.
struct Earlier {
  std::vector<tracer::MeasuredPoint> points;
  std::optional<tracer::Reference> reference;
  bool is_other = false;  ///< there is one, of another scene, size or build: it will be replaced
};

/// Of `name`.json and `name`.reference. Fails where they cannot be read, or `name`.json is something else, which would
/// be lost.
tracer::Result<Earlier, FileFailure> read_earlier(const std::string& name, const std::string& key);

/// `name`.reference: one line of text, then the sums as this machine holds doubles.
Done write_reference(const std::string& name, const std::string& key, const tracer::Reference& reference);
/// `name`.json.
Done write_points(const std::string& name, const std::string& key, const tracer::Measurement& measurement,
                  bool complete);
/// `name`.csv, .svg and .png: all or none of them.
Done write_results(const std::string& name, const tracer::Measurement& measurement);

}  // namespace cli
