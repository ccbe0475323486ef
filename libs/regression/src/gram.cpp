#include "whirl/regression/gram.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "whirl/core/error.hpp"
#include "whirl/core/gram.hpp"

namespace whirl::regression {

double GramBlock::residual(const Eigen::VectorXd& xi) const {
  const Eigen::VectorXd g_xi = gram.selfadjointView<Eigen::Lower>() * xi;
  return std::max(0.0, energy - 2 * moment.dot(xi) + xi.dot(g_xi));
}

GramBlock& GramBlock::operator+=(const GramBlock& other) {
  gram += other.gram;
  moment += other.moment;
  energy += other.energy;
  rows += other.rows;
  return *this;
}

GramBlock& GramBlock::operator-=(const GramBlock& other) {
  gram -= other.gram;
  moment -= other.moment;
  energy -= other.energy;
  rows -= other.rows;
  return *this;
}

GramAccumulator::GramAccumulator(Eigen::Index terms, Eigen::Index targets, Eigen::Index rows_per_block)
    : q_(terms), targets_(targets), rows_per_block_(rows_per_block) {
  if (terms < 1) throw Error::in_field("candidate terms", std::to_string(terms), "at least 1");
  if (targets < 1) throw Error::in_field("regression targets", std::to_string(targets), "at least 1");
}

void GramAccumulator::add(const Eigen::Ref<const Eigen::MatrixXd>& theta, const Eigen::Ref<const Eigen::MatrixXd>& y) {
  if (theta.cols() != q_ || y.cols() != targets_ || theta.rows() != y.rows()) {
    throw Error(fmt::format("regression rows of size {} x {} and {} x {}: must be n x {} and n x {}", theta.rows(),
                            theta.cols(), y.rows(), y.cols(), q_, targets_));
  }
  const Eigen::Index k = q_ + targets_;
  // Panels of this many rows stay in the cache while their products are summed.
  constexpr Eigen::Index panel = 512;
  for (Eigen::Index at = 0; at < theta.rows();) {
    if (!open_) {
      if (blocks_.size() >= kMostBlocks) merge_pairs();
      blocks_.push_back({Eigen::MatrixXd::Zero(k, k), 0});
      open_ = true;
    }
    Sums& sums = blocks_.back();
    Eigen::Index n = std::min(panel, theta.rows() - at);
    if (rows_per_block_ > 0) n = std::min(n, rows_per_block_ - sums.rows);
    work_.resize(n, k);
    work_.leftCols(q_) = theta.middleRows(at, n);
    work_.rightCols(targets_) = y.middleRows(at, n);
    Eigen::Index used = n;
    if (!work_.allFinite()) {
      used = 0;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (!work_.row(i).allFinite()) continue;
        if (i != used) work_.row(used) = work_.row(i).eval();
        ++used;
      }
    }
    add_gram(work_.topRows(used), sums.m);
    sums.rows += used;
    total_rows_ += used;
    at += n;
    if (rows_per_block_ > 0 && sums.rows >= rows_per_block_) open_ = false;
  }
}

void GramAccumulator::end_block() { open_ = false; }

void GramAccumulator::merge_pairs() {
  std::size_t out = 0;
  for (std::size_t i = 0; i < blocks_.size(); i += 2, ++out) {
    Sums sums = std::move(blocks_[i]);
    if (i + 1 < blocks_.size()) {
      sums.m += blocks_[i + 1].m;
      sums.rows += blocks_[i + 1].rows;
    }
    blocks_[out] = std::move(sums);
  }
  blocks_.resize(out);
  rows_per_block_ *= 2;
}

Problem GramAccumulator::problem(Eigen::Index target, std::vector<std::string> names) const {
  Problem p;
  p.names = std::move(names);
  p.total = {Eigen::MatrixXd::Zero(q_, q_), Eigen::VectorXd::Zero(q_), 0, 0};
  for (const Sums& s : blocks_) {
    GramBlock b;
    b.gram = s.m.topLeftCorner(q_, q_).selfadjointView<Eigen::Lower>();
    b.moment = s.m.row(q_ + target).head(q_);
    b.energy = s.m(q_ + target, q_ + target);
    b.rows = static_cast<double>(s.rows);
    p.total += b;
    p.blocks.push_back(std::move(b));
  }
  return p;
}

Problem make_problem(const Eigen::Ref<const Eigen::MatrixXd>& theta, const Eigen::Ref<const Eigen::VectorXd>& y,
                     int blocks, std::vector<std::string> names) {
  if (blocks < 1) throw Error::in_field("time blocks", std::to_string(blocks), "at least 1");
  const Eigen::Index per = (theta.rows() + blocks - 1) / blocks;
  GramAccumulator sums(theta.cols(), 1, std::max<Eigen::Index>(per, 1));
  sums.add(theta, y);
  return sums.problem(0, std::move(names));
}

