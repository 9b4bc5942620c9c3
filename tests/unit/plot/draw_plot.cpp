// draw_plot svg|png: a plot as lines of words separated by tabs on standard input, its bytes on standard output, for
// the readers of plot_test.py.
//   title TEXT | note TEXT | size WIDTH HEIGHT | x LABEL linear|log | y LABEL linear|log
//   series NAME MARK JOIN [dashed [COLOR]] | point X Y [LABEL]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/plot.h"

namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream text(line);
  for (std::string word; std::getline(text, word, '\t');) words.push_back(word);
  words.resize(6);
  return words;
}

constexpr std::string_view marks[] = {"none", "circle", "square", "diamond", "triangle", "cross"};
constexpr std::string_view joins[] = {"none", "line", "steps", "pairs"};

/// The enumerator whose name has its place in the list.
template <class Value, std::size_t count>
Value value_of(const std::string_view (&names)[count], const std::string& name) {
  const auto found = std::find(std::begin(names), std::end(names), name);
  if (found == std::end(names)) std::exit(2);
  return static_cast<Value>(found - std::begin(names));
}

void take(const std::vector<std::string>& words, tracer::Plot& plot) {
  const std::string& kind = words[0];
  if (kind == "title") plot.title = words[1];
  if (kind == "note") plot.note = words[1];
  if (kind == "size") {
    plot.width = static_cast<std::uint32_t>(std::stoul(words[1]));
    plot.height = static_cast<std::uint32_t>(std::stoul(words[2]));
  }
  if (kind == "x") plot.x = {words[1], words[2] == "log"};
  if (kind == "y") plot.y = {words[1], words[2] == "log"};
  if (kind == "series") {
    plot.series.push_back({words[1],
                           {},
                           value_of<tracer::PlotMark>(marks, words[2]),
                           value_of<tracer::PlotJoin>(joins, words[3]),
                           !words[4].empty()});
    if (!words[5].empty()) plot.series.back().color = static_cast<std::uint32_t>(std::stoul(words[5], nullptr, 16));
  }
  if (kind == "point")
    plot.series.back().points.push_back(
        {std::strtod(words[1].c_str(), nullptr), std::strtod(words[2].c_str(), nullptr), words[3]});
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  tracer::Plot plot;
  for (std::string line; std::getline(std::cin, line);) take(words_of(line), plot);
  if (std::string_view(arguments[1]) == "svg") {
    std::cout << tracer::plot_svg(plot);
    return 0;
  }
  const auto png = tracer::plot_png(plot);
  if (!png) {
    std::cerr << png.error() << "\n";
    return 1;
  }
  return std::fwrite(png->data(), 1, png->size(), stdout) == png->size() ? 0 : 3;
}
