// Recordings that are opened while the hub runs: read in the thread of whoever brings them, taken over between two
// steps.
#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/monitor/hub.hpp"

namespace whirl::monitor {

bool Hub::takes(Opened as) const { return options_.read && (as == Opened::compared || source_->replaceable()); }

void Hub::open(const std::filesystem::path& file, const std::string& name, Opened as) {
  {
    const std::lock_guard lock(mutex_);
    if (!takes(as)) {
      throw Error(as == Opened::played && options_.read
                      ? name + ": a running loop is shown, no recording takes its place; it can be compared with one"
                      : name + ": this monitor opens no recordings");
    }
  }
  const auto named = [&](std::string text) {  // the user knows the name of the file, not of the copy
    for (std::size_t at; (at = text.find(file.string())) != std::string::npos;)
      text.replace(at, file.string().size(), name);
    return text;
  };
  try {
    Recording recording = options_.read(file);
    recording.source = name;
    std::unique_ptr<FrameSource> source;
    std::optional<Reference> reference;
    if (as == Opened::played) {
      source = std::make_unique<PlaybackSource>(std::move(recording));
    } else {
      reference = reference_of(recording, 600, Motion::measured);
    }
    const std::lock_guard lock(mutex_);
    if (source) opened_.source = std::move(source);
    if (reference) opened_.reference = std::move(reference);
  } catch (const Error& e) {
    throw Error(named(e.what()));
  }
}

void Hub::replace_source(std::unique_ptr<FrameSource> source) {
  if (recorder_.active()) {
    note("record stopped: another recording was opened");
    recorder_.stop("another recording was opened");
  }
  std::map<std::string, double> limits;
  for (const auto& [channel, limit] : options_.limits) {
    const auto has = [&](const ChannelInfo& c) { return c.name == channel; };
    if (std::ranges::any_of(source->info().channels, has)) {
      limits.emplace(channel, limit);
    } else {
      note(fmt::format("no limit of {}: {} has no such channel", channel, source->info().name));
    }
  }
  {
    const std::lock_guard lock(mutex_);
    source_ = std::move(source);
    controls_ = controls_of(*source_);
    tracked_ = tracked_channels(source_->info().channels);
    options_.spectrum.block = block_for(source_->info().rate);
    ++streams_;
    set_up();
  }
  limits_ = LimitWatch(source_->info(), limits);
  spectrum_ = make_spectrum(options_.spectrum);
  trend_ = SpeedTrend();
  speed_ = std::numeric_limits<double>::quiet_NaN();
  cycles_ = 0;
  last_time_ = 0;
}

void Hub::take_opened() {
  std::unique_ptr<FrameSource> source;
  std::optional<Reference> reference;
  {
    const std::lock_guard lock(mutex_);
    source = std::move(opened_.source);
    reference = std::exchange(opened_.reference, std::nullopt);
    if (reference) options_.reference = reference;
  }
  if (!source && !reference) return;
  if (source) {
    replace_source(std::move(source));
    note("opened " + source_->info().name);
  }
  if (reference) note("compared with " + reference->name);
  publish(std::make_shared<Message>(Message{description(), true}));
}

}  // namespace whirl::monitor
