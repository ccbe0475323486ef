#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

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

}  // namespace whirl::io::detail
