#include "whirl/rt/drivers/optoncdt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"

namespace whirl::rt::optoncdt {
namespace {

constexpr std::uint32_t kFullScale = 65520;
constexpr std::uint32_t kRangeStart = 643, kRangeEnd = 64877;
constexpr std::uint32_t kFirstErrorCode = 262072;

}  // namespace

std::array<std::uint8_t, 3> encode(Value v) noexcept {
  return {static_cast<std::uint8_t>(v.raw & 0x3f), static_cast<std::uint8_t>(0x40 | (v.raw >> 6 & 0x3f)),
          static_cast<std::uint8_t>((v.first ? 0x80 : 0xc0) | (v.raw >> 12 & 0x3f))};
}

std::string_view to_string(SensorError error) {
  constexpr std::string_view kWords[kSensorErrors] = {"none",
                                                      "too much data for the baud rate",
                                                      "no peak",
                                                      "peak before the measuring range",
                                                      "peak behind the measuring range",
                                                      "value not calculable",
                                                      "peak too large",
                                                      "laser off",
                                                      "unknown error code",
                                                      "no distance"};
  const auto place = static_cast<std::size_t>(error);
  return place < std::size(kWords) ? kWords[place] : "?";
}

Scale::Scale(double range, bool mastering) : range_(range), mastering_(mastering) {
  const auto known = {0.01, 0.025, 0.05, 0.1, 0.2, 0.5};
  if (std::none_of(known.begin(), known.end(), [&](double r) { return std::abs(range - r) < 1e-9; })) {
    throw Error::in_field("laser range", fmt::format("{:g} m", range), "0.01, 0.025, 0.05, 0.1, 0.2 or 0.5 m");
  }
}

Reading Scale::operator()(std::uint32_t raw) const noexcept {
  Reading out;
  if (raw >= kFirstErrorCode) {
    using enum SensorError;
    constexpr SensorError kFrom262075[] = {too_much_data, no_peak,        peak_before_range, peak_behind_range,
                                           unknown_code,  not_calculable, peak_too_large,    laser_off};
    const std::uint32_t place = raw - 262075;
    out.error = place < std::size(kFrom262075) ? kFrom262075[place] : unknown_code;
  } else if (raw > kFullScale && !mastering_) {
    out.error = SensorError::no_distance;
  }
  if (out.error != SensorError::none) {
    out.distance = std::numeric_limits<double>::quiet_NaN();
    return out;
  }
  out.distance = (raw * 1.02 / kFullScale - (mastering_ ? 0.51 : 0.01)) * range_;
  // With mastering the raw value is relative to the master, so that it says nothing about the place in the
  // range.
  out.in_range = mastering_ || (raw >= kRangeStart && raw <= kRangeEnd);
  return out;
}

double Scale::resolution() const noexcept { return 1.02 / kFullScale * range_; }

bool ValueDecoder::push(std::uint8_t byte, Value& value) noexcept {
  ++statistics_.bytes;
  const unsigned flag = byte >> 6;
  if (flag == 0) {  // L: the start of a value, whatever came before
    if (have_ > 0) {
      ++statistics_.resyncs;
      statistics_.dropped += have_;
    }
    held_[0] = byte;
    have_ = 1;
    return false;
  }
  if (flag == 1 && have_ == 1) {
    held_[1] = byte;
    have_ = 2;
    return false;
  }
  if (flag >= 2 && have_ == 2) {
    value.raw = static_cast<std::uint32_t>(held_[0] & 0x3f) | static_cast<std::uint32_t>(held_[1] & 0x3f) << 6 |
                static_cast<std::uint32_t>(byte & 0x3f) << 12;
    value.first = flag == 2;
    have_ = 0;
    ++statistics_.values;
    return true;
  }
  if (have_ > 0) ++statistics_.resyncs;
  statistics_.dropped += have_ + 1u;
  have_ = 0;
  return false;
}

FrameDecoder::FrameDecoder(int values_per_frame, int counter) : expected_(values_per_frame), counter_at_(counter) {
  if (values_per_frame < 1 || values_per_frame > static_cast<int>(kMaxValues)) {
    throw Error::in_field("values per frame", fmt::format("{}", values_per_frame), fmt::format("1 to {}", kMaxValues));
  }
  require_range("place of the counter", counter, -1, values_per_frame - 1);
}

bool FrameDecoder::follows(const Frame& frame) noexcept {
  bool good = !gap_;
  gap_ = false;
  if (counter_at_ >= 0) {
    const std::uint32_t count = frame.raw[static_cast<std::size_t>(counter_at_)];
    good = good && counted_ && lost_between(counter_, count) == 0;
    counter_ = count;
    counted_ = true;
  }
  return good;
}

bool FrameDecoder::push(std::uint8_t byte, Frame& frame) noexcept {
  Value value;
  const std::uint64_t dropped = values_.statistics_.dropped;
  const bool complete = values_.push(byte, value);
  const auto cut = [this] {
    ++values_.statistics_.incomplete;
    have_ = 0;
    gap_ = true;
  };
  // Bytes were lost: what follows may belong to another frame.
  if (values_.statistics_.dropped != dropped) {
    gap_ = true;
    if (have_ > 0) cut();
  }
  if (!complete) return false;
  if (value.first) {
    if (have_ > 0) cut();
  } else if (have_ == 0) {  // the rest of a frame whose start was lost, or more values than configured
    cut();
    return false;
  }
  current_.raw[static_cast<std::size_t>(have_++)] = value.raw;
  if (have_ < expected_) return false;
  have_ = 0;
  if (!follows(current_)) {
    ++values_.statistics_.unconfirmed;
    return false;
  }
  frame = current_;
  ++values_.statistics_.frames;
  return true;
}

}  // namespace whirl::rt::optoncdt
