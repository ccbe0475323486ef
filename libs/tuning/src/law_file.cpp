#include "whirl/tuning/law_file.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/io/json.hpp"

namespace whirl::tuning {
namespace {

constexpr Eigen::Index kOrder = control::LinearAxis::kOrder;

struct Matrices {
  Eigen::MatrixXd a, b, c, d;
};

/// Place of a law in its file, as text and as values.
struct Place {
  io::JsonReader in;
  const io::Json* json;
  Place at(std::string_view key) const { return {in.at(key), json->find(key)}; }
};

bool nested(const io::Json& json) {
  const auto* array = json.get<io::Json::Array>();
  return array != nullptr && !array->empty() && array->front().get<io::Json::Array>() != nullptr;
}

/// Rows of numbers; a single row or column may be flat, a single number bare.
Eigen::MatrixXd read_matrix(const Place& place, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd out(rows, columns);
  std::vector<double> all;
  if (nested(*place.json)) {
    const auto items = place.in.items();
    if (static_cast<Eigen::Index>(items.size()) != rows)
      throw place.in.error(fmt::format("{} rows: must be {}", items.size(), rows));
    for (const io::JsonReader& item : items) {
      const std::vector<double> row = item.numbers();
      if (static_cast<Eigen::Index>(row.size()) != columns)
        throw item.error(fmt::format("{} numbers: must be {}", row.size(), columns));
      all.insert(all.end(), row.begin(), row.end());
    }
  } else {
    all = place.json->get<double>() != nullptr ? std::vector<double>{place.in.number()} : place.in.numbers();
    if (std::min(rows, columns) > 1 || static_cast<Eigen::Index>(all.size()) != rows * columns)
      throw place.in.error(fmt::format("{} numbers: must be {} rows of {}", all.size(), rows, columns));
  }
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    out(i / columns, i % columns) = all[static_cast<std::size_t>(i)];
    if (!std::isfinite(all[static_cast<std::size_t>(i)])) throw place.in.error("must be finite numbers");
  }
  return out;
}

Eigen::Index require_order(const io::JsonReader& in, std::size_t order) {
  if (order > static_cast<std::size_t>(kOrder))
    throw in.error(fmt::format("order {}: must be at most {} for each axis", order, kOrder));
  return static_cast<Eigen::Index>(order);
}

/// Inputs: columns of B, or of D where there is no state.
Eigen::Index inputs_of(const Place& place, Eigen::Index outputs) {
  const Place wide = place.at(place.in.has("B") ? "B" : "D");
  std::size_t columns = 1;
  if (nested(*wide.json)) columns = wide.in.items().front().numbers().size();
  if (!nested(*wide.json) && !place.in.has("B") && wide.json->get<double>() == nullptr)
    columns = wide.in.numbers().size();
  const auto n = static_cast<Eigen::Index>(columns);
  if (n != outputs && n != 2 * outputs) {
    throw wide.in.error(
        fmt::format("{} columns: must be {} (displacement) or {} (displacement, velocity)", n, outputs, 2 * outputs));
  }
  return n;
}

Matrices of_matrices(const Place& place, Eigen::Index outputs) {
  const io::JsonReader& in = place.in;
  if (in.has("A") != in.has("B") || in.has("A") != in.has("C")) throw in.error("A, B and C must be given together");
  if (!in.has("A") && !in.has("D")) throw in.error("must have A, B, C, D or num, den");
  const Eigen::Index n = in.has("A") ? require_order(in.at("A"), in.at("A").items().size()) : 0;
  const Eigen::Index inputs = inputs_of(place, outputs);
  Matrices m;
  m.a.setZero(n, n), m.b.setZero(n, inputs), m.c.setZero(outputs, n), m.d.setZero(outputs, inputs);
  if (n > 0) {
    m.a = read_matrix(place.at("A"), n, n);
    m.b = read_matrix(place.at("B"), n, inputs);
    m.c = read_matrix(place.at("C"), outputs, n);
  }
  if (in.has("D")) m.d = read_matrix(place.at("D"), outputs, inputs);
  return m;
}

std::vector<double> read_polynomial(const io::JsonReader& in) {
  std::vector<double> out = in.numbers();
  for (const double value : out) {
    if (!std::isfinite(value)) throw in.error("must be finite numbers");
  }
  out.erase(out.begin(), std::ranges::find_if(out, [](double v) { return v != 0; }));
  return out;
}

/// Companion form. Of a continuous one in a time of its own, w = s / scale: its coefficients are near 1 then.
Matrices of_polynomials(const io::JsonReader& in, bool sampled) {
  std::vector<double> num = read_polynomial(in.at("num")), den = read_polynomial(in.at("den"));
  if (den.empty()) throw in.at("den").error("must have a coefficient that is not 0");
  const Eigen::Index n = require_order(in.at("den"), den.size() - 1);
  if (num.size() > den.size()) {
    throw in.at("num").error(
        fmt::format("degree {} above that of den, {}: not proper, a sampled law cannot follow it", num.size() - 1, n));
  }
  num.insert(num.begin(), den.size() - num.size(), 0);
  double scale = 0;
  for (std::size_t k = 1; k < den.size(); ++k)
    scale = std::max(scale, std::pow(std::abs(den[k] / den[0]), 1 / static_cast<double>(k)));
  if (sampled || !(scale > 0)) scale = 1;
  Matrices m;
  m.a.setZero(n, n), m.b.setZero(n, 1), m.c.setZero(1, n), m.d.setZero(1, 1);
  m.d(0, 0) = num[0] / den[0];
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k + 1);
    const double size = std::pow(scale, static_cast<double>(k + 1));
    m.a(0, k) = -scale * (den[i] / den[0]) / size;
    m.c(0, k) = (num[i] / den[0] - m.d(0, 0) * (den[i] / den[0])) / size;
    if (k > 0) m.a(k, k - 1) = scale;
  }
  if (n > 0) m.b(0, 0) = scale;
  return m;
}

