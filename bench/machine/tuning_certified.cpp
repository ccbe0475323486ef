// What a certificate promises, counted on machines made apart from the library (testing/foreign_rig.hpp,
// control/limited_machine.hpp, control/flexible_machine.hpp): every make gets five designs and a PD with an adaptive 1x
// vector, its numbers the best of 27 on the make's own machine. Members scatter within the tolerances of `robustness`.
// Each is run down, run up and held at its critical speed.
//     bench_tuning_certified OUT [MAKES = 10 [MEMBERS = 20 [EVALUATIONS = 16]]]
// Rows of a make are appended to OUT when it is complete; makes that stand there are not run again. The table is that
// of all rows in OUT.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "whirl/control/controller.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/testing/control/flexible_machine.hpp"
#include "whirl/testing/control/foreign_rig.hpp"
#include "whirl/testing/control/limited_machine.hpp"
#include "whirl/testing/control/machine_families.hpp"
#include "whirl/tuning/design.hpp"

namespace {

using namespace whirl;
using Complex = std::complex<double>;
using testing::FlexibleMachine;
using testing::ForeignMachine;
using testing::LimitedMachine;
using Machine = std::variant<ForeignMachine, LimitedMachine, FlexibleMachine>;

constexpr std::array kCourses{"run-down", "run-up", "critical speed held"};
constexpr double kHeld = 4;  // s at the critical speed

/// What identification and data sheets say of a make.
struct Papers {
  RotorModel rotor;
  tuning::Hardware hardware;
  double critical = 0;  ///< rad/s
};

// Errors of an identification: stiffness, damping, size and angle of the unbalance.
constexpr double kStiffness = 1.01, kDamping = 1.15, kUnbalance = 0.97, kAngle = 0.04;

rig::RigParameters sheet(double top, double ramp, double still, double limit, double lag, double noise, double age,
                         int counts) {
  rig::RigParameters p;
  p.profile = {.omega_start = top, .omega_end = 0, .ramp_time = ramp, .dwell_end = still};
  p.laser.noise = noise;
  p.laser.rate = 0;  // the plants of a design look at whole Runge-Kutta steps
  p.laser.latency = 0.25e-3 * std::max(1.0, std::round(age / 0.25e-3));
  p.actuator.force_per_volt = limit / p.actuator.voltage_limit;
  p.actuator.bandwidth = 1 / (2 * std::numbers::pi * lag);
  p.actuator.delay_samples = 1;
  p.encoder.counts = counts;
  return p;
}

void state_runout(tuning::Hardware& h, const std::array<double, 3>& amplitude) {
  h.laser.runout_1x = amplitude[0], h.laser.runout_2x = amplitude[1], h.laser.runout_3x = amplitude[2];
}

void add_mode(tuning::Hardware& h, double hertz, double damping, double share) {
  h.modes.push_back({hertz, damping, std::abs(share), share < 0 ? -1.0 : 1.0, 0});
}

/// What was identified: off the machine as far as the constants above say.
template <class Machine>
auto rotor_of(const Machine& m) {
  decltype(Papers::rotor) r;
  r.k1 = kStiffness * m.stiffness / m.mass, r.k2 = m.cubic / m.mass, r.c = kDamping * m.damping / m.mass;
  r.gain = 1 / m.mass;
  r.eps = std::polar(kUnbalance * m.unbalance, m.unbalance_angle + kAngle);
  return r;
}

Papers papers(const ForeignMachine& m) {
  Papers p;
  p.critical = m.critical();
  p.rotor = rotor_of(m);
  p.hardware = tuning::data_sheet(sheet(m.top, m.down, m.still, m.force_limit, m.lag, m.noise, m.age, m.counts));
  state_runout(p.hardware, m.runout);
  for (const testing::ForeignMode& mode : m.modes) {
    add_mode(p.hardware, mode.hertz, mode.damping, mode.participation(m.mass));
  }
  return p;
}

Papers papers(const LimitedMachine& m) {
  Papers p;
  p.critical = m.critical();
  p.rotor = rotor_of(m);
  rig::RigParameters s = sheet(m.from, m.ramp, m.still, m.force_limit, m.lag, m.noise, m.age + m.sensor_lag, 4096);
  s.actuator.slew = m.slew, s.actuator.hysteresis = m.hysteresis;
  p.hardware = tuning::data_sheet(s);
  state_runout(p.hardware, {m.runout, 0.4 * m.runout, 0});
  add_mode(p.hardware, m.second_hertz, m.second_damping, m.second_share);
  return p;
}

Papers papers(const FlexibleMachine& m) {
  const testing::FlexibleModes modes(m);
  Papers p;
  p.critical = modes.omega[0];
  p.rotor.k1 = kStiffness * p.critical * p.critical, p.rotor.c = kDamping * 2 * m.damping * p.critical;
  p.rotor.gain = modes.seen[0] * modes.drive[0];
  const Complex unbalance = modes.seen[0] * modes.unbalance[0];
  p.rotor.eps = std::polar(kUnbalance * std::abs(unbalance), std::arg(unbalance) + kAngle);
  p.hardware = tuning::data_sheet(sheet(m.from, m.ramp, m.still, m.force_limit, m.lag, m.noise, m.age, m.counts));
  state_runout(p.hardware, {m.runout[0], m.runout[1], 0});
  for (int k = 1; k < 3; ++k) {
    add_mode(p.hardware, modes.omega[k] / (2 * std::numbers::pi), m.damping * std::sqrt(modes.omega[k] / p.critical),
             modes.seen[k] * modes.drive[k] / p.rotor.gain);
  }
  return p;
}

/// The machine that a make is designed for.
Machine centre(int make) {
  const auto seed = static_cast<std::uint64_t>(8000 + make);
  if (make % 5 < 2) {
    ForeignMachine m = testing::MachineFamily(seed, true).centre();
    m.runout = testing::MachineFamily::kRunout;
    return m;
  }
  if (make % 5 < 4) return LimitedMachine::draw(seed);
  FlexibleMachine m = FlexibleMachine::draw(seed);
  const testing::FlexibleModes modes(m);
  m.from = 2.2 * modes.omega[0];
  const double eccentric = std::abs(modes.unbalance[0] / modes.drive[0]);
  m.force_limit = 1.6 * eccentric * m.from * m.from;
  return m;
}

/// A member: even within limits whose standard deviations are those of `robustness`.
Machine member(const Machine& make, std::mt19937_64& random) {
  const auto within = [&](double sd) {
    return std::sqrt(3.0) * sd * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1);
  };
  constexpr double kTurn = 3.1415 / 1.7320508;
  const double stiff = 1 + within(0.05), damped = 1 + within(0.2), larger = 1 + within(0.02), turned = within(0.02),
               gain = 1 + within(0.03), axes = within(0.02), share = 1 + within(0.3), rough = 1 + within(0.3);
  Machine out = make;
  if (auto* m = std::get_if<ForeignMachine>(&out)) {
    m->stiffness *= stiff, m->damping *= damped, m->unbalance *= larger, m->unbalance_angle += turned;
    m->gain = gain, m->cross = axes;
    for (testing::ForeignMode& mode : m->modes) mode.inverse_mass *= share;
    for (double& r : m->runout) r *= rough;
    for (double& phase : m->runout_phase) phase = within(kTurn);
  } else if (auto* l = std::get_if<LimitedMachine>(&out)) {
    l->stiffness *= stiff, l->damping *= damped, l->unbalance *= larger, l->unbalance_angle += turned;
    l->gain = gain, l->second_share *= share, l->runout *= rough, l->runout_angle = within(kTurn);
  } else {
    auto& f = std::get<FlexibleMachine>(out);
    f.young *= stiff, f.damping *= damped, f.gain = gain, f.turned = axes;
    for (Complex& e : f.unbalance) e *= std::polar(larger, turned);
    for (double& r : f.runout) r *= rough;
    for (double& phase : f.runout_phase) phase = within(kTurn);
  }
  return out;
}

