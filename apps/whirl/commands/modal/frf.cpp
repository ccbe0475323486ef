#include "whirl/modal/frf.hpp"

#include <fmt/format.h>

#include "ambient.hpp"
#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/modal/shaker_frf.hpp"
#include "whirl/pages/text/modes.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {

namespace {

struct FrfFlags {
  std::vector<std::string> files, forces;
  std::string out, figure, estimator = "h1", excitation = "auto";
  modal::FrfOptions frf;
  modal::ShakerOptions shaker;
  RecordOptions record;
  bool keep_odd = false;
  double trigger_percent = 20, pre_trigger_ms = 20, window_end_percent = 100;
};

FrequencyResponse from_shaker(const FrfFlags& o, const std::vector<Recording>& records) {
  const FrfFlags other;
  const std::pair<const char*, bool> for_blows[] = {
      {"--estimator", o.estimator != other.estimator},
      {"--trigger-percent", o.trigger_percent != other.trigger_percent},
      {"--pre-trigger-ms", o.pre_trigger_ms != other.pre_trigger_ms},
      {"--duration-s", o.frf.cut.duration != other.frf.cut.duration},
      {"--window-end-percent", o.window_end_percent != other.window_end_percent},
      {"--exclude", !o.frf.exclude.blows.empty()},
      {"--keep-odd-impacts", o.keep_odd},
      {"--repair", o.frf.repair},
      {"--drop-double-hits", o.frf.exclude.double_hits}};
  for (const auto& [flag, given] : for_blows) {
    if (given)
      throw Error(
          fmt::format("{} is for impacts: here a force acts all the time (--excitation hammer otherwise)", flag));
  }
  modal::ShakerOptions options = o.shaker;
  options.forces = o.forces;
  options.reference = o.frf.reference;
  return modal::estimate_shaker_frf(records, options);
}

FrequencyResponse from_blows(const FrfFlags& o, const std::vector<Recording>& records, Session& session) {
  modal::FrfOptions options = o.frf;
  if (o.forces.size() > 1) throw Error("--force-channel: a hammer has one force channel");
  if (o.shaker.resolution > 0)
    throw Error("--resolution-hz is for shakers: here are impacts (--excitation shaker otherwise)");
  if (!o.forces.empty()) options.force = o.forces.front();
  options.estimator = o.estimator == "h2"   ? FrfEstimator::h2
                      : o.estimator == "hv" ? FrfEstimator::hv
                                            : FrfEstimator::h1;
  options.exclude.odd = !o.keep_odd;
  options.cut.trigger = o.trigger_percent / 100;
  options.cut.pre_trigger = o.pre_trigger_ms * 1e-3;
  options.window.end = o.window_end_percent / 100;
  std::vector<modal::BlowReport> blows;
  FrequencyResponse frf = modal::estimate_frf(records, options, &blows);
  session.say(report::to_text(pages::blows_table(blows)));
  return frf;
}

}  // namespace

