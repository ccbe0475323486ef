#include "whirl/io/info.hpp"

#include "command.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/records/check.hpp"

namespace whirl::app {
namespace {

io::Json::Array texts(const std::vector<std::string>& lines) {
  io::Json::Array out;
  for (const std::string& line : lines) out.push_back(line);
  return out;
}

/// What the record check finds in a table of uniformly sampled time signals with known units.
records::RecordReport check(const io::SignalTable& table, const std::string& source) {
  Recording record;
  record.source = source;
  record.t0 = table.start;
  record.dt = table.step;
  if (table.abscissa != Quantity::time || !(table.step > 0)) return {};
  for (const io::Signal& s : table.signals) {
    if (s.quantity && s.imaginary.size() == 0 && !record.has(s.name)) record.add(s.name, *s.quantity, s.value);
  }
  return records::check(record);
}

io::Json to_json(const records::Finding& f) {
  io::Json json = io::Json::object();
  json.set("kind", std::string(records::to_string(f.kind)));
  json.set("severity", std::string(records::to_string(f.severity)));
  json.set("channel", f.channel);
  json.set("begin_s", f.begin).set("end_s", f.end);
  json.set("samples", static_cast<double>(f.samples));
  json.set("size", f.size).set("frequency_hz", f.frequency);
  json.set("text", f.text());
  return json;
}

/// The record check says the same with the time and what follows from it.
void leave_out_repeated(std::vector<std::string>& findings) {
  std::erase_if(findings, [](const std::string& f) {
    return f.starts_with("clipped:") || f.starts_with("frozen:") || f.find("single-sample spikes") != f.npos;
  });
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
                    const io::SignalFile file = io::read_signals(o->file, csv);
                    io::FileInfo info = io::describe(file);
                    std::vector<records::RecordReport> reports;
                    for (std::size_t k = 0; k < file.tables.size(); ++k) {
                      reports.push_back(check(file.tables[k], file.source));
                      if (reports.back().findings.empty()) continue;
                      for (io::ChannelInfo& c : info.tables[k].channels) leave_out_repeated(c.findings);
                    }
                    std::string text = to_string(info);
                    for (const records::RecordReport& r : reports) {
                      for (const records::Finding& f : r.findings) text += fmt::format("  ! {}\n", f.text());
                    }
                    session.say(text);
                    io::Json json = io::start_document("whirl.info", 2);
                    json.set("source", info.source);
                    json.set("format", info.format);
                    io::Json::Array tables;
                    for (std::size_t k = 0; k < info.tables.size(); ++k) {
                      io::Json table = to_json(info.tables[k]);
                      io::Json::Array findings;
                      for (const records::Finding& f : reports[k].findings) findings.push_back(to_json(f));
                      table.set("record_check", std::move(findings));
                      tables.push_back(std::move(table));
                    }
                    json.set("tables", std::move(tables));
                    json.set("contents", texts(info.contents));
                    json.set("findings", texts(info.findings));
                    session.result(json);
                  });
  sub->add_option("FILE", o->file, "file of any of these formats")->input()->required();
  sub->add_option("--rate", o->rate, "sample rate in Hz, for CSV files without a time column");
}

}  // namespace whirl::app
