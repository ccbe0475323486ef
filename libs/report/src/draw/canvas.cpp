#include "canvas.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace whirl::report {
namespace {

/// Far outside any drawing the place does not matter; lround needs a number that fits.
long to_tenths(double px) { return std::lround(std::clamp(std::isnan(px) ? 0 : px, -1e6, 1e6) * 10); }

std::string tenths(long value) {
  if (value % 10 == 0) return std::to_string(value / 10);
  const long whole = std::labs(value) / 10;
  return fmt::format("{}{}.{}", value < 0 ? "-" : "", whole == 0 ? "" : std::to_string(whole), std::labs(value) % 10);
}

void append_pair(std::string& out, long x, long y) {
  out += tenths(x);
  const std::string second = tenths(y);
  if (second.front() != '-') out += ' ';
  out += second;
}

}  // namespace

double text_width(std::string_view text, double size) {
  double em = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0) == 0x80) continue;  // continuation byte of a character already counted
    const bool narrow = std::string_view(" .,:;'|!ijl()[]").find(c) != std::string_view::npos;
    const bool wide = std::string_view("mwMW%@").find(c) != std::string_view::npos;
    em += narrow ? 0.36 : wide ? 0.95 : (c >= 'A' && c <= 'Z') ? 0.7 : 0.61;
  }
  return em * size;
}

std::string px(double value) { return tenths(to_tenths(value)); }

std::string stroke(const Style& style) {
  std::string out = fmt::format("stroke-width=\"{}\"", px(style.width));
  if (style.dash == Dash::dashed) out += " stroke-dasharray=\"6 4\"";
  if (style.dash == Dash::dotted) out += " stroke-dasharray=\"1.5 3\"";
  if (style.opacity < 1) out += fmt::format(" opacity=\"{:.2f}\"", style.opacity);
  return out;
}

void Path::move(double x, double y) {
  x_ = to_tenths(x);
  y_ = to_tenths(y);
  data_ += 'M';
  append_pair(data_, x_, y_);
  moved_ = true;
}

void Path::line(double x, double y) {
  const long to_x = to_tenths(x), to_y = to_tenths(y);
  if (to_x == x_ && to_y == y_) return;
  if (moved_) data_ += 'l';
  std::string step;
  append_pair(step, to_x - x_, to_y - y_);
  if (!moved_ && step.front() != '-') data_ += ' ';
  data_ += step;
  moved_ = false;
  x_ = to_x;
  y_ = to_y;
}

void Canvas::line(double x1, double y1, double x2, double y2, std::string_view css) {
  out_ += fmt::format("<path class=\"{}\" d=\"M{} {}L{} {}\"/>\n", css, px(x1), px(y1), px(x2), px(y2));
}

void Canvas::rect(const Box& box, std::string_view css, std::string_view extra) {
  out_ += fmt::format("<rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"{}{}/>\n", css, px(box.x),
                      px(box.y), px(box.width), px(box.height), extra.empty() ? "" : " ", extra);
}

void Canvas::path(const Path& path, std::string_view css, std::string_view extra) {
  if (path.empty()) return;
  out_ += fmt::format("<path class=\"{}\"{}{} d=\"{}\"/>\n", css, extra.empty() ? "" : " ", extra, path.data());
}

void Canvas::moving(const std::vector<Eigen::Matrix2Xd>& instants, int seconds, std::string_view css,
                    std::string_view extra) {
  std::vector<std::string> lists;
  for (const Eigen::Matrix2Xd& points : instants) {
    std::string& list = lists.emplace_back();
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      list += fmt::format("{}{} {}", i > 0 ? " " : "", px(points(0, i)), px(points(1, i)));
  }
  out_ += fmt::format(
      "<polyline fill=\"none\" class=\"{}\" {} points=\"{}\"><animate attributeName=\"points\" dur=\"{}s\" "
      "repeatCount=\"indefinite\" values=\"{}\"/></polyline>\n",
      css, extra, lists.front(), seconds, fmt::join(lists, ";"));
}

void Canvas::text(double x, double y, std::string_view text, Anchor anchor, std::string_view css, double angle) {
  if (text.empty()) return;
  out_ += fmt::format("<text x=\"{}\" y=\"{}\"", px(x), px(y));
  if (!css.empty()) out_ += fmt::format(" class=\"{}\"", css);
  if (anchor == Anchor::middle) out_ += " text-anchor=\"middle\"";
  if (anchor == Anchor::end) out_ += " text-anchor=\"end\"";
  if (angle != 0) out_ += fmt::format(" transform=\"rotate({} {} {})\"", px(angle), px(x), px(y));
  out_ += fmt::format(">{}</text>\n", escape_markup(text));
}

void Canvas::mark(double x, double y, Mark mark, int color, double opacity) {
  const std::string alpha = opacity < 1 ? fmt::format(" opacity=\"{:.2f}\"", opacity) : "";
  const std::string at = fmt::format("M{} {}", px(x), px(y));
  const auto filled = [&](std::string_view shape) {
    out_ += fmt::format("<path class=\"f{}\"{} d=\"{}{}\"/>\n", color, alpha, at, shape);
  };
  const auto open = [&](std::string_view shape) {
    out_ += fmt::format("<path class=\"s{}\" stroke-width=\"1.4\"{} d=\"{}{}\"/>\n", color, alpha, at, shape);
  };
  switch (mark) {
    case Mark::none:
      break;
    case Mark::circle:
      filled("m-2.8 0a2.8 2.8 0 1 0 5.6 0a2.8 2.8 0 1 0-5.6 0z");
      break;
    case Mark::square:
      filled("m-2.5-2.5h5v5h-5z");
      break;
    case Mark::triangle:
      filled("m0-3.2l3.2 5.6h-6.4z");
      break;
    case Mark::diamond:
      filled("m0-3.5l3.5 3.5l-3.5 3.5l-3.5-3.5z");
      break;
    case Mark::cross:
      open("m-3-3l6 6m0-6l-6 6");
      break;
    case Mark::plus:
      open("m-3.5 0h7m-3.5-3.5v7");
      break;
  }
}

void Canvas::begin_clip(const Box& box, std::string_view extra) {
  // A nested <svg> clips without an id, which would have to be unique over all figures of a page.
  out_ += fmt::format("<svg x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" viewBox=\"{0} {1} {2} {3}\"{4}>\n",
                      px(box.x), px(box.y), px(box.width), px(box.height), extra);
}

}  // namespace whirl::report
