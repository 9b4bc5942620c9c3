#include "api/comparison.h"

#include "api/src/result_json.h"

namespace api {
namespace {

Json worst_json(const std::vector<tracer::PixelDifference>& worst) {
  Json list = Json::array();
  for (const tracer::PixelDifference& pixel : worst)
    list.push_back({{"x", pixel.x}, {"y", pixel.y}, {"difference", pixel.difference}, {"a", pixel.a}, {"b", pixel.b}});
  return list;
}

}  // namespace

std::string write_comparison(const tracer::Comparison& comparison, const ComparisonInfo& info) {
  const std::optional<double>& tolerance = info.tolerance;
  const Json json{{"formats", info.formats},
                  {"width", comparison.width},
                  {"height", comparison.height},
                  {"rmse", comparison.rmse},
                  {"rmse_channel", comparison.rmse_channel},
                  {"bias", comparison.bias},
                  {"greatest", comparison.greatest},
                  {"psnr_db", comparison.psnr_db},
                  {"ssim", or_null(comparison.ssim)},
                  {"differing", comparison.differing},
                  {"worst", worst_json(comparison.worst)},
                  {"tolerance", or_null(tolerance)},
                  {"within_tolerance", tolerance ? Json(comparison.rmse <= *tolerance) : Json(nullptr)},
                  {"heat_white", or_null(info.heat_white)}};
  return json.dump() + '\n';
}

}  // namespace api