/// s = (2/h) (z - 1)/(z + 1).
void sample(Matrices& m, double h, const io::JsonReader& in) {
  const Eigen::Index n = m.a.rows();
  if (n == 0) return;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  constexpr double kLargest = 1e9;  // of what is 1 far from that pole
  const Eigen::MatrixXd inverse = (one - 0.5 * h * m.a).inverse();
  if (!(inverse.cwiseAbs().maxCoeff() < kLargest))
    throw in.error(fmt::format("a pole at {:g} 1/s, 2 / sample time: must be elsewhere", 2 / h));
  m.d += 0.5 * h * m.c * inverse * m.b;
  m.b = (h * inverse * m.b).eval();
  m.c = (m.c * inverse).eval();
  m.a = ((one + 0.5 * h * m.a) * inverse).eval();
}

/// `axis`: 0 x, 1 y; -1: the matrices have the inputs and outputs of both.
control::LinearAxis axis_of(const Matrices& m, int axis, bool both) {
  control::LinearAxis out;
  out.order = static_cast<int>(m.a.rows());
  const auto at = [](Eigen::Index i) { return static_cast<std::size_t>(i); };
  const Eigen::Index row = both ? axis : 0;
  // x, y, v_x, v_y
  const auto input = [&](Eigen::Index k) { return at(both ? k : 2 * k + axis); };
  constexpr std::size_t kInputs = control::LinearAxis::kInputs;
  for (Eigen::Index i = 0; i < m.a.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.a.cols(); ++j) out.a[at(i * kOrder + j)] = m.a(i, j);
    for (Eigen::Index k = 0; k < m.b.cols(); ++k) out.b[at(i) * kInputs + input(k)] = m.b(i, k);
    out.c[at(i)] = m.c(row, i);
  }
  for (Eigen::Index k = 0; k < m.d.cols(); ++k) out.d[input(k)] = m.d(row, k);
  return out;
}

/// A key that nobody reads would be a number that changes nothing.
void require_keys(const io::JsonReader& in, std::initializer_list<std::string_view> known, std::string_view allowed) {
  for (const auto& [key, value] : in.members()) {
    if (std::ranges::find(known, key) == known.end()) throw in.error(fmt::format("key '{}': must be {}", key, allowed));
  }
}

Matrices read_axis(const Place& place, bool sampled) {
  require_keys(place.in, {"A", "B", "C", "D", "num", "den"}, "A, B, C, D or num, den");
  const bool polynomials = place.in.has("num") || place.in.has("den");
  if (polynomials && (place.in.has("A") || place.in.has("D"))) throw place.in.error("must have A, B, C, D or num, den");
  return polynomials ? of_polynomials(place.in, sampled) : of_matrices(place, 1);
}

}  // namespace

OwnLaw read_law(const io::Json& document, const std::filesystem::path& file, double sample_time) {
  const Place top{io::JsonReader(document, file.string()), &document};
  top.in.require_schema("whirl.law", 1);
  require_keys(top.in, {"schema", "comment", "provenance", "sample_time_s", "x", "y", "A", "B", "C", "D"},
               "sample_time_s, x, y, A, B, C, D or comment");
  const bool both = top.in.has("A") || top.in.has("D"), sampled = top.in.has("sample_time_s");
  if (both == top.in.has("x")) throw top.in.error("must have either A, B, C, D or x (and y)");
  if (both && top.in.has("y")) throw top.in.at("y").error("stands beside A, B, C, D of both axes: leave it out");
  if (sampled) {
    const io::JsonReader time = top.in.at("sample_time_s");
    const double value = time.number();
    if (!(std::abs(value / sample_time - 1) < 1e-9)) {
      throw time.error(
          fmt::format("{:g} s: must be that of the loop, {:g} s (timing.rate of --hardware); a continuous law fits any",
                      value, sample_time));
    }
  }
  Matrices x = both ? of_matrices(top, 2) : read_axis(top.at("x"), sampled);
  Matrices y = both ? x : top.in.has("y") ? read_axis(top.at("y"), sampled) : x;
  if (!sampled) {
    sample(x, sample_time, both ? top.in : top.in.at("x"));
    sample(y, sample_time, top.in.has("y") ? top.in.at("y") : top.in);
  }
  return {axis_of(x, 0, both), axis_of(y, 1, both), sample_time};
}

}  // namespace whirl::tuning
