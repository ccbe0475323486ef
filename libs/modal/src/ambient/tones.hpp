#pragma once
#include "whirl/modal/oma.hpp"

namespace whirl::modal {

/// Tones whose energy stands in single lines of the whole record, between two frequencies (Hz). `y`: samples x
/// channels.
std::vector<Tone> find_tones(const Eigen::MatrixXd& y, double dt, double low, double high);

/// Subtracts a tone from every channel (least squares; its frequency is refined). Sets amplitude.
void subtract_tone(Eigen::MatrixXd& y, double dt, Tone& tone);

/// Subtracts the order `order` of a rotor's angle (rad, per sample): amplitude and phase may change from one block of
/// the record to the next, linearly inside (about 40 revolutions each). The tone has the mean frequency and amplitude.
Tone subtract_order(Eigen::MatrixXd& y, const Eigen::VectorXd& angle, double dt, int order);

/// Kurtosis of the response band-passed to +- half_width about a frequency, of the channel where it is strongest.
double band_kurtosis(const Eigen::MatrixXd& y, double dt, double frequency, double half_width);

}  // namespace whirl::modal
