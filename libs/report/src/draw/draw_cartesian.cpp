#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drawing.hpp"
#include "whirl/report/decimate.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::Matrix2Xd;

/// Data in SI to px.
struct Mapping {
  const PanelLayout& layout;

  double x(double si) const {
    return layout.plot.x + layout.plot.width * layout.limits.x.fraction(si / layout.panel.x.unit.factor);
  }
  double y(double si) const {
    // Far outside the plot the exact place does not matter, but renderers want moderate numbers.
    const double at =
        layout.plot.bottom() - layout.plot.height * layout.limits.y.fraction(si / layout.panel.y.unit.factor);
    return std::isnan(at) ? at : std::clamp(at, -1e4, 1e4);
  }
  Matrix2Xd points(const Eigen::VectorXd& xs, const Eigen::VectorXd& ys) const {
    Matrix2Xd out(2, xs.size());
    for (Index i = 0; i < xs.size(); ++i) out.col(i) << x(xs(i)), y(ys(i));
    return out;
  }
};

/// The points that matter at this size. Marks are all kept: each is a reading.
Matrix2Xd reduce(const PanelLayout& layout, const Series& s, const Matrix2Xd& points) {
  if (s.kind != Series::Kind::line || s.style.mark != Mark::none || points.cols() < 2 * layout.plot.width)
    return points;
  const Eigen::VectorXd x = points.row(0), y = points.row(1);
  if (!x.allFinite() || !std::is_sorted(x.data(), x.data() + x.size())) return points;
  const auto kept = decimate_columns(x, y, layout.plot.x, layout.plot.right(), static_cast<int>(layout.plot.width));
  return points(Eigen::all, kept);
}

void draw_band(Canvas& canvas, const Mapping& map, const Series& s) {
  Path path;
  // Finite stretches become one closed area each.
  for (Index i = 0; i < s.x.size();) {
    const auto finite = [&](Index k) { return std::isfinite(map.y(s.low(k))) && std::isfinite(map.y(s.high(k))); };
    if (!finite(i)) {
      ++i;
      continue;
    }
    const Index first = i;
    while (i < s.x.size() && finite(i)) ++i;
    path.move(map.x(s.x(first)), map.y(s.high(first)));
    for (Index k = first + 1; k < i; ++k) path.line(map.x(s.x(k)), map.y(s.high(k)));
    for (Index k = i - 1; k >= first; --k) path.line(map.x(s.x(k)), map.y(s.low(k)));
    path.close();
  }
  canvas.path(path, fmt::format("f{}", s.style.color), fmt::format("opacity=\"{:.2f}\"", 0.25 * s.style.opacity));
}

void draw_errors(Canvas& canvas, const Mapping& map, const Series& s) {
  Path path;
  for (Index i = 0; i < s.x.size(); ++i) {
    const double x = map.x(s.x(i)), low = map.y(s.low(i)), high = map.y(s.high(i));
    if (!std::isfinite(x + low + high)) continue;
    path.move(x, low);
    path.line(x, high);
    for (const double y : {low, high}) {
      path.move(x - 3, y);
      path.line(x + 3, y);
    }
  }
  canvas.path(path, fmt::format("s{}", s.style.color), stroke(s.style));
  Series marks = s;
  marks.kind = Series::Kind::scatter;
  draw_points(canvas, marks, map.points(s.x, s.y));
}

void draw_step(Canvas& canvas, const Mapping& map, const Series& s) {
  Matrix2Xd corners(2, std::max<Index>(0, 2 * s.x.size() - 1));
  for (Index i = 0; i < s.x.size(); ++i) {
    corners.col(2 * i) << map.x(s.x(i)), map.y(s.y(i));
    if (i + 1 < s.x.size()) corners.col(2 * i + 1) << map.x(s.x(i + 1)), map.y(s.y(i));
  }
  draw_points(canvas, s, corners);
}

void draw_stems(Canvas& canvas, const Mapping& map, const Series& s) {
  Path path;
  for (Index i = 0; i < s.x.size(); ++i) {
    if (!std::isfinite(map.y(s.y(i)))) continue;
    path.move(map.x(s.x(i)), map.y(0));
    path.line(map.x(s.x(i)), map.y(s.y(i)));
  }
  canvas.path(path, fmt::format("s{}", s.style.color), stroke(s.style));
  Series marks = s;
  marks.kind = Series::Kind::scatter;
  draw_points(canvas, marks, map.points(s.x, s.y));
}

