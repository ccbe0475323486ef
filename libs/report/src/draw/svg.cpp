#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drawing.hpp"
#include "whirl/core/error.hpp"

namespace whirl::report {
namespace {

constexpr double kTitleHeight = 22;
constexpr double kGap = 14;  ///< between panels, px
constexpr double kColorBarWidth = 86;
constexpr double kRunLine = 15;  ///< of the lines about the runs, px

double widest(const std::vector<std::string>& labels) {
  double width = 0;
  for (const std::string& label : labels) width = std::max(width, text_width(label));
  return width;
}

void resolve_colors(Panel& panel) {
  int next = 0;
  for (Series& s : panel.series) {
    if (s.style.color == Style::kNext) s.style.color = next++ % 6;
    if (s.style.color < 0 || s.style.color > 7) {
      throw Error::in_field("color", std::to_string(s.style.color), "0 to 7, or Style::kNext");
    }
  }
}

/// Text broken at spaces into lines of at most `width` px where possible.
std::vector<std::string> wrap(const std::string& text, double width) {
  std::vector<std::string> lines{""};
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(' ', from), text.size());
    const std::string word = text.substr(from, to - from);
    const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
    if (!lines.back().empty() && text_width(longer) > width) {
      lines.push_back(word);
    } else {
      lines.back() = longer;
    }
    from = to + 1;
  }
  return lines;
}

/// Widens one axis so that a unit is equally long on both; the plot area keeps its size.
void equalise(PanelLimits& limits, const Panel& panel, double width, double height) {
  const double unit_x = panel.x.unit.factor, unit_y = panel.y.unit.factor;
  const double span_x = (limits.x.high - limits.x.low) * unit_x, span_y = (limits.y.high - limits.y.low) * unit_y;
  const double per_px = std::max(span_x / width, span_y / height);
  const double add_x = 0.5 * (per_px * width - span_x) / unit_x, add_y = 0.5 * (per_px * height - span_y) / unit_y;
  limits.x.low -= add_x;
  limits.x.high += add_x;
  limits.y.low -= add_y;
  limits.y.high += add_y;
}

void find_ticks(PanelLayout& layout, double width) {
  const Panel& panel = layout.panel;
  const double height = panel.height;
  if (panel.kind == Panel::Kind::polar) {
    layout.y = ticks_of(layout.limits.y, 0.5 * height, 34);
    return;
  }
  if (panel.kind == Panel::Kind::projected) {
    layout.x = ticks_of(layout.limits.x, 0.72 * width, 80);
    layout.y = ticks_of(layout.limits.y, 0.3 * width, 44);
    layout.z = ticks_of(layout.limits.z, 0.56 * height, 34);
    return;
  }
  layout.y = ticks_of(layout.limits.y, height, 34);
  if (panel.categories.empty()) {
    // Room for the widest label: first with the usual distance, then with the one the labels need.
    layout.x = ticks_of(layout.limits.x, width, 56);
    const double need = widest(layout.x.labels) + 20;
    if (need > 56) layout.x = ticks_of(layout.limits.x, width, need);
    return;
  }
  const double slot = width / (layout.limits.x.high - layout.limits.x.low);
  for (std::size_t i = 0; i < panel.categories.size(); ++i) {
    layout.x.major.push_back(static_cast<double>(i));
    layout.category_lines.push_back(wrap(panel.categories[i], slot - 6));
  }
}

void find_margins(PanelLayout& layout) {
  const Panel& panel = layout.panel;
  layout.top = (panel.title.empty() ? 8 : kTitleHeight) + (layout.legend_height > 0 ? layout.legend_height + 4 : 0);
  if (panel.kind == Panel::Kind::polar) {
    layout.left = layout.right = 10;
    layout.bottom = 22;
    return;
  }
  if (panel.kind == Panel::Kind::projected) {
    layout.left = 7 + std::max(widest(layout.z.labels), 26.0) + 26;
    layout.right = 12;
    layout.bottom = 24;
    return;
  }
  layout.left = 7 + widest(layout.y.labels) + 9 + 14;
  layout.right = panel.heat_maps.empty() ? 14 : kColorBarWidth;
  std::size_t lines = 1;
  for (const auto& label : layout.category_lines) lines = std::max(lines, label.size());
  const bool named = !axis_text(panel.x, layout.x.exponent).empty();
  layout.bottom = layout.x_labels ? 22.0 + 13.0 * static_cast<double>(lines - 1) + (named ? 18 : 0) : 8;
}

