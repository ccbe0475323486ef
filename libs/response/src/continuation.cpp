#include "whirl/response/continuation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/core/counted.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

/// A point in scaled coordinates: coefficients over their scale, then parameter over its own.
struct Scaled {
  Eigen::VectorXd y;
  Eigen::VectorXd tangent;
  double determinant_sign = 0;  ///< of the bordered matrix
  int harmonics = 0;
};

class Tracer {
 public:
  Tracer(const PeriodicSystem& system, Parameter parameter, double fixed, const CurveOptions& options)
      : system_(system), parameter_(parameter), fixed_(fixed), o_(options) {}

  ResponseCurve run() {
    ResponseCurve curve;
    curve.parameter = parameter_;
    curve.names = system_.names();
    PeriodicSolution first;
    first.coefficients = Eigen::MatrixXd::Zero(2 * o_.harmonics + 1, system_.size());
    // A little motion: sqrt(x'^2 + y'^2) and the like have no slope at rest.
    for (Index i = 0; i < system_.size(); ++i) {
      const double phase = 0.3 + 0.5 * std::numbers::pi * static_cast<double>(i);
      first.coefficients(1, i) = 1e-9 * std::cos(phase);
      first.coefficients(2, i) = 1e-9 * std::sin(phase);
    }
    set_parameter(first, o_.from);
    if (!start(first)) {
      curve.summary.fail(fmt::format("no periodic answer was found at the begin of the range ({:.5g})", o_.from));
      return curve;
    }
    follow(curve, first);
    return curve;
  }

  /// From an answer that is known.
  ResponseCurve run_from(PeriodicSolution first) {
    ResponseCurve curve;
    curve.parameter = parameter_;
    curve.names = system_.names();
    if (solve_periodic(system_, first)) {
      may_close_ = true;
      follow(curve, first);
    } else {
      curve.summary.fail("the answer to start from is none");
    }
    return curve;
  }

 private:
  void follow(ResponseCurve& curve, const PeriodicSolution& first) {
    choose_scales(first);
    Scaled at = pack(first);
    Eigen::VectorXd along = Eigen::VectorXd::Zero(at.y.size());
    along[along.size() - 1] = o_.to > o_.from ? 1 : -1;
    find_tangent(at, along);
    add(curve, at);
    double step = o_.longest_step / 4;
    while (static_cast<int>(curve.points.size()) < o_.most_points) {
      Scaled next = at;
      int iterations = 0;
      bool good = advance(at, step, next, iterations);
      // A turn of more than 25 degrees between two points would jump to another part of the curve.
      if (good && next.tangent.dot(at.tangent) < 0.9) good = false;
      if (!good) {
        step *= 0.5;
        if (step < o_.shortest_step) {
          curve.summary.warn(fmt::format("the curve could not be followed beyond {:.6g}", parameter_of(at)));
          break;
        }
        continue;
      }
      if (outside(next)) {
        finish_at_border(curve, at, next);
        break;
      }
      events(curve, at, next, step);
      at = next;
      add(curve, at);
      if (closes(curve, first, at, step)) break;
      widen(at);
      step = std::min(o_.longest_step, step * (iterations <= 3 ? 1.5 : iterations <= 5 ? 1.0 : 0.6));
    }
    if (static_cast<int>(curve.points.size()) >= o_.most_points)
      curve.summary.warn(fmt::format("the curve was cut after {}", counted(o_.most_points, "point")));
  }

  /// Back at the first point, and going the same way.
  bool closes(ResponseCurve& curve, const PeriodicSolution& first, const Scaled& at, double step) const {
    if (!may_close_ || curve.points.size() < 8 || first.harmonics() != at.harmonics) return false;
    const Eigen::VectorXd to_first = pack(first).y - at.y;
    if (to_first.norm() > step || to_first.dot(at.tangent) < 0) return false;
    curve.closed = true;
    add(curve, pack_with(first, at));
    return true;
  }
  Scaled pack_with(const PeriodicSolution& s, const Scaled& at) const {
    Scaled p = pack(s);
    p.tangent = at.tangent;
    return p;
  }

  double range() const { return std::abs(o_.to - o_.from); }
  double parameter_of(const Scaled& s) const { return s.y[s.y.size() - 1] * range(); }
  void set_parameter(PeriodicSolution& s, double value) const {
    s.omega = parameter_ == Parameter::speed ? value : fixed_;
    s.force = parameter_ == Parameter::speed ? fixed_ : value;
  }

