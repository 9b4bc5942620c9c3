#pragma once
/// The result of validating a scene document as JSON text, one line. Invalid UTF-8 is replaced by U+FFFD.

#include <optional>
#include <string>
#include <vector>

#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// {valid: true, errors: [], requirements, reasons, estimate{samples, seconds, memory_bytes}}. `samples` is the total
/// over all pixels; with adaptive sampling, the minimum. `seconds` is estimated_work (api/estimate.h) times
/// `seconds_per_work`, at most the time budget; null if neither is known. Precondition: tracer::validate accepts
/// `scene`.
std::string write_valid(const tracer::Scene& scene, std::optional<double> seconds_per_work);

/// {valid: false, errors: [{pointer, code, detail}], requirements: null, reasons: null, estimate: null}
std::string write_invalid(const std::vector<tracer::Issue>& errors);

/// A JSON pointer as a URI fragment (RFC 6901, section 6): characters that RFC 3986 excludes are percent-encoded.
std::string uri_fragment(const std::string& pointer);

/// `document` with `format` appended to its output.formats, otherwise unchanged.
/// Precondition: parse_scene accepts it.
std::string with_format(const std::string& document, tracer::Format format);

}  // namespace api
