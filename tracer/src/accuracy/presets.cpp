/// What a picture's accuracy is where its document leaves it open.

#include <algorithm>
#include <cmath>

#include "tracer/accuracy.h"

namespace tracer {

double target_error_of(Preset preset) {
  switch (preset) {
    case Preset::draft:
      return 4;
    case Preset::standard:
      return 1;
    case Preset::fine:
      return 0.5;
    case Preset::reference:
      break;
  }
  return 0.25;
}

double default_cutoff(double target_error, double exposure) {
  return std::min(Accuracy{}.cutoff, target_error * 1e-4 / std::exp2(std::max(0.0, exposure)));
}

}  // namespace tracer
