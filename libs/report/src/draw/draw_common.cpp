#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drawing.hpp"
#include "whirl/report/decimate.hpp"

namespace whirl::report {
namespace {

constexpr double kLegendRow = 17;
constexpr double kSwatch = 22;

bool overlap(const Box& a, const Box& b) {
  return a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom();
}

/// Calls place(series, x, row) for each named series.
template <class F>
int for_each_legend_item(const Panel& panel, double width, F&& place) {
  double x = 0;
  int row = 0;
  bool any = false;
  for (const Series& s : panel.series) {
    if (s.name.empty()) continue;
    const double item = kSwatch + 6 + text_width(s.name) + 16;
    if (any && x + item > width) {
      x = 0;
      ++row;
    }
    place(s, x, row);
    x += item;
    any = true;
  }
  return any ? row + 1 : 0;
}

}  // namespace

double legend_height(const Panel& panel, double width) {
  return kLegendRow * for_each_legend_item(panel, width, [](const Series&, double, int) {});
}

void draw_legend(Canvas& canvas, const PanelLayout& layout) {
  const double top = layout.plot.y - layout.legend_height - 4;
  for_each_legend_item(layout.panel, layout.plot.width, [&](const Series& s, double dx, int row) {
    const double x = layout.plot.x + dx, y = top + kLegendRow * (row + 0.5);
    const std::string color = std::to_string(s.style.color);
    if (layout.id >= 0)
      canvas.raw(fmt::format("<g class=\"lg\" data-a=\"{}\" data-n=\"{}\">\n", layout.id, escape_markup(s.name)));
    if (s.kind == Series::Kind::bars) {
      canvas.rect({x + 4, y - 5, kSwatch - 8, 10}, "f" + color);
    } else if (s.kind == Series::Kind::band) {
      canvas.rect({x, y - 5, kSwatch, 10}, "f" + color, "opacity=\"0.25\"");
    } else {
      if (s.kind != Series::Kind::scatter) {
        Path sample;
        sample.move(x, y);
        sample.line(x + kSwatch, y);
        Style style = s.style;
        style.width = std::max(style.width, 2.0);
        style.opacity = 1;
        canvas.path(sample, "s" + color, stroke(style));
      }
      canvas.mark(x + kSwatch / 2, y, s.style.mark, s.style.color);
    }
    canvas.text(x + kSwatch + 6, y + 4, s.name);
    if (layout.id >= 0) canvas.raw("</g>\n");
  });
}

void draw_points(Canvas& canvas, const Series& series, const Eigen::Matrix2Xd& points) {
  const std::string color = std::to_string(series.style.color);
  if (series.kind != Series::Kind::scatter) {
    Path path;
    bool pen_down = false;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (!points.col(i).allFinite()) {
        pen_down = false;
        continue;
      }
      if (pen_down) {
        path.line(points(0, i), points(1, i));
      } else {
        path.move(points(0, i), points(1, i));
      }
      pen_down = true;
    }
    canvas.path(path, "s" + color, stroke(series.style));
  }
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) continue;
    canvas.mark(points(0, i), points(1, i), series.style.mark, series.style.color, series.style.opacity);
  }
}

void LabelPlacer::place(Canvas& canvas, std::string_view text, const std::vector<Eigen::Vector2d>& candidates) {
  if (text.empty() || candidates.empty()) return;
  const double width = text_width(text);
  Box box;
  bool have_inside = false;
  for (const Eigen::Vector2d& at : candidates) {
    const double x = std::clamp(at.x() - width / 2, area_.x + 2, std::max(area_.x + 2, area_.right() - width - 2));
    const Box tried{x, at.y() - 10, width, 13};
    const bool inside = tried.y >= area_.y && tried.bottom() <= area_.bottom();
    if (inside && std::none_of(taken_.begin(), taken_.end(), [&](const Box& b) { return overlap(b, tried); })) {
      box = tried;
      break;
    }
    if (box.width == 0 || (inside && !have_inside)) box = tried;
    have_inside = have_inside || inside;
  }
  taken_.push_back(box);
  canvas.text(box.x + width / 2, box.y + 10, text, Anchor::middle, "halo");
}

}  // namespace whirl::report