double critical_of(const Machine& m) {
  return std::visit([](const auto& one) { return papers(one).critical; }, m);
}

/// The machine on a course.
Machine on(Machine machine, std::size_t course) {
  const double critical = critical_of(machine);
  const auto change = [&](double& from, double& to, double& ramp, double& still) {
    if (course == 1) std::swap(from, to);
    if (course == 2) ramp *= 1 - critical / from, to = critical, still = kHeld;
  };
  if (auto* m = std::get_if<ForeignMachine>(&machine)) change(m->top, m->bottom, m->down, m->still);
  if (auto* m = std::get_if<LimitedMachine>(&machine)) change(m->from, m->to, m->ramp, m->still);
  if (auto* m = std::get_if<FlexibleMachine>(&machine)) change(m->from, m->to, m->ramp, m->still);
  return machine;
}

struct Played {
  double peak = 0;  ///< |x| after half a second, m
  bool diverged = false, tripped = false, stepped = false;
};

/// `step`: reading to force; where it has none, none acts from then on. `far`: motion that has diverged, m.
template <class Rig, class Description, class Step>
Played play(const Description& m, std::uint64_t seed, double far, Step&& step) {
  Rig rig(m, seed);
  Played out;
  for (; !rig.done(); rig.advance()) {
    Complex z;
    if constexpr (requires { rig.z(); }) {
      z = rig.z();
    } else {
      z = {rig.x(), rig.y()};
    }
    if (!(std::abs(z) < far)) {
      out.diverged = true, out.peak = std::max(out.peak, far);
      break;
    }
    const Measurement r = rig.read();
    if (r.t > 0.5) out.peak = std::max(out.peak, std::abs(z.real()));
    const auto u = out.tripped ? Expected<Command, Fault>(Command{}) : step(r);
    out.tripped = out.tripped || !u;
    rig.write(u ? *u : Command{});
  }
  return out;
}

