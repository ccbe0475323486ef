#include "whirl/io/info.hpp"

#include "command.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::app {
namespace {

io::Json::Array texts(const std::vector<std::string>& lines) {
  io::Json::Array out;
  for (const std::string& line : lines) out.push_back(line);
  return out;
}

io::Json to_json(const io::TableInfo& table) {
  io::Json json = io::Json::object();
  json.set("name", table.name);
  json.set("abscissa", table.abscissa);
  json.set("start", table.start);
  json.set("step", table.step);
  json.set("rows", static_cast<double>(table.rows));
  io::Json::Array channels;
  for (const io::ChannelInfo& c : table.channels) {
    io::Json channel = io::Json::object();
    channel.set("name", c.name);
    channel.set("unit", c.unit);
    channel.set("minimum", c.minimum);
    channel.set("maximum", c.maximum);
    channel.set("mean", c.mean);
    channel.set("rms", c.rms);
    channel.set("findings", texts(c.findings));
    channels.push_back(std::move(channel));
  }
  json.set("channels", std::move(channels));
  return json;
}

}  // namespace

void add_info(CommandLine& app, Session& session) {
  struct Options {
    std::string file;
    double rate = 0;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub =
      add_command(app, session, "info", "What a file holds: channels, units, rate, duration, and what looks suspicious",
                  "Input: CSV with a header of quantity_unit columns, universal file (UFF 58, 58b, 55, 15, 82, ...), "
                  "ATFX, MAT (v5, v7.3),\n"
                  "HDF5, WAV, LVM. The format is found from the content; CSV and UFF may be .gz.\n\n"
                  "Example: whirl info rundown.csv",
                  [o, &session] {
                    io::CsvOptions csv;
                    if (o->rate > 0) csv.rate = o->rate;
                    const io::FileInfo info = io::describe(io::read_signals(o->file, csv));
                    session.say(to_string(info));
                    io::Json json = io::start_document("whirl.info", 2);
                    json.set("source", info.source);
                    json.set("format", info.format);
                    io::Json::Array tables;
                    for (const io::TableInfo& table : info.tables) tables.push_back(to_json(table));
                    json.set("tables", std::move(tables));
                    json.set("contents", texts(info.contents));
                    json.set("findings", texts(info.findings));
                    session.result(json);
                  });
  sub->add_option("FILE", o->file, "file of any of these formats")->input()->required();
  sub->add_option("--rate", o->rate, "sample rate in Hz, for CSV files without a time column");
}

}  // namespace whirl::app
