#include "scaled.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::regression::detail {

double Scaled::rss(const Eigen::VectorXd& w) const { return std::max(0.0, 1 - 2 * c.dot(w) + w.dot(g * w)); }

Scaled scale(const GramBlock& block, const SolveOptions& options, double rows) {
  const Eigen::Index q = block.terms();
  Scaled s;
  s.rows = rows;
  s.floor = options.noise_floor;
  s.y_rms = block.rows > 0 ? std::sqrt(block.energy / block.rows) : 0;
  s.sign = options.rules.sign;
  if (!s.sign.empty() && s.sign.size() != static_cast<std::size_t>(q)) {
    throw Error(fmt::format("{} sign bounds for {} terms: must be as many, or none", s.sign.size(), q));
  }
  if (s.sign.empty()) s.sign.assign(static_cast<std::size_t>(q), 0);
  Eigen::VectorXd norm = block.gram.diagonal().cwiseMax(0.0).cwiseSqrt();
  const double y_norm = std::sqrt(block.energy);
  std::vector<char> kept(static_cast<std::size_t>(q), 0);
  for (int j : options.rules.keep) {
    if (j < 0 || j >= q) throw Error::in_field("term to keep", std::to_string(j), fmt::format("0 to {}", q - 1));
    kept[static_cast<std::size_t>(j)] = 1;
  }
  s.unit = Eigen::VectorXd::Zero(q);
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(q);
  for (Eigen::Index j = 0; j < q; ++j) {
    if (!(norm[j] > 0)) continue;
    inverse[j] = 1 / norm[j];
    s.unit[j] = y_norm / norm[j];
    (kept[static_cast<std::size_t>(j)] ? s.keep : s.candidates).push_back(static_cast<int>(j));
  }
  s.g = inverse.asDiagonal() * block.gram * inverse.asDiagonal();
  s.c = y_norm > 0 ? Eigen::VectorXd(inverse.cwiseProduct(block.moment) / y_norm) : Eigen::VectorXd::Zero(q);
  return s;
}

Scaled scale_like(const GramBlock& block, const Scaled& like) {
  Scaled s;
  s.rows = block.rows;
  s.unit = like.unit;
  s.candidates = like.candidates;
  s.keep = like.keep;
  s.sign = like.sign;
  const double energy = block.rows * like.y_rms * like.y_rms;
  s.g = like.unit.asDiagonal() * block.gram * like.unit.asDiagonal() / energy;
  s.c = like.unit.cwiseProduct(block.moment) / energy;
  s.y_rms = std::sqrt(block.energy / block.rows);
  return s;
}

std::vector<int> support_of(const Eigen::VectorXd& w) {
  std::vector<int> s;
  for (Eigen::Index j = 0; j < w.size(); ++j) {
    if (w[j] != 0) s.push_back(static_cast<int>(j));
  }
  return s;
}

std::vector<int> all_terms(const Scaled& s) {
  std::vector<int> all = s.candidates;
  all.insert(all.end(), s.keep.begin(), s.keep.end());
  std::sort(all.begin(), all.end());
  return all;
}

double bic(const Scaled& s, double mean_square, int terms) {
  // Below 1e-14 the residual of a Gram matrix is rounding, not information.
  return s.rows * std::log(std::max(mean_square, 1e-14) + s.floor * s.floor) + terms * std::log(s.rows);
}
double aic(const Scaled& s, double mean_square, int terms) {
  return s.rows * std::log(std::max(mean_square, 1e-14) + s.floor * s.floor) + 2.0 * terms;
}

namespace {
Eigen::VectorXd plain(const Scaled& s, const std::vector<int>& support, double ridge) {
  Eigen::MatrixXd g = s.g(support, support);
  g.diagonal().array() += ridge;
  return g.ldlt().solve(Eigen::VectorXd(s.c(support)));
}
}  // namespace

Eigen::VectorXd least_squares(const Scaled& s, const std::vector<int>& support, double ridge) {
  Eigen::VectorXd w = Eigen::VectorXd::Zero(s.size());
  if (support.empty()) return w;
  std::vector<int> bounded;
  for (int j : support) {
    if (s.sign[static_cast<std::size_t>(j)] != 0) bounded.push_back(j);
  }
  w(support) = plain(s, support, ridge);
  const auto violates = [&](int j) { return s.sign[static_cast<std::size_t>(j)] * w[j] < 0; };
  if (std::none_of(bounded.begin(), bounded.end(), violates)) return w;

  // Lawson and Hanson 1974, chapter 23: bounded terms enter one by one, those that reach zero leave.
  std::vector<int> passive;
  for (int j : support) {
    if (s.sign[static_cast<std::size_t>(j)] == 0) passive.push_back(j);
  }
  w.setZero();
  if (!passive.empty()) w(passive) = plain(s, passive, ridge);
  for (std::size_t round = 0; round < 10 * support.size(); ++round) {
    int enter = -1;
    double steepest = 1e-12;
    const Eigen::VectorXd gradient = s.c - s.g * w - ridge * w;
    for (int j : bounded) {
      if (std::find(passive.begin(), passive.end(), j) != passive.end()) continue;
      const double slope = gradient[j] * s.sign[static_cast<std::size_t>(j)];
      if (slope > steepest) {
        steepest = slope;
        enter = j;
      }
    }
    if (enter < 0) break;
    passive.push_back(enter);
    while (true) {
      const Eigen::VectorXd target = plain(s, passive, ridge);
      double step = 1;
      int leave = -1;
      for (std::size_t k = 0; k < passive.size(); ++k) {
        const int j = passive[k];
        const double t = target[static_cast<Eigen::Index>(k)];
        if (s.sign[static_cast<std::size_t>(j)] == 0 || t * s.sign[static_cast<std::size_t>(j)] > 0) continue;
        const double fraction = w[j] == t ? 0 : w[j] / (w[j] - t);
        if (fraction < step || leave < 0) {
          step = fraction;
          leave = j;
        }
      }
      for (std::size_t k = 0; k < passive.size(); ++k) {
        w[passive[k]] += step * (target[static_cast<Eigen::Index>(k)] - w[passive[k]]);
      }
      if (leave < 0) break;
      w[leave] = 0;
      std::erase(passive, leave);
      if (passive.empty()) break;
    }
  }
  return w;
}

std::vector<Fold> make_folds(const Problem& problem, const Scaled& s, int folds) {
  std::vector<Fold> out;
  const std::size_t n = problem.blocks.size();
  if (folds < 2 || n < 2) return out;
  const std::size_t count = std::min<std::size_t>(static_cast<std::size_t>(folds), n);
  for (std::size_t f = 0; f < count; ++f) {
    GramBlock test = problem.blocks[f];
    for (std::size_t b = f + count; b < n; b += count) test += problem.blocks[b];
    if (test.rows < 1) continue;
    GramBlock train = problem.total;
    train -= test;
    if (train.rows < 1) continue;
    out.push_back({scale_like(train, s), scale_like(test, s)});
  }
  return out;
}

}  // namespace whirl::regression::detail
