// Random scenes: grounds, polygons, wires and views with a closed form, and solids on a floor.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;

Canvas random_canvas(Random& random, Canvas largest) {
  constexpr double smallest = 64;
  const auto side = [&](std::uint32_t limit) {
    return static_cast<std::uint32_t>(std::lround(random.spread(smallest, std::max<double>(limit, smallest))));
  };
  return {side(largest.width), side(largest.height)};
}

Polygon random_polygon(Random& random, const Vec2& place, double size) {
  const double angle = random.in(0, std::numbers::pi);
  switch (random.below(3)) {
    case 0:
      return rectangle(place, size, size, angle);
    case 1:
      return rectangle(place, size, size * random.spread(0.01, 1), angle);
    default:
      return disc(place, size / 2, 3 + static_cast<int>(random.below(30)));
  }
}

FlatScene random_ground(Canvas canvas, Random& random) {
  if (random.chance(0.3)) return FlatScene(canvas, random.color(), random.color());
  return FlatScene(canvas, random.color(), static_cast<FlatScene::View>(random.below(3)));
}

CorpusScene flat(Canvas canvas, Random& random) {
  FlatScene result = random_ground(canvas, random);
  const double largest = random.spread(0.1, 0.3 * canvas.height), brightest = random.chance(0.15) ? 20 : 1;
  const int count = 1 + static_cast<int>(random.spread(1, 40));
  for (const Vec2& place : random_places(canvas, random, count, 1.5 * largest + 1)) {
    const Color color = random.color();
    const double factor = random.in(0.2, brightest);
    result.add(random_polygon(random, place, largest * random.spread(0.1, 1)),
               {factor * color.r, factor * color.g, factor * color.b});
  }
  Output& output = result.scene().output;
  if (random.chance(0.1)) output.overflow = Output::Overflow::scale;
  if (random.chance(0.1)) output.overflow = Output::Overflow::reinhard;
  if (random.chance(0.3)) output.exposure = random.in(-1, 2);
  return finished(result);
}

}  // namespace

GrammarScene grammar_scene(std::uint64_t seed, Canvas largest) {
  Random random(seed);
  const bool closed_form = random.chance(0.75);
  const Canvas canvas = random_canvas(random, largest);
  return {canvas, closed_form ? flat(canvas, random) : random_solids(canvas, random)};
}

}  // namespace error_coverage
