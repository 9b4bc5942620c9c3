#include "tracer/src/plot/drawing.h"

namespace tracer::plotting {
namespace {

// All marks have about the same weight: the areas are within a fifth of the circle's 64 pixels.
constexpr Place square[] = {{-4, -4}, {4, -4}, {4, 4}, {-4, 4}};
constexpr Place diamond[] = {{0, -5.5}, {5.5, 0}, {0, 5.5}, {-5.5, 0}};
constexpr Place triangle[] = {{0, -6.2}, {5.7, 4.6}, {-5.7, 4.6}};
constexpr Place cross[] = {{-5.5, -3.2}, {-3.2, -5.5}, {0, -2.3}, {3.2, -5.5}, {5.5, -3.2}, {2.3, 0},
                           {5.5, 3.2},   {3.2, 5.5},   {0, 2.3},  {-3.2, 5.5}, {-5.5, 3.2}, {-2.3, 0}};

}  // namespace

std::span<const Place> corners(PlotMark mark) {
  switch (mark) {
    case PlotMark::none:
    case PlotMark::circle:
      return {};
    case PlotMark::square:
      return square;
    case PlotMark::diamond:
      return diamond;
    case PlotMark::triangle:
      return triangle;
    case PlotMark::cross:
      return cross;
  }
  return {};
}

}  // namespace tracer::plotting