void add_frf(CommandLine& app, Session& session) {
  auto o = std::make_shared<FrfFlags>();
  CommandLine* sub = add_command(
      app, session, "frf", "Frequency responses from hammer impacts or shakers",
      "Input: one or more records (any format of `whirl info`) with a force channel (force_N, force_lbf) and "
      "one or\n"
      "more responses (acc_x_m_s2, acc_x_g, x_um, ...): impacts, one or several in each, or a force that acts all the "
      "time\n"
      "(random, burst random, sweep, periodic random; several forces at once). Without a force: --base.\n"
      "Output: responses with coherence and variance per line. Impacts: H1, H2 or Hv; double hits and overloads are\n"
      "reported. Shakers: local polynomials, without window or leakage.\n\n"
      "Example: whirl frf blow_1.csv blow_2.csv blow_3.csv --out frf.json",
      [o, &session] {
        require_json_name(o->out);
        std::vector<Recording> records;
        for (const std::string& file : o->files) records.push_back(o->record.read(file));
        const bool based = !o->shaker.base.empty();
        if (based && (!o->forces.empty() || o->excitation == "hammer"))
          throw Error("--base: a motion is the input; neither --force-channel nor --excitation hammer goes with it");
        const bool shaker = based || (o->excitation == "auto" ? modal::excited_by_shakers(records, o->forces)
                                                              : o->excitation == "shaker");
        FrequencyResponse frf = shaker ? from_shaker(*o, records) : from_blows(*o, records, session);
        frf.provenance = io::provenance({o->files.begin(), o->files.end()}, session.command_line);
        session.write_together();
        if (!o->out.empty()) io::save(o->out, frf);
        session.say(fmt::format("{} ({}, {}), {} from {:.4g} to {:.4g} Hz{}", counted(frf.channels.size(), "FRF"),
                                to_string(frf.kind), to_string(frf.estimator), counted(frf.frequency.size(), "line"),
                                frf.frequency.size() ? frf.frequency[0] : 0.0,
                                frf.frequency.size() ? frf.frequency[frf.frequency.size() - 1] : 0.0,
                                shaker ? "" : ", " + counted(frf.averages, "average")));
        if (!o->figure.empty()) report::write_figure(report::frequency_response(frf, 0), o->figure);
        session.result(to_json(frf));
        session.finish(frf.summary);
      });
  sub->add_option("FILES", o->files, "records")->input()->required();
  sub->add_option("--out", o->out, "write the frequency responses as JSON")->output("whirl.frf");
  sub->add_option("--figure", o->figure, "draw the first response: magnitude, phase, coherence (.svg .png .pdf .csv)")
      ->output("figure");
  sub->add_option("--estimator", o->estimator, "h1, h2 or hv")->one_of({"h1", "h2", "hv"})->show_default();
  sub->add_option("--excitation", o->excitation,
                  "hammer: impacts; shaker: forces that act all the time; auto: by the record")
      ->one_of({"auto", "hammer", "shaker"})
      ->show_default();
  sub->add_option("--resolution-hz", o->shaker.resolution,
                  "shaker: Hz between lines; 0 = the finest that leaves something for the noise")
      ->range(0, 1e6)
      ->show_default();
  sub->add_option("--force-channel", o->forces,
                  "name of the force channel when there are several; shaker: names, default all forces");
  sub->add_option("--base", o->shaker.base,
                  "transmissibility: the motion of this channel is the input, no force; modes are those with it held");
  sub->add_option("--reference", o->frf.reference,
                  "name of the point and direction hit, e.g. acc_y or 3:+Z; default: the force channel's");
  sub->add_option("--trigger-percent", o->trigger_percent, "an impact starts at this share of the largest force")
      ->range(0.1, 99)
      ->show_default();
  sub->add_option("--pre-trigger-ms", o->pre_trigger_ms, "kept before the trigger, to measure each channel's offset")
      ->range(0, 1e6)
      ->show_default();
  sub->add_option("--duration-s", o->frf.cut.duration, "length of one impact; 0 = to the next one")
      ->range(0, 1e6)
      ->show_default();
  sub->add_option("--window-end-percent", o->window_end_percent,
                  "exponential window: its value at the end; 100 = none. Modes are corrected for it")
      ->range(1e-10, 100)
      ->show_default();
  o->record.add_to(sub);
  sub->add_option("--exclude", o->frf.exclude.blows, "impacts to leave out, counted from 1 over all files");
  sub->add_flag(
      "--keep-odd-impacts,--keep-odd-blows", o->keep_odd,
      "average impacts too that certainly disagree with the others (reversed, other unit, delayed, incoherent)");
  sub->add_flag("--repair", o->frf.repair,
                "bridge single samples that look like spikes; without it they are reported, and no sample is changed");
  sub->add_flag("--drop-double-hits", o->frf.exclude.double_hits, "leave impacts with a second hit out");
}

}  // namespace whirl::app