void draw_bars(Canvas& canvas, const Mapping& map, const Series& s, int place, int of) {
  const double spacing = s.x.size() > 1 ? std::abs(map.x(s.x(1)) - map.x(s.x(0))) : 0.6 * map.layout.plot.width;
  const double group = (of > 1 || !map.layout.panel.categories.empty() ? 0.74 : 0.96) * spacing;
  const double width = group / of;
  const bool logarithmic = map.layout.limits.y.logarithmic;
  const double base = logarithmic ? map.layout.plot.bottom() : map.y(0);
  for (Index i = 0; i < s.x.size(); ++i) {
    const double top = map.y(s.y(i));
    if (!std::isfinite(top)) continue;
    const double left = map.x(s.x(i)) - group / 2 + place * width;
    canvas.rect({left, std::min(top, base), std::max(0.5, width - (of > 1 ? 1.5 : 0.5)), std::abs(base - top)},
                fmt::format("f{}", s.style.color));
  }
}

void draw_color_bar(Canvas& canvas, const PanelLayout& layout, const HeatMap& map) {
  const Limits limits = color_limits(map);
  const Box bar{layout.plot.right() + 12, layout.plot.y, 12, layout.plot.height};
  // The bar runs over the limits in equal steps of colour whatever the scale.
  const Limits unit_limits;
  const Eigen::MatrixXd ramp = Eigen::VectorXd::LinSpaced(128, 0, 1);
  canvas.raw(
      fmt::format("<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" href=\"{}\"/>\n",
                  px(bar.x), px(bar.y), px(bar.width), px(bar.height), png_data_uri(ramp, unit_limits, 1)));
  canvas.rect(bar, "frame");
  const Ticks ticks = ticks_of(limits, bar.height, 34);
  double widest = 0;
  for (std::size_t i = 0; i < ticks.major.size(); ++i) {
    const double y = bar.bottom() - bar.height * limits.fraction(ticks.major[i]);
    canvas.line(bar.right(), y, bar.right() + 3, y, "ax");
    canvas.text(bar.right() + 6, y + 4, ticks.labels[i]);
    widest = std::max(widest, text_width(ticks.labels[i]));
  }
  canvas.text(bar.right() + 6 + widest + 14, bar.y + bar.height / 2, axis_text(map.color, ticks.exponent),
              Anchor::middle, "", -90);
}

void draw_heat_map(Canvas& canvas, const Mapping& map, const HeatMap& heat) {
  const double dx = (heat.x_high - heat.x_low) / std::max<Index>(1, heat.values.cols() - 1);
  const double dy = (heat.y_high - heat.y_low) / std::max<Index>(1, heat.values.rows() - 1);
  const double left = map.x(heat.x_low - dx / 2), right = map.x(heat.x_high + dx / 2);
  const double top = map.y(heat.y_high + dy / 2), bottom = map.y(heat.y_low - dy / 2);
  canvas.raw(
      fmt::format("<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
                  "style=\"image-rendering:pixelated\" href=\"{}\"/>\n",
                  px(left), px(top), px(right - left), px(bottom - top),
                  png_data_uri(heat.values, color_limits(heat), heat.color.unit.factor)));
}

/// What the script of a page needs to know of an axis; limits in shown units.
std::string axis_data(const Axis& axis, const Limits& limits) {
  const auto plain = [](std::string text) {
    std::erase_if(text, [](char c) { return c == '"' || c == '\\' || c == '\''; });
    return escape_markup(text);
  };
  const std::string name = plain(axis.label), unit = plain(axis.unit.symbol);
  return fmt::format(R"({{"low":{},"high":{},"log":{},"name":"{}","unit":"{}","key":"{} {}"}})", limits.low,
                     limits.high, limits.logarithmic, name, unit, name, unit);
}

std::string panel_data(const PanelLayout& layout) {
  if (layout.id < 0) return {};
  return fmt::format(" data-a=\"{}\" data-p='{{\"x\":{},\"y\":{}}}'", layout.id,
                     axis_data(layout.panel.x, layout.limits.x), axis_data(layout.panel.y, layout.limits.y));
}

