#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

#include "formats/arrays/arrays.hpp"
#include "formats/parts/rows.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

class RowStream : public SignalStream {
 public:
  RowStream(std::unique_ptr<RowReader> reader, const PartRows& rows)
      : reader_(std::move(reader)), rows_(rows), at_(rows.first) {
    if (reader_->rows() < 2)
      throw Error::in_file(reader_->name(), 0, counted(reader_->rows(), "sample") + "; at least 2 are needed");
    require_rows(rows, reader_->rows());
    rows_.end = std::min(rows_.end, reader_->rows());
    // How many channels there are, by a first look at two rows.
    std::size_t channels = 0;
    for (const SignalTable& table : reader_->read(0, 2).tables) channels += table.signals.size();
    each_ = rows_of_part(rows_, channels);
  }

  bool next(SignalFile& part) override {
    if (at_ >= rows_.end) return false;
    Eigen::Index count = std::min(each_, rows_.end - at_);
    if (rows_.end - at_ - count == 1) count = count > 2 ? count - 1 : count + 1;  // no part of a single row
    const Eigen::Index skipped = count < 2 && at_ > 0 ? 1 : 0;                    // a range of one: with the row before
    if (count + skipped < 2) throw Error("one sample is no record");
    part = reader_->read(at_ - skipped, count + skipped);
    if (skipped > 0) keep_rows(part, 1, count);
    at_ += count;
    gather(part);
    return true;
  }
  Eigen::Index rows() const override { return rows_.end - rows_.first; }
  double done() const override {
    return rows_.end > rows_.first
               ? static_cast<double>(at_ - rows_.first) / static_cast<double>(rows_.end - rows_.first)
               : 1;
  }

 private:
  /// What is said once, and what is counted over all parts.
  void gather(SignalFile& part) {
    std::erase_if(part.findings, [&](const std::string& text) { return !said_.insert(text).second; });
    for (const RoundedIntegers& r : part.rounded) {
      const auto known =
          std::find_if(rounded_.begin(), rounded_.end(), [&](const auto& k) { return k.name == r.name; });
      if (known == rounded_.end()) {
        rounded_.push_back(r);
      } else {
        known->count += r.count;
      }
    }
    for (RoundedIntegers& r : rounded_) r.of = rows_.end - rows_.first;
    part.rounded.clear();
    if (at_ < rows_.end) return;
    part.rounded = rounded_;
    tell_rounding(part);
  }

  std::unique_ptr<RowReader> reader_;
  PartRows rows_;
  Eigen::Index at_, each_ = 0;
  std::set<std::string> said_;
  std::vector<RoundedIntegers> rounded_;
};

}  // namespace

void require_rows(const PartRows& wanted, Eigen::Index present) {
  const bool stated = wanted.end != PartRows{}.end;
  if (wanted.first < 0 || wanted.end <= wanted.first || (stated && wanted.end > present))
    throw Error::in_field("--rows", fmt::format("{}:{}", wanted.first, wanted.end),
                          fmt::format("FIRST:END with 0 <= FIRST < END <= {}", present));
}

Eigen::Index rows_of_part(const PartRows& rows, std::size_t channels) {
  constexpr Eigen::Index kValues = Eigen::Index{1} << 20, kLeastRows = 64;  // of a part
  const auto n = static_cast<Eigen::Index>(std::max<std::size_t>(channels, 1));
  return std::max(std::min(rows.each, std::max(kValues / n, kLeastRows)), Eigen::Index{2});
}

std::unique_ptr<SignalStream> stream_rows(std::unique_ptr<RowReader> reader, const PartRows& rows) {
  return std::make_unique<RowStream>(std::move(reader), rows);
}

}  // namespace whirl::io
