#include <fmt/format.h>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "commands/modal/response_options.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/record_stream.hpp"

namespace whirl::app {
namespace {

void convert_parts(const RecordOptions& record, const std::string& in, const std::string& out, Session& session) {
  const io::Converted done = io::convert_in_parts(in, out, record.csv(), record.part_rows(),
                                                  [&session](double share) { session.progress("convert", share); });
  session.say(fmt::format("{}: {}, {} at {:.9g} Hz", out, counted(done.channels, "channel"),
                          counted(done.samples, "sample"), done.rate));
}

}  // namespace

void add_convert(CommandLine& app, Session& session) {
  struct Options {
    std::string in, out;
    RecordOptions record;
    ResponseFlags responses;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "convert", "A record or frequency responses from one file format to another",
      "Input: " + io::readable_formats() +
          ", found from the content; or frequency responses\n"
          "(UFF 58, JSON of `whirl frf`, CSV table with --kind).\n"
          "Output, by the ending of OUT: for records " +
          io::recording_endings() +
          "; for frequency responses .json .uff .csv. SI.\n"
          "State a unit that the file does not have: --columns HEADER:name_unit, with a calibration "
          "name_unit*FACTOR.\n"
          "Missing samples stay missing: NaN, or an empty cell of a CSV table; a warning counts them. Rows "
          "left out of\nan even time are put back as missing; uneven times are taken onto an even grid. With "
          "--stream gaps are refused.\n\n"
          "Example: whirl convert blow.wav blow.csv --columns 1:force_N*250 2:acc_g*50",
      [o, &session] {
        if (o->record.in_parts(o->in)) return convert_parts(o->record, o->in, o->out, session);
        const bool chosen = !o->record.columns.empty() || o->record.header_line > 0 || io::is_large(o->in);
        if (const std::optional<FrequencyResponse> frf =
                chosen ? std::nullopt : io::read_responses(o->in, o->responses.options())) {
          io::write_responses(o->out, *frf);
          for (const std::string& remark : frf->summary.warnings)
            fmt::print(stderr, "whirl: warning: {}: {}\n", o->in, remark);
          session.say(fmt::format("{}: {} of {}", o->out, counted(frf->channels.size(), "frequency response"),
                                  counted(frf->frequency.size(), "line")));
          return;
        }
        o->record.gaps = true;
        const Recording record = o->record.read(o->in);
        io::write_recording(o->out, record);
        session.say(fmt::format("{}: {}, {} at {:.9g} Hz", o->out, counted(record.channels.size(), "channel"),
                                counted(record.size(), "sample"), record.rate()));
      });
  sub->add_option("IN", o->in, "file to read")->input()->required();
  sub->add_option("OUT", o->out, "file to write")->output("signals")->required();
  o->responses.add_to(sub);
  o->record.add_to(sub);
  o->record.add_stream_to(sub);
  o->record.add_tacho_to(sub);
}

}  // namespace whirl::app
