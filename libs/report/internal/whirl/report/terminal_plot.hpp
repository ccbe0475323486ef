#pragma once
#include <string>

#include "whirl/report/figure.hpp"

namespace whirl::report {

struct TerminalOptions {
  int columns = 100;   ///< of the terminal, >= 40; with the axis labels
  int rows = 16;       ///< text rows of one plot area, >= 4
  bool color = false;  ///< ANSI colours, one per series
};

/// The panels of a figure in braille characters (2 x 4 dots each), one below the other: lines, steps, scatter,
/// stems and bars; long lines are drawn from the extremes of every dot column. A heat map is drawn in five shades, a
/// polar panel as the path of its points; projected panels and bar charts with categories are named and left out.
/// Limits and ticks are those of `to_svg`. Throws Error as `to_svg` does.
std::string to_terminal(const Figure& figure, const TerminalOptions& options = {});

}  // namespace whirl::report
