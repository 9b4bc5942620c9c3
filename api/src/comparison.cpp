#include "api/comparison.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace api {
namespace {

using Json = nlohmann::ordered_json;

Json worst_json(const std::vector<tracer::PixelDifference>& worst) {
  Json list = Json::array();
  for (const tracer::PixelDifference& pixel : worst) {
    list.push_back({{"x", pixel.x}, {"y", pixel.y}, {"difference", pixel.difference}, {"a", pixel.a}, {"b", pixel.b}});
  }
  return list;
}

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

}  // namespace

std::string write_comparison(const tracer::Comparison& comparison, const ComparedAs& how) {
  const std::optional<double>& tolerance = how.tolerance;
  const bool equal = std::isinf(comparison.psnr_db);
  const Json json{{"formats", how.formats},
                  {"width", comparison.width},
                  {"height", comparison.height},
                  {"rmse", comparison.rmse},
                  {"rmse_channel", comparison.rmse_channel},
                  {"bias", comparison.bias},
                  {"greatest", comparison.greatest},
                  {"psnr_db", equal ? Json(nullptr) : Json(comparison.psnr_db)},
                  {"ssim", or_null(comparison.ssim)},
                  {"differing", comparison.differing},
                  {"worst", worst_json(comparison.worst)},
                  {"tolerance", or_null(tolerance)},
                  {"within_tolerance", tolerance ? Json(comparison.rmse <= *tolerance) : Json(nullptr)},
                  {"heat_white", or_null(how.heat_white)}};
  return json.dump() + '\n';
}

}  // namespace api