/// Opens a group that the script of a page finds; nothing in a drawing on its own.
void open_group(Canvas& canvas, const PanelLayout& layout, std::string_view css, const std::string& name = "") {
  if (layout.id < 0) return;
  canvas.raw(fmt::format("<g class=\"{}\" data-a=\"{}\" data-n=\"{}\">\n", css, layout.id, escape_markup(name)));
}
void close_group(Canvas& canvas, const PanelLayout& layout) {
  if (layout.id >= 0) canvas.raw("</g>\n");
}

void draw_axes(Canvas& canvas, const PanelLayout& layout) {
  const Box& plot = layout.plot;
  const Limits& lx = layout.limits.x;
  const Limits& ly = layout.limits.y;
  canvas.rect(plot, "frame");
  open_group(canvas, layout, "tx");
  for (std::size_t i = 0; i < layout.x.major.size(); ++i) {
    const double x = plot.x + plot.width * lx.fraction(layout.x.major[i]);
    const bool category = !layout.category_lines.empty();
    if (!category) canvas.line(x, plot.bottom(), x, plot.bottom() + 4, "ax");
    if (!layout.x_labels) continue;
    if (category) {
      for (std::size_t k = 0; k < layout.category_lines[i].size(); ++k) {
        canvas.text(x, plot.bottom() + 15 + 13.0 * static_cast<double>(k), layout.category_lines[i][k], Anchor::middle);
      }
    } else {
      canvas.text(x, plot.bottom() + 16, layout.x.labels[i], Anchor::middle);
    }
  }
  for (const double v : layout.x.minor) {
    const double x = plot.x + plot.width * lx.fraction(v);
    canvas.line(x, plot.bottom(), x, plot.bottom() + 2, "ax");
  }
  close_group(canvas, layout);
  open_group(canvas, layout, "ty");
  double widest = 0;
  for (std::size_t i = 0; i < layout.y.major.size(); ++i) {
    const double y = plot.bottom() - plot.height * ly.fraction(layout.y.major[i]);
    canvas.line(plot.x - 4, y, plot.x, y, "ax");
    canvas.text(plot.x - 7, y + 4, layout.y.labels[i], Anchor::end);
    widest = std::max(widest, text_width(layout.y.labels[i]));
  }
  for (const double v : layout.y.minor) {
    const double y = plot.bottom() - plot.height * ly.fraction(v);
    canvas.line(plot.x - 2, y, plot.x, y, "ax");
  }
  close_group(canvas, layout);
  if (layout.x_labels) {
    canvas.text(plot.x + plot.width / 2, plot.bottom() + layout.bottom - 4,
                axis_text(layout.panel.x, layout.x.exponent), Anchor::middle);
  }
  canvas.text(plot.x - 7 - widest - 9, plot.y + plot.height / 2, axis_text(layout.panel.y, layout.y.exponent),
              Anchor::middle, "", -90);
}

void draw_grid(Canvas& canvas, const PanelLayout& layout) {
  const Box& plot = layout.plot;
  if (layout.category_lines.empty()) {
    for (const double v : layout.x.major) {
      const double x = plot.x + plot.width * layout.limits.x.fraction(v);
      canvas.line(x, plot.y, x, plot.bottom(), "grid");
    }
  }
  for (const double v : layout.y.major) {
    const double y = plot.bottom() - plot.height * layout.limits.y.fraction(v);
    canvas.line(plot.x, y, plot.right(), y, "grid");
  }
}

