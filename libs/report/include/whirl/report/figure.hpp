#pragma once
#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "whirl/report/format.hpp"

namespace whirl::report {

/// Figures are values: they hold the full data in SI units, an axis says in which unit it is shown. NaN is a gap.

inline constexpr double kAutomatic = std::numeric_limits<double>::quiet_NaN();

enum class Scale { linear, logarithmic };

/// One axis of a panel.
struct Axis {
  std::string label;  ///< quantity in words, with peak / p-p / rms where it is an amplitude
  Unit unit;          ///< shown in brackets behind the label
  Scale scale = Scale::linear;
  double low = kAutomatic;   ///< SI; automatic limits enclose the data
  double high = kAutomatic;  ///< SI
};

enum class Mark { none, circle, square, triangle, diamond, cross, plus };
enum class Dash { solid, dashed, dotted };

/// Colours come from a palette that stays distinct for colour-blind readers (Okabe and Ito): 0 blue, 1 vermilion,
/// 2 green, 3 purple, 4 orange, 5 sky blue, 6 text colour, 7 grey.
struct Style {
  static constexpr int kNext = -1;
  int color = kNext;   ///< 0..7; kNext takes the next colour of the panel
  double width = 1.2;  ///< line width, px
  Dash dash = Dash::solid;
  Mark mark = Mark::none;
  double opacity = 1;  ///< (0, 1]
};

/// One data set of a panel. All vectors have the same size unless noted.
struct Series {
  enum class Kind {
    line,     ///< polyline; marks too when the style asks for them
    scatter,  ///< marks only
    step,     ///< value held until the next x
    stem,     ///< line from zero, with a mark
    bars,     ///< bars centred on x, from zero; bars of several series in one panel stand beside each other
    band,     ///< area between `low` and `high`
    errors,   ///< error bars from `low` to `high` with a mark at y
  };
  Kind kind = Kind::line;
  std::string name;           ///< in the legend; not listed there when empty
  Eigen::VectorXd x;          ///< SI; time for time traces, angle in rad in a polar panel
  Eigen::VectorXd y;          ///< SI; radius in a polar panel; unused by bands
  Eigen::VectorXd z;          ///< SI; projected panels only
  Eigen::VectorXd low, high;  ///< SI; bands and error bars only
  /// Lines of projected panels that vibrate: y and z a quarter of a period later, SI. An SVG moves them, other formats
  /// show them at rest as they are. Empty: nothing moves.
  Eigen::VectorXd y_later, z_later;
  Style style;
};

/// Values over a regular grid, column j at x_low + j dx, row i at y_low + i dy (cell centres).
struct HeatMap {
  Eigen::MatrixXd values;        ///< SI (or dB); NaN cells stay empty
  double x_low = 0, x_high = 0;  ///< centre of the first and last column, SI
  double y_low = 0, y_high = 0;  ///< centre of the first and last row, SI
  Axis color;                    ///< label, unit, scale and limits of the colour bar
};

enum class Direction { horizontal, vertical };

/// A line across the panel at one value of y (horizontal) or x (vertical).
struct ReferenceLine {
  Direction direction = Direction::vertical;
  double value = 0;  ///< SI
  std::string label;
  Style style{.color = 6, .width = 1, .dash = Dash::dashed};
};

/// A shaded range of x (vertical) or y (horizontal), e.g. a segment of a run.
struct Span {
  Direction direction = Direction::vertical;
  double low = 0, high = 0;  ///< SI
  std::string label;
  int color = 7;
};

/// Text at a point of the data.
struct Annotation {
  double x = 0, y = 0;  ///< SI
  std::string text;
  bool above = false;  ///< centred above the point (values over bars); otherwise beside it where there is room
};

/// A displacement probe at the frame of a plot of the shaft's plane, drawn as a wedge that points to the shaft.
struct Probe {
  double angle = 0;  ///< rad, counter-clockwise from the right
  std::string name;  ///< beside it; may be empty
};

/// One pair (or triple) of axes with its data.
struct Panel {
  enum class Kind {
    cartesian,
    polar,      ///< x = angle in rad from the right, counter-clockwise or `clockwise`, y = radius
    projected,  ///< x, y, z in parallel projection; the x axis runs to the right and back
  };
  Kind kind = Kind::cartesian;
  std::string title;
  Axis x, y, z;
  bool clockwise = false;               ///< a polar angle grows clockwise
  bool equal_aspect = false;            ///< one unit is equally long on both axes (orbits)
  double height = 220;                  ///< of the plot area, px
  std::vector<std::string> categories;  ///< names of x = 0, 1, 2, ...: replaces the ticks of x (bar charts)
  std::vector<Series> series;
  std::vector<HeatMap> heat_maps;
  std::vector<ReferenceLine> lines;
  std::vector<Span> spans;
  std::vector<Annotation> annotations;
  std::vector<Probe> probes;
  bool rotation = false;  ///< an arrow in the corner: the shaft turns counter-clockwise

  /// Adds data and returns it, to change its style; the reference holds until the next series is added.
  Series& line(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Style style = {});
  Series& scatter(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Style style = {});
  Series& step(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Style style = {});
  Series& stem(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Style style = {});
  Series& bars(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Style style = {});
  Series& band(std::string name, Eigen::VectorXd x, Eigen::VectorXd low, Eigen::VectorXd high, Style style = {});
  Series& error_bars(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Eigen::VectorXd low, Eigen::VectorXd high,
                     Style style = {});
  Series& line3(std::string name, Eigen::VectorXd x, Eigen::VectorXd y, Eigen::VectorXd z, Style style = {});
  /// Counts of `values` in `bins` equal bins over their range, as bars. NaN values are not counted.
  Series& histogram(std::string name, const Eigen::VectorXd& values, int bins, Style style = {});
  void vertical(double x, std::string label, Style style = ReferenceLine{}.style);
  void horizontal(double y, std::string label, Style style = ReferenceLine{}.style);
  void span(double low, double high, std::string label, int color = 7);
  void annotate(double x, double y, std::string text, bool above = false);
};

/// Panels in a grid filled row by row, drawn together.
struct Figure {
  std::string title;        ///< for readers of the page's structure; the caption belongs to the document
  std::string description;  ///< what a person who cannot see the figure should know; the SVG's <desc>
  double width = 760;       ///< px
  int columns = 1;
  bool shared_x =
      false;  ///< Cartesian panels of one column have the same x: limits are joined, only the lowest has tick labels
  std::vector<Panel> panels;
  std::vector<std::string> runs;  ///< below the panels, a line each: the file and what the shaft did in it

  /// Adds a panel; the reference holds until the next one is added.
  Panel& panel(std::string panel_title, Axis x, Axis y);
};

struct SvgOptions {
  /// Inside a page: the style sheet of the page colours the figure (light and dark). Otherwise the SVG brings its own.
  bool embedded = false;
};

/// The figure as SVG text. The same figure gives the same text, byte for byte. Long lines are reduced to the extremes
/// per pixel column, so no peak is lost. Throws Error when vectors of a series differ in size, when nothing in a panel
/// is finite, or when a logarithmic axis has no positive value.
std::string to_svg(const Figure& figure, const SvgOptions& options = {});

/// Style sheet of the figures, with rules for a dark page when `dark_scheme`.
std::string figure_style(bool dark_scheme);

/// All data in the shown units, one column per vector, named "series: label [unit]"; an abscissa that all series share
/// stands once, a name that came before gets a number. Vectors of different length leave empty cells.
std::string to_csv(const Figure& figure);

}  // namespace whirl::report
