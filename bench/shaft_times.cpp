// Processor time of the analyses of `whirl rotor` as a ratio to plain dense algebra on the same matrices, for a rotor
// of 28 and one of 52 degrees of freedom in both planes (1.5 m shaft, two discs, two bearings). The dense ways: all
// eigenvalues of the state matrix by QR at 50 speeds, one complex LU at each of 200 speeds, Newmark's method with an LU
// in each of 15000 steps. Targets: Campbell 0.5 and 0.15, response 2, run-down 1.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <ctime>

#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/transient.hpp"

namespace {

using namespace whirl::shaft;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

double processor_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Least of several runs, s.
template <class Work>
double time_of(const Work& work) {
  double least = INFINITY;
  for (int k = 0; k < 5; ++k) {
    const double start = processor_time();
    work();
    least = std::min(least, processor_time() - start);
  }
  return least;
}

Rotor two_discs(int elements) {
  Rotor rotor;
  rotor.materials[0].density = 7810;
  rotor.materials[0].youngs_modulus = 2.11e11;
  for (int k = 0; k < 3; ++k) rotor.sections.push_back({0.5, 0.05, 0.05, 0, 0, 0, elements / 3});
  rotor.element = ElementKind::usual;
  for (const auto& [position, diameter] : {std::pair{0.5, 0.28}, {1.0, 0.35}}) {
    Disc disc = cylinder(7810, diameter, 0.05, 0.07);
    disc.name = position < 0.7 ? "A" : "B";
    disc.position = position;
    rotor.discs.push_back(disc);
  }
  for (const double position : {0.0, 1.5}) {
    Support support;
    support.name = position > 0 ? "right" : "left";
    support.a = {"shaft", position};
    support.b = {"ground", 0};
    support.law.stiffness = {1e6 * Eigen::Matrix2d::Identity()};
    support.law.damping = {100 * Eigen::Matrix2d::Identity()};
    support.law.mass = {Eigen::Matrix2d::Zero()};
    rotor.supports.push_back(support);
  }
  rotor.unbalances.push_back({0.5, 0.5, 1e-4, 0});
  return rotor;
}

void campbell_by_qr(const System& system, const std::vector<double>& speeds) {
  for (const double speed : speeds) {
    const auto e = plane_equations(system, speed);
    const Eigen::Index n = e.mass.rows();
    const Eigen::PartialPivLU<MatrixXd> lu(e.mass);
    MatrixXd a = MatrixXd::Zero(2 * n, 2 * n);
    a.topRightCorner(n, n).setIdentity();
    a.bottomLeftCorner(n, n) = -lu.solve(e.stiffness);
    a.bottomRightCorner(n, n) = -lu.solve(e.damping);
    const Eigen::EigenSolver<MatrixXd> found(a, false);
    if (found.info() != Eigen::Success) std::abort();
  }
}

void response_by_lu(const System& system, const std::vector<double>& speeds) {
  for (const double speed : speeds) {
    const auto e = plane_equations(system, speed);
    MatrixXcd d = (e.stiffness - speed * speed * e.mass).cast<std::complex<double>>();
    d += std::complex<double>(0, speed) * e.damping;
    const Eigen::Index n = system.size();
    VectorXcd force(2 * n);
    force << speed * speed * system.unbalance, std::complex<double>(0, -speed * speed) * system.unbalance;
    if (!d.partialPivLu().solve(force).allFinite()) std::abort();
  }
}

void run_down_by_newmark(const System& system, double from, double duration, double h) {
  const Eigen::Index n = 2 * system.size();
  const auto rest = plane_equations(system, 0), turning = plane_equations(system, 1);
  const MatrixXd gyroscopic = turning.damping - rest.damping;
  const MatrixXd constant = rest.mass * (4 / (h * h)) + rest.damping * (2 / h) + rest.stiffness,
                 per_speed = gyroscopic * (2 / h);
  VectorXd q = VectorXd::Zero(n), v = q, a = q, unbalance(n), across(n);
  unbalance << system.unbalance.real(), system.unbalance.imag();
  across << -system.unbalance.imag(), system.unbalance.real();
  Eigen::PartialPivLU<MatrixXd> lu(n);
  const double slope = -from / duration;
  for (long i = 1; i <= std::lround(duration / h); ++i) {
    const double t = h * static_cast<double>(i), w = from + slope * t, angle = from * t + 0.5 * slope * t * t;
    const double c = std::cos(angle), s = std::sin(angle);
    const VectorXd p = q * (4 / (h * h)) + v * (4 / h) + a, r = q * (2 / h) + v;
    const VectorXd force = unbalance * (w * w * c + slope * s) + across * (w * w * s - slope * c) + rest.mass * p +
                           rest.damping * r + w * (gyroscopic * r);
    lu.compute(constant + w * per_speed);
    const VectorXd next = lu.solve(force);
    const VectorXd acceleration = (next - q) * (4 / (h * h)) - v * (4 / h) - a;
    v += 0.5 * h * (a + acceleration);
    a = acceleration;
    q = next;
  }
}

std::vector<double> evenly(double from, double to, int count) {
  std::vector<double> out;
  for (int k = 0; k < count; ++k) out.push_back(from + (to - from) * k / (count - 1));
  return out;
}

void print(const char* what, Eigen::Index freedoms, double own, double dense, double target) {
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.2f} | {:g} |\n", what, freedoms, 1e3 * own, 1e3 * dense, own / dense,
             target);
}

}  // namespace

int main() {
  fmt::print("| analysis | degrees of freedom | whirl ms | dense ms | ratio | target |\n|---|---|---|---|---|---|\n");
  for (const int elements : {6, 12}) {
    const System system = assemble(two_discs(elements));
    const Eigen::Index freedoms = 2 * system.size();
    const std::vector<double> few = evenly(0, 471, 50), many = evenly(1, 450, 200);
    print("Campbell diagram, 50 speeds, 8 modes", freedoms, time_of([&] { campbell(system, few, 8); }),
          time_of([&] { campbell_by_qr(system, few); }), elements == 6 ? 0.5 : 0.15);
    print("unbalance response, 200 speeds", freedoms, time_of([&] { unbalance_response(system, many); }),
          time_of([&] { response_by_lu(system, many); }), 2);
    RunOptions run;
    run.from = 450;
    run.duration = 15;
    run.from_rest = true;
    const double newmark = time_of([&] { run_down_by_newmark(system, 450, 15, 1e-3); });
    print("run-down of 15 s, full", freedoms, time_of([&] { simulate_run(system, run); }), newmark, 1);
    const Reduction reduced = reduce(system);
    print("run-down of 15 s, reduced", 2 * reduced.system.size(), time_of([&] { simulate_run(reduced.system, run); }),
          time_of([&] { run_down_by_newmark(reduced.system, 450, 15, 1e-3); }), 1);
  }
}