Elimination eliminate(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  if (a.rows() != b.size()) {
    throw Error(fmt::format("{} constraint rows with {} right-hand sides: must be as many", a.rows(), b.size()));
  }
  const Eigen::Index q = a.cols();
  Eigen::MatrixXd m(a.rows(), q + 1);
  m << a, b;
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    const double scale = m.row(i).head(q).cwiseAbs().maxCoeff();
    if (scale > 0) m.row(i) /= scale;
  }
  constexpr double tiny = 1e-11;
  std::vector<Eigen::Index> pivots;
  Eigen::Index row = 0;
  // From the last column, so that the first of several tied coefficients stays the free one.
  for (Eigen::Index col = q - 1; col >= 0 && row < m.rows(); --col) {
    Eigen::Index best = 0;
    const double size = m.col(col).tail(m.rows() - row).cwiseAbs().maxCoeff(&best);
    if (size <= tiny) continue;
    m.row(row).swap(m.row(row + best));
    m.row(row) /= m(row, col);
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      if (i != row) m.row(i) -= m(i, col) * m.row(row).eval();
    }
    pivots.push_back(col);
    ++row;
  }
  for (Eigen::Index i = row; i < m.rows(); ++i) {
    if (std::abs(m(i, q)) > tiny) throw Error("linear constraints on the coefficients contradict each other");
  }
  Elimination e;
  e.fixed = Eigen::VectorXd::Zero(q);
  for (Eigen::Index j = 0; j < q; ++j) {
    if (std::find(pivots.begin(), pivots.end(), j) == pivots.end()) e.free.push_back(static_cast<int>(j));
  }
  e.map = Eigen::MatrixXd::Zero(q, static_cast<Eigen::Index>(e.free.size()));
  for (std::size_t k = 0; k < e.free.size(); ++k) {
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    e.map(e.free[k], column) = 1;
    for (std::size_t r = 0; r < pivots.size(); ++r) {
      e.map(pivots[r], column) = -m(static_cast<Eigen::Index>(r), e.free[k]);
    }
  }
  for (std::size_t r = 0; r < pivots.size(); ++r) e.fixed[pivots[r]] = m(static_cast<Eigen::Index>(r), q);
  return e;
}

namespace {
GramBlock reduce_block(const GramBlock& b, const Elimination& e) {
  const Eigen::VectorXd g_fixed = b.gram * e.fixed;
  GramBlock r;
  r.gram = e.map.transpose() * b.gram * e.map;
  r.moment = e.map.transpose() * (b.moment - g_fixed);
  r.energy = std::max(0.0, b.energy - 2 * b.moment.dot(e.fixed) + e.fixed.dot(g_fixed));
  r.rows = b.rows;
  return r;
}
}  // namespace

Problem reduce(const Problem& problem, const Elimination& e) {
  if (e.map.rows() != problem.total.terms() || e.fixed.size() != problem.total.terms()) {
    throw Error(
        fmt::format("elimination for {} coefficients applied to {} terms", e.map.rows(), problem.total.terms()));
  }
  Problem p;
  p.total = reduce_block(problem.total, e);
  for (const GramBlock& b : problem.blocks) p.blocks.push_back(reduce_block(b, e));
  p.effective_rows = problem.effective_rows;
  if (!problem.names.empty()) {
    for (int j : e.free) p.names.push_back(problem.names[static_cast<std::size_t>(j)]);
  }
  return p;
}

Problem stack(const std::vector<Problem>& problems, const std::vector<double>& weights) {
  if (problems.empty()) throw Error("no regression problems to stack");
  if (!weights.empty() && weights.size() != problems.size()) {
    throw Error(fmt::format("{} weights for {} regression problems", weights.size(), problems.size()));
  }
  const auto scaled = [&](const GramBlock& b, std::size_t i) {
    GramBlock s = b;
    const double w = weights.empty() ? 1.0 : weights[i];
    s.gram *= w;
    s.moment *= w;
    s.energy *= w;
    return s;
  };
  Problem p;
  p.names = problems.front().names;
  bool same_blocks = true;
  for (const Problem& q : problems) {
    if (q.total.terms() != problems.front().total.terms()) throw Error("stacked problems must have the same unknowns");
    same_blocks = same_blocks && q.blocks.size() == problems.front().blocks.size();
  }
  for (std::size_t i = 0; i < problems.size(); ++i) {
    if (i == 0) {
      p.total = scaled(problems[i].total, i);
    } else {
      p.total += scaled(problems[i].total, i);
    }
    p.effective_rows += problems[i].information_rows();
    // Equations of one record are cut at the same instants: their blocks belong together.
    for (std::size_t b = 0; b < problems[i].blocks.size(); ++b) {
      if (same_blocks && i > 0) {
        p.blocks[b] += scaled(problems[i].blocks[b], i);
      } else {
        p.blocks.push_back(scaled(problems[i].blocks[b], i));
      }
    }
  }
  return p;
}

}  // namespace whirl::regression
