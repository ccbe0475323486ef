#include "scaling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"

namespace whirl::report {
namespace {

/// Smallest and largest finite value; positive ones only on a logarithmic axis.
class Range {
 public:
  explicit Range(const Axis& axis) : axis_(axis) {}
  void add(double value) {
    const double shown = value / axis_.unit.factor;
    if (!std::isfinite(shown) || (axis_.scale == Scale::logarithmic && shown <= 0)) return;
    low_ = std::min(low_, shown);
    high_ = std::max(high_, shown);
  }
  void add(const Eigen::VectorXd& values) {
    for (const double v : values) add(v);
  }
  bool empty() const { return !(low_ <= high_); }

  /// `tight`: no margin around the data (a time axis ends with its record). A range that starts at zero keeps its edge
  /// there: bars stand on the axis.
  Limits limits(bool tight, std::string_view what) const {
    const bool logarithmic = axis_.scale == Scale::logarithmic;
    double low = low_, high = high_;
    const bool low_given = !std::isnan(axis_.low), high_given = !std::isnan(axis_.high);
    if (empty() && !(low_given && high_given)) {
      throw Error(fmt::format("figure: {} has no {} value to draw", what, logarithmic ? "positive" : "finite"));
    }
    const bool stands_on_zero = low == 0;
    if (!(tight && high > low)) {
      if (logarithmic) {
        double log_low = std::log10(low), log_high = std::log10(high);
        widen(log_low, log_high);
        // Inside what a double holds, also after head room is added.
        low = std::pow(10.0, std::max(log_low, -300.0));
        high = std::pow(10.0, std::min(log_high, 300.0));
      } else {
        widen(low, high);
        if (stands_on_zero && high > 0) low = 0;
      }
    }
    if (low_given) low = axis_.low / axis_.unit.factor;
    if (high_given) high = axis_.high / axis_.unit.factor;
    if (!(low < high) || (logarithmic && low <= 0)) {
      throw Error(fmt::format("figure: limits of {} are {:g} to {:g}: must ascend{}", what, low, high,
                              logarithmic ? " and be positive on a logarithmic axis" : ""));
    }
    return {low, high, logarithmic, axis_.unit.symbol == "°"};
  }

 private:
  const Axis& axis_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

bool stands_on_zero(Series::Kind kind) { return kind == Series::Kind::bars || kind == Series::Kind::stem; }

double bar_spacing(const Eigen::VectorXd& x) { return x.size() > 1 ? (x(x.size() - 1) - x(0)) / (x.size() - 1.0) : 1; }

}  // namespace

double Limits::fraction(double shown) const {
  if (!logarithmic) return (shown - low) / (high - low);
  return shown > 0 ? std::log(shown / low) / std::log(high / low) : std::numeric_limits<double>::quiet_NaN();
}

PanelLimits find_limits(const Panel& panel) {
  Range x(panel.x), y(panel.y), z(panel.z);
  bool tight_x = true;
  bool tight_y = true;
  for (const Series& s : panel.series) {
    x.add(s.x);
    y.add(s.y);
    y.add(s.low);
    y.add(s.high);
    z.add(s.z);
    tight_y = false;
    if (s.kind == Series::Kind::scatter || s.kind == Series::Kind::errors || s.kind == Series::Kind::stem) {
      tight_x = false;
    }
    if (stands_on_zero(s.kind)) y.add(0.0);
    if (s.kind == Series::Kind::bars && s.x.size() > 0) {
      const double half = 0.5 * bar_spacing(s.x);
      x.add(s.x.minCoeff() - half);
      x.add(s.x.maxCoeff() + half);
    }
  }
  for (const HeatMap& map : panel.heat_maps) {
    const double half_x = 0.5 * (map.x_high - map.x_low) / std::max<Eigen::Index>(1, map.values.cols() - 1);
    const double half_y = 0.5 * (map.y_high - map.y_low) / std::max<Eigen::Index>(1, map.values.rows() - 1);
    x.add(map.x_low - half_x);
    x.add(map.x_high + half_x);
    y.add(map.y_low - half_y);
    y.add(map.y_high + half_y);
  }
  for (const ReferenceLine& line : panel.lines) {
    if (line.direction == Direction::horizontal) y.add(line.value);
  }
  const std::string name = panel.title.empty() ? "panel" : "panel '" + panel.title + "'";
  PanelLimits limits;
  if (panel.kind == Panel::Kind::polar) {
    y.add(0.0);
    Axis radius = panel.y;
    limits.x = {};
    limits.y = y.limits(false, name + ", radius");
    limits.y.low = 0;
    return limits;
  }
  limits.x = x.limits(tight_x && !panel.equal_aspect, name + ", x");
  limits.y = y.limits(tight_y, name + ", y");
  if (panel.kind == Panel::Kind::projected) limits.z = z.limits(false, name + ", z");
  return limits;
}

Limits color_limits(const HeatMap& map) {
  Range range(map.color);
  for (Eigen::Index j = 0; j < map.values.cols(); ++j) {
    for (Eigen::Index i = 0; i < map.values.rows(); ++i) range.add(map.values(i, j));
  }
  return range.limits(true, "heat map");
}

Ticks ticks_of(const Limits& limits, double pixels, double pixels_per_tick) {
  const int most = std::max(2, static_cast<int>(pixels / pixels_per_tick));
  if (limits.degrees) return degree_ticks(limits.low, limits.high, most + 1);
  return limits.logarithmic ? log_ticks(limits.low, limits.high, most) : linear_ticks(limits.low, limits.high, most);
}

std::string axis_text(const Axis& axis, int exponent) {
  std::string unit = exponent == 0 ? "" : power_of_ten(exponent).substr(std::string("×").size());
  if (!axis.unit.symbol.empty()) unit += (unit.empty() ? "" : " ") + axis.unit.symbol;
  return unit.empty() ? axis.label : axis.label + " [" + unit + "]";
}

void check_panel(const Panel& panel) {
  for (const Series& s : panel.series) {
    const auto require = [&](const Eigen::VectorXd& v, std::string_view what) {
      if (v.size() != s.x.size()) {
        throw Error(fmt::format("figure: series '{}' of panel '{}' has {} values of x but {} of {}: must be equal",
                                s.name, panel.title, s.x.size(), v.size(), what));
      }
    };
    const bool range = s.kind == Series::Kind::band || s.kind == Series::Kind::errors;
    if (s.kind != Series::Kind::band) require(s.y, "y");
    if (range) require(s.low, "low");
    if (range) require(s.high, "high");
    if (panel.kind == Panel::Kind::projected) require(s.z, "z");
    if (s.y_later.size() + s.z_later.size() > 0) {
      require(s.y_later, "y_later");
      require(s.z_later, "z_later");
    }
  }
  if (panel.equal_aspect && (panel.x.scale != Scale::linear || panel.y.scale != Scale::linear)) {
    throw Error(fmt::format("figure: panel '{}' with equal aspect needs linear axes", panel.title));
  }
  if (panel.kind == Panel::Kind::polar && panel.y.scale != Scale::linear) {
    throw Error(fmt::format("figure: polar panel '{}' needs a linear radius", panel.title));
  }
  for (const HeatMap& map : panel.heat_maps) {
    if (map.values.size() == 0 || panel.x.scale != Scale::linear || panel.y.scale != Scale::linear) {
      throw Error(fmt::format("figure: heat map of panel '{}' needs values and linear axes", panel.title));
    }
  }
}

}  // namespace whirl::report
