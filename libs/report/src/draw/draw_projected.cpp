#include <cmath>

#include "drawing.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::report {

namespace {
constexpr int kInstants = 24;  // of a period that is drawn; the browser moves points straight between them
constexpr int kPeriod = 3;     // s
}  // namespace

void draw_projected(Canvas& canvas, const PanelLayout& layout) {
  using Eigen::Vector2d;
  const Panel& panel = layout.panel;
  const Box& plot = layout.plot;
  // Parallel projection: x to the right and back (up), y to the right and front (down), z up.
  const Vector2d ex(0.72 * plot.width, -0.20 * plot.height), ey(0.26 * plot.width, 0.22 * plot.height);
  const Vector2d ez(0, -0.56 * plot.height);
  const Vector2d origin(plot.x + 0.01 * plot.width, plot.y + 0.77 * plot.height);
  const auto at = [&](double a, double b, double c) { return Vector2d(origin + a * ex + b * ey + c * ez); };
  const auto segment = [&](const Vector2d& a, const Vector2d& b, std::string_view css) {
    canvas.line(a.x(), a.y(), b.x(), b.y(), css);
  };
  draw_legend(canvas, layout);

  for (const double v : layout.x.major) {
    const double a = layout.limits.x.fraction(v);
    segment(at(a, 0, 0), at(a, 1, 0), "grid");
    segment(at(a, 0, 0), at(a, 0, 1), "grid");
  }
  for (const double v : layout.y.major) {
    const double b = layout.limits.y.fraction(v);
    segment(at(0, b, 0), at(1, b, 0), "grid");
    segment(at(1, b, 0), at(1, b, 1), "grid");
  }
  for (const double v : layout.z.major) {
    const double c = layout.limits.z.fraction(v);
    segment(at(0, 0, c), at(1, 0, c), "grid");
    segment(at(1, 0, c), at(1, 1, c), "grid");
  }
  const double corners[9][2][3] = {{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {1, 1, 0}},
                                   {{0, 1, 0}, {1, 1, 0}}, {{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {1, 0, 1}},
                                   {{1, 1, 0}, {1, 1, 1}}, {{0, 0, 1}, {1, 0, 1}}, {{1, 0, 1}, {1, 1, 1}}};
  for (const auto& edge : corners) {
    segment(at(edge[0][0], edge[0][1], edge[0][2]), at(edge[1][0], edge[1][1], edge[1][2]), "ax");
  }

  const auto places = [&](const Series& s, const Eigen::VectorXd& y, const Eigen::VectorXd& z) {
    Eigen::Matrix2Xd points(2, s.x.size());
    for (Eigen::Index i = 0; i < s.x.size(); ++i) {
      points.col(i) = at(layout.limits.x.fraction(s.x(i) / panel.x.unit.factor),
                         layout.limits.y.fraction(y(i) / panel.y.unit.factor),
                         layout.limits.z.fraction(z(i) / panel.z.unit.factor));
    }
    return points;
  };
  for (const Series& s : panel.series) {
    if (s.y_later.size() == 0) {
      draw_points(canvas, s, places(s, s.y, s.z));
      continue;
    }
    std::vector<Eigen::Matrix2Xd> instants;
    for (int k = 0; k <= kInstants; ++k) {
      const double phase = 2 * kPi * k / kInstants;
      instants.push_back(places(s, std::cos(phase) * s.y + std::sin(phase) * s.y_later,
                                std::cos(phase) * s.z + std::sin(phase) * s.z_later));
    }
    canvas.moving(instants, kPeriod, "s" + std::to_string(s.style.color), stroke(s.style));
  }

  for (std::size_t i = 0; i < layout.x.major.size(); ++i) {
    const Vector2d p = at(layout.limits.x.fraction(layout.x.major[i]), 1, 0);
    segment(p, p + Vector2d(2, 4), "ax");
    canvas.text(p.x() + 4, p.y() + 16, layout.x.labels[i], Anchor::middle);
  }
  for (std::size_t i = 0; i < layout.y.major.size(); ++i) {
    const Vector2d p = at(0, layout.limits.y.fraction(layout.y.major[i]), 0);
    segment(p, p + Vector2d(-3, 3), "ax");
    canvas.text(p.x() - 6, p.y() + 13, layout.y.labels[i], Anchor::end);
  }
  for (std::size_t i = 0; i < layout.z.major.size(); ++i) {
    const Vector2d p = at(0, 0, layout.limits.z.fraction(layout.z.major[i]));
    segment(p, p + Vector2d(-4, 0), "ax");
    canvas.text(p.x() - 7, p.y() + 4, layout.z.labels[i], Anchor::end);
  }
  const Vector2d x_label = at(0.62, 1, 0) + Vector2d(20, 32), y_label = at(0, 0.5, 0) + Vector2d(-30, 44);
  canvas.text(x_label.x(), x_label.y(), axis_text(panel.x, layout.x.exponent), Anchor::middle);
  canvas.text(y_label.x(), y_label.y(), axis_text(panel.y, layout.y.exponent), Anchor::middle);
  const Vector2d z_label = at(0, 0, 0.5);
  canvas.text(plot.x - layout.left + 14, z_label.y(), axis_text(panel.z, layout.z.exponent), Anchor::middle, "", -90);
}

}  // namespace whirl::report
