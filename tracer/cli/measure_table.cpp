#include "tracer/cli/measure_table.h"

#include <algorithm>
#include <cinttypes>
#include <vector>

namespace cli {

void print_table(std::FILE* into, const tracer::Measurement& measurement) {
  std::fprintf(into, "image    %" PRIu32 " x %" PRIu32 "\n", measurement.width, measurement.height);
  std::fprintf(into, "reference  %" PRIu32 " samples a pixel, standard error %.4f levels\n",
               measurement.reference_samples, measurement.reference_error);
  std::fprintf(into, "\n  %-34s %9s %9s %9s %9s\n", "setting (* nothing is better)", "seconds", "error", "claimed",
               "samples");
  const std::vector<std::size_t> front = tracer::pareto_front(measurement.points);
  for (std::size_t i = 0; i < measurement.points.size(); ++i) {
    const tracer::MeasuredPoint& point = measurement.points[i];
    const bool in_front = std::find(front.begin(), front.end(), i) != front.end();
    std::fprintf(into, "%c %-34s %9.4f %9.4f %9.4f %9.2f\n", in_front ? '*' : ' ', title(point.setting).c_str(),
                 point.seconds, point.error, point.claimed.estimate, point.samples_mean);
  }
  std::fprintf(into, "\n");
  for (const std::string& sentence : tracer::advice(measurement)) std::fprintf(into, "- %s\n", sentence.c_str());
}

}  // namespace cli
