#include "whirl/pages/file_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/pages/record_views.hpp"
#include "whirl/pages/text/findings.hpp"
#include "whirl/pages/vibration_tables.hpp"
#include "whirl/signal/motion_quantity.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::pages {
namespace {

io::Json::Array texts(const std::vector<std::string>& lines) {
  io::Json::Array out;
  for (const std::string& line : lines) out.push_back(line);
  return out;
}

/// A table of uniformly sampled time signals with known units; no channels for another one.
Recording recording_of(const io::SignalTable& table, const std::string& source) {
  Recording record;
  record.source = source;
  record.t0 = table.start;
  record.dt = table.step;
  if (table.abscissa != Quantity::time || !(table.step > 0)) return record;
  for (const io::Signal& s : table.signals) {
    if (s.quantity && s.imaginary.size() == 0 && !record.has(s.name)) record.add(s.name, *s.quantity, s.value);
  }
  return record;
}

/// Of a record with an angle that cannot be read, or with forces (no rotor turns there), nothing: those who need the
/// angle say why.
diagnosis::VibrationFindings vibration_of_table(const Recording& record) {
  if (std::ranges::any_of(record.channels, [](const Channel& c) { return c.quantity == Quantity::force; })) return {};
  try {
    return diagnosis::find_vibration(record);
  } catch (const Error&) {
    return {};
  }
}

/// Range, mean and rms without the readings that the check leaves out of the motions.
void describe_usable(const Recording& record, const records::RecordReport& checked,
                     std::vector<io::ChannelInfo>& channels) {
  for (io::ChannelInfo& info : channels) {
    const Channel* c = record.find(info.name);
    const records::ChannelMask* mask = checked.mask(info.name);
    if (c == nullptr || mask == nullptr || !signal::integrations(c->quantity, c->quantity)) continue;
    const auto used = mask->usable && c->samples.array().isFinite();
    const auto count = static_cast<double>(used.count());
    if (count == 0) continue;
    info.minimum = used.select(c->samples.array(), INFINITY).minCoeff();
    info.maximum = used.select(c->samples.array(), -INFINITY).maxCoeff();
    info.mean = used.select(c->samples.array(), 0.0).sum() / count;
    info.rms = std::sqrt(used.select(c->samples.array().square(), 0.0).sum() / count);
  }
}

/// Of channels that look like a tacho's by their levels and their even pattern, but not by their name, how to use them.
std::vector<std::string> unnamed_pulses(const Recording& record) {
  std::vector<std::string> out;
  for (const Channel& c : record.channels) {
    const bool electric =
        c.quantity == Quantity::voltage || c.quantity == Quantity::current || c.quantity == Quantity::dimensionless;
    if (!electric || !c.samples.allFinite() || !signal::has_two_levels(c.samples)) continue;
    try {
      std::vector<std::string> said;
      signal::angle_of_tacho(record, c.name, {}, said);
      out.push_back(fmt::format("channel {0} looks like the pulses of a tacho; for the angle: --pulses {0}", c.name));
    } catch (const Error&) {
      continue;  // no pattern of a turning shaft
    }
  }
  return out;
}

io::Json finding_json(const records::Finding& f) {
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

io::Json table_json(const io::TableInfo& table) {
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
    std::vector<std::string> said = c.findings;
    said.insert(said.end(), c.damage.begin(), c.damage.end());
    channel.set("findings", texts(said));
    channels.push_back(std::move(channel));
  }
  json.set("channels", std::move(channels));
  return json;
}

}  // namespace

FileReport report_file(const io::SignalFile& file, const std::function<Recording(const Recording&)>& with_angle) {
  FileReport report{io::describe(file), {}, {}, {}};
  for (std::size_t k = 0; k < file.tables.size(); ++k) {
    const Recording record = recording_of(file.tables[k], file.source);
    const bool known = !record.channels.empty();
    const Recording turning = known && with_angle ? with_angle(record) : record;
    std::optional<diagnosis::Rotation> rotation;
    const bool whole = std::ranges::all_of(record.channels, [](const Channel& c) { return c.samples.allFinite(); });
    try {
      if (whole) rotation = diagnosis::rotation_of(turning);
      if (known && whole && !rotation)
        for (std::string& said : unnamed_pulses(record)) report.info.findings.push_back(std::move(said));
    } catch (const Error& e) {
      report.info.findings.push_back(std::string("no 1X: ") + e.what());
    }
    report.records.push_back(known ? records::check(record) : records::RecordReport{});
    const records::RecordReport& checked = report.records.back();
    const Recording clean = without_bad_samples(record, checked, rotation);
    report.vibration.push_back(diagnosis::vibration_of(clean, rotation));
    report.findings.push_back(known ? vibration_of_table(without_bad_samples(turning, checked, rotation))
                                    : diagnosis::VibrationFindings{});
    describe_usable(record, checked, report.info.tables[k].channels);
    if (report.records.back().findings.empty()) continue;
    for (io::ChannelInfo& c : report.info.tables[k].channels)
      c.damage.clear();  // the record check says it with the time and what follows
  }
  return report;
}

FileReport report_of(io::FileInfo info) {
  const std::size_t tables = info.tables.size();
  FileReport report{std::move(info), {}, {}, {}};
  report.records.resize(tables);
  report.findings.resize(tables);
  report.vibration.resize(tables);
  return report;
}

std::string to_text(const FileReport& report) {
  std::string text = io::to_string(report.info);
  for (const std::vector<diagnosis::ChannelVibration>& table : report.vibration) {
    if (table.empty()) continue;
    std::vector<RunVibration> rows;
    for (const diagnosis::ChannelVibration& v : table) rows.push_back({"", v});
    text += report::to_text(vibration_table(rows));
    if (const report::Table housing = housing_table(rows); !housing.rows.empty()) text += report::to_text(housing);
  }
  for (const records::RecordReport& r : report.records) {
    for (const records::Finding& f : r.findings) text += fmt::format("  ! {}\n", f.text());
  }
  for (const diagnosis::VibrationFindings& f : report.findings)
    if (f.angle != diagnosis::AngleSource::none) text += to_text(f, "  * ");
  return text;
}

io::Json to_json(const FileReport& report) {
  io::Json json = io::start_document("whirl.info", 2);
  json.set("source", report.info.source);
  json.set("format", report.info.format);
  io::Json::Array tables;
  for (std::size_t k = 0; k < report.info.tables.size(); ++k) {
    io::Json table = table_json(report.info.tables[k]);
    io::Json::Array findings;
    for (const records::Finding& f : report.records[k].findings) findings.push_back(finding_json(f));
    table.set("record_check", std::move(findings));
    table.set("vibration_findings", to_json(report.findings[k]));
    io::Json vibration = io::Json::array();
    for (const diagnosis::ChannelVibration& v : report.vibration[k]) vibration.push(to_json(v));
    table.set("vibration", std::move(vibration));
    tables.push_back(std::move(table));
  }
  json.set("tables", std::move(tables));
  json.set("contents", texts(report.info.contents));
  json.set("findings", texts(report.info.findings));
  return json;
}

}  // namespace whirl::pages
