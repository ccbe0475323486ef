#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/modal/oma.hpp"

namespace whirl::modal {

/// Transforms of all channels of a record, not windowed.
struct RecordSpectra {
  Eigen::MatrixXcd lines;  ///< lines x channels
  Eigen::Index samples = 0;
  double dt = 0;

  double line() const { return 1 / (dt * static_cast<double>(samples)); }  ///< Hz
};
RecordSpectra spectra_of(const Eigen::MatrixXd& y, double dt);

/// Complex envelopes of all channels about the line `centre`, of the lines within `half`, at `count` even instants.
Eigen::MatrixXcd envelopes(const RecordSpectra& spectra, Eigen::Index centre, Eigen::Index half, Eigen::Index count);

/// What turns: an angle per sample and how its speed departs from the mean.
struct ShaftAngle {
  Eigen::VectorXd angle;      ///< rad
  Eigen::VectorXd deviation;  ///< of the speed from its mean, in units of `wander`
  Eigen::VectorXd rate;       ///< change of the deviation, of unit size
  double frequency = 0;       ///< Hz, mean
  double wander = 0;          ///< relative sd of the speed
};
/// The speed is that over `smooth` seconds.
ShaftAngle shaft_of(Eigen::VectorXd angle, double dt, double smooth);

/// Size and phase of an order as a function of the speed (and of time, slowly), the same terms for all channels. The
/// response to an order is that of the structure at the speed of the moment.
enum class OrderTerms { constant, speed, rate, square, cube, time };

/// Columns of the first `terms` of them at a sample.
Eigen::MatrixXd order_terms(const ShaftAngle& shaft, Eigen::Index terms);

/// Lines on either side of one, first to last, that are neither its own nor another slope of the spectrum.
constexpr Eigen::Index kAboutFirst = 4, kAboutLast = 22;

/// Logarithm of the chance that random response has so much in one line: Hotelling's T^2 over the channels against the
/// lines `about` it (one a row), all behind a Hann window.
double line_chance(const Eigen::VectorXcd& own, const Eigen::MatrixXcd& about);

/// The same of the line of an order once the angle is turned back.
double order_chance(const RecordSpectra& spectra, const ShaftAngle& shaft, double order);

/// How an order stands in the record: `terms` by description length, its envelope and what else is there.
struct OrderFit {
  Eigen::Index terms = 1;
  Eigen::MatrixXcd model, residual;  ///< instants x directions, turned back by the order
  Eigen::MatrixXcd noise;            ///< covariance of the residual
  double oversampled = 1;            ///< instants per independent sample of the residual
};
OrderFit fit_order(const RecordSpectra& spectra, const ShaftAngle& shaft, double order, Eigen::Index half,
                   Eigen::Index count);

/// Takes an order off all channels; the tone has the mean frequency and size.
Tone take_off_order(Eigen::MatrixXd& y, const ShaftAngle& shaft, double order, Eigen::Index terms);

}  // namespace whirl::modal
