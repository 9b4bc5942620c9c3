#pragma once
/// Conclusions from the points of the parameter "model".

#include <string>
#include <vector>

#include "tracer/measurement.h"

namespace tracer {

/// Two digits, the accuracy of single runs.
std::string text_of_number(double number);
inline std::string levels_text(double error) { return text_of_number(error) + " levels"; }

/// Relative; smaller differences of errors or times occur by chance and are not worth a sentence.
inline constexpr double significant = 0.05;

/// The distance of each model from the rendering equation, the causes of Whitted's, or the refusal of the model. Empty
/// if models were not measured.
std::vector<std::string> model_advice(const Measurement& measurement);

/// Seconds against total error: the front of each model, and its points with upper limits.
std::vector<PlotSeries> model_series(const Measurement& measurement);

}  // namespace tracer
