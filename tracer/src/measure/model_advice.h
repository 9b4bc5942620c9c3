#pragma once
/// Conclusions from the points of the parameter "model".

#include <string>
#include <vector>

#include "tracer/measurement.h"

namespace tracer {

/// Two digits, the accuracy of single runs.
std::string text_of_number(double number);

/// The distance of each model from the rendering equation, the causes of Whitted's, or the refusal of the model. Empty
/// if models were not measured.
std::vector<std::string> model_advice(const Measurement& measurement);

/// Seconds against total error: the front of each model, and its points with upper limits.
std::vector<PlotSeries> model_series(const Measurement& measurement);

}  // namespace tracer
