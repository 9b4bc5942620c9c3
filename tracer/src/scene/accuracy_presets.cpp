/// Target errors of the presets.

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

}  // namespace tracer