/// Room above the data for labels at the upper edge, unless the limit is given.
void add_head_room(PanelLayout& layout) {
  const Panel& panel = layout.panel;
  if (panel.kind != Panel::Kind::cartesian || !panel.heat_maps.empty() || !std::isnan(panel.y.high)) return;
  const auto labelled = [](const auto& item) { return item.direction == Direction::vertical && !item.label.empty(); };
  const auto spans = std::count_if(panel.spans.begin(), panel.spans.end(), labelled);
  const auto lines = std::count_if(panel.lines.begin(), panel.lines.end(), labelled);
  const double rows = (spans > 0 ? 1 : 0) + (lines > 2 ? 2.0 : lines > 0 ? 1.0 : 0.0);
  const double room = std::min(0.4 * panel.height, 14 * rows);
  Limits& y = layout.limits.y;
  const double share = room / (panel.height - room);
  y.high =
      y.logarithmic ? std::min(1e305, y.high * std::pow(y.high / y.low, share)) : y.high + (y.high - y.low) * share;
}

/// Cartesian panels of one column get the same x limits. Throws Error when their scales differ.
void join_x_limits(std::vector<PanelLayout>& layouts, std::size_t columns) {
  for (std::size_t c = 0; c < columns; ++c) {
    std::vector<PanelLayout*> column;
    for (std::size_t i = c; i < layouts.size(); i += columns) {
      if (layouts[i].panel.kind == Panel::Kind::cartesian) column.push_back(&layouts[i]);
    }
    double low = INFINITY, high = -INFINITY;
    for (const PanelLayout* layout : column) {
      if (layout->limits.x.logarithmic != column.front()->limits.x.logarithmic) {
        throw Error(fmt::format("figure: panels '{}' and '{}' share x: must have the same scale",
                                column.front()->panel.title, layout->panel.title));
      }
      low = std::min(low, layout->limits.x.low);
      high = std::max(high, layout->limits.x.high);
    }
    for (PanelLayout* layout : column) {
      layout->limits.x.low = low;
      layout->limits.x.high = high;
      layout->x_labels = layout == column.back();
    }
  }
}

/// Columns of panels side by side: their width and the margins that all panels of a column share.
struct Columns {
  std::size_t count;
  double cell;
  std::vector<double> left, right;
  double width(std::size_t c) const { return cell - left[c] - right[c]; }
};

std::vector<PanelLayout> layouts_of(const Figure& figure) {
  std::vector<PanelLayout> layouts;
  for (const Panel& panel : figure.panels) {
    check_panel(panel);
    PanelLayout layout;
    layout.panel = panel;
    resolve_colors(layout.panel);
    layout.limits = find_limits(panel);
    add_head_room(layout);
    layouts.push_back(std::move(layout));
  }
  return layouts;
}

/// Margins first with the cell's width, then once more with the width they leave (equal aspect moves the limits).
void settle_margins(std::vector<PanelLayout>& layouts, Columns& columns) {
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t i = 0; i < layouts.size(); ++i) {
      PanelLayout& layout = layouts[i];
      const double width = std::max(40.0, pass == 0 ? columns.cell - 80 : columns.width(i % columns.count));
      if (layout.panel.equal_aspect) equalise(layout.limits, layout.panel, width, layout.panel.height);
      layout.category_lines.clear();
      layout.x = {};
      find_ticks(layout, width);
      layout.legend_height = legend_height(layout.panel, width);
      find_margins(layout);
    }
    for (std::size_t c = 0; c < columns.count; ++c) {
      columns.left[c] = columns.right[c] = 0;
      for (std::size_t i = c; i < layouts.size(); i += columns.count) {
        columns.left[c] = std::max(columns.left[c], layouts[i].left);
        columns.right[c] = std::max(columns.right[c], layouts[i].right);
      }
    }
  }
}

