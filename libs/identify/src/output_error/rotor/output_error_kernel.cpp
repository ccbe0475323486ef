#include "output_error/rotor/output_error_kernel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "whirl/core/wide_registers.hpp"

namespace whirl::identification::detail {
namespace {

/// Linear lateral dynamics about the present motion: a = f(z, v) and its derivatives, in real numbers.
struct Local {
  double ax, ay;              // acceleration
  double kxx, kxy, kyx, kyy;  // minus d a / d z
  double cxx, cxy, cyx, cyy;  // minus d a / d v
};

inline Local local(const RotorModel& m, Complex eps, double x, double y, double vx, double vy, Complex f) {
  Local l;
  const double r2 = x * x + y * y, a = m.k1_conj.real(), b = m.k1_conj.imag();
  const double k = m.k1 + m.k2 * r2;
  l.cxx = m.c + m.c_conj.real();
  l.cyy = m.c - m.c_conj.real();
  l.cxy = l.cyx = m.c_conj.imag();
  l.ax = -(k + a) * x - b * y - l.cxx * vx - l.cxy * vy + eps.real() * f.real() - eps.imag() * f.imag();
  l.ay = -(k - a) * y - b * x - l.cxy * vx - l.cyy * vy + eps.real() * f.imag() + eps.imag() * f.real();
  l.kxx = k + a + 2 * m.k2 * x * x;
  l.kyy = k - a + 2 * m.k2 * y * y;
  l.kxy = l.kyx = b + 2 * m.k2 * x * y;
  return l;
}

inline void add_term(const RotorTerm& term, const TermForce& f, Local& l) {
  l.ax += term.value * f.x, l.ay += term.value * f.y;
  l.kxx -= term.value * f.x_x, l.kxy -= term.value * f.x_y;
  l.kyx -= term.value * f.y_x, l.kyy -= term.value * f.y_y;
  l.cxx -= term.value * f.x_vx, l.cxy -= term.value * f.x_vy;
  l.cyx -= term.value * f.y_vx, l.cyy -= term.value * f.y_vy;
}

/// The lanes of one quantity. (Eigen's arrays are as wide as the oldest processor that the program is built for.)
template <int Lanes>
struct LaneArray {
  static constexpr int kParts = Lanes / kRegisterWidth;
  Register parts[kParts] = {};
  void set(Eigen::Index lane, double value) {
    parts[static_cast<std::size_t>(lane / kRegisterWidth)][lane % kRegisterWidth] = value;
  }
  /// The lanes before kProfile; the others of the same registers become 0. (In registers: lanes stored one by one are
  /// not in the cache yet when the whole is read.)
  void compose(const std::array<double, kProfile>& v) {
    [&]<std::size_t... Part>(std::index_sequence<Part...>) { (fill<Part>(v), ...); }
    (std::make_index_sequence<(kProfile + kRegisterWidth - 1) / kRegisterWidth>{});
  }
  template <std::size_t Part>
  void fill(const std::array<double, kProfile>& v) {
    constexpr std::size_t first = Part * kRegisterWidth,
                          count = std::min<std::size_t>(kRegisterWidth, kProfile - first);
    [&]<std::size_t... Lane>(std::index_sequence<Lane...>) { parts[Part] = Register{v[first + Lane]...}; }
    (std::make_index_sequence<count>{});
  }
  void add(Eigen::Index lane, double value) {
    parts[static_cast<std::size_t>(lane / kRegisterWidth)][lane % kRegisterWidth] += value;
  }
};

/// Extended: with forces beyond RotorModel.
template <int Lanes, bool Extended>
struct Stepper {
  using Array = LaneArray<Lanes>;

  const RotorModel& model;
  Complex eps;
  const Eigen::VectorXcd& forcing;
  const Eigen::MatrixXcd& profile;
  const TermForces& extra;
  double half_step;
  const std::vector<Eigen::Index>& references;

