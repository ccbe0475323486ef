#include "monte_carlo/machine_lanes.hpp"

#include <cmath>
#include <optional>

#include "whirl/control/controller.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::tuning {
namespace {

/// One lane of a batch as a rig of the loop.
template <int Lanes>
struct LaneRig {
  const rig::BatchRig<Lanes>* batch;
  rig::LaneArray<Lanes>*ux, *uy;
  int lane;
  double half_range;

  Measurement read() const noexcept {
    const auto& r = batch->read();
    const double x = r.x[lane], y = r.y[lane];
    // The converter clips at its range.
    return {r.t, x, y, r.beta, r.omega, r.omega_dot, std::abs(x) < half_range && std::abs(y) < half_range};
  }
  void write(const Command& c) noexcept { (*ux)[lane] = c.ux, (*uy)[lane] = c.uy; }
  void advance() noexcept {}
};

template <int Lanes>
struct LaneLoop {
  LaneLoop(const rig::BatchRig<Lanes>* batch, rig::LaneArray<Lanes>* ux, rig::LaneArray<Lanes>* uy, int lane,
           const ControllerDesign& design, const rig::RigParameters& rig)
      : view{batch, ux, uy, lane, 0.5 * rig.laser.range},
        controller(control::make_controller(design)),
        clock(1 / rig.timing.rate),
        loop(view, controller, clock) {}
  LaneRig<Lanes> view;
  control::Controller controller;
  rt::SimulatedClock clock;
  rt::Loop<LaneRig<Lanes>, control::Controller, rt::SimulatedClock> loop;
  bool running = true;
  std::uint32_t supervision = 0;  // bits of the whole run
};

}  // namespace

template <int Lanes>
MachineLanes<Lanes>::MachineLanes(const RigDraw& draw, const std::vector<int>& indices,
                                  const std::shared_ptr<const rig::RigTables>& like) {
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    if (i < indices.size()) {
      rigs_.push_back(draw(indices[i]));
      tables_[i] = rig::make_rig_tables(rigs_.back().rig, like);
    } else {
      tables_[i] = tables_[i - 1];
    }
    seeds_[i] = rigs_.back().noise_seed;
  }
  const rig::RigParameters& shared = rigs_.front().rig;
  const double rate = shared.timing.rate;
  const long ticks = std::lround(shared.profile.duration() * rate);
  const ClosedLoopOptions options;

  omega_.resize(ticks);
  double last = 0;
  for (long k = 0; k < ticks; ++k) {
    const rotor::AngleState a = shared.profile.at(static_cast<double>(k) / rate);
    omega_[k] = a.omega;
    const double u = control::unbalance_per_metre(a.beta, a.omega, a.alpha).real();
    smooth_ += std::abs(u - last) * rate / static_cast<double>(ticks);
    last = u;
  }
  for (const DrawnRig& r : rigs_) segments_.push_back(rig::segments(omega_, r.rig.natural_frequency(), options.bounds));

  const rig::SegmentPeaks far{.all = 1e3};
  std::vector<RunJudge> open;
  for (const std::vector<int>& segment : segments_) open.emplace_back(far, &segment, rate, options.skip, ticks);
  rig::BatchRig<Lanes> batch(tables_, seeds_);
  for (long k = 0; k < ticks; ++k) {
    for (std::size_t i = 0; i < open.size(); ++i) {
      const int lane = static_cast<int>(i);
      open[i].motion(in_reach({batch.true_x()[lane], batch.true_y()[lane]}, shared.laser.range), 0);
      open[i].cycle({.valid = false}, 0, false, Fault::none);
    }
    batch.coast();
  }
  for (const RunJudge& o : open) open_.push_back(o.closed());
}

template <int Lanes>
std::vector<LaneRun> MachineLanes<Lanes>::run(const ControllerDesign& design) const {
  const double rate = rigs_.front().rig.timing.rate, skip = ClosedLoopOptions().skip;
  const long ticks = omega_.size();
  rig::BatchRig<Lanes> batch(tables_, seeds_);
  rig::LaneArray<Lanes> ux, uy;
  std::deque<LaneLoop<Lanes>> loops;
  std::vector<RunJudge> judges;
  for (std::size_t i = 0; i < rigs_.size(); ++i) {
    loops.emplace_back(&batch, &ux, &uy, static_cast<int>(i), design, rigs_[i].rig);
    judges.emplace_back(open_[i], &segments_[i], rate, skip, ticks);
  }
  std::vector<std::optional<rt::CycleRecord>> cycles(loops.size());
  for (long k = 0; k < ticks; ++k) {
    const std::complex<double> turn = control::unit_phasor(batch.read().beta);
    for (std::size_t i = 0; i < loops.size(); ++i) {
      LaneLoop<Lanes>& l = loops[i];
      const int lane = static_cast<int>(i);
      cycles[i].reset();
      if (!l.running) continue;
      if (!judges[i].motion({batch.true_x()[lane], batch.true_y()[lane]}, omega_[k])) {
        l.running = false;
        l.view.write({});
        continue;
      }
      cycles[i] = l.loop.cycle();
      l.supervision |= l.controller.state().supervision.word;
    }
    batch.write(ux, uy);
    batch.advance();
    for (std::size_t i = 0; i < loops.size(); ++i) {
      if (!cycles[i]) continue;
      // What acts: the noise of a command that stays within the play of an amplifier chatters nowhere.
      judges[i].cycle(cycles[i]->measurement, turn, batch.commanded_x()[static_cast<int>(i)],
                      loops[i].controller.state().saturated || cycles[i]->limited, cycles[i]->trip);
    }
  }
  std::vector<LaneRun> out;
  for (std::size_t i = 0; i < rigs_.size(); ++i) {
    const double force = smooth_ * std::abs(rigs_[i].rotor.eps) / rigs_[i].rotor.gain;
    // What supervision had to take back is not held by the design.
    out.push_back({judges[i].collected(force, nominal_excess(design)), judges[i].saturated(),
                   (loops[i].supervision & control::kUnheld) == 0});
  }
  return out;
}

template class MachineLanes<8>;
template class MachineLanes<16>;
template class MachineLanes<32>;

}  // namespace whirl::tuning
