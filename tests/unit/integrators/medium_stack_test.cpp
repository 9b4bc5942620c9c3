// Stacks of enclosing solids, against plain lists.
#include "tracer/src/compiled/medium_stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tracer {
namespace {

using oracle::Random;

double radius_of(std::size_t sphere) { return sphere % 2 == 0 ? 1 : 0.5; }

/// Seven spheres of two sizes and three kinds of glass, two of one priority.
std::shared_ptr<const CompiledScene> spheres() {
  Scene scene = scenes::empty(1);
  const int priorities[] = {0, 1, 1};
  std::vector<MaterialId> kinds;
  for (const int priority : priorities) {
    Material glass = scenes::glass();
    glass.priority = priority;
    kinds.push_back(scenes::add(scene, glass));
  }
  for (std::size_t i = 0; i < 7; ++i)
    scenes::add(scene, Sphere{{3.0 * static_cast<double>(i), 0, -9}, radius_of(i)}, kinds[i % 3]);
  RenderControl control;
  return *compile(scene, control);
}

/// Innermost last.
struct PlainList {
  std::vector<std::uint32_t> objects;

  bool remove_latest(const std::function<bool(std::uint32_t)>& sought) {
    for (std::size_t i = objects.size(); i-- > 0;) {
      if (!sought(objects[i])) continue;
      objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(i));
      return true;
    }
    return false;
  }
  /// True if a surface was crossed.
  bool cross(const CompiledScene& scene, std::uint32_t object, bool back) {
    if (!back) {
      objects.push_back(object);
      return true;
    }
    const auto itself = [&](std::uint32_t other) { return other == object; };
    const auto alike = [&](std::uint32_t other) {
      return scene.objects.material[other] == scene.objects.material[object];
    };
    return remove_latest(itself) || remove_latest(alike);
  }
  [[nodiscard]] std::uint32_t current_medium(const CompiledScene& scene) const {
    if (objects.empty()) return MediumStack::nothing;
    return *std::max_element(objects.begin(), objects.end(), [&](std::uint32_t a, std::uint32_t b) {
      const auto rank = [&](std::uint32_t of) {
        return std::tuple(scene.material_of(of).priority, -radius_of(of), scene.objects.material[of], of);
      };
      return rank(a) < rank(b);
    });
  }
};

TEST(TheMediaOfARay, AreThoseOfAPlainListWhateverIsCrossed) {
  const auto scene = spheres();
  Random random(8);
  std::uint64_t hidden = 0, uncrossed = 0;
  const std::uint64_t walks = effort::cases(1'000);
  for (std::uint64_t walk = 0; walk < walks; ++walk) {
    MediumStack media(*scene);
    MediumStack::List list = MediumStack::camera(*scene);
    PlainList plain;
    for (int step = 0; step < 30; ++step) {
      const std::uint32_t object = random.below(7), near = plain.current_medium(*scene);
      const bool back = random.chance(0.55);
      const bool crossed = plain.cross(*scene, object, back);
      const std::uint32_t far = plain.current_medium(*scene);
      const MediumStack::Crossing found = media.cross(list, object, back);
      ASSERT_EQ(found.near, near);
      ASSERT_EQ(found.far, far);
      ASSERT_EQ(found.after != list, crossed);
      ASSERT_EQ(found.hidden, crossed && near == far);
      ASSERT_EQ(media.current_medium(found.after), far);
      ASSERT_EQ(found.after == MediumStack::outside, plain.objects.empty());
      hidden += found.hidden ? 1 : 0;
      uncrossed += crossed ? 0 : 1;
      list = found.after;
    }
  }
  EXPECT_GT(hidden, walks);
  EXPECT_GT(uncrossed, walks);
}

}  // namespace
}  // namespace tracer