  /// From rest; where Newton does not find the answer, the forcing grows in steps.
  bool start(PeriodicSolution& s) const {
    PeriodicSolution trial = s;
    if (solve_periodic(system_, trial)) {
      s = trial;
      return true;
    }
    if (system_.driven_by_angle()) return false;
    const double force = s.force;
    trial = s;
    for (int k = 1; k <= 32; ++k) {
      trial.force = force * k / 32;
      if (!solve_periodic(system_, trial)) return false;
    }
    s = trial;
    return true;
  }

  void choose_scales(const PeriodicSolution& s) {
    scale_ = s.coefficients.colwise().norm().transpose();
    const double largest = scale_.maxCoeff();
    for (Index i = 0; i < scale_.size(); ++i) scale_[i] = std::max(scale_[i], 1e-3 * largest);
    if (!(largest > 0)) scale_.setOnes();
  }
  /// As the answer grows the arclength is measured in larger units, so that a resonance takes no more points than
  /// needed.
  void rescale(Scaled& s) {
    const PeriodicSolution x = unpack(s);
    Eigen::VectorXd now = x.coefficients.colwise().norm().transpose();
    const double largest = now.maxCoeff();
    Eigen::VectorXd next = scale_;
    for (Index i = 0; i < now.size(); ++i) next[i] = std::max({now[i], 1e-3 * largest, 1e-300});
    if ((next.array() / scale_.array()).maxCoeff() < 1.5 && (next.array() / scale_.array()).minCoeff() > 0.66) return;
    const Index m = 2 * s.harmonics + 1;
    for (Index i = 0; i < next.size(); ++i) {
      s.y.segment(i * m, m) *= scale_[i] / next[i];
      s.tangent.segment(i * m, m) *= scale_[i] / next[i];
    }
    s.tangent.normalize();
    scale_ = next;
    find_tangent(s, s.tangent);
  }

  Scaled pack(const PeriodicSolution& s) const {
    Scaled p;
    p.harmonics = s.harmonics();
    const Index m = s.coefficients.rows();
    p.y.resize(m * system_.size() + 1);
    for (Index i = 0; i < system_.size(); ++i) p.y.segment(i * m, m) = s.coefficients.col(i) / scale_[i];
    p.y[p.y.size() - 1] = (parameter_ == Parameter::speed ? s.omega : s.force) / range();
    return p;
  }
  PeriodicSolution unpack(const Scaled& p) const {
    PeriodicSolution s;
    const Index m = 2 * p.harmonics + 1;
    s.coefficients.resize(m, system_.size());
    for (Index i = 0; i < system_.size(); ++i) s.coefficients.col(i) = p.y.segment(i * m, m) * scale_[i];
    set_parameter(s, parameter_of(p));
    return s;
  }

  /// [J R_lambda; row] and the residual, rows scaled by their coordinate.
  void assemble(const Scaled& p, const Eigen::VectorXd& row, Eigen::MatrixXd& matrix, Eigen::VectorXd& residual) const {
    const Balance b = balance(system_, unpack(p), parameter_);
    const Index n = b.residual.size(), m = 2 * p.harmonics + 1;
    matrix.resize(n + 1, n + 1);
    matrix.topLeftCorner(n, n) = b.jacobian;
    matrix.topRightCorner(n, 1) = b.by_parameter * range();
    for (Index i = 0; i < system_.size(); ++i) {
      matrix.block(0, i * m, n, m) *= scale_[i];
      matrix.middleRows(i * m, m) /= scale_[i];
    }
    matrix.row(n) = row.transpose();
    residual = b.residual;
    for (Index i = 0; i < system_.size(); ++i) residual.segment(i * m, m) /= scale_[i];
  }

  using Lu = Eigen::PartialPivLU<Eigen::MatrixXd>;
  void find_tangent(Scaled& p, const Eigen::VectorXd& along) const {
    Eigen::MatrixXd matrix;
    Eigen::VectorXd residual;
    assemble(p, along, matrix, residual);
    take_tangent(p, Lu(matrix));
  }
  static void take_tangent(Scaled& p, const Lu& lu) {
    const Index n = p.y.size();
    p.tangent = lu.solve(Eigen::VectorXd::Unit(n, n - 1)).normalized();
    double sign = lu.permutationP().determinant();
    for (Index k = 0; k < n; ++k) sign *= lu.matrixLU()(k, k) < 0 ? -1 : 1;
    p.determinant_sign = sign;
  }

