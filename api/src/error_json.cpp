#include "api/src/error_json.h"

namespace api {

using Json = nlohmann::ordered_json;

Json error_json(const tracer::ErrorEstimate& error) {
  return {{"estimate", error.estimate},
          {"confidence", error.confidence},
          {"target", error.target ? Json(*error.target) : Json(nullptr)},
          {"met", error.target_met},
          {"bounded", error.bounded},
          {"parts",
           {{"sampling", error.sampling},
            {"depth", error.depth},
            {"cutoff", error.cutoff},
            {"approximation", error.approximation}}}};
}

tracer::ErrorEstimate error_of_json(const Json& json) {
  tracer::ErrorEstimate error;
  json.at("estimate").get_to(error.estimate);
  json.at("confidence").get_to(error.confidence);
  if (!json.at("target").is_null()) error.target = json.at("target").get<double>();
  json.at("met").get_to(error.target_met);
  json.at("bounded").get_to(error.bounded);
  const Json& parts = json.at("parts");
  parts.at("sampling").get_to(error.sampling);
  parts.at("depth").get_to(error.depth);
  parts.at("cutoff").get_to(error.cutoff);
  parts.at("approximation").get_to(error.approximation);
  return error;
}

Json rays_json(const tracer::RayCounts& rays) {
  return {{"camera", rays.camera},
          {"shadow", rays.shadow},
          {"reflection", rays.reflection},
          {"refraction", rays.refraction}};
}

tracer::RayCounts rays_of_json(const Json& json) {
  tracer::RayCounts rays;
  json.at("camera").get_to(rays.camera);
  json.at("shadow").get_to(rays.shadow);
  json.at("reflection").get_to(rays.reflection);
  json.at("refraction").get_to(rays.refraction);
  return rays;
}

}  // namespace api
