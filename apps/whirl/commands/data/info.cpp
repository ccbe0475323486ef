#include "command.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/pages/file_report.hpp"

namespace whirl::app {

void add_info(CommandLine& app, Session& session) {
  struct Options {
    std::string file;
    double rate = 0;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "info", "What a file holds: channels, units, rate, duration, and what looks suspicious",
      "Input: " + io::readable_formats() +
          ", found from the content; text may be .gz.\n"
          "CSV has a header of quantity_unit columns, a universal file datasets 58, 58b, 55, 15, 82, ...\n\n"
          "Example: whirl info rundown.csv",
      [o, &session] {
        io::CsvOptions csv;
        if (o->rate > 0) csv.rate = o->rate;
        const pages::FileReport report = pages::report_file(io::read_signals(o->file, csv));
        session.say(pages::to_text(report));
        session.result(pages::to_json(report));
      });
  sub->add_option("FILE", o->file, "file of any of these formats")->input()->required();
  sub->add_option("--rate", o->rate, "sample rate in Hz, for CSV files without a time column");
}

}  // namespace whirl::app