  // Explicit part of d a / d p: each lane's own column of the equation.
  void direct(double x, double y, double vx, double vy, Eigen::Index half, Array& gx, Array& gy) const {
    const double r2 = x * x + y * y;
    const Complex f = forcing[half];
    gx.compose({-x, -r2 * x, -vx, f.real(), -f.imag(), 0, 0, 0, 0, -x, -y, -vx, -vy});
    gy.compose({-y, -r2 * y, -vy, f.imag(), f.real(), 0, 0, 0, 0, y, -x, vy, -vx});
    for (Eigen::Index k = 0; k < profile.cols(); ++k) {
      const Complex d = profile(half, k);
      gx.set(kProfile + k, eps.real() * d.real() - eps.imag() * d.imag());
      gy.set(kProfile + k, eps.real() * d.imag() + eps.imag() * d.real());
    }
  }

  struct State {
    double x, y, vx, vy;
    Array sx, sy, sux, suy;
  };
  struct Rate {
    double ax, ay;
    Array sax, say;
  };

  void rate(const State& s, Eigen::Index half, Array& gx, Array& gy, Rate& r) const {
    Local l = local(model, eps, s.x, s.y, s.vx, s.vy, forcing[half]);
    direct(s.x, s.y, s.vx, s.vy, half, gx, gy);
    if constexpr (Extended) {
      if (extra.known != nullptr) {
        l.ax += (*extra.known)[half].real();
        l.ay += (*extra.known)[half].imag();
      }
      const TermPoint point = extra.point(s.x, s.y, s.vx, s.vy, half, half_step);
      Eigen::Index lane = kProfile + profile.cols();
      for (const RotorTerm& term : extra.terms) {
        const auto force = [&] {
          const TermForce f = term_force(term, point);
          gx.set(lane, f.x);
          gy.set(lane++, f.y);
          return f;
        };
        // A term that is only scored moves nothing: its derivatives are not worked out.
        if (term.value == 0)
          force();
        else
          add_term(term, force(), l);
      }
      for (std::size_t k = 0; k < references.size(); ++k) {
        if (references[k] < 0) continue;
        const RotorTerm& term = extra.terms[k];
        const TermForce f = term.entry->by_reference(point, term.reference, term.part);
        const Eigen::Index own = lane + references[k];
        if (term.part == 0) gx.set(own, 0), gy.set(own, 0);
        gx.add(own, term.value * f.x);
        gy.add(own, term.value * f.y);
      }
    }
    r.ax = l.ax;
    r.ay = l.ay;
    for (std::size_t k = 0; k < Array::kParts; ++k) {
      const Register sx = s.sx.parts[k], sy = s.sy.parts[k], sux = s.sux.parts[k], suy = s.suy.parts[k];
      r.sax.parts[k] = gx.parts[k] - l.kxx * sx - l.kxy * sy - l.cxx * sux - l.cxy * suy;
      r.say.parts[k] = gy.parts[k] - l.kyx * sx - l.kyy * sy - l.cyx * sux - l.cyy * suy;
    }
  }

  /// State a time `step` from s, with velocity s.v + within * before.a on the way and acceleration latest.a.
  static void stage(const State& s, double step, double within, const Rate& before, const Rate& latest, State& t) {
    t.x = s.x + step * (s.vx + within * before.ax);
    t.y = s.y + step * (s.vy + within * before.ay);
    t.vx = s.vx + step * latest.ax;
    t.vy = s.vy + step * latest.ay;
    for (std::size_t k = 0; k < Array::kParts; ++k) {
      t.sx.parts[k] = s.sx.parts[k] + step * (s.sux.parts[k] + within * before.sax.parts[k]);
      t.sy.parts[k] = s.sy.parts[k] + step * (s.suy.parts[k] + within * before.say.parts[k]);
      t.sux.parts[k] = s.sux.parts[k] + step * latest.sax.parts[k];
      t.suy.parts[k] = s.suy.parts[k] + step * latest.say.parts[k];
    }
  }

