#include <algorithm>
#include <utility>

#include "tracer/src/plot/drawing.h"
#include "tracer/src/plot/scale.h"
#include "tracer/src/plot/text.h"
#include "tracer/validate.h"

namespace tracer::plotting {
namespace {

constexpr double edge = 18;  // margin
constexpr double title_size = 19, label_size = 15, tick_size = 13, legend_size = 14, note_size = 13;
constexpr double legend_sample = 34, legend_gap = 26, legend_row = 22;
constexpr Color frame = 0x666666, grid = 0xd0d0d0, fine_grid = 0xececec;

// Okabe and Ito 2008, without yellow, which is illegible on white.
constexpr Color palette[] = {0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0x000000, 0xe69f00, 0x56b4e9};

Color color_of(const Plot& plot, std::size_t index) {
  const auto has_none = [](const PlotSeries& series) { return !series.color; };
  const auto earlier = std::count_if(plot.series.begin(), plot.series.begin() + index, has_none);
  return plot.series[index].color.value_or(palette[earlier % std::size(palette)]) & 0xffffffU;
}

// ---- labels of points ----------------------------------------------------------------------------------------------

struct Bounds {
  double left = 0, top = 0, right = 0, bottom = 0;
};

struct PointToLabel {
  Place at;
  bool marked = true;   ///< no label may cover it
  std::string label{};  ///< empty: none
};

constexpr double point_label_size = 12, aside = 4, mark_reach = 6;
constexpr double ascent = 0.8 * point_label_size, descent = 0.25 * point_label_size;
constexpr double above = -mark_reach - descent - 1, below = mark_reach + ascent + 1;

bool overlap(const Bounds& a, const Bounds& b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

bool within(const Bounds& inner, const Bounds& outer) {
  return inner.left >= outer.left && inner.right <= outer.right && inner.top >= outer.top &&
         inner.bottom <= outer.bottom;
}

struct Try {
  Place offset;
  Anchor anchor;
};
// Diagonal positions only: lines often leave horizontally or vertically.
constexpr std::array<Try, 4> tries{{{{aside, above}, Anchor::start},
                                    {{-aside, below}, Anchor::end},
                                    {{aside, below}, Anchor::start},
                                    {{-aside, above}, Anchor::end}}};

Bounds box_of(const Words& words) {
  const double width = text_width(words.text, point_label_size);
  const double start = words.anchor == Anchor::start ? 0 : -width;
  const double left = words.at.x + start;
  return {left, words.at.y - ascent, left + width, words.at.y + descent};
}

/// Greedy placement in order: above and right of the point, else in one of the three other corners, within `inside`. A
/// label that would cover a mark or an earlier label in all four is omitted.
std::vector<Words> point_labels(const std::vector<PointToLabel>& points, const Bounds& inside) {
  std::vector<Bounds> taken;
  for (const PointToLabel& point : points) {
    const auto& [x, y] = point.at;
    if (point.marked) taken.push_back({x - mark_reach, y - mark_reach, x + mark_reach, y + mark_reach});
  }
  std::vector<Words> placed;
  for (const PointToLabel& point : points) {
    if (point.label.empty()) continue;
    for (const Try& attempt : tries) {
      const Place at{point.at.x + attempt.offset.x, point.at.y + attempt.offset.y};
      Words words{.at = at, .text = point.label, .size = point_label_size, .anchor = attempt.anchor, .haloed = true};
      const Bounds box = box_of(words);
      const bool free =
          within(box, inside) && std::ranges::none_of(taken, [&](const Bounds& other) { return overlap(box, other); });
      if (!free) continue;
      taken.push_back(box);
      placed.push_back(std::move(words));
      break;
    }
  }
  return placed;
}

// ---- layout --------------------------------------------------------------------------------------------------------

class Layout {
 public:
  explicit Layout(const Plot& plot) : plot_(plot) {
    drawing_.width = std::clamp(plot.width, 320U, 8192U);
    drawing_.height = std::clamp(plot.height, 240U, 8192U);
    right_ = drawing_.width - edge;
    gather_points();
  }

  Drawing drawing() {
    title();
    legend();
    note();
    axes();
    for (std::size_t i = 0; i < drawable_.size(); ++i) joined(i);
    for (std::size_t i = 0; i < drawable_.size(); ++i) marks(i);
    for (Words& label : point_labels(labelled_, {left_, top_, right_, bottom_})) drawing_.items.emplace_back(label);
    describe();
    return std::move(drawing_);
  }

 private:
  [[nodiscard]] bool can_show(const PlotPoint& point) const {
    return plotting::can_show(point.x, plot_.x.logarithmic) && plotting::can_show(point.y, plot_.y.logarithmic);
  }

  void gather_points() {
    std::vector<double> xs, ys;
    for (const PlotSeries& series : plot_.series) {
      std::vector<PlotPoint>& kept = drawable_.emplace_back();
      for (const PlotPoint& point : series.points) {
        if (!can_show(point)) continue;
        kept.push_back(point);
        xs.push_back(point.x);
        ys.push_back(point.y);
      }
      left_out_ += series.points.size() - kept.size();
    }
    x_ = covering(xs, plot_.x.logarithmic);
    y_ = covering(ys, plot_.y.logarithmic);
  }

  void write(Place at, const std::string& text, double size, Anchor anchor, bool bold = false) {
    drawing_.items.emplace_back(Words{.at = at, .text = text, .size = size, .anchor = anchor, .bold = bold});
  }

  void title() {
    drawing_.title = drawable(plot_.title);
    top_ = edge;
    if (drawing_.title.empty()) return;
    top_ += title_size;
    write({edge, top_ - 3}, cut(drawing_.title, title_size, right_ - edge), title_size, Anchor::start, true);
    top_ += 8;
  }

  /// Places the legend from left to right in rows, within the upper third.
  void legend() {
    double x = edge;
    bool any = false;
    for (std::size_t i = 0; i < plot_.series.size(); ++i) {
      const PlotSeries& series = plot_.series[i];
      if (series.name.empty()) continue;
      const std::string name = cut(drawable(series.name), legend_size, right_ - edge - legend_sample);
      const double width = legend_sample + text_width(name, legend_size);
      if (!any || x + width > right_) {
        if (top_ + legend_row > drawing_.height / 3.0) break;
        x = edge;
        top_ += legend_row;
        any = true;
      }
      const double middle = top_ - 9;
      if (series.join != PlotJoin::none) stroke({{{x, middle}, {x + legend_sample - 8, middle}}}, i);
      if (series.mark != PlotMark::none)
        drawing_.items.emplace_back(Marker{{x + (legend_sample - 8) / 2, middle}, series.mark, color_of(plot_, i)});
      write({x + legend_sample, middle + 5}, name, legend_size, Anchor::start);
      x += width + legend_gap;
    }
    top_ += 10;
  }

  /// Places the note, with the number of omitted points, from the bottom upwards; then the label of the x axis.
  void note() {
    bottom_ = drawing_.height - edge;
    std::string text = drawable(plot_.note);
    if (left_out_ > 0) {
      text += text.empty() ? "Not shown: " : " Not shown: ";
      text += std::to_string(left_out_);
      text += left_out_ == 1 ? " point that has" : " points that have";
      text += " no place on these axes.";
    }
    constexpr double line_height = note_size + 5;
    const int lines_max = std::max(3, static_cast<int>(drawing_.height / 3.0 / line_height));
    const auto lines = wrapped(text, note_size, right_ - edge, lines_max);
    for (std::size_t i = lines.size(); i-- > 0; bottom_ -= line_height)
      write({edge, bottom_}, lines[i], note_size, Anchor::start);
    if (!lines.empty()) bottom_ -= 6;
  }

  void axes() {
    const std::string x_label = drawable(plot_.x.label), y_label = drawable(plot_.y.label);
    const double x_label_at = bottom_;
    if (!x_label.empty()) bottom_ -= label_size + 10;
    bottom_ -= tick_size + 8;
    y_.from = bottom_;
    y_.to = top_;
    const Ticks y_ticks = ticks(y_, [](const std::string&) { return 2.2 * tick_size; });
    double widest = 0;
    for (const Tick& tick : y_ticks.labelled) widest = std::max(widest, text_width(tick.text(), tick_size));
    left_ = edge + (y_label.empty() ? 0 : label_size + 10) + widest + 8;
    x_.from = left_;
    x_.to = right_;
    const Ticks x_ticks =
        ticks(x_, [](const std::string& text) { return std::max(50.0, text_width(text, tick_size) + 14); });
    draw_grid(x_ticks, y_ticks);
    const Place middle{(left_ + right_) / 2, (top_ + bottom_) / 2};
    write({middle.x, x_label_at}, cut(x_label, label_size, right_ - left_), label_size, Anchor::middle);
    drawing_.items.emplace_back(Words{.at = {edge + label_size - 3, middle.y},
                                      .text = cut(y_label, label_size, bottom_ - top_),
                                      .size = label_size,
                                      .anchor = Anchor::middle,
                                      .upwards = true});
  }

  void draw_grid(const Ticks& x_ticks, const Ticks& y_ticks) {
    Stroke fine{.lines = {}, .color = fine_grid}, main{.lines = {}, .color = grid};
    for (const double value : x_ticks.minor) fine.lines.push_back(across_x(value));
    for (const double value : y_ticks.minor) fine.lines.push_back(across_y(value));
    for (const Tick& tick : x_ticks.labelled) main.lines.push_back(across_x(tick.value()));
    for (const Tick& tick : y_ticks.labelled) main.lines.push_back(across_y(tick.value()));
    const Stroke axis_lines{.lines = {{{left_, top_}, {left_, bottom_}, {right_, bottom_}}}, .color = frame};
    for (const Stroke& lines : {fine, main, axis_lines}) drawing_.items.emplace_back(lines);
    for (const Tick& tick : x_ticks.labelled)
      write({x_.place(tick.value()), bottom_ + tick_size + 6}, tick.text(), tick_size, Anchor::middle);
    for (const Tick& tick : y_ticks.labelled)
      write({left_ - 8, y_.place(tick.value()) + 0.36 * tick_size}, tick.text(), tick_size, Anchor::end);
  }

  [[nodiscard]] std::vector<Place> across_x(double value) const {
    const double x = x_.place(value);
    return {{x, top_}, {x, bottom_}};
  }
  [[nodiscard]] std::vector<Place> across_y(double value) const {
    const double y = y_.place(value);
    return {{left_, y}, {right_, y}};
  }
  [[nodiscard]] Place place(const PlotPoint& point) const { return {x_.place(point.x), y_.place(point.y)}; }

  void stroke(std::vector<std::vector<Place>> lines, std::size_t index) {
    drawing_.items.emplace_back(Stroke{std::move(lines), color_of(plot_, index), 2, plot_.series[index].dashed});
  }

  void joined(std::size_t index) {
    const std::vector<PlotPoint>& points = plot_.series[index].points;
    const PlotJoin join = plot_.series[index].join;
    std::vector<std::vector<Place>> lines(1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (join == PlotJoin::pairs && i % 2 == 0) lines.emplace_back();
      if (!can_show(points[i])) continue;
      const Place next = place(points[i]);
      std::vector<Place>& line = lines.back();
      if (join == PlotJoin::steps && !line.empty()) line.push_back({next.x, line.back().y});
      line.push_back(next);
    }
    std::erase_if(lines, [](const std::vector<Place>& line) { return line.size() < 2; });
    if (join != PlotJoin::none && !lines.empty()) stroke(std::move(lines), index);
  }

  void marks(std::size_t index) {
    const PlotSeries& series = plot_.series[index];
    for (const PlotPoint& point : drawable_[index]) {
      const std::string label = drawable(point.label);
      labelled_.push_back({place(point), series.mark != PlotMark::none, label});
      if (series.mark == PlotMark::none) continue;
      std::string hint = label.empty() ? drawable(series.name) : label;
      hint += (hint.empty() ? "" : ": ") + text_of(point.x, 4) + ", " + text_of(point.y, 4);
      drawing_.items.emplace_back(Marker{place(point), series.mark, color_of(plot_, index), std::move(hint)});
    }
  }

  void describe() {
    std::string& text = drawing_.description;
    text = drawable(plot_.y.label) + " over " + drawable(plot_.x.label) + ".";
    for (std::size_t i = 0; i < drawable_.size(); ++i) {
      const std::string name = drawable(plot_.series[i].name);
      if (name.empty() || drawable_[i].empty()) continue;
      const PlotPoint &first = drawable_[i].front(), &last = drawable_[i].back();
      text.append(" ").append(name).append(": ");
      text += std::to_string(drawable_[i].size()) + (drawable_[i].size() == 1 ? " point" : " points");
      text += ", from (" + text_of(first.x, 4) + ", " + text_of(first.y, 4) + ") to (" + text_of(last.x, 4) + ", " +
              text_of(last.y, 4);
      text += ").";
    }
    if (!plot_.note.empty()) text += " " + drawable(plot_.note);
  }

  const Plot& plot_;
  Drawing drawing_;
  std::vector<std::vector<PlotPoint>> drawable_;  // per series, the points that can be drawn
  std::vector<PointToLabel> labelled_;
  std::size_t left_out_ = 0;
  Scale x_, y_;
  double left_ = 0, top_ = 0, right_ = 0, bottom_ = 0;  // of the remaining area; finally of the axes
};

}  // namespace

Drawing layout(const Plot& plot) { return Layout(plot).drawing(); }

}  // namespace tracer::plotting
