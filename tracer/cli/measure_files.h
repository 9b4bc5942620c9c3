#pragma once
/// The files of `whittle measure`: results, and the state from which an interrupted measurement resumes.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/assets.h"
#include "tracer/cli/files.h"
#include "tracer/cli/options.h"
#include "tracer/measure.h"

namespace cli {

/// SHA-256 of document, assets, build and every option that changes the result of a point, including the number of
/// threads, in hexadecimal.
std::string fingerprint(std::string_view document, const tracer::Assets& assets, const MeasureOptions& options);

/// State of an interrupted run.
struct SavedMeasurement {
  std::vector<tracer::MeasuredPoint> points;
  std::optional<tracer::Reference> reference;
  bool has_other_key = false;  ///< one exists for another scene, size or build; it will be replaced
};

/// Reads `name`.json and `name`.reference. Fails if one of them exists and cannot be read, or if `name`.json is not a
/// measurement, so that no other file is overwritten.
tracer::Result<SavedMeasurement, FileError> read_saved_measurement(const std::string& name, const std::string& key);

/// Writes `name`.reference: one line of text, then the sums as doubles in native byte order.
FileResult write_reference(const std::string& name, const std::string& key, const tracer::Reference& reference);
/// Writes `name`.json.
FileResult write_points(const std::string& name, const std::string& key, const tracer::Measurement& measurement,
                        bool complete);
/// Writes `name`.csv, .svg and .png: all or none.
FileResult write_results(const std::string& name, const tracer::Measurement& measurement);

}  // namespace cli