template <class Step>
Played play(const Machine& machine, std::uint64_t seed, double far, Step&& step) {
  if (const auto* m = std::get_if<ForeignMachine>(&machine)) return play<testing::ForeignRig>(*m, seed, far, step);
  if (const auto* m = std::get_if<LimitedMachine>(&machine)) return play<testing::LimitedRig>(*m, seed, far, step);
  return play<testing::FlexibleRig>(std::get<FlexibleMachine>(machine), seed, far, step);
}

Played play(const Machine& machine, std::uint64_t seed, double far, const ControllerDesign& design) {
  control::Controller controller = control::make_controller(design);
  std::uint32_t word = 0;
  Played out = play(machine, seed, far, [&](const Measurement& m) {
    const auto u = controller.step(m);
    word |= controller.state().supervision.word;
    return u;
  });
  constexpr std::uint32_t kSteps =
      control::kGainLowered | control::kFeedbackOff | control::kForceOff | control::kSupervisionTrip;
  out.stepped = (word & (kSteps | control::kUnheld)) != 0;
  return out;
}

/// PD on a filtered difference and a vector at 1x that follows the rotor's answer (influence of the damped rotor).
class HandTuned {
 public:
  struct Numbers {
    double damping = 0.2, adaptation = 3, cutoff = 600;  ///< of critical; 1/s; 1/s
  };
  HandTuned(const Papers& p, const Numbers& n, double limit) : papers_(p), numbers_(n), limit_(limit) {}

