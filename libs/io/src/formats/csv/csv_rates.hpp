#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io::detail {

/// Channels of several rates in one table: every line has a time, a slow channel a value in few of the lines. Keeps the
/// lines of the fastest channel and takes the others to its times by straight lines; one sentence for each. Nothing is
/// done where every channel has a value in most lines. `time`: index of the time in `channels`, which follows `t`.
std::vector<std::string> join_rates(Eigen::VectorXd& t, std::vector<Channel>& channels, std::size_t time);

/// Step of the last of six significant digits of the largest time, which many programs write.
double six_digits(const Eigen::VectorXd& t);

/// Times of few digits, which stand still now and then but never fall, are those of `rate` (Hz): none is off an even
/// grid by more than the steps in which they are written and half a sample.
bool agrees_coarsely(const Eigen::VectorXd& t, double rate);

/// The grid that the times of a file are read as.
struct CsvGrid {
  double dt = 0;
  double rounding = 0, exact = 0;  ///< s: how far a time may be off by its written digits, and by those of a double
};
/// Of n times from `first` to `last`. `digits`: what six written digits leave open, where the rate is stated.
CsvGrid csv_grid(const CsvStream& stream, double first, double last, Eigen::Index n, double digits, bool stated);

}  // namespace whirl::io::detail
