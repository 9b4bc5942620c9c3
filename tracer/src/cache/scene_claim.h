#pragma once
/// What a scene has of a cache while it is compiled.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/cache/shelf.h"
#include "tracer/src/scene/trace_frame.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

/// Shapes as rays meet them, and where they lie in the world.
struct KeptGeometry {
  std::shared_ptr<const Accelerator> accelerator;
  Bounds bounds;
};

/// For the thread that compiles the scene.
class SceneClaim {
 public:
  /// `geometry`: nothing where the scene's is not to be kept.
  SceneClaim(std::shared_ptr<Shelf> shelf, std::vector<std::string> contents, std::optional<Shelf::Turn> geometry)
      : shelf_(std::move(shelf)), contents_(std::move(contents)), geometry_(std::move(geometry)) {}

  /// Of an earlier scene, or null.
  [[nodiscard]] const KeptGeometry* geometry() const;
  /// Precondition: there was none. Keeps it where that is worth while.
  void keep(const KeptGeometry& geometry);

  /// Nothing where the content of the file is not known. Fails with `cancelled`.
  Result<std::optional<Shelf::Turn>, Failure> picture(const ImageTexture& texture, const RenderControl& control);
  /// Where that is worth while.
  static void keep(Shelf::Turn turn, const std::shared_ptr<const ImageMap>& picture);

 private:
  std::shared_ptr<Shelf> shelf_;
  std::vector<std::string> contents_;
  std::optional<Shelf::Turn> geometry_;
};

}  // namespace tracer
