#include "whirl/report/terminal_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "scaling.hpp"
#include "whirl/core/error.hpp"
#include "whirl/report/decimate.hpp"
#include "whirl/report/table.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;

/// Dots of a text area, two columns and four rows per character.
class Dots {
 public:
  Dots(int columns, int rows) : columns_(columns), cells_(static_cast<std::size_t>(columns * rows)) {}
  int width() const { return 2 * columns_; }
  int height() const { return 4 * static_cast<int>(cells_.size()) / columns_; }

  void set(int x, int y, int color) {
    if (x < 0 || y < 0 || x >= width() || y >= height()) return;
    constexpr std::uint8_t kBits[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
    Cell& cell = cells_[static_cast<std::size_t>(y / 4 * columns_ + x / 2)];
    cell.bits |= kBits[x % 2][y % 4];
    cell.color = color;
  }
  /// The larger distance decides the number of dots; both ends inside or near the area.
  void line(double x0, double y0, double x1, double y1, int color) {
    const double steps = std::ceil(std::max({std::abs(x1 - x0), std::abs(y1 - y0), 1.0}));
    if (steps > 1e5) return;
    for (double k = 0; k <= steps; ++k) {
      set(static_cast<int>(std::lround(x0 + (x1 - x0) * k / steps)),
          static_cast<int>(std::lround(y0 + (y1 - y0) * k / steps)), color);
    }
  }
  std::string row(int r, bool with_color) const {
    constexpr int kAnsi[] = {34, 31, 32, 35, 33, 36, 39, 90};
    std::string out;
    for (int c = 0; c < columns_; ++c) {
      const Cell& cell = cells_[static_cast<std::size_t>(r * columns_ + c)];
      if (cell.bits == 0) {
        out += ' ';
        continue;
      }
      // U+2800 + bits in UTF-8.
      const std::string glyph = {'\xE2', static_cast<char>(0xA0 | cell.bits >> 6),
                                 static_cast<char>(0x80 | (cell.bits & 0x3F))};
      out += with_color ? fmt::format("\x1b[{}m{}\x1b[0m", kAnsi[cell.color], glyph) : glyph;
    }
    if (!with_color) out.erase(out.find_last_not_of(' ') + 1);
    return out;
  }

 private:
  struct Cell {
    std::uint8_t bits = 0;
    int color = 0;
  };
  int columns_;
  std::vector<Cell> cells_;
};

std::string pad_left(const std::string& text, std::size_t width) {
  const std::size_t used = display_width(text);
  return (used < width ? std::string(width - used, ' ') : "") + text;
}

void draw_series(Dots& dots, const Panel& panel, const PanelLimits& limits, const Series& s, int color) {
  const double right = dots.width() - 1, bottom = dots.height() - 1;
  const Index n = s.x.size();
  const Eigen::VectorXd& values = s.y.size() == n ? s.y : s.high;
  Eigen::VectorXd x(n), y(n);
  for (Index i = 0; i < n; ++i) {
    x(i) = right * limits.x.fraction(s.x(i) / panel.x.unit.factor);
    y(i) = std::clamp(bottom * (1 - limits.y.fraction(values(i) / panel.y.unit.factor)), -1e4, 1e4);
  }
  const bool ascending = x.allFinite() && std::is_sorted(x.data(), x.data() + n);
  std::vector<Index> kept;
  if (s.kind == Series::Kind::line && ascending && n > 4 * dots.width()) {
    kept = decimate_columns(x, y, 0, right, dots.width());
  } else {
    for (Index i = 0; i < n; ++i) kept.push_back(i);
  }
  const bool from_zero = s.kind == Series::Kind::bars || s.kind == Series::Kind::stem;
  const double zero = limits.y.logarithmic ? bottom : bottom * (1 - limits.y.fraction(0));
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const Index i = kept[k];
    if (!std::isfinite(x(i)) || !std::isfinite(y(i))) continue;
    if (from_zero) {
      dots.line(x(i), zero, x(i), y(i), color);
    } else if (s.kind == Series::Kind::scatter || s.kind == Series::Kind::errors) {
      dots.line(x(i), y(i), x(i), y(i), color);
    } else if (k > 0 && std::isfinite(x(kept[k - 1])) && std::isfinite(y(kept[k - 1]))) {
      const Index before = kept[k - 1];
      if (s.kind == Series::Kind::step) {
        dots.line(x(before), y(before), x(i), y(before), color);
        dots.line(x(i), y(before), x(i), y(i), color);
      } else {
        dots.line(x(before), y(before), x(i), y(i), color);
      }
    }
  }
}

/// A polar panel with its points at (r cos, r sin), which a terminal can draw.
Panel unrolled(const Panel& polar) {
  Panel panel = polar;
  panel.kind = Panel::Kind::cartesian;
  double radius = 0;
  for (Series& s : panel.series) {
    const Eigen::VectorXd angle = s.x, r = s.y;
    s.x = r.array() * angle.array().cos();
    s.y = r.array() * angle.array().sin();
    for (const double v : r) radius = std::isfinite(v) ? std::max(radius, v) : radius;
  }
  panel.annotations.clear();
  panel.x = {"angle zero to the right", polar.y.unit, Scale::linear, -radius, radius};
  panel.y = {polar.y.label, polar.y.unit, Scale::linear, -radius, radius};
  return panel;
}

