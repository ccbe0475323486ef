#pragma once
#include "whirl/modal/oma.hpp"

namespace whirl::modal {

/// A record that shows some of the rows of the modes' shapes.
struct SeenBy {
  const Eigen::MatrixXd* y = nullptr;  ///< samples x channels, divided by `scale`
  double dt = 0;                       ///< s
  Eigen::VectorXd scale;               ///< of the channels
  std::vector<Eigen::Index> channels;  ///< rows of the shapes
};

/// Gain (twice the log likelihood) per record, times the share of the orders that show the mode, below which it is
/// chance. Over 160 records of structures with one to eight modes a pole laid through random lines had at most 91, a
/// mode at least 130.
constexpr double kChanceGain = 100;

/// Drops modes that explain no more of the spectra about their frequency than chance, one after the other: poles that
/// came back over the orders by themselves, and the second of two that were laid through one mode. What to add to the
/// trust.
std::string drop_chance_modes(const std::vector<SeenBy>& records, std::size_t orders, OperationalModes& result);

}  // namespace whirl::modal
