#include <algorithm>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "commands/modal/responses.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/frf_csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::app {
namespace {

std::string extension_of(const std::string& file) {
  std::filesystem::path path = file;
  if (path.extension() == ".gz") path.replace_extension();
  return path.extension().string();
}

void write_record(const std::string& out, const Recording& record) {
  const std::string to = extension_of(out);
  if (to == ".csv") {
    io::write_csv(out, record);
  } else if (to == ".uff" || to == ".unv") {
    io::write_uff(out, io::uff_from_recording(record));
  } else if (to == ".mat") {
    io::write_mat(out, record);
  } else if (to == ".h5" || to == ".hdf5") {
    io::write_hdf5(out, record);
  } else if (to == ".wav") {
    io::write_wav(out, record);
  } else if (to == ".lvm") {
    io::write_lvm(out, record);
  } else {
    throw Error::in_field("OUT", out, "a file ending in .csv, .uff, .mat, .h5, .wav or .lvm (.csv.gz, .uff.gz)");
  }
}

void write_responses(const std::string& out, const FrequencyResponse& frf) {
  const std::string to = extension_of(out);
  if (to == ".json") {
    io::save(out, frf);
  } else if (to == ".uff" || to == ".unv") {
    io::write_uff(out, io::uff_from_frf(frf));
  } else if (to == ".csv") {
    io::write_frf_csv(out, frf);
  } else {
    throw Error::in_field("OUT", out, "a file ending in .json, .uff or .csv: the input holds frequency responses");
  }
}

}  // namespace

void add_convert(CommandLine& app, Session& session) {
  struct Options {
    std::string in, out, kind;
    RecordOptions record;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub =
      add_command(app, session, "convert", "A record or frequency responses from one file format to another",
                  "Input: CSV, universal file (UFF), ATFX, MAT (v5, v7.3), HDF5, WAV, LVM, found from the content; or "
                  "frequency responses\n"
                  "(UFF 58, JSON of `whirl frf`, CSV table with --kind).\n"
                  "Output, by the ending of OUT: .csv .uff .mat .h5 .wav .lvm for records, .json .uff .csv for "
                  "frequency responses. SI.\n"
                  "A unit that the file does not state is asked for: --columns HEADER:name_unit, with a calibration "
                  "name_unit*FACTOR.\n\n"
                  "Example: whirl convert blow.wav blow.csv --columns 1:force_N*250 2:acc_g*50",
                  [o, &session] {
                    if (const std::optional<FrequencyResponse> frf = read_responses(o->in, o->kind)) {
                      write_responses(o->out, *frf);
                      for (const std::string& remark : frf->summary.warnings)
                        fmt::print(stderr, "whirl: warning: {}: {}\n", o->in, remark);
                      session.say(fmt::format("{}: {} frequency responses of {} lines", o->out, frf->channels.size(),
                                              frf->frequency.size()));
                      return;
                    }
                    const Recording record = o->record.read(o->in);
                    write_record(o->out, record);
                    session.say(fmt::format("{}: {} channels, {} samples at {:.9g} Hz", o->out, record.channels.size(),
                                            record.size(), record.rate()));
                  });
  sub->add_option("IN", o->in, "file to read")->input()->required();
  sub->add_option("OUT", o->out, "file to write")->output("signals")->required();
  sub->add_option("--kind", o->kind, "of a CSV table of frequency responses")
      ->one_of({"receptance", "mobility", "accelerance"});
  o->record.add_to(sub);
}

}  // namespace whirl::app