/// The heat map in shades, lightest for the smallest; several cells in one character show their largest.
std::string shades(const HeatMap& map, const PanelLimits& limits, const Panel& panel, int row, int rows, int columns) {
  static constexpr const char* kShades[] = {" ", "░", "▒", "▓", "█"};
  const Limits color = color_limits(map);
  const auto range = [](double low, double high, double first, double last, Index n) {
    // Cells whose centre lies in [low, high]; the nearest one when none does.
    const double step = n > 1 ? (last - first) / static_cast<double>(n - 1) : 1;
    const auto from = static_cast<Index>(std::ceil((low - first) / step)),
               to = static_cast<Index>(std::floor((high - first) / step));
    const Index near = std::lround((0.5 * (low + high) - first) / step);
    return from > to ? std::pair{near, near} : std::pair{from, to};
  };
  const auto shown = [](const Limits& l, double fraction) { return l.low + fraction * (l.high - l.low); };
  const auto [i0, i1] = range(shown(limits.y, 1 - (row + 1.0) / rows) * panel.y.unit.factor,
                              shown(limits.y, 1 - static_cast<double>(row) / rows) * panel.y.unit.factor, map.y_low,
                              map.y_high, map.values.rows());
  std::string out;
  for (int c = 0; c < columns; ++c) {
    const auto [j0, j1] =
        range(shown(limits.x, static_cast<double>(c) / columns) * panel.x.unit.factor,
              shown(limits.x, (c + 1.0) / columns) * panel.x.unit.factor, map.x_low, map.x_high, map.values.cols());
    double largest = NAN;
    for (Index j = std::max<Index>(0, j0); j <= std::min(j1, map.values.cols() - 1); ++j) {
      for (Index i = std::max<Index>(0, i0); i <= std::min(i1, map.values.rows() - 1); ++i)
        largest = std::fmax(largest, map.values(i, j));
    }
    const double f = color.fraction(largest / map.color.unit.factor);
    out += std::isnan(f) ? " " : kShades[std::clamp(static_cast<int>(5 * f), 0, 4)];
  }
  return out;
}

std::string draw_panel(const Panel& panel, const TerminalOptions& options) {
  const PanelLimits limits = find_limits(panel);
  const Ticks y = ticks_of(limits.y, options.rows, 3.0);
  std::size_t margin = 0;
  for (const std::string& label : y.labels) margin = std::max(margin, display_width(label));
  const int columns = options.columns - static_cast<int>(margin) - 2;
  const Ticks x = ticks_of(limits.x, columns, 12.0);

  Dots dots(columns, options.rows);
  std::string legend;
  if (!panel.heat_maps.empty()) {
    const Limits color = color_limits(panel.heat_maps.front());
    legend = fmt::format("░▒▓█ {:g} to {:g} {}", color.low, color.high, axis_text(panel.heat_maps.front().color, 0));
  }
  int next = 0;
  for (const Series& s : panel.series) {
    if (!panel.heat_maps.empty()) break;
    const int color = s.style.color == Style::kNext ? next++ % 6 : s.style.color;
    draw_series(dots, panel, limits, s, color);
    if (!s.name.empty()) legend += (legend.empty() ? "" : ", ") + s.name;
  }

  std::string out = panel.title.empty() ? "" : panel.title + "\n";
  out += axis_text(panel.y, y.exponent) + (legend.empty() ? "" : "   (" + legend + ")") + "\n";
  std::vector<std::string> row_labels(static_cast<std::size_t>(options.rows));
  for (std::size_t i = 0; i < y.major.size(); ++i) {
    const double row = (1 - limits.y.fraction(y.major[i])) * (options.rows - 1);
    row_labels[static_cast<std::size_t>(std::clamp(std::lround(row), 0L, options.rows - 1L))] = y.labels[i];
  }
  for (int r = 0; r < options.rows; ++r) {
    const std::string& label = row_labels[static_cast<std::size_t>(r)];
    out += pad_left(label, margin) + (label.empty() ? "│" : "┤") +
           (panel.heat_maps.empty() ? dots.row(r, options.color)
                                    : shades(panel.heat_maps.front(), limits, panel, r, options.rows, columns)) +
           "\n";
  }
  std::string ruler(margin, ' '), numbers;
  ruler += "└";
  std::vector<bool> ticked(static_cast<std::size_t>(columns), false);
  for (std::size_t i = 0; i < x.major.size(); ++i) {
    const auto at = static_cast<std::size_t>(std::lround(limits.x.fraction(x.major[i]) * (columns - 1)));
    ticked[at] = true;
    const std::size_t width = display_width(x.labels[i]), centre = margin + 1 + at;
    const std::size_t from = centre > width / 2 ? centre - width / 2 : 0, used = display_width(numbers);
    if (from < used + (used == 0 ? 0 : 1)) continue;
    numbers += std::string(from - used, ' ') + x.labels[i];
  }
  for (const bool tick : ticked) ruler += tick ? "┬" : "─";
  out += ruler + "\n" + numbers + "\n";
  const std::string name = axis_text(panel.x, x.exponent);
  const std::size_t free =
      static_cast<std::size_t>(options.columns) - std::min<std::size_t>(display_width(name), options.columns);
  return out + std::string(free / 2, ' ') + name + "\n";
}

}  // namespace

std::string to_terminal(const Figure& figure, const TerminalOptions& options) {
  require_range("columns", options.columns, 40, 1000);
  require_range("rows", options.rows, 4, 200);
  std::string out = figure.title.empty() ? "" : figure.title + "\n";
  for (const std::string& run : figure.runs) out += run + "\n";
  for (const Panel& panel : figure.panels) {
    check_panel(panel);
    if (panel.kind == Panel::Kind::projected || !panel.categories.empty()) {
      out += fmt::format("[panel '{}' is not drawn in a terminal]\n", panel.title);
    } else {
      out += draw_panel(panel.kind == Panel::Kind::polar ? unrolled(panel) : panel, options);
    }
  }
  return out;
}

}  // namespace whirl::report
