#pragma once
#include <functional>
#include <vector>

#include "canvas.hpp"
#include "scaling.hpp"

namespace whirl::report {

/// A panel with everything decided but its place: styles resolved, limits and ticks found, margins known.
struct PanelLayout {
  Panel panel;  ///< copy with colours resolved
  PanelLimits limits;
  Ticks x, y, z;
  std::vector<std::vector<std::string>> category_lines;  ///< labels of categories, broken into lines
  double left = 0, right = 0, top = 0, bottom = 0;       ///< margins around the plot area, px
  double legend_height = 0;
  bool x_labels = true;
  Box plot;
  int id = -1;  ///< of the panel in its figure, for the script of a page; -1: a drawing without
};

void draw_cartesian(Canvas& canvas, const PanelLayout& layout);
void draw_polar(Canvas& canvas, const PanelLayout& layout);
void draw_projected(Canvas& canvas, const PanelLayout& layout);
/// Arrow of the rotation and probes of a panel at the rim of `plot`; of a round one when `radius` > 0.
void draw_machine(Canvas& canvas, const Panel& panel, const Box& plot, double radius = 0);
void draw_legend(Canvas& canvas, const PanelLayout& layout);
/// Height of the legend when it wraps at `width`, px; 0 without named series.
double legend_height(const Panel& panel, double width);

/// Draws `points` (2 x n, px; NaN is a gap) as line and marks of the series.
void draw_points(Canvas& canvas, const Series& series, const Eigen::Matrix2Xd& points);

/// Keeps texts inside the plot apart: greedy, in the order given.
class LabelPlacer {
 public:
  explicit LabelPlacer(const Box& area) : area_(area) {}
  /// Writes the text at the first of the candidate baselines (x, y of the middle of the text) where it fits; at the
  /// first one inside the area when none does.
  void place(Canvas& canvas, std::string_view text, const std::vector<Eigen::Vector2d>& candidates);

  void reserve(const Box& box) { taken_.push_back(box); }

 private:
  Box area_;
  std::vector<Box> taken_;
};

/// Data URI of a PNG image with the map's colours, first row of `values` at the bottom. Missing values are transparent.
std::string png_data_uri(const Eigen::MatrixXd& values, const Limits& limits, double factor);

}  // namespace whirl::report