void draw_labels(Canvas& canvas, const Mapping& map) {
  const Box& plot = map.layout.plot;
  LabelPlacer placer(plot);
  const auto rows_from_top = [&](double x) {
    std::vector<Eigen::Vector2d> rows;
    for (double y = plot.y + 12; y < plot.bottom() - 4 && rows.size() < 6; y += 14) rows.emplace_back(x, y);
    return rows;
  };
  const auto beside = [&](double value) {
    return std::vector<Eigen::Vector2d>{{plot.right(), map.y(value) - 4},
                                        {plot.right(), map.y(value) + 13},
                                        {plot.x, map.y(value) - 4},
                                        {plot.x, map.y(value) + 13}};
  };
  for (const Span& span : map.layout.panel.spans) {
    if (span.direction == Direction::vertical) {
      const double low = std::clamp(map.x(span.low), plot.x, plot.right());
      const double high = std::clamp(map.x(span.high), plot.x, plot.right());
      if (low < high) placer.place(canvas, span.label, rows_from_top(0.5 * (low + high)));
    } else {
      placer.place(canvas, span.label, beside(0.5 * (span.low + span.high)));
    }
  }
  for (const ReferenceLine& line : map.layout.panel.lines) {
    if (line.direction == Direction::horizontal) {
      placer.place(canvas, line.label, beside(line.value));
    } else if (const double x = map.x(line.value); x >= plot.x && x <= plot.right()) {
      placer.place(canvas, line.label, rows_from_top(x));
    }
  }
  for (const Annotation& note : map.layout.panel.annotations) {
    const double x = map.x(note.x), y = map.y(note.y), half = text_width(note.text) / 2 + 6;
    if (!std::isfinite(x + y)) continue;
    if (note.above) {
      placer.place(canvas, note.text, {{x, y - 4}});
      continue;
    }
    placer.place(canvas, note.text,
                 {{x + half, y - 4},
                  {x - half, y - 4},
                  {x + half, y + 13},
                  {x - half, y + 13},
                  {x, y - 8},
                  {x, y + 17},
                  {x, y - 20},
                  {x + half, y - 18},
                  {x - half, y - 18},
                  {x, y - 8}});
  }
}

}  // namespace

void draw_cartesian(Canvas& canvas, const PanelLayout& layout) {
  const Panel& panel = layout.panel;
  const Box& plot = layout.plot;
  const Mapping map{layout};
  canvas.rect(plot, "plot");
  draw_legend(canvas, layout);
  canvas.begin_clip(plot, layout.panel.categories.empty() ? panel_data(layout) : "");
  for (const Span& span : panel.spans) {
    const bool vertical = span.direction == Direction::vertical;
    const double a = vertical ? map.x(span.low) : map.y(span.high), b = vertical ? map.x(span.high) : map.y(span.low);
    const Box box = vertical ? Box{a, plot.y, b - a, plot.height} : Box{plot.x, a, plot.width, b - a};
    canvas.rect(box, fmt::format("f{}", span.color), "opacity=\"0.13\"");
  }
  if (panel.heat_maps.empty()) draw_grid(canvas, layout);
  for (const HeatMap& heat : panel.heat_maps) draw_heat_map(canvas, map, heat);
  const auto is_bars = [](const Series& s) { return s.kind == Series::Kind::bars; };
  const auto bar_series = std::count_if(panel.series.begin(), panel.series.end(), is_bars);
  int bar = 0;
  for (const Series& s : panel.series) {
    open_group(canvas, layout, "sr", s.name);
    switch (s.kind) {
      case Series::Kind::band:
        draw_band(canvas, map, s);
        break;
      case Series::Kind::errors:
        draw_errors(canvas, map, s);
        break;
      case Series::Kind::step:
        draw_step(canvas, map, s);
        break;
      case Series::Kind::stem:
        draw_stems(canvas, map, s);
        break;
      case Series::Kind::bars:
        draw_bars(canvas, map, s, bar++, static_cast<int>(bar_series));
        break;
      default:
        draw_points(canvas, s, reduce(layout, s, map.points(s.x, s.y)));
    }
    close_group(canvas, layout);
  }
  for (const ReferenceLine& line : panel.lines) {
    const bool vertical = line.direction == Direction::vertical;
    const double at = vertical ? map.x(line.value) : map.y(line.value);
    if (!std::isfinite(at)) continue;
    Path path;
    path.move(vertical ? at : plot.x, vertical ? plot.y : at);
    path.line(vertical ? at : plot.right(), vertical ? plot.bottom() : at);
    canvas.path(path, fmt::format("s{}", line.style.color), stroke(line.style));
  }
  canvas.end_clip();
  draw_axes(canvas, layout);
  draw_machine(canvas, panel, plot);
  for (const HeatMap& heat : panel.heat_maps) draw_color_bar(canvas, layout, heat);
  open_group(canvas, layout, "lb");
  draw_labels(canvas, map);
  close_group(canvas, layout);
}

}  // namespace whirl::report