  void run(const StepGrid& grid, Complex z0, Complex dz0, Sensitivities& out) const {
    const Eigen::Index n = out.motion.z.size();
    Array gx, gy;
    State s{z0.real(), z0.imag(), dz0.real(), dz0.imag(), {}, {}, {}, {}};
    s.sx.set(kX0, 1);
    s.sy.set(kY0, 1);
    s.sux.set(kVx0, 1);
    s.suy.set(kVy0, 1);
    State t;
    Rate r1, r2, r3, r4;
    const double h = grid.step(), q = 0.5 * h;
    for (Eigen::Index i = 0;; ++i) {
      out.motion.z[i] = {s.x, s.y};
      out.motion.v[i] = {s.vx, s.vy};
      const Array *x = &s.sx, *y = &s.sy;
      if (grid.derivative == 1) x = &s.sux, y = &s.suy;
      if (grid.derivative == 2) {
        rate(s, 2 * grid.substeps * i, gx, gy, r1);
        out.motion.a[i] = {r1.ax, r1.ay};
        x = &r1.sax, y = &r1.say;
      }
      std::memcpy(&out.dx(i, 0), x->parts, sizeof *x);
      std::memcpy(&out.dy(i, 0), y->parts, sizeof *y);
      if (i + 1 == n) break;
      for (int k = 0; k < grid.substeps; ++k) {
        const Eigen::Index half = 2 * (grid.substeps * i + k);
        // RK4 of z'' = a(z, z'): the velocities of the stages are known sums, so only accelerations are kept.
        rate(s, half, gx, gy, r1);
        stage(s, q, 0, r1, r1, t);
        rate(t, half + 1, gx, gy, r2);
        stage(s, q, q, r1, r2, t);
        rate(t, half + 1, gx, gy, r3);
        stage(s, h, q, r2, r3, t);
        rate(t, half + 2, gx, gy, r4);
        const double w = h / 6;
        s.x += h * (s.vx + w * (r1.ax + r2.ax + r3.ax));
        s.y += h * (s.vy + w * (r1.ay + r2.ay + r3.ay));
        s.vx += w * (r1.ax + 2 * (r2.ax + r3.ax) + r4.ax);
        s.vy += w * (r1.ay + 2 * (r2.ay + r3.ay) + r4.ay);
        for (std::size_t p = 0; p < Array::kParts; ++p) {
          const Register x1 = r1.sax.parts[p], x23 = r2.sax.parts[p] + r3.sax.parts[p];
          const Register y1 = r1.say.parts[p], y23 = r2.say.parts[p] + r3.say.parts[p];
          s.sx.parts[p] += h * (s.sux.parts[p] + w * (x1 + x23));
          s.sy.parts[p] += h * (s.suy.parts[p] + w * (y1 + y23));
          s.sux.parts[p] += w * (x1 + 2 * x23 + r4.sax.parts[p]);
          s.suy.parts[p] += w * (y1 + 2 * y23 + r4.say.parts[p]);
        }
      }
      if (!(s.x * s.x + s.y * s.y < 1e6)) {  // a kilometre: diverged (also true for NaN)
        out.finite = false;
        return;
      }
    }
  }
};

}  // namespace

std::vector<Eigen::Index> reference_lanes(const std::vector<RotorTerm>& terms) {
  std::vector<Eigen::Index> lanes;
  Eigen::Index next = -1;
  for (const RotorTerm& term : terms) {
    const bool estimated = term.entry->by_reference != nullptr;
    if (estimated && term.part == 0) ++next;
    lanes.push_back(estimated ? next : -1);
  }
  return lanes;
}

Sensitivities main_mode_sensitivities(const RotorModel& model, Complex eps, const Eigen::VectorXcd& forcing,
                                      const Eigen::MatrixXcd& profile, const TermForces& terms, const StepGrid& grid,
                                      Complex z0, Complex dz0) {
  Sensitivities out;
  main_mode_sensitivities(model, eps, forcing, profile, terms, grid, z0, dz0, out);
  return out;
}

void main_mode_sensitivities(const RotorModel& model, Complex eps, const Eigen::VectorXcd& forcing,
                             const Eigen::MatrixXcd& profile, const TermForces& terms, const StepGrid& grid, Complex z0,
                             Complex dz0, Sensitivities& out) {
  constexpr int kNarrow = 16, kWide = 24;
  out.finite = true;
  const Eigen::Index n = grid.samples(forcing.size());
  const std::vector<Eigen::Index> references = reference_lanes(terms.terms);
  const Eigen::Index more = references.empty() ? 0 : *std::ranges::max_element(references) + 1;
  const auto needed = kProfile + profile.cols() + static_cast<Eigen::Index>(terms.terms.size()) + more;
  const int lanes = needed <= kNarrow ? kNarrow : needed <= kWide ? kWide : kMostLanes;
  out.motion.z.resize(n);
  out.motion.v.resize(n);
  if (grid.derivative == 2) out.motion.a.resize(n);
  out.dx.resize(n, lanes);
  out.dy.resize(n, lanes);
  const auto run = [&]<int Lanes>() {
    if (!terms.any()) {
      const Stepper<Lanes, false> stepper{model, eps, forcing, profile, terms, 0.5 * grid.step(), references};
      on_wide_registers([&] { stepper.run(grid, z0, dz0, out); });
    } else {
      const Stepper<Lanes, true> stepper{model, eps, forcing, profile, terms, 0.5 * grid.step(), references};
      on_wide_registers([&] { stepper.run(grid, z0, dz0, out); });
    }
  };
  if (lanes == kNarrow) {
    run.template operator()<kNarrow>();
  } else if (lanes == kWide) {
    run.template operator()<kWide>();
  } else {
    run.template operator()<kMostLanes>();
  }
}

MainMotion main_mode(const RotorModel& model, Complex eps, const Eigen::VectorXcd& forcing, const TermForces& terms,
                     const StepGrid& grid, Complex z0, Complex dz0) {
  const Eigen::Index n = grid.samples(forcing.size());
  MainMotion out{Eigen::VectorXcd(n), Eigen::VectorXcd(n), Eigen::VectorXcd(grid.derivative == 2 ? n : 0)};
  double x = z0.real(), y = z0.imag(), vx = dz0.real(), vy = dz0.imag();
  const double h = grid.step(), q = 0.5 * h;
  const auto at = [&](double px, double py, double pvx, double pvy, Eigen::Index half) {
    Local l = local(model, eps, px, py, pvx, pvy, forcing[half]);
    if (terms.known != nullptr) {
      l.ax += (*terms.known)[half].real();
      l.ay += (*terms.known)[half].imag();
    }
    for (const RotorTerm& term : terms.terms) {
      add_term(term, term_force(term, terms.point(px, py, pvx, pvy, half, q)), l);
    }
    return l;
  };
  const auto follow = [&] {
    for (Eigen::Index i = 0;; ++i) {
      out.z[i] = {x, y};
      out.v[i] = {vx, vy};
      if (grid.derivative == 2) {
        const Local now = at(x, y, vx, vy, 2 * grid.substeps * i);
        out.a[i] = {now.ax, now.ay};
      }
      if (i + 1 == n) break;
      for (int k = 0; k < grid.substeps; ++k) {
        const Eigen::Index half = 2 * (grid.substeps * i + k);
        const Local a = at(x, y, vx, vy, half);
        const Local b = at(x + q * vx, y + q * vy, vx + q * a.ax, vy + q * a.ay, half + 1);
        const Local c = at(x + q * (vx + q * a.ax), y + q * (vy + q * a.ay), vx + q * b.ax, vy + q * b.ay, half + 1);
        const Local d = at(x + h * (vx + q * b.ax), y + h * (vy + q * b.ay), vx + h * c.ax, vy + h * c.ay, half + 2);
        x += h * (vx + h / 6 * (a.ax + b.ax + c.ax));
        y += h * (vy + h / 6 * (a.ay + b.ay + c.ay));
        vx += h / 6 * (a.ax + 2 * (b.ax + c.ax) + d.ax);
        vy += h / 6 * (a.ay + 2 * (b.ay + c.ay) + d.ay);
      }
    }
  };
  on_wide_registers(follow);
  return out;
}

}  // namespace whirl::identification::detail