  Expected<Command, Fault> operator()(const Measurement& m) {
    constexpr double h = 1e-3, kSlow = 15;
    const Complex z{m.x, m.y}, turn = std::polar(1.0, m.beta);
    if (!started_) last_ = z, started_ = true;
    const double share = numbers_.cutoff * h / (1 + numbers_.cutoff * h);
    v_ += share * ((z - last_) / h - v_);
    last_ = z;
    const RotorModel& r = papers_.rotor;
    const double kd = 2 * numbers_.damping * std::sqrt(r.k1);
    Complex u = -kd * v_ / r.gain;
    if (m.omega > kSlow) {
      // One newton at 1x moves the rotor by `answer`; it comes some 2 ms after the reading it is computed from.
      const double w = m.omega;
      const Complex answer = r.gain / Complex(r.k1 - w * w, (r.c + kd) * w) * std::polar(1.0, -2e-3 * w);
      vector_ -= h * numbers_.adaptation * z * std::conj(turn) / (answer * w * w);
      u += vector_ * turn * w * w;
    }
    return Command{std::clamp(u.real(), -limit_, limit_), std::clamp(u.imag(), -limit_, limit_)};
  }

 private:
  Papers papers_;
  Numbers numbers_;
  double limit_;
  Complex v_, last_, vector_;
  bool started_ = false;
};

/// The best of 27 settings on the make's own machine, by the sum of its three peaks.
HandTuned::Numbers by_hand(const Machine& make, const Papers& p, double limit) {
  HandTuned::Numbers best;
  double least = 1e9;
  for (const double damping : {0.1, 0.2, 0.4}) {
    for (const double adaptation : {1.0, 3.0, 10.0}) {
      for (const double cutoff : {300.0, 600.0, 1200.0}) {
        const HandTuned::Numbers tried{damping, adaptation, cutoff};
        double sum = 0;
        for (std::size_t course = 0; course < kCourses.size(); ++course)
          sum += play(on(make, course), 17, 0.1, HandTuned(p, tried, limit)).peak;
        if (sum < least) least = sum, best = tried;
      }
    }
  }
  return best;
}

struct Count {
  long runs = 0, diverged = 0, worse = 0, trips = 0, steps = 0, above = 0;
  double largest = 0;  ///< peak / peak without control
  void add(const Played& run, double open, double stated) {
    ++runs, diverged += run.diverged, worse += run.peak > 1.05 * open, trips += run.tripped, steps += run.stepped;
    above += stated > 0 && run.peak > stated;
    largest = std::max(largest, run.peak / open);
  }
  void add(const Count& c) {
    runs += c.runs, diverged += c.diverged, worse += c.worse, trips += c.trips, steps += c.steps, above += c.above;
    largest = std::max(largest, c.largest);
  }
};

struct Entry {
  std::string name;
  std::optional<ControllerDesign> design;
};

/// The certified ones of five designs; what is refused is said.
std::vector<Entry> designs(const Papers& p, int evaluations, int make) {
  std::vector<Entry> out;
  for (const auto& [law, estimator, feedforward] : {std::tuple{"tsmc", "kfe", true},
                                                    {"pd", "kfo", true},
                                                    {"pd_notch", "lpf", false},
                                                    {"lqi", "kfo", false},
                                                    {"lsmc", "kfe", true}}) {
    IdentifiedModel model;
    model.method = "stand-in";
    model.rotor = p.rotor;
    tuning::DesignOptions o;
    o.law = law, o.estimator = estimator, o.feedforward = feedforward;
    o.hardware = p.hardware;
    o.evaluations = evaluations;
    o.threads = 1;
    ControllerDesign d = tuning::design(model, o);
    const std::string name = fmt::format("`{}`, {}", law, estimator);
    if (d.margins.at("certified") != 1) {
      fmt::print("make {}: {} is not certified\n", make, name);
      continue;
    }
    out.push_back({name, std::move(d)});
  }
  out.push_back({"PD, adaptive 1x vector", std::nullopt});
  return out;
}

