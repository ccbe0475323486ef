#include "command.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/info.hpp"

namespace whirl::app {

void add_info(CLI::App& app, Session& session) {
  struct Options {
    std::string file;
    double rate = 0;
  };
  auto o = std::make_shared<Options>();
  CLI::App* sub = add_command(
      app, session, "info", "What a record holds: channels, units, rate, duration, and what looks suspicious",
      "Input: CSV record with a header of quantity_unit columns; .gz is read directly.\n\n"
      "Example: whirl info rundown.csv",
      [o, &session] {
        CsvOptions csv;
        if (o->rate > 0) csv.rate = o->rate;
        const RecordingInfo info = describe(read_csv(o->file, csv));
        session.say(to_string(info));
        Json json = start_document("whirl.info", 1);
        json.set("source", info.source);
        json.set("rate", info.rate);
        json.set("duration", info.duration);
        json.set("samples", static_cast<double>(info.samples));
        Json::Array channels;
        for (const ChannelInfo& c : info.channels) {
          Json channel = Json::object();
          channel.set("name", c.name);
          channel.set("unit", std::string(si_unit(c.quantity)));
          channel.set("minimum", c.minimum);
          channel.set("maximum", c.maximum);
          channel.set("mean", c.mean);
          channel.set("rms", c.rms);
          Json::Array findings;
          for (const std::string& f : c.findings) findings.push_back(f);
          channel.set("findings", std::move(findings));
          channels.push_back(std::move(channel));
        }
        json.set("channels", std::move(channels));
        session.result(json);
      });
  sub->add_option("FILE", o->file, "record (CSV)")->required();
  sub->add_option("--rate", o->rate, "sample rate in Hz, for files without a time column");
}

}  // namespace whirl::app
