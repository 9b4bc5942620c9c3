// draw_plot svg|png: a plot as lines of words separated by tabs on standard input, its bytes on standard output, for
// the readers of plot_test.py.
//   title TEXT | note TEXT | size WIDTH HEIGHT | x LABEL linear|log | y LABEL linear|log
//   series NAME MARK JOIN [dashed [COLOR]] | point X Y [LABEL]
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/plot.h"

namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words(1);
  for (const char c : line) {
    if (c == '\t') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  words.resize(6);
  return words;
}

tracer::PlotMark mark_of(const std::string& name) {
  constexpr const char* names[] = {"none", "circle", "square", "diamond", "triangle", "cross"};
  for (int i = 0; i < 6; ++i)
    if (name == names[i]) return static_cast<tracer::PlotMark>(i);
  std::exit(2);
}

tracer::PlotJoin join_of(const std::string& name) {
  constexpr const char* names[] = {"none", "line", "steps", "pairs"};
  for (int i = 0; i < 4; ++i)
    if (name == names[i]) return static_cast<tracer::PlotJoin>(i);
  std::exit(2);
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
    plot.series.push_back({words[1], {}, mark_of(words[2]), join_of(words[3]), !words[4].empty()});
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
