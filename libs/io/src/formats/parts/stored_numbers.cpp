#include "formats/parts/stored_numbers.hpp"

#include <algorithm>
#include <utility>

namespace whirl::io {
namespace {

constexpr std::uint64_t kBlockBytes = std::uint64_t{1} << 24;  // the channels of a part find it in the window

/// True where `run` is what follows `last`, which then holds it too.
bool joined(NumberRun& last, const NumberRun& run) {
  if (run.width != last.width || run.offset != last.offset || run.stretches != 1) return false;
  if (last.stretches == 1 && run.at == last.at + last.rows * last.width) {
    last.rows += run.rows;
    return true;
  }
  if (run.rows != last.rows || run.at < last.at) return false;
  if (last.stretches == 1) last.distance = run.at - last.at;
  if (run.at != last.at + last.stretches * last.distance) return false;
  ++last.stretches;
  return true;
}

}  // namespace

void StoredNumbers::add(NumberRun run) {
  if (run.stretches > 1 && run.distance == run.rows * run.width) run.rows *= std::exchange(run.stretches, 1);
  const std::uint64_t count = run.rows * run.stretches;
  if (count == 0) return;
  if (!runs_.empty() && joined(runs_.back(), run)) {
    ends_.back() += count;
    return;
  }
  runs_.push_back(run);
  ends_.push_back((ends_.empty() ? 0 : ends_.back()) + count);
}

Eigen::VectorXd StoredNumbers::read(const RandomBytes& bytes, Eigen::Index first, Eigen::Index count) const {
  Eigen::VectorXd out(count);
  auto at = static_cast<std::uint64_t>(first);
  const std::uint64_t end = at + static_cast<std::uint64_t>(count);
  auto k = static_cast<std::size_t>(std::upper_bound(ends_.begin(), ends_.end(), at) - ends_.begin());
  double* to = out.data();
  while (at < end) {
    const NumberRun& run = runs_[k];
    const std::uint64_t inside = at - (k == 0 ? 0 : ends_[k - 1]), row = inside % run.rows;
    const std::uint64_t most = std::max<std::uint64_t>(1, kBlockBytes / run.width);
    const std::uint64_t n = std::min({run.rows - row, end - at, most});
    const std::string_view rows = bytes.view(run.at + inside / run.rows * run.distance + row * run.width,
                                             static_cast<std::size_t>(n * run.width));
    numbers_into(to, static_cast<std::size_t>(n), rows, run.width, run.offset, type_, big_);
    if (bit_ >= 0) {
      for (std::uint64_t i = 0; i < n; ++i) to[i] = static_cast<double>(static_cast<unsigned>(to[i]) >> bit_ & 1U);
    }
    at += n;
    to += n;
    if (at == ends_[k]) ++k;
  }
  return out;
}

}  // namespace whirl::io
