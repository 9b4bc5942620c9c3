#pragma once
/// Small scenes in which an estimate of error is easily wrong, and at least one for each feature of the scene document.

#include <string>
#include <string_view>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/assets.h"

namespace honesty {

/// A scene of some 2000 pixels; what it asks of `accuracy` is for the caller to fill in.
struct Case {
  std::string name;       ///< as on the command line: "wide_penumbra"
  std::string exercises;  ///< what it has that others have not
  tracer::Scene scene;
  tracer::Assets assets{};
};

/// All of them, always in the same order.
const std::vector<Case>& corpus();
/// Null: there is none of that name.
const Case* find(std::string_view name);

/// What the scenes of each file add, in order. The camera of a new one stands at (0, 1.5, 6), looks at (0, 0.5, 0) and
/// sees 40 degrees; the background is a dull blue.
std::vector<Case> shape_cases();
std::vector<Case> light_cases();
std::vector<Case> material_cases();
std::vector<Case> texture_cases();
std::vector<Case> view_cases();
std::vector<Case> trap_cases();

/// The parts that many have.
Case fresh(std::string name, std::string exercises);
/// A white floor at y = 0 and a point light above, to the left of the camera.
Case lit(std::string name, std::string exercises);
tracer::Light light_of(const tracer::LightSource& source, double intensity = 1);
tracer::Material phong(const tracer::Color& color, double specular, double shininess);
tracer::Material textured(tracer::Scene& scene, const tracer::Texture& texture);
tracer::Texture checker(double scale);
tracer::Transform turned(double degrees, const tracer::Vec3& to, double scale = 1);  ///< about y, then moved

}  // namespace honesty
