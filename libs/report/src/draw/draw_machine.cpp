#include <cmath>
#include <numbers>

#include "drawing.hpp"

namespace whirl::report {
namespace {

using Eigen::Vector2d;

constexpr double kArrow = 11;  ///< radius of the arc, px
constexpr double kWedge = 9;   ///< length of a probe, px

void fill(Canvas& canvas, const std::vector<Vector2d>& corners) {
  Path path;
  path.move(corners[0].x(), corners[0].y());
  for (std::size_t i = 1; i < corners.size(); ++i) path.line(corners[i].x(), corners[i].y());
  path.close();
  canvas.path(path, "f6");
}

void draw_arrow(Canvas& canvas, const Vector2d& centre) {
  constexpr double kFrom = -0.2 * std::numbers::pi, kTo = 1.3 * std::numbers::pi;
  const auto at = [&](double angle, double r) {  // y points down
    return Vector2d(centre + r * Vector2d(std::cos(angle), -std::sin(angle)));
  };
  Path arc;
  for (int k = 0; k <= 24; ++k) {
    const Vector2d p = at(kFrom + (kTo - kFrom) * k / 24, kArrow);
    if (k == 0) arc.move(p.x(), p.y());
    arc.line(p.x(), p.y());
  }
  canvas.path(arc, "s6", "stroke-width=\"1.4\"");
  fill(canvas, {at(kTo + 0.45, kArrow), at(kTo, kArrow - 4), at(kTo, kArrow + 4)});
}

/// Where the ray from the middle meets the rim, and the middle.
Vector2d rim(const Box& plot, double radius, double angle, Vector2d& middle) {
  middle = {plot.x + plot.width / 2, plot.y + plot.height / 2};
  const Vector2d along(std::cos(angle), -std::sin(angle));
  if (radius > 0) return middle + radius * along;
  const double across = std::abs(along.x()) > 1e-12 ? 0.5 * plot.width / std::abs(along.x()) : INFINITY;
  const double upright = std::abs(along.y()) > 1e-12 ? 0.5 * plot.height / std::abs(along.y()) : INFINITY;
  return middle + std::min(across, upright) * along;
}

}  // namespace

void draw_machine(Canvas& canvas, const Panel& panel, const Box& plot, double radius) {
  if (!panel.rotation && panel.probes.empty()) return;
  canvas.raw("<g class=\"machine\">\n");
  for (const Probe& probe : panel.probes) {
    Vector2d middle;
    const Vector2d foot = rim(plot, radius, probe.angle, middle), in = (middle - foot).normalized();
    const Vector2d side(-in.y(), in.x());
    fill(canvas, {foot + kWedge * in, foot + 4.5 * side, foot - 4.5 * side});
    if (probe.name.empty()) continue;
    // Beside the wedge, where the path of the shaft seldom is.
    const bool above = std::abs(in.y()) > 0.5;
    const Vector2d text = above ? Vector2d(foot + Vector2d(9, in.y() > 0 ? 11 : -4)) : Vector2d(foot + 2 * in);
    const Anchor anchor = !above && in.x() < 0 ? Anchor::end : Anchor::start;
    canvas.text(text.x(), text.y() - (above ? 0 : 9), probe.name, anchor, "halo");
  }
  if (panel.rotation) {
    const Vector2d centre(plot.right() - kArrow - 12, plot.y + kArrow + 10);
    draw_arrow(canvas, centre);
    canvas.text(centre.x() - kArrow - 8, centre.y() + 4, "rotation", Anchor::end, "halo");
  }
  canvas.raw("</g>\n");
}

}  // namespace whirl::report
