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

double radius_of(std::size_t object) { return object % 2 == 0 ? 1 : 0.5; }

/// Objects 0 to 6 are spheres, 7 to 9 discs.
constexpr std::uint32_t spheres = 7, objects = 10;
bool is_solid(std::uint32_t object) { return object < spheres; }

/// Spheres and discs of two sizes and three kinds of glass, two of one priority, and a disc that only filters light.
std::shared_ptr<const CompiledScene> glass_objects() {
  Scene scene = scenes::empty(1);
  const int priorities[] = {0, 1, 1};
  std::vector<MaterialId> kinds;
  for (const int priority : priorities) {
    Material glass = scenes::glass();
    glass.priority = priority;
    kinds.push_back(scenes::add(scene, glass));
  }
  for (std::size_t i = 0; i < spheres; ++i)
    scenes::add(scene, Sphere{{3.0 * static_cast<double>(i), 0, -9}, radius_of(i)}, kinds[i % 3]);
  for (const std::size_t i : {7, 8})
    scenes::add(scene, Disc{{3.0 * static_cast<double>(i), 0, -9}, {0, 0, 1}, std::sqrt(1.5) * radius_of(i), 0, {}},
                kinds[i % 3]);
  Material filter = scenes::glass();
  filter.transparency = Material::Transparency::filtered;
  scenes::add(scene, Disc{{30, 0, -9}, {0, 0, 1}, 1, 0, {}}, filter);
  return scenes::compiled(scene);
}

/// Innermost last.
struct PlainList {
  std::vector<std::uint32_t> objects;

  template <class Sought>
  bool remove_latest(const Sought& sought) {
    const auto found = std::find_if(objects.rbegin(), objects.rend(), sought);
    if (found == objects.rend()) return false;
    objects.erase(std::next(found).base());
    return true;
  }
  /// True if a surface was crossed.
  bool cross(const CompiledScene& scene, std::uint32_t object, bool back) {
    if (object == 9) return false;
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
        return std::tuple(scene.material_of(of).priority, is_solid(of), -radius_of(of), scene.objects.material[of], of);
      };
      return rank(a) < rank(b);
    });
  }
};

TEST(TheMediaOfARay, AreThoseOfAPlainListWhateverIsCrossed) {
  const auto scene = glass_objects();
  Random random(8);
  std::uint64_t hidden = 0, uncrossed = 0;
  const std::uint64_t walks = effort::cases(1'000);
  for (std::uint64_t walk = 0; walk < walks; ++walk) {
    MediumStack media(*scene);
    MediumStack::List list = MediumStack::camera(*scene);
    PlainList plain;
    for (int step = 0; step < 30; ++step) {
      const std::uint32_t object = random.below(objects), near = plain.current_medium(*scene);
      const bool back = random.chance(0.55);
      const bool crossed = plain.cross(*scene, object, back);
      const std::uint32_t far = plain.current_medium(*scene);
      const MediumStack::Crossing found = media.cross(list, object, back);
      ASSERT_EQ(found.near, near);
      ASSERT_EQ(found.far, far);
      ASSERT_EQ(found.after != list, crossed);
      const auto priority = [&](std::uint32_t of) { return scene->material_of(of).priority; };
      ASSERT_EQ(found.hidden,
                crossed && near == far && is_solid(near) && (is_solid(object) || priority(object) < priority(near)));
      ASSERT_EQ(found.unentered, !crossed && object != 9);
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
