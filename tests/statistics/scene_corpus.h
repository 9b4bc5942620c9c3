#pragma once
/// Small scenes whose error is difficult to estimate, with at least one for each feature of the scene document.

#include <string>
#include <string_view>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/scene.h"

namespace statistics {

/// A scene of about 2000 pixels. The caller sets `accuracy`.
struct Case {
  std::string name;       ///< as on the command line: "wide_penumbra"
  std::string exercises;  ///< the feature that distinguishes it
  tracer::Scene scene;
  tracer::Assets assets{};
};

/// All cases, always in the same order.
const std::vector<Case>& corpus();
/// Returns null if no case has that name.
const Case* find(std::string_view name);

/// Cases of each file, in order.
std::vector<Case> shape_cases();
std::vector<Case> light_cases();
std::vector<Case> material_cases();
std::vector<Case> texture_cases();
std::vector<Case> view_cases();
std::vector<Case> subpixel_cases();

/// A case without objects: camera at (0, 1.5, 6) towards (0, 0.5, 0) with a field of view of 40 degrees, blue
/// background.
Case empty_case(std::string name, std::string exercises);
/// A white floor at y = 0 and a point light above, to the left of the camera.
Case lit_floor_case(std::string name, std::string exercises);
tracer::Light light_of(const tracer::LightSource& source, double intensity = 1);
tracer::Material phong(const tracer::Color& color, double specular, double shininess);
tracer::Material textured(tracer::Scene& scene, const tracer::Texture& texture);
tracer::Texture checker(double scale);
tracer::Transform turned(double degrees, const tracer::Vec3& to, double scale = 1);  ///< about y, then moved

}  // namespace statistics
