#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "whirl/report/figure.hpp"

namespace whirl::report {

/// A rectangle of the drawing, px, y downwards.
struct Box {
  double x = 0, y = 0, width = 0, height = 0;
  double right() const { return x + width; }
  double bottom() const { return y + height; }
};

/// Estimated width of text in px: enough to keep labels apart in the fonts of the style sheet.
double text_width(std::string_view text, double size = 11);

/// Path data with coordinates in tenths of a pixel, written relative to the last point to stay short.
class Path {
 public:
  void move(double x, double y);
  /// Line to the point; a point that rounds to the last one is left out.
  void line(double x, double y);
  void close() { data_ += 'z'; }
  const std::string& data() const { return data_; }
  bool empty() const { return data_.empty(); }

 private:
  std::string data_;
  long x_ = 0, y_ = 0;
  bool moved_ = false;  ///< nothing drawn since the last move
};

enum class Anchor { start, middle, end };

/// Appends SVG elements to a text.
class Canvas {
 public:
  void raw(std::string_view markup) { out_ += markup; }
  void line(double x1, double y1, double x2, double y2, std::string_view css);
  void rect(const Box& box, std::string_view css, std::string_view extra = "");
  void path(const Path& path, std::string_view css, std::string_view extra = "");
  /// A line that goes through these instants again and again, `seconds` each time; without animation the first.
  void moving(const std::vector<Eigen::Matrix2Xd>& instants, int seconds, std::string_view css, std::string_view extra);
  /// Text with its baseline at y; `angle` in degrees, clockwise about the point.
  void text(double x, double y, std::string_view text, Anchor anchor = Anchor::start, std::string_view css = "",
            double angle = 0);
  void mark(double x, double y, Mark mark, int color, double opacity = 1);
  /// Everything until end_clip() is cut at the box.
  void begin_clip(const Box& box, std::string_view extra = "");
  void end_clip() { out_ += "</svg>\n"; }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

/// One decimal, without trailing zeros: deterministic and short.
std::string px(double value);
/// Stroke attributes of a line in this style (the colour comes from the class).
std::string stroke(const Style& style);

}  // namespace whirl::report