  /// Predictor along the tangent, Newton in the plane across it. Steps square their error: after one below 1e-5 the
  /// next is the last, and its matrix gives the tangent too.
  bool advance(const Scaled& from, double step, Scaled& to, int& iterations) const {
    to = from;
    to.y = from.y + step * from.tangent;
    Eigen::MatrixXd matrix;
    Eigen::VectorXd residual, right(to.y.size());
    bool last = false;
    for (iterations = 1; iterations <= 8; ++iterations) {
      assemble(to, from.tangent, matrix, residual);
      right << residual, from.tangent.dot(to.y - from.y) - step;
      if (!matrix.allFinite() || !right.allFinite()) return false;
      const Lu lu(matrix);
      const Eigen::VectorXd change = lu.solve(right);
      if (!change.allFinite() || change.norm() > 10) return false;
      to.y -= change;
      if (last && change.norm() < 1e-7) {
        take_tangent(to, lu);
        return to.tangent.allFinite();
      }
      last = change.norm() < 1e-5;
    }
    return false;
  }

  bool outside(const Scaled& p) const {
    const double v = parameter_of(p), low = std::min(o_.from, o_.to), high = std::max(o_.from, o_.to);
    return v < low || v > high;
  }

  void finish_at_border(ResponseCurve& curve, const Scaled& at, const Scaled& next) const {
    const double border =
        parameter_of(next) > std::max(o_.from, o_.to) ? std::max(o_.from, o_.to) : std::min(o_.from, o_.to);
    const double part = (border - parameter_of(at)) / (parameter_of(next) - parameter_of(at));
    Scaled between = at;
    between.y = at.y + part * (next.y - at.y);
    PeriodicSolution s = unpack(between);
    set_parameter(s, border);
    if (solve_periodic(system_, s)) {
      Scaled end = pack(s);
      end.tangent = next.tangent;
      add(curve, end);
    }
    if (border != o_.to && !may_close_) curve.summary.warn("the curve came back to the begin of its range");
  }

  void add(ResponseCurve& curve, const Scaled& p) const {
    CurvePoint point;
    point.solution = unpack(p);
    point.forward = p.tangent[p.tangent.size() - 1] >= 0;
    if (o_.stability) {
      const Eigen::VectorXcd mu = floquet_multipliers(system_, point.solution);
      point.multiplier = mu.cwiseAbs().maxCoeff();
      point.stable = point.multiplier < 1 + 1e-9;
      Eigen::Index k = 0;
      mu.cwiseAbs().maxCoeff(&k);
      if (!curve.points.empty() && curve.points.back().stable != point.stable) {
        const std::complex<double> critical = mu[k];
        const std::size_t after = curve.points.size() - 1;
        const bool known = !curve.events.empty() && curve.events.back().after + 1 >= after;
        // A loss of stability that is no fold and no branch point: by the multiplier that leaves the circle.
        if (!known && (std::abs(critical.imag()) > 1e-3 || critical.real() < 0))
          curve.events.push_back(
              {std::abs(critical.imag()) > 1e-3 ? EventKind::neimark_sacker : EventKind::period_doubling, after,
               point.solution, parameter_of(p)});
      }
    }
    curve.points.push_back(std::move(point));
  }

  double parameter_slope(const Scaled& p) const { return p.tangent[p.tangent.size() - 1]; }

  /// Zero of g between the points `a` and its follower at arclength `step`, by regula falsi (Illinois).
  template <class G>
  bool locate(const Scaled& a, double step, G&& g, Scaled& found) const {
    double low = 0, high = step, at_low = g(a), at_high = 0;
    int iterations = 0;
    if (!advance(a, step, found, iterations)) return false;
    at_high = g(found);
    for (int k = 0; k < 60 && std::abs(high - low) > 1e-13 * step; ++k) {
      const double s = low + (high - low) * at_low / (at_low - at_high);
      if (!advance(a, s, found, iterations)) return false;
      const double value = g(found);
      if (std::abs(value) < 1e-12) return true;
      if ((value > 0) == (at_high > 0)) {
        high = s;
        at_high = value;
        at_low *= 0.5;
      } else {
        low = s;
        at_low = value;
        at_high *= 0.5;
      }
    }
    return true;
  }

