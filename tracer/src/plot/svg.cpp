// Writes SVG 1.1 (second edition) with the `href` of SVG 2.
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "tracer/src/plot/drawing.h"

namespace tracer {
namespace {

using namespace plotting;

/// Rounded to hundredths of a pixel, without trailing zeros.
std::string number(double value) {
  std::array<char, 32> digits{};
  const double rounded = static_cast<double>(std::llround(value * 100)) / 100;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), rounded).ptr};
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    const std::string_view entity = c == '&'   ? "&amp;"
                                    : c == '<' ? "&lt;"
                                    : c == '>' ? "&gt;"
                                    : c == '"' ? "&quot;"
                                               : "";
    entity.empty() ? safe.push_back(c) : void(safe.append(entity));
  }
  return safe;
}

std::string hex(plotting::Color color) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "#%06x", color & 0xffffffU);
  return text.data();
}

std::string attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "=\"" + value + "\"";
}

std::string path(std::span<const Place> places) {
  std::string text;
  for (const Place& place : places) text += (text.empty() ? "M" : "L") + number(place.x) + " " + number(place.y);
  return text;
}

std::string id_of(PlotMark mark) {
  constexpr const char* names[] = {"none", "circle", "square", "diamond", "triangle", "cross"};
  return std::string("plot-") + names[static_cast<std::size_t>(mark)];
}

/// Defines each mark shape once. The prefix avoids conflicts with ids of a page that embeds the plot.
std::string definitions() {
  std::string text = "<defs>\n";
  for (const PlotMark mark :
       {PlotMark::circle, PlotMark::square, PlotMark::diamond, PlotMark::triangle, PlotMark::cross}) {
    const std::string id = attribute("id", id_of(mark));
    text += mark == PlotMark::circle ? "<circle" + id + attribute("r", number(circle_radius))
                                     : "<path" + id + attribute("d", path(corners(mark)) + "Z");
    text += attribute("stroke", "#fff") + attribute("stroke-width", number(rim_width)) + "/>\n";
  }
  return text + "</defs>\n";
}

std::string element(const Stroke& stroke) {
  std::string data;
  for (const auto& line : stroke.lines) data += path(line);
  if (data.empty()) return "";
  std::string text =
      "<path" + attribute("d", data) + attribute("fill", "none") + attribute("stroke", hex(stroke.color));
  text += attribute("stroke-width", number(stroke.width)) + attribute("stroke-linejoin", "round");
  if (stroke.dashed) text += attribute("stroke-dasharray", number(dash[0]) + " " + number(dash[1]));
  return text + "/>\n";
}

std::string element(const Marker& marker) {
  const std::string text = "<use" + attribute("href", "#" + id_of(marker.mark)) + attribute("x", number(marker.at.x)) +
                           attribute("y", number(marker.at.y)) + attribute("fill", hex(marker.color));
  return marker.hint.empty() ? text + "/>\n" : text + "><title>" + escaped(marker.hint) + "</title></use>\n";
}

std::string element(const Words& words) {
  if (words.text.empty()) return "";
  const std::string x = number(words.at.x), y = number(words.at.y);
  std::string placed = attribute("x", x) + attribute("y", y) + attribute("font-size", number(words.size));
  if (words.anchor != Anchor::start)
    placed += attribute("text-anchor", words.anchor == Anchor::middle ? "middle" : "end");
  if (words.bold) placed += attribute("font-weight", "bold");
  if (words.upwards) placed += attribute("transform", "rotate(-90 " + x + " " + y + ")");
  const std::string end = ">" + escaped(words.text) + "</text>\n";
  if (!words.haloed) return "<text" + placed + end;
  // A separate element, because not every viewer supports `paint-order`; hidden from screen readers.
  return "<text aria-hidden=\"true\" stroke=\"#fff\" stroke-linejoin=\"round\"" +
         attribute("stroke-width", number(halo_width)) + placed + end + "<text" + placed + end;
}

}  // namespace

std::string plot_svg(const Plot& plot) {
  const Drawing drawing = layout(plot);
  const std::string width = std::to_string(drawing.width), height = std::to_string(drawing.height);
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("width", width) +
                     attribute("height", height) + attribute("viewBox", "0 0 " + width + " " + height) +
                     attribute("role", "img") + attribute("aria-labelledby", "plot-title plot-desc") +
                     attribute("font-family", "'" + std::string(font_family) + "', Verdana, sans-serif") +
                     attribute("fill", hex(ink)) + ">\n";
  text += "<title id=\"plot-title\">" + escaped(drawing.title) + "</title>\n";
  text += "<desc id=\"plot-desc\">" + escaped(drawing.description) + "</desc>\n";
  text += definitions();
  text += "<rect" + attribute("width", width) + attribute("height", height) + attribute("fill", "#fff") + "/>\n";
  for (const Item& item : drawing.items) text += std::visit([](const auto& shape) { return element(shape); }, item);
  return text + "</svg>\n";
}

}  // namespace tracer