/// Puts the panels into rows; the height of all of them.
double place_rows(std::vector<PanelLayout>& layouts, const Columns& columns) {
  double y = 0;
  for (std::size_t row = 0; row < layouts.size(); row += columns.count) {
    const std::size_t end = std::min(row + columns.count, layouts.size());
    double top = 0, height = 0, bottom = 0;
    for (std::size_t i = row; i < end; ++i) {
      top = std::max(top, layouts[i].top);
      height = std::max(height, layouts[i].panel.height);
      bottom = std::max(bottom, layouts[i].bottom);
    }
    for (std::size_t i = row; i < end; ++i) {
      const std::size_t c = i - row;
      PanelLayout& layout = layouts[i];
      layout.left = columns.left[c];
      layout.plot = {static_cast<double>(c) * (columns.cell + kGap) + columns.left[c], y + top, columns.width(c),
                     layout.panel.height};
      if (layout.panel.equal_aspect) equalise(layout.limits, layout.panel, layout.plot.width, layout.plot.height);
    }
    y += top + height + bottom + (end < layouts.size() ? 6 : 2);
  }
  return y;
}

void draw_panel(Canvas& canvas, const PanelLayout& layout) {
  const double title_y = layout.plot.y - (layout.legend_height > 0 ? layout.legend_height + 4 : 0) - 7;
  canvas.text(layout.plot.x, title_y, layout.panel.title, Anchor::start, "title");
  switch (layout.panel.kind) {
    case Panel::Kind::cartesian:
      draw_cartesian(canvas, layout);
      break;
    case Panel::Kind::polar:
      draw_polar(canvas, layout);
      break;
    case Panel::Kind::projected:
      draw_projected(canvas, layout);
      break;
  }
}

}  // namespace

std::string to_svg(const Figure& figure, const SvgOptions& options) {
  if (figure.panels.empty()) throw Error(fmt::format("figure '{}' has no panel", figure.title));
  if (figure.columns < 1) throw Error::in_field("columns", std::to_string(figure.columns), "at least 1");
  Columns columns;
  columns.count = std::min(static_cast<std::size_t>(figure.columns), figure.panels.size());
  columns.cell = (figure.width - kGap * static_cast<double>(columns.count - 1)) / static_cast<double>(columns.count);
  columns.left.assign(columns.count, 0);
  columns.right.assign(columns.count, 0);

  std::vector<PanelLayout> layouts = layouts_of(figure);
  if (figure.shared_x) join_x_limits(layouts, columns.count);
  settle_margins(layouts, columns);
  const double below = place_rows(layouts, columns);
  std::vector<std::string> runs;
  for (const std::string& run : figure.runs) {
    for (std::string& line : wrap(run, figure.width - 16)) runs.push_back(std::move(line));
  }
  const double height = below + kRunLine * static_cast<double>(runs.size()) + (runs.empty() ? 0 : 5);

  Canvas canvas;
  canvas.raw(
      fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"wf\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
                  "height=\"{1}\" role=\"img\">\n",
                  px(figure.width), px(height)));
  if (!figure.title.empty()) canvas.raw(fmt::format("<title>{}</title>\n", escape_markup(figure.title)));
  if (!figure.description.empty()) canvas.raw(fmt::format("<desc>{}</desc>\n", escape_markup(figure.description)));
  if (!options.embedded) {
    canvas.raw("<style>" + figure_style(false) + "</style>\n");
    canvas.rect({0, 0, figure.width, height}, "page");
  }
  int panels = 0;
  for (PanelLayout& layout : layouts) {
    if (options.embedded) layout.id = panels++;
    draw_panel(canvas, layout);
  }
  for (std::size_t i = 0; i < runs.size(); ++i)
    canvas.text(8, below + kRunLine * static_cast<double>(i + 1) - 2, runs[i], Anchor::start, "run");
  canvas.raw("</svg>\n");
  return canvas.take();
}

}  // namespace whirl::report
