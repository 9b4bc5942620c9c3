#pragma once
/// A measurement for people.

#include <cstdio>

#include "tracer/measurement.h"

namespace cli {

/// A line each for reference, points (those of the front with a *) and sentences of advice.
void print_table(std::FILE* into, const tracer::Measurement& measurement);

}  // namespace cli