/// Rows of one make, as text: make, entry, course, numbers.
std::string rows(int make, int members, int evaluations) {
  const Machine machine = centre(make);
  const Papers p = std::visit([](const auto& m) { return papers(m); }, machine);
  const double limit = p.hardware.actuator.force_limit();
  const std::vector<Entry> entries = designs(p, evaluations, make);
  const HandTuned::Numbers numbers = by_hand(machine, p, limit);
  std::vector<std::array<Count, kCourses.size()>> counts(entries.size());
  std::mt19937_64 random(static_cast<std::uint64_t>(make) * 31337 + 5);
  for (int i = 0; i < members; ++i) {
    const Machine one = member(machine, random);
    for (std::size_t course = 0; course < kCourses.size(); ++course) {
      const Machine run = on(one, course);
      const auto seed = static_cast<std::uint64_t>(1000 * make + 10 * i) + course;
      const double open =
          play(run, seed, 1, [](const Measurement&) { return Expected<Command, Fault>(Command{}); }).peak;
      const double far = 3 * open + 5e-3;
      for (std::size_t e = 0; e < entries.size(); ++e) {
        const auto& d = entries[e].design;
        const Played played = d ? play(run, seed, far, *d) : play(run, seed, far, HandTuned(p, numbers, limit));
        const double stated = d ? d->margins.at("peak_m") : 0;
        counts[e][course].add(played, open, stated);
        if (played.diverged || played.tripped || (d && (played.stepped || played.peak > 1.05 * open))) {
          fmt::print("make {} member {}, {}, {}: peak {:.4f} mm, open {:.4f}, stated {:.4f}{}{}{}\n", make, i,
                     entries[e].name, kCourses[course], 1e3 * played.peak, 1e3 * open, 1e3 * stated,
                     played.diverged ? ", diverged" : "", played.tripped ? ", tripped" : "",
                     played.stepped ? ", supervision steps in" : "");
        }
      }
    }
  }
  std::string text;
  for (std::size_t e = 0; e < entries.size(); ++e) {
    for (std::size_t course = 0; course < kCourses.size(); ++course) {
      const Count& c = counts[e][course];
      text += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{:.4f}\n", make, entries[e].name, course, c.runs,
                          c.diverged, c.worse, c.trips, c.steps, c.above, c.largest);
    }
  }
  return text;
}

/// Counts of all rows in the file, by entry and course, and the makes that stand there.
using Table = std::map<std::pair<std::string, std::size_t>, Count>;
std::set<int> read(const std::string& path, Table& table) {
  std::set<int> makes;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    std::string make, name, course;
    std::getline(fields, make, '\t'), std::getline(fields, name, '\t'), std::getline(fields, course, '\t');
    Count c;
    fields >> c.runs >> c.diverged >> c.worse >> c.trips >> c.steps >> c.above >> c.largest;
    makes.insert(std::atoi(make.c_str()));
    table[{name, static_cast<std::size_t>(std::atoi(course.c_str()))}].add(c);
  }
  return makes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::puts("usage: bench_tuning_certified OUT [MAKES [MEMBERS [EVALUATIONS]]]"), 2;
  const int makes = argc > 2 ? std::atoi(argv[2]) : 10, members = argc > 3 ? std::atoi(argv[3]) : 20;
  const int evaluations = argc > 4 ? std::atoi(argv[4]) : 16;
  Table before;
  const std::set<int> done = read(argv[1], before);
  for (int make = 0; make < makes; ++make) {
    if (done.contains(make)) continue;
    const std::string text = rows(make, members, evaluations);
    std::ofstream(argv[1], std::ios::app) << text;
    fmt::print("make {} of {} done\n", make + 1, makes);
    std::fflush(stdout);
  }
  Table table;
  read(argv[1], table);
  fmt::print(
      "| design | course | runs | diverged | above 1.05 of the uncontrolled peak | trips | supervision steps in | "
      "above "
      "the stated peak | largest by uncontrolled peak |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& [key, c] : table) {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {:.2f} |\n", key.first, kCourses.at(key.second), c.runs,
               c.diverged, c.worse, c.trips, c.steps, c.above, c.largest);
  }
  return 0;
}