  void events(ResponseCurve& curve, const Scaled& a, const Scaled& b, double step) const {
    Scaled found;
    const std::size_t after = curve.points.size() - 1;
    if (parameter_slope(a) * parameter_slope(b) < 0) {
      if (locate(
              a, step, [&](const Scaled& p) { return parameter_slope(p); }, found))
        curve.events.push_back({EventKind::fold, after, unpack(found), parameter_of(found)});
    }
    if (a.determinant_sign * b.determinant_sign < 0 &&
        locate(
            a, step, [](const Scaled& p) { return p.determinant_sign; }, found))
      curve.events.push_back({EventKind::branch_point, after, unpack(found), parameter_of(found)});
  }

  /// More harmonics where the spectrum asks for them; the new ones start at zero and Newton fills them.
  void widen(Scaled& p) {
    rescale(p);
    if (!(o_.truncation > 0) || p.harmonics >= o_.most_harmonics) return;
    PeriodicSolution s = unpack(p);
    if (truncation(system_, s) < o_.truncation) return;
    const Eigen::VectorXd old = p.tangent;
    const Index m = 2 * p.harmonics + 1, wider = m + 4;
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(wider, system_.size());
    x.topRows(m) = s.coefficients;
    s.coefficients = x;
    if (!solve_periodic(system_, s, 8)) return;
    Scaled wide = pack(s);
    Eigen::VectorXd along = Eigen::VectorXd::Zero(wide.y.size());
    for (Index i = 0; i < system_.size(); ++i) along.segment(i * wider, m) = old.segment(i * m, m);
    along[along.size() - 1] = old[old.size() - 1];
    find_tangent(wide, along.normalized());
    p = wide;
  }

  const PeriodicSystem& system_;
  Parameter parameter_;
  double fixed_;
  CurveOptions o_;
  Eigen::VectorXd scale_;
  bool may_close_ = false;
};

}  // namespace

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::fold:
      return "fold";
    case EventKind::branch_point:
      return "branch point";
    case EventKind::period_doubling:
      return "period doubling";
    default:
      return "Neimark-Sacker";
  }
}

namespace {

/// Largest value between the samples of a square over a period: a parabola through the largest and its neighbours.
double largest_root(const Eigen::VectorXd& square) {
  Index at = 0;
  const double most = square.maxCoeff(&at);
  const Index n = square.size();
  const double before = square[(at + n - 1) % n], after = square[(at + 1) % n], bend = 2 * most - before - after;
  const double rise = after - before;
  return std::sqrt(bend > 0 ? most + rise * rise / (8 * bend) : most);
}

}  // namespace

double ResponseCurve::peak(const PeriodicSolution& s, Index i) {
  return largest_root(s.orbit(std::max(64, 8 * s.harmonics())).col(i).cwiseAbs2());
}

double ResponseCurve::radius(const PeriodicSolution& s) {
  const Eigen::MatrixXd q = s.orbit(std::max(64, 8 * s.harmonics()));
  return largest_root(q.leftCols(std::min<Index>(2, q.cols())).rowwise().squaredNorm());
}

ResponseCurve response_curve(const PeriodicSystem& system, Parameter parameter, double fixed,
                             const CurveOptions& options) {
  const double low = std::min(options.from, options.to);
  require_range("from", options.from, -1e12, 1e12);
  require_range("to", options.to, -1e12, 1e12);
  if (!(std::abs(options.to - options.from) > 0)) throw Error("the range of the response curve is empty");
  if (parameter == Parameter::speed && !(low > 0))
    throw Error::in_field("range", fmt::format("{:g} rad/s", low), "> 0");
  if (parameter == Parameter::force && !(fixed > 0))
    throw Error::in_field("speed", fmt::format("{:g} rad/s", fixed), "> 0");
  require_range("harmonics", options.harmonics, 1, 200);
  require_range("longest_step", options.longest_step, 1e-6, 1);
  return Tracer(system, parameter, fixed, options).run();
}

ResponseCurve follow_curve(const PeriodicSystem& system, Parameter parameter, const PeriodicSolution& start,
                           const CurveOptions& options) {
  if (!(std::abs(options.to - options.from) > 0)) throw Error("the range of the response curve is empty");
  const double fixed = parameter == Parameter::speed ? start.force : start.omega;
  return Tracer(system, parameter, fixed, options).run_from(start);
}

}  // namespace whirl::response
