#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drawing.hpp"

namespace whirl::report {

void draw_polar(Canvas& canvas, const PanelLayout& layout) {
  const Panel& panel = layout.panel;
  const Box& plot = layout.plot;
  const double radius = 0.5 * std::min(plot.width - 60, plot.height - 36);
  const Eigen::Vector2d centre(plot.x + plot.width / 2, plot.y + plot.height / 2);
  const double down = panel.clockwise ? 1 : -1;
  const auto at = [&](double angle, double r) {
    return Eigen::Vector2d(centre + r * Eigen::Vector2d(std::cos(angle), down * std::sin(angle)));
  };
  const auto scaled = [&](double si) { return radius * layout.limits.y.fraction(si / panel.y.unit.factor); };
  const auto circle = [&](double r, std::string_view css) {
    canvas.raw(fmt::format("<circle class=\"{}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>\n", css, px(centre.x()), px(centre.y()),
                           px(r)));
  };
  LabelPlacer placer(plot);
  draw_legend(canvas, layout);
  circle(radius, "plot");
  const Ticks& rings = layout.y;
  for (const double r : rings.major) {
    if (r > 0) circle(radius * layout.limits.y.fraction(r), "ring");
  }
  for (int degrees = 0; degrees < 360; degrees += 30) {
    const double angle = degrees * std::numbers::pi / 180;
    const Eigen::Vector2d rim = at(angle, radius), text = at(angle, radius + 8);
    canvas.line(centre.x(), centre.y(), rim.x(), rim.y(), "grid");
    const double side = std::cos(angle);
    const std::string label = fmt::format("{}°", degrees);
    const double width = text_width(label);
    placer.reserve({text.x() - (side > 0.1 ? 0 : side < -0.1 ? width : width / 2), text.y() - 6, width, 13});
    canvas.text(text.x(), text.y() + 4, label, side > 0.1 ? Anchor::start : side < -0.1 ? Anchor::end : Anchor::middle);
  }
  circle(radius, "frame");
  draw_machine(canvas, panel, plot, radius);
  for (const Series& s : panel.series) {
    Eigen::Matrix2Xd points(2, s.x.size());
    for (Eigen::Index i = 0; i < s.x.size(); ++i) points.col(i) = at(s.x(i), scaled(s.y(i)));
    draw_points(canvas, s, points);
  }
  for (std::size_t i = 0; i < rings.major.size(); ++i) {
    const double r = radius * layout.limits.y.fraction(rings.major[i]);
    if (r <= 0) continue;
    const Eigen::Vector2d p = at(-down * 75 * std::numbers::pi / 180, r);
    placer.place(canvas, rings.labels[i], {Eigen::Vector2d(p.x(), p.y() + 4)});
  }
  for (const Annotation& note : panel.annotations) {
    const Eigen::Vector2d p = at(note.x, scaled(note.y));
    const double half = text_width(note.text) / 2 + 6;
    const Eigen::Vector2d outside =
        p + Eigen::Vector2d(std::cos(note.x) * half, down * std::sin(note.x) * 14 + 4);  // away from the centre
    placer.place(canvas, note.text,
                 {outside,
                  {p.x() + half, p.y() - 4},
                  {p.x() - half, p.y() - 4},
                  {p.x() + half, p.y() + 13},
                  {p.x() - half, p.y() + 13},
                  {p.x(), p.y() - 18}});
  }
  canvas.text(centre.x(), plot.bottom() + 14, axis_text(panel.y, rings.exponent), Anchor::middle);
}

}  // namespace whirl::report
