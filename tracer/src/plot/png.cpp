// Rasterizes the drawing with Cairo.
#include <cairo.h>

#include <memory>

#include "tracer/src/plot/drawing.h"

namespace tracer {
namespace {

using namespace plotting;

constexpr double quarter_turn = 1.5707963267948966, whole_turn = 4 * quarter_turn;

struct Release {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Context = std::unique_ptr<cairo_t, Release>;
using Surface = std::unique_ptr<cairo_surface_t, Release>;

constexpr plotting::Color white = 0xffffff;

void use_color(cairo_t* context, plotting::Color color) {
  const auto channel = [color](unsigned shift) { return static_cast<double>(color >> shift & 0xffU) / 255; };
  cairo_set_source_rgb(context, channel(16), channel(8), channel(0));
}

void draw(cairo_t* context, const Stroke& stroke) {
  use_color(context, stroke.color);
  cairo_set_line_width(context, stroke.width);
  cairo_set_dash(context, dash, stroke.dashed ? 2 : 0, 0);
  for (const auto& line : stroke.lines) {
    cairo_new_sub_path(context);
    for (const Place& place : line) cairo_line_to(context, place.x, place.y);
  }
  cairo_stroke(context);
  cairo_set_dash(context, nullptr, 0, 0);
}

void draw(cairo_t* context, const Marker& marker) {
  cairo_new_path(context);
  if (marker.mark == PlotMark::circle) cairo_arc(context, marker.at.x, marker.at.y, circle_radius, 0, whole_turn);
  for (const Place& corner : corners(marker.mark))
    cairo_line_to(context, marker.at.x + corner.x, marker.at.y + corner.y);
  cairo_close_path(context);
  use_color(context, marker.color);
  cairo_fill_preserve(context);
  use_color(context, white);
  cairo_set_line_width(context, rim_width);
  cairo_stroke(context);
}

void draw(cairo_t* context, const Words& words) {
  if (words.text.empty()) return;
  cairo_save(context);
  cairo_select_font_face(context, font_family.data(), CAIRO_FONT_SLANT_NORMAL,
                         words.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, words.size);
  cairo_text_extents_t extents;
  cairo_text_extents(context, words.text.c_str(), &extents);
  const double start = words.anchor == Anchor::start ? 0 : words.anchor == Anchor::middle ? 0.5 : 1;
  cairo_translate(context, words.at.x, words.at.y);
  if (words.upwards) cairo_rotate(context, -quarter_turn);
  cairo_move_to(context, -start * extents.x_advance, 0);
  if (words.haloed) {
    cairo_text_path(context, words.text.c_str());
    use_color(context, white);
    cairo_set_line_width(context, halo_width);
    cairo_stroke(context);
    cairo_move_to(context, -start * extents.x_advance, 0);
  }
  use_color(context, ink);
  cairo_show_text(context, words.text.c_str());
  cairo_restore(context);
}

using Bytes = std::vector<std::uint8_t>;

/// Callback from C: must not throw.
cairo_status_t append(void* bytes, const unsigned char* piece, unsigned length) try {
  auto* all = static_cast<Bytes*>(bytes);
  all->insert(all->end(), piece, piece + length);
  return CAIRO_STATUS_SUCCESS;
} catch (const std::bad_alloc&) {
  return CAIRO_STATUS_NO_MEMORY;
}

}  // namespace

Result<Bytes, std::string> plot_png(const Plot& plot) {
  const Drawing drawing = layout(plot);
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(drawing.width),
                                                   static_cast<int>(drawing.height)));
  const Context context(cairo_create(surface.get()));
  cairo_set_line_join(context.get(), CAIRO_LINE_JOIN_ROUND);
  use_color(context.get(), white);
  cairo_paint(context.get());
  for (const Item& item : drawing.items) std::visit([&](const auto& shape) { draw(context.get(), shape); }, item);
  // Cairo stores the first error and draws nothing after it.
  cairo_status_t status = cairo_status(context.get());
  Bytes bytes;
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_write_to_png_stream(surface.get(), append, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) return std::string("plot: ") + cairo_status_to_string(status);
  return bytes;
}

}  // namespace tracer
