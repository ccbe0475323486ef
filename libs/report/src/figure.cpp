#include "whirl/report/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "whirl/core/error.hpp"
#include "whirl/report/units.hpp"

namespace whirl::report {
namespace {

using Eigen::VectorXd;

Series& add(Panel& panel, Series::Kind kind, std::string name, VectorXd x, VectorXd y, Style style) {
  Series s;
  s.kind = kind;
  s.name = std::move(name);
  s.x = std::move(x);
  s.y = std::move(y);
  s.style = style;
  return panel.series.emplace_back(std::move(s));
}

}  // namespace

Series& Panel::line(std::string name, VectorXd xs, VectorXd ys, Style style) {
  return add(*this, Series::Kind::line, std::move(name), std::move(xs), std::move(ys), style);
}
Series& Panel::scatter(std::string name, VectorXd xs, VectorXd ys, Style style) {
  if (style.mark == Mark::none) style.mark = Mark::circle;
  return add(*this, Series::Kind::scatter, std::move(name), std::move(xs), std::move(ys), style);
}
Series& Panel::step(std::string name, VectorXd xs, VectorXd ys, Style style) {
  return add(*this, Series::Kind::step, std::move(name), std::move(xs), std::move(ys), style);
}
Series& Panel::stem(std::string name, VectorXd xs, VectorXd ys, Style style) {
  if (style.mark == Mark::none) style.mark = Mark::circle;
  return add(*this, Series::Kind::stem, std::move(name), std::move(xs), std::move(ys), style);
}
Series& Panel::bars(std::string name, VectorXd xs, VectorXd ys, Style style) {
  return add(*this, Series::Kind::bars, std::move(name), std::move(xs), std::move(ys), style);
}
Series& Panel::band(std::string name, VectorXd xs, VectorXd low, VectorXd high, Style style) {
  Series& s = add(*this, Series::Kind::band, std::move(name), std::move(xs), {}, style);
  s.low = std::move(low);
  s.high = std::move(high);
  return s;
}
Series& Panel::error_bars(std::string name, VectorXd xs, VectorXd ys, VectorXd low, VectorXd high, Style style) {
  if (style.mark == Mark::none) style.mark = Mark::circle;
  Series& s = add(*this, Series::Kind::errors, std::move(name), std::move(xs), std::move(ys), style);
  s.low = std::move(low);
  s.high = std::move(high);
  return s;
}
Series& Panel::line3(std::string name, VectorXd xs, VectorXd ys, VectorXd zs, Style style) {
  Series& s = add(*this, Series::Kind::line, std::move(name), std::move(xs), std::move(ys), style);
  s.z = std::move(zs);
  return s;
}

Series& Panel::histogram(std::string name, const VectorXd& values, int bins, Style style) {
  if (bins < 1) throw Error::in_field("bins", std::to_string(bins), "at least 1");
  double low = INFINITY, high = -INFINITY;
  for (const double v : values) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  if (!(low <= high)) throw Error(fmt::format("figure: histogram '{}' has no finite value", name));
  if (low == high) low -= 0.5, high += 0.5;
  const double width = (high - low) / bins;
  VectorXd counts = VectorXd::Zero(bins);
  for (const double v : values) {
    if (std::isfinite(v)) counts(std::min<Eigen::Index>(bins - 1, static_cast<Eigen::Index>((v - low) / width))) += 1;
  }
  const VectorXd centres = VectorXd::LinSpaced(bins, low + 0.5 * width, high - 0.5 * width);
  return bars(std::move(name), centres, counts, style);
}

void Panel::vertical(double at, std::string label, Style style) {
  lines.push_back({Direction::vertical, at, std::move(label), style});
}
void Panel::horizontal(double at, std::string label, Style style) {
  lines.push_back({Direction::horizontal, at, std::move(label), style});
}
void Panel::span(double low, double high, std::string label, int color) {
  spans.push_back({Direction::vertical, low, high, std::move(label), color});
}
void Panel::annotate(double at_x, double at_y, std::string text, bool above) {
  annotations.push_back({at_x, at_y, std::move(text), above});
}

void show_y_as(Panel& panel, Quantity quantity) {
  double largest = 0;
  for (const Series& s : panel.series) {
    for (const double v : s.y) largest = std::isfinite(v) ? std::max(largest, std::abs(v)) : largest;
  }
  panel.y.unit = engineering_unit(quantity, largest);
}

Panel& Figure::panel(std::string panel_title, Axis x, Axis y) {
  Panel p;
  p.title = std::move(panel_title);
  p.x = std::move(x);
  p.y = std::move(y);
  return panels.emplace_back(std::move(p));
}

namespace {

struct CsvColumn {
  std::string name, unit;  // "series: label", "[unit]"
  std::string abscissa;    // label and unit where it is one
  VectorXd shown;
};

// Abscissas of one kind that are all the same: the first stands for them.
void share_abscissas(std::vector<CsvColumn>& columns) {
  const auto same = [](const VectorXd& a, const VectorXd& b) {
    return a.size() == b.size() && (a.array() == b.array() || (a.array().isNaN() && b.array().isNaN())).all();
  };
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k].abscissa.empty()) continue;
    const auto alike = [&](const CsvColumn& c) { return c.abscissa == columns[k].abscissa; };
    if (!std::ranges::all_of(columns, [&](const auto& c) { return !alike(c) || same(c.shown, columns[k].shown); }))
      continue;
    for (std::size_t i = columns.size(); i-- > k + 1;)
      if (alike(columns[i])) columns.erase(columns.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace

std::string to_csv(const Figure& figure) {
  std::vector<CsvColumn> columns;
  const auto add_column = [&](const std::string& of, const Axis& axis, const std::string& suffix, const VectorXd& v,
                              bool abscissa = false) {
    if (v.size() == 0) return;
    const std::string unit = axis.unit.symbol.empty() ? "" : " [" + axis.unit.symbol + "]";
    columns.push_back({of + axis.label + suffix, unit, abscissa ? axis.label + unit : "", v / axis.unit.factor});
  };
  for (const Panel& panel : figure.panels) {
    for (const Series& s : panel.series) {
      const std::string of = (panel.title.empty() ? "" : panel.title + ": ") + (s.name.empty() ? "" : s.name + ": ");
      add_column(of, panel.x, "", s.x, true);
      add_column(of, panel.y, "", s.y);
      add_column(of, panel.y, " low", s.low);
      add_column(of, panel.y, " high", s.high);
      add_column(of, panel.z, "", s.z);
    }
    for (const HeatMap& map : panel.heat_maps) {
      // One row per place along x, one column per place along y: as the samples of a record, which is read again.
      const Eigen::Index rows = map.values.rows(), cols = map.values.cols();
      const std::string of = panel.title.empty() ? "" : panel.title + ": ";
      add_column(of, panel.x, "", VectorXd::LinSpaced(cols, map.x_low, map.x_high), true);
      const VectorXd ys = VectorXd::LinSpaced(rows, map.y_low, map.y_high);
      for (Eigen::Index i = 0; i < rows; ++i) {
        add_column(of, map.color, fmt::format(" at {:.6g} {}", ys(i) / panel.y.unit.factor, panel.y.unit.symbol),
                   map.values.row(i).transpose());
      }
    }
  }
  share_abscissas(columns);
  std::string out;
  Eigen::Index rows = 0;
  std::map<std::string, int> before;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const int count = ++before[columns[c].name + columns[c].unit];
    const std::string name = count == 1 ? columns[c].name : fmt::format("{} {}", columns[c].name, count);
    out += (c == 0 ? "" : ",") + escape_csv(name + columns[c].unit);
    rows = std::max(rows, columns[c].shown.size());
  }
  out += '\n';
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (c > 0) out += ',';
      if (i < columns[c].shown.size() && !std::isnan(columns[c].shown(i))) {
        out += fmt::format("{:.9g}", columns[c].shown(i));
      }
    }
    out += '\n';
  }
  return out;
}

}  // namespace whirl::report
