#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <string>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/shaft/fit/order_run.hpp"
#include "whirl/shaft/fit/setup.hpp"

namespace whirl::shaft {

enum class UnknownKind {
  stiffness,
  damping,
  material_damping,
  joint_damping,
  youngs_modulus,
  diameter,
  disc_position,
  disc_mass,
  unbalance,  ///< complex, of a station of Rotor::unbalances
  bow,        ///< complex, of a point of Rotor::bow
  gain,       ///< complex, of a probe; 1: as the record says
  runout,     ///< complex, of a probe
};

/// One real unknown of a fit.
struct FitUnknown {
  UnknownKind kind = UnknownKind::stiffness;
  std::size_t index = 0;    ///< of the support, material, joint, section, disc, station or probe
  int row = 0, column = 0;  ///< of a 2 x 2 coefficient
  int part = 0;             ///< over speed: 0 value, 1 change; of a table: its place; complex: 0 real, 1 imaginary
  std::string name;         ///< in words, e.g. "stiffness x of left"
  std::string unit;         ///< SI
  Estimate estimate;        ///< with the tolerances stated
  /// Half width of the 95 % interval as a part of the size: of the value; of the value in the middle for a change over
  /// speed; of the amplitude for a complex one. Gains count as unknown here, whatever their tolerance.
  double relative_half_width = 0;
  bool identifiable = true;  ///< relative_half_width is at most kIdentifiable
};
/// A value known to +-30 % is none to decide on. Stated as a limit, not tuned: with both critical speeds of a two-disc
/// rotor passed at 30 dB every coefficient lies below 20 %, with the first alone material damping above 90 %.
inline constexpr double kIdentifiable = 0.3;

/// A combination of unknowns that the records leave open, those of no tolerance included.
struct WeakDirection {
  std::string words;      ///< e.g. "unbalance scale against common gain"
  double half_width = 0;  ///< of its 95 % interval, in relative units
  struct Share {
    std::string name;   ///< of the unknown, or of the group that moves together
    double weight = 0;  ///< component of the unit vector
  };
  std::vector<Share> shares;  ///< the largest, descending
};

/// What a further run would do.
struct NextRun {
  std::string words;      ///< e.g. "trial mass of 80 gmm at 500 mm"
  std::string decides;    ///< the unknown that gains most
  double half_width = 0;  ///< of its relative interval with that run too
  double now = 0;         ///< of the same without it
};

/// Misfit of the records. `chi_square`: variance of the residual over that of its differences from block to block
/// (von Neumann, Ann. Math. Stat. 12, 1941, 367-395): the noise is the data's own scatter, and a misfit that is smooth
/// over speed stands out. One that is as rough as noise stands out against the scatter of the runs alone.
struct FitMisfit {
  double chi_square = 1;
  double deviations = 0;       ///< its distance from 1 in standard deviations of that ratio
  double band_deviations = 0;  ///< the largest of the same in a band of one run
  std::string band_run;
  double band_from = 0, band_to = 0;  ///< rad/s
  double scatter_ratio = 1;           ///< residual's variance over that of the runs' own scatter, mean of all probes
  double scatter_deviations = 0;      ///< its distance from 1 in standard deviations
  bool explained = true;              ///< none is beyond its limit

  bool above_scatter() const;
  /// The largest of all deviations.
  double most() const { return std::max({std::abs(deviations), band_deviations, scatter_deviations}); }
};
/// Limits for a false alarm in a thousand fits: 3.3 two-sided is 1e-3; a band is one of 8 of each run, 4.2 is 1.3e-5
/// each. The scatter counts curvature of the response too, so that a right fit lies below it: 0.5 to 0.95 in 20 rotors.
/// Noise that is uneven over speed lies above it; half more is allowed.
inline constexpr double kMisfitLimit = 3.3, kBandLimit = 4.2, kScatterLimit = 1.5;
inline bool FitMisfit::above_scatter() const {
  return scatter_ratio > kScatterLimit && scatter_deviations > kMisfitLimit;
}

class FitModel;  // private to the library: the fitted rotor in few coordinates

struct RotorFit {
  Rotor rotor;  ///< as drawn, with the estimates
  std::vector<FitUnknown> unknowns;
  Eigen::MatrixXd covariance;  ///< of the unknowns in `internal` units: logarithms of stiffness and damping
  std::vector<WeakDirection> weak;
  std::vector<NextRun> next;
  FitMisfit misfit;
  std::vector<double> noise;                ///< rms of each probe's record, m, by the scatter of its vectors; worst run
  std::vector<Eigen::MatrixXcd> residuals;  ///< measured less model, m: per run, probes x blocks
  int iterations = 0;
  int starts = 1;  ///< descents, more than one where the first ends in a misfit
  Summary summary;
  std::shared_ptr<const FitModel> model;  ///< for `virtual_probe`
};

struct FitOptions {
  int max_iterations = 40;
  int restarts = 10;  ///< further starts where the first leaves a misfit; 0: none
  int modes = 5;      ///< of a plane, kept by the reduced model beside static shapes of supports and discs
  bool next = true;   ///< RotorFit::next too: most of the time of a short fit
};

/// Fits what `setup` leaves open to the synchronous vectors of the runs: output error, runs through resonances included
/// (the motion of each mode that the speed passes is integrated along the angle of the record). Throws Error where
/// there is nothing to fit: no probe, no unbalance, no run, a trial for a run that is not there.
RotorFit fit_rotor(const Rotor& rotor, const FitSetup& setup, const std::vector<OrderRun>& runs,
                   const FitOptions& options = {});

/// What a probe would show that is not there, from the fitted model: the steady synchronous motion at a station.
struct VirtualProbe {
  double position = 0;             ///< m
  std::vector<double> speeds;      ///< rad/s
  Eigen::VectorXcd x, y;           ///< m, zero-to-peak
  Eigen::VectorXd x_half, y_half;  ///< half width of the 95 % interval of the amplitude, m
};
VirtualProbe virtual_probe(const RotorFit& fit, double position, const std::vector<double>& speeds);

/// The synchronous force of a support on its first point, the same way.
struct VirtualForce {
  std::string support;
  std::vector<double> speeds;      ///< rad/s
  Eigen::VectorXcd x, y;           ///< N, zero-to-peak
  Eigen::VectorXd x_half, y_half;  ///< N
};
VirtualForce virtual_force(const RotorFit& fit, std::size_t support, const std::vector<double>& speeds);

}  // namespace whirl::shaft
